//! The modules that touch memory without the compiler's checks, alone: nothing but the standard library behind them, so that a
//! sanitizer takes seconds to build them with (see `tests/sanitize.sh`).
#![allow(missing_docs, dead_code, unused)]

#[path = "../../src/scalar/mod.rs"]
pub mod scalar;

#[path = "../../src/evaluate/simd.rs"]
pub mod simd;
