//! Files that appear whole or not at all.

use std::io::Write;
use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};

use crate::{Error, Result};

/// Writes a file by way of a temporary one in the same folder, so that a reader, or a run that is
/// stopped half way, never sees part of it.
///
/// # Errors
/// [`Error::Io`] when the folder is missing or cannot be written to.
pub fn write_whole(path: impl AsRef<Path>, contents: &[u8]) -> Result<()> {
    static SERIAL: AtomicU64 = AtomicU64::new(0);
    let path = path.as_ref();
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let serial = SERIAL.fetch_add(1, Ordering::Relaxed);
    let temporary = path.with_file_name(format!(".{name}.{}-{serial}.tmp", std::process::id()));
    let write = || {
        let mut file = std::fs::File::create(&temporary)?;
        file.write_all(contents)?;
        file.sync_all()?;
        drop(file);
        std::fs::rename(&temporary, path)
    };
    write().map_err(|source| {
        // The first failure is the one to report; a leftover that cannot be removed changes nothing.
        let _ = std::fs::remove_file(&temporary);
        Error::io(path, "write", source)
    })
}
