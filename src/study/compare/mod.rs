//! Runs side by side, from what their folders hold: no study is run again.

mod page;
mod read;

pub use page::compare;
pub use read::{Figure, Run, Trace};
