//! Identification: which car drove this lap?

mod polish;

pub use polish::{Polished, polish};
