//! Runs side by side, from what their folders hold: no study is run again.

mod page;
mod read;

pub use page::compare;
pub(crate) use page::{LIMITS, limits, overlay};
pub(crate) use read::read_table;
pub use read::{Figure, Run, Trace};
