//! What a result depends on, as one number, and the files that it was read from.

use super::write_json;
use crate::config::{FilesRead, LARGEST_LOG, noting_files, read_bytes, read_text};
use crate::error::{Error, Result};
use crate::files::lock::LockFile;
use std::fmt::{Debug, Write as _};
use std::hash::{DefaultHasher, Hasher};
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

/// What went into a stage, as one number: the program's version, and whatever is [added](Inputs::add).
pub struct Inputs(DefaultHasher);

impl Inputs {
    /// Of a stage of this name.
    pub fn new(stage: &str) -> Self {
        let mut inputs = Self(DefaultHasher::new());
        inputs.add(&(stage, env!("CARGO_PKG_VERSION")));
        inputs
    }

    /// As [`Inputs::new`], and of the very program that runs: what it finds may differ from build to build of one version.
    pub fn of_program(stage: &str) -> Self {
        static PROGRAM: OnceLock<Option<u64>> = OnceLock::new();
        let mut inputs = Self::new(stage);
        // Where the program cannot be read its version has to do.
        inputs.add(PROGRAM.get_or_init(|| {
            let mut hasher = DefaultHasher::new();
            hasher.write(&std::fs::read(std::env::current_exe().ok()?).ok()?);
            Some(hasher.finish())
        }));
        inputs
    }

    /// Adds a value with all that it holds.
    pub fn add(&mut self, value: &impl Debug) {
        struct Into<'a>(&'a mut DefaultHasher);
        impl std::fmt::Write for Into<'_> {
            fn write_str(&mut self, text: &str) -> std::fmt::Result {
                self.0.write(text.as_bytes());
                Ok(())
            }
        }
        // Writing to a hasher cannot fail.
        let _ = write!(Into(&mut self.0), "{value:?};");
    }

    /// The number, as text.
    pub fn key(&self) -> String {
        format!("{:016x}", self.0.finish())
    }
}

/// The files that several studies read, kept in a file of their own: what they were when they were first read they must stay.
pub struct InputFiles {
    kept: PathBuf,
    read: FilesRead,
}

impl InputFiles {
    /// None yet; `kept` is where they are kept.
    pub fn new(kept: PathBuf) -> Self {
        Self {
            kept,
            read: FilesRead::new(),
        }
    }

    /// Goes on from those that an earlier run has kept.
    ///
    /// # Errors
    /// [`Error::Input`] naming a file that is not what it was; [`Error::Io`] if what was kept cannot be read.
    pub fn reopen(&mut self) -> Result<()> {
        self.read = self.kept()?;
        for (path, sum) in &self.read {
            match read_bytes(path, LARGEST_LOG) {
                Ok(bytes) if crc32fast::hash(&bytes) == *sum => {}
                Ok(_) => return Err(changed(path, "another file than the one that was read before")),
                Err(error) => return Err(changed(path, &error.to_string())),
            }
        }
        Ok(())
    }

    /// Those that are kept.
    fn kept(&self) -> Result<FilesRead> {
        if !self.kept.exists() {
            return Ok(FilesRead::new());
        }
        serde_json::from_str(&read_text(&self.kept)?).map_err(|e| {
            let expected = "the files that the studies have read";
            Error::input(&self.kept, "contents", e.to_string(), expected)
        })
    }

    /// Does `work`, and keeps the names of the files that it read. Other processes may keep theirs in the same place.
    ///
    /// # Errors
    /// Those of `work`; [`Error::Input`] naming a file that is not what it was when it was first read.
    pub fn noted<T>(&mut self, work: impl FnOnce() -> Result<T>) -> Result<T> {
        let (done, read) = noting_files(work);
        if read.iter().all(|(path, sum)| self.read.get(path) == Some(sum)) {
            return done;
        }
        let _alone = LockFile::take(&self.kept.with_extension("lock"))?;
        self.read.extend(self.kept()?);
        for (path, sum) in read {
            if *self.read.entry(path.clone()).or_insert(sum) != sum {
                return Err(changed(&path, "another file than the one that was read before"));
            }
        }
        write_json(&self.kept, &self.read)?;
        done
    }
}

/// A file is not what it was.
fn changed(file: &Path, found: &str) -> Error {
    let expected = "the file as it was: put it back, or begin anew in another folder";
    Error::input(file, "contents", found, expected)
}
