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
