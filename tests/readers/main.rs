//! Everything that reads files, on files that are damaged, random, or once broke it.

mod damage;
mod fuzzed;
#[path = "../common/studies.rs"]
#[allow(dead_code)] // Others run them from the command line.
mod small_studies;
