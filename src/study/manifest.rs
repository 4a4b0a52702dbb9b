//! What a run was made with, as every run folder's `manifest.json` says it.

use crate::error::{Error, Result};
use crate::report::write_whole;
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::Path;

/// The program that writes manifests, by which they are known again.
pub const PROGRAM: &str = "lapswarm";
/// The file.
pub const FILE: &str = "manifest.json";

/// The manifest of a run.
#[derive(Clone, Debug, Serialize)]
pub struct Manifest<'a> {
    /// The study, as on the command line.
    pub study: &'a str,
    /// Seed of all random numbers; none where none were drawn.
    pub seed: Option<u64>,
    /// `cpu`, `simd` or `gpu`.
    pub backend: &'a str,
    /// Instruction set, or name of the adapter.
    pub adapter: &'a str,
    /// Driver of the adapter.
    pub driver: &'a str,
    /// What went in, as in `track`, `car` and `log`.
    #[serde(flatten)]
    pub inputs: BTreeMap<&'a str, &'a str>,
    /// The file in the folder that repeats the run, if there is one.
    pub settings: Option<&'a str>,
    /// Whether the run was broken off.
    pub interrupted: bool,
}

#[derive(Serialize)]
struct Whole<'a> {
    program: &'a str,
    version: &'a str,
    #[serde(flatten)]
    manifest: &'a Manifest<'a>,
}

impl Manifest<'_> {
    /// Writes the manifest into a run's folder.
    ///
    /// # Errors
    /// [`Error::Io`] if it cannot be written.
    pub fn write(&self, folder: &Path) -> Result<()> {
        let path = folder.join(FILE);
        let whole = Whole {
            program: PROGRAM,
            version: env!("CARGO_PKG_VERSION"),
            manifest: self,
        };
        let text = serde_json::to_string_pretty(&whole)
            .map_err(|e| Error::io(&path, "write", std::io::Error::other(e)))?;
        write_whole(path, text.as_bytes())
    }
}
