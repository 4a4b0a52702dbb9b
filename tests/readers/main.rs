//! Everything that reads files, on files that are damaged, random, or once broke it.

mod damage;
mod fuzzed;
