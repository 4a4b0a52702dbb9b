//! Runs side by side, from what their folders hold: no study is run again.

mod page;
mod read;

pub use page::compare;
#[cfg(feature = "studies")]
pub(crate) use page::{LIMITS, limits, overlay};
#[cfg(feature = "studies")]
pub(crate) use read::read_table;
pub use read::{Figure, Run, Trace};
