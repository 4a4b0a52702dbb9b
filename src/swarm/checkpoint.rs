//! States on disk: a run resumes where it stopped, bit for bit.
//!
//! A checkpoint is a file of its own kind: `LAPSWARM`, the format's version (`u32`, little endian like all numbers in
//! it), the length (`u32`) and the name of the kind of state, the length (`u64`) of the state, the state as `postcard`
//! writes it, and a CRC-32 of all of that. Floats keep every bit, infinities and all. A file that is foreign, newer,
//! torn or of another state is refused. It is written beside its place and then moved there, so that a run that is
//! interrupted while it writes leaves the last one whole.

use super::{
    CooperativeSwarm, CovarianceSwarm, DifferenceSwarm, HybridSwarm, Islands, Moead, Mopso, Nsga2, Nsga3,
    Optimiser, Pso, WindowSwarm,
};
use crate::config::{check_memory, memory_limit, read_bytes, read_start};
use crate::error::{Error, Result};
use crate::files::write_whole;
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::path::Path;

/// The format that this version writes, and the only one that it reads. It changes with the fields of any state, and with what an
/// optimiser asks after the same answers: a run that resumes replays some of them.
pub const VERSION: u32 = 21;

const MAGIC: &[u8; 8] = b"LAPSWARM";
/// Bytes of that and the version.
const HEAD: u64 = 12;

/// A state that can be kept in a file.
pub trait Checkpoint: Serialize + DeserializeOwned {
    /// What the file says that it is.
    const KIND: &'static str;
}

/// Reads the bytes of a checkpoint of an optimiser; the path is what errors call them.
type Reader = fn(&[u8], &Path) -> Result<Box<dyn Optimiser + Send>>;

macro_rules! optimisers {
    ($($state:ty: $kind:literal),* $(,)?) => {
        $(impl Checkpoint for $state { const KIND: &'static str = $kind; })*

        /// The optimisers, by the names of their states.
        const READERS: &[(&str, Reader)] = &[
            $(($kind, |bytes, file| Ok(Box::new(from_bytes::<$state>(bytes, file)?)))),*
        ];
    };
}

optimisers! {
    CooperativeSwarm: "cooperative swarm",
    CovarianceSwarm: "covariance swarm",
    DifferenceSwarm: "difference swarm",
    HybridSwarm: "hybrid swarm",
    Moead: "MOEA/D",
    Mopso: "multi-objective swarm",
    Nsga2: "NSGA-II",
    Nsga3: "NSGA-III",
    Pso: "swarm",
    WindowSwarm: "window swarm",
    Islands<Mopso>: "islands of multi-objective swarms",
    Islands<Pso>: "islands of swarms",
    Islands<DifferenceSwarm>: "islands of difference swarms",
}

/// The bytes of a checkpoint of `state`.
///
/// # Errors
/// [`Error::Study`] if the state cannot be written down at all.
pub fn to_bytes<T: Checkpoint>(state: &T) -> Result<Vec<u8>> {
    let payload = postcard::to_allocvec(state)
        .map_err(|e| Error::Study(format!("the state of the {} cannot be kept: {e}", T::KIND)))?;
    let mut bytes = Vec::with_capacity(payload.len() + 64);
    bytes.extend(MAGIC);
    bytes.extend(VERSION.to_le_bytes());
    bytes.extend((T::KIND.len() as u32).to_le_bytes());
    bytes.extend(T::KIND.as_bytes());
    bytes.extend((payload.len() as u64).to_le_bytes());
    bytes.extend(payload);
    bytes.extend(crc32fast::hash(&bytes).to_le_bytes());
    Ok(bytes)
}

/// The state in the bytes of a checkpoint; `file` is what errors call them.
///
/// # Errors
/// [`Error::Input`] if they are no checkpoint, of another version, damaged, or of another kind of state.
pub fn from_bytes<T: Checkpoint>(bytes: &[u8], file: &Path) -> Result<T> {
    let (kind, state) = opened(bytes, file)?;
    if kind != T::KIND.as_bytes() {
        return Err(other_kind(kind, file, &format!("a {}", T::KIND)));
    }
    postcard::from_bytes(state).map_err(|_| damaged(file))
}

/// The optimiser in the bytes of a checkpoint, whichever it is; `file` is what errors call them.
///
/// # Errors
/// As [`from_bytes`].
pub fn optimiser_from_bytes(bytes: &[u8], file: &Path) -> Result<Box<dyn Optimiser + Send>> {
    let (kind, _) = opened(bytes, file)?;
    match READERS.iter().find(|(known, _)| known.as_bytes() == kind) {
        Some((_, read)) => read(bytes, file),
        None => Err(other_kind(kind, file, "an optimiser")),
    }
}

fn damaged(file: &Path) -> Error {
    Error::input(
        file,
        "checkpoint",
        "a damaged one",
        "a whole one, as it was written",
    )
}

fn other_kind(kind: &[u8], file: &Path, expected: &str) -> Error {
    let found = format!("a {}", String::from_utf8_lossy(kind));
    Error::input(file, "state in the checkpoint", found, expected)
}

/// The name of the kind of state in the bytes of a checkpoint, and the state.
fn opened<'b>(bytes: &'b [u8], file: &Path) -> Result<(&'b [u8], &'b [u8])> {
    let wrong = |place: &str, found: String, expected: String| Error::input(file, place, found, expected);
    let damaged = || damaged(file);
    let mut rest = bytes;
    let mut take = |count: usize| -> Option<&'b [u8]> {
        let (head, tail) = rest.split_at_checked(count)?;
        rest = tail;
        Some(head)
    };
    if take(MAGIC.len()) != Some(MAGIC) {
        return Err(wrong(
            "start of the file",
            "something else".to_owned(),
            "a checkpoint of lapswarm".to_owned(),
        ));
    }
    let word = |bytes: Option<&[u8]>| Some(u32::from_le_bytes(bytes?.try_into().ok()?));
    let version = word(take(4)).ok_or_else(damaged)?;
    if version != VERSION {
        let expected = format!("version {VERSION}, which this program reads");
        return Err(wrong("version of the checkpoint", version.to_string(), expected));
    }
    // Before anything that is written in it is believed.
    let body = bytes.len().checked_sub(4).ok_or_else(damaged)?;
    if word(Some(&bytes[body..])) != Some(crc32fast::hash(&bytes[..body])) {
        return Err(damaged());
    }
    let length = word(take(4)).ok_or_else(damaged)? as usize;
    let kind = take(length).ok_or_else(damaged)?;
    let length = take(8).and_then(|b| b.try_into().ok()).map(u64::from_le_bytes);
    let payload = length
        .and_then(|length| usize::try_from(length).ok())
        .and_then(&mut take)
        .ok_or_else(damaged)?;
    Ok((kind, payload))
}

/// Keeps `state` in the file `path`, in the place of what may be there from before.
///
/// # Errors
/// [`Error::Io`] if the file cannot be written.
pub fn save<T: Checkpoint>(path: &Path, state: &T) -> Result<()> {
    write_whole(path, &to_bytes(state)?)
}

/// The state in the file `path`.
///
/// # Errors
/// [`Error::Io`] if the file cannot be read, [`Error::Input`] as [`from_bytes`].
pub fn load<T: Checkpoint>(path: &Path) -> Result<T> {
    load_within(path, memory_limit())
}

/// Keeps the state of an optimiser in the file `path`, in the place of what may be there from before.
///
/// # Errors
/// [`Error::Io`] if the file cannot be written, and those of [`Optimiser::to_checkpoint`].
pub fn save_optimiser(path: &Path, optimiser: &dyn Optimiser) -> Result<()> {
    write_whole(path, &optimiser.to_checkpoint()?)
}

/// The optimiser in the file `path`, whichever it is.
///
/// # Errors
/// As [`load`].
pub fn load_optimiser(path: &Path) -> Result<Box<dyn Optimiser + Send>> {
    read_within(path, memory_limit(), optimiser_from_bytes)
}

/// As [`load`], within so much memory (bytes).
fn load_within<T: Checkpoint>(path: &Path, limit: u64) -> Result<T> {
    read_within(path, limit, from_bytes)
}

fn read_within<T>(path: &Path, limit: u64, read: impl Fn(&[u8], &Path) -> Result<T>) -> Result<T> {
    let head = read_start(path, HEAD)?;
    // What is none, or of another version, need not be read to be refused.
    if head.len() < HEAD as usize || !head.starts_with(MAGIC) || head[MAGIC.len()..] != VERSION.to_le_bytes()
    {
        return read(&head, path);
    }
    let size = std::fs::metadata(path)
        .map_err(|e| Error::io(path, "read", e))?
        .len();
    // As it is read and as it is; a study counts a state that is written down thrice at the least.
    check_memory(path, &format!("{size} bytes"), size.saturating_mul(2), limit)?;
    read(&read_bytes(path, limit)?, path)
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde::Deserialize;

    #[derive(Debug, Serialize, Deserialize)]
    struct Text(String);

    impl Checkpoint for Text {
        const KIND: &'static str = "a text";
    }

    #[test]
    fn a_state_that_does_not_fit_is_not_read() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("state");
        let text = "x".repeat(1 << 20);
        save(&path, &Text(text.clone())).expect("saved");
        let said = load_within::<Text>(&path, 2 << 20)
            .expect_err("a little more than twice 1 MiB")
            .to_string();
        for part in ["state: file size", "some 3 MiB", "fits into 2 MiB"] {
            assert!(said.contains(part), "{said}");
        }
        assert_eq!(load_within::<Text>(&path, 3 << 20).expect("it fits").0, text);
    }
}
