//! The folder that a run writes into: one run each, nothing overwritten.

use crate::error::{Error, Result};
use std::path::{Path, PathBuf};

/// Where runs go that were given no folder.
const RUNS: &str = "runs";

/// Creates the folder of a run: `asked`, or the next free `runs/<study>-NNN`.
///
/// # Errors
/// [`Error::Input`] if the folder asked for holds anything already; [`Error::Io`] if it cannot be created.
pub fn create(study: &str, asked: Option<&Path>) -> Result<PathBuf> {
    if let Some(folder) = asked {
        let holds_something = folder
            .read_dir()
            .is_ok_and(|mut entries| entries.next().is_some());
        if holds_something || folder.is_file() {
            let expected = "a new or empty folder: nothing is overwritten";
            return Err(Error::input(
                folder,
                "--out",
                "a folder that holds another run, or a file",
                expected,
            ));
        }
        std::fs::create_dir_all(folder).map_err(|e| Error::io(folder, "create", e))?;
        return Ok(folder.to_owned());
    }
    std::fs::create_dir_all(RUNS).map_err(|e| Error::io(RUNS, "create", e))?;
    let mut number = 1u32;
    loop {
        let folder = Path::new(RUNS).join(format!("{study}-{number:03}"));
        match std::fs::create_dir(&folder) {
            Ok(()) => return Ok(folder),
            // Taken, perhaps just now by another process.
            Err(e) if e.kind() == std::io::ErrorKind::AlreadyExists => number += 1,
            Err(e) => return Err(Error::io(folder, "create", e)),
        }
    }
}

/// Who made a run and of what, as `manifest.json` says it.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Manifest<'a> {
    /// `lapswarm`.
    pub program: &'static str,
    /// Its version.
    pub version: &'static str,
    /// The study.
    pub study: &'static str,
    /// Seed of all random numbers.
    pub seed: u64,
    /// `cpu`, `simd` or `gpu`.
    pub backend: &'a str,
    /// Instruction set, or name of the adapter.
    pub adapter: &'a str,
    /// Driver of the adapter.
    pub driver: &'a str,
    /// The log, if one was read.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub log: Option<&'a str>,
    /// The track, if there is one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub track: Option<&'a str>,
    /// The car.
    pub car: &'a str,
    /// The file of resolved settings.
    pub settings: &'static str,
    /// Whether the run was broken off.
    pub interrupted: bool,
}

impl<'a> Manifest<'a> {
    /// The manifest of a study on a backend; the log, the track and whether it was interrupted are filled in after.
    pub fn new(
        study: &'static str,
        seed: u64,
        backend: &'a crate::evaluate::BackendInfo,
        car: &'a str,
    ) -> Self {
        Self {
            program: "lapswarm",
            version: env!("CARGO_PKG_VERSION"),
            study,
            seed,
            backend: backend.backend,
            adapter: &backend.device,
            driver: &backend.driver,
            log: None,
            track: None,
            car,
            settings: "study.toml",
            interrupted: false,
        }
    }
}

/// Writes a value as JSON, whole or not at all.
///
/// # Errors
/// [`Error::Io`] if it cannot be written.
pub fn write_json(path: &Path, value: &impl serde::Serialize) -> Result<()> {
    let text = serde_json::to_string_pretty(value)
        .map_err(|e| Error::io(path, "write", std::io::Error::other(e)))?;
    crate::report::write_whole(path, text.as_bytes())
}
