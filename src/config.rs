//! Settings and other TOML that know their lines, and files that are read within limits.

mod choice;
#[cfg(feature = "vehicle")]
mod document;
#[cfg(feature = "vehicle")]
pub mod kinds;
#[cfg(feature = "vehicle")]
mod separated;
#[cfg(feature = "vehicle")]
pub mod settings;

pub use choice::Choice;
pub(crate) use choice::named;
#[cfg(feature = "vehicle")]
pub use document::{Document, Table};
#[cfg(feature = "vehicle")]
pub(crate) use document::{line_of, refused};
#[cfg(feature = "vehicle")]
pub(crate) use separated::{Rows, cells, with_commas};

use crate::error::{Error, Place, Result};
use std::cell::RefCell;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

/// The largest file of settings, a car, a tyre or a map (bytes): far above any that a person or a logger makes.
pub const LARGEST_TEXT: u64 = 64 << 20;
/// The largest log (bytes): hours of all channels at a kilohertz.
pub const LARGEST_LOG: u64 = 1 << 30;
/// Memory that the process may take where nothing else is said (MiB).
pub const USUAL_MEMORY_MIB: u64 = 4096;

static MEMORY_LIMIT: AtomicU64 = AtomicU64::new(USUAL_MEMORY_MIB << 20);

/// From now on what is read of logs and states has to fit into so much memory (MiB). Like the memory, the limit is the
/// process's.
pub fn limit_memory(mib: u64) {
    MEMORY_LIMIT.store(mib.saturating_mul(1 << 20), Ordering::Relaxed);
}

/// The memory that is allowed at present (bytes).
pub fn memory_limit() -> u64 {
    MEMORY_LIMIT.load(Ordering::Relaxed)
}

/// Whether what a file with so much in it takes, `needed` bytes, fits into `limit` bytes.
///
/// # Errors
/// [`Error::Memory`] with the file, what is in it, what that takes and the limit.
pub fn check_memory(path: &Path, size: &str, needed: u64, limit: u64) -> Result<()> {
    if needed <= limit {
        return Ok(());
    }
    Err(Error::Memory {
        file: path.display().to_string(),
        what: "file size",
        found: size.to_owned(),
        needed_mib: needed.div_ceil(1 << 20),
        expected: format!("a file that fits into {} MiB", limit >> 20),
    })
}

/// Files that were read, each with a sum (CRC-32) over what was in it.
pub type FilesRead = BTreeMap<PathBuf, u32>;

thread_local! {
    static READ: RefCell<Option<FilesRead>> = const { RefCell::new(None) };
}

/// Does `work`, and tells which files it read on this thread.
pub fn noting_files<T>(work: impl FnOnce() -> T) -> (T, FilesRead) {
    let outer = READ.replace(Some(FilesRead::new()));
    let done = work();
    let read = READ.replace(outer).unwrap_or_default();
    (done, read)
}

/// The folder that a file lies in, which has a name even where the file was named without one.
pub fn folder_of(path: &Path) -> &Path {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
    folder.unwrap_or(Path::new("."))
}

/// Reads a file of at most `most` bytes, so that none takes all memory, not even one without an end.
///
/// # Errors
/// [`Error::Io`] if it is missing or cannot be read, [`Error::Input`] if it is larger.
pub fn read_bytes(path: &Path, most: u64) -> Result<Vec<u8>> {
    let failed = |e| Error::io(path, "read", e);
    let too_large = |found: String| Error::input(path, "file size", found, format!("at most {most} bytes"));
    let file = File::open(path).map_err(failed)?;
    let metadata = file.metadata().map_err(failed)?;
    if metadata.is_dir() {
        return Err(Error::input(path, "contents", "a folder", "a file"));
    }
    let told = metadata.len();
    if told > most {
        return Err(too_large(format!("{told} bytes")));
    }
    // As much as it tells and no more: what grows by doubling may come to twice that.
    let mut bytes = Vec::new();
    bytes
        .try_reserve_exact(usize::try_from(told.saturating_add(1)).unwrap_or(usize::MAX))
        .map_err(|e| Error::io(path, "read", e.into()))?;
    // Pipes and devices do not tell their size.
    file.take(most.saturating_add(1))
        .read_to_end(&mut bytes)
        .map_err(failed)?;
    if bytes.len() as u64 > most {
        return Err(too_large("more".to_owned()));
    }
    READ.with_borrow_mut(|read| {
        if let (Some(read), Ok(path)) = (read, std::path::absolute(path)) {
            read.insert(path, crc32fast::hash(&bytes));
        }
    });
    Ok(bytes)
}

/// The first bytes of a file, `most` of them at the most.
///
/// # Errors
/// [`Error::Io`] if it is missing or cannot be read.
pub fn read_start(path: &Path, most: u64) -> Result<Vec<u8>> {
    let failed = |e| Error::io(path, "read", e);
    let mut bytes = Vec::new();
    let file = File::open(path).map_err(failed)?;
    file.take(most).read_to_end(&mut bytes).map_err(failed)?;
    Ok(bytes)
}

/// Reads a text file of at most [`LARGEST_TEXT`] bytes.
///
/// # Errors
/// As [`read_bytes`], and [`Error::Input`] naming the line that is no UTF-8.
pub fn read_text(path: &Path) -> Result<String> {
    String::from_utf8(read_bytes(path, LARGEST_TEXT)?).map_err(|e| {
        let sound = e.utf8_error().valid_up_to();
        let bytes = e.as_bytes();
        let line = bytes[..sound].iter().filter(|&&b| b == b'\n').count() + 1;
        let found = format!("the byte 0x{:02x}", bytes[sound]);
        Error::input(path, Place::line(line), found, "text in UTF-8")
    })
}

/// The longest name of a car, a circuit, a section or a scenario (bytes): names become parts of files' names, which end at 255.
pub const LONGEST_NAME: usize = 120;
