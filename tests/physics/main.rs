//! The car's equations: signs, balances, limits, closed forms, and other implementations' figures.

mod body;
#[path = "../common/mod.rs"]
mod common;
mod drive;
mod gt;
mod properties;
mod signs;
mod steady;
mod support;
mod tyre;
