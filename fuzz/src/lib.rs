//! Fuzz targets for every reader of lapswarm; see README.md. The readers are those of the package's own tests.

#[path = "../../tests/common/readers.rs"]
pub mod readers;
