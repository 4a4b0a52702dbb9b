//! The repository itself: what the program is built of, and what its documents and sources refer to.

mod dependencies;
mod references;
