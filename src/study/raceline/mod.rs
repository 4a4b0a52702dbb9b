//! The racing-line study.

mod search;

pub use search::{FoundLine, LevelRow, LineProgress, LineSearch, LineSearchSettings, search_line};
