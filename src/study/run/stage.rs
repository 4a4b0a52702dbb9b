//! Stages whose results are kept by what went into them.

use crate::error::{Error, Result};
use std::fmt::{Debug, Write as _};
use std::hash::{DefaultHasher, Hasher};
use std::path::{Path, PathBuf};

/// What went into a stage, as one number: the program's version, and whatever is [added](Inputs::add).
pub struct Inputs(DefaultHasher);

impl Inputs {
    /// Of a stage of this name.
    pub fn new(stage: &str) -> Self {
        let mut inputs = Self(DefaultHasher::new());
        inputs.add(&(stage, env!("CARGO_PKG_VERSION")));
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

    /// Adds a file's contents.
    ///
    /// # Errors
    /// [`Error::Io`] if it cannot be read.
    pub fn add_file(&mut self, path: &Path) -> Result<()> {
        self.0
            .write(&std::fs::read(path).map_err(|e| Error::io(path, "read", e))?);
        Ok(())
    }

    /// The number, as text.
    pub fn key(&self) -> String {
        format!("{:016x}", self.0.finish())
    }
}

/// Present in a stage's folder once all of its files are.
const DONE: &str = "done";

/// Where stages are kept between runs.
pub struct Stages {
    cache: Option<PathBuf>,
    folder: PathBuf,
}

impl Stages {
    /// Stages of a run in `folder`, kept in `cache` if that is given.
    pub fn new(folder: &Path, cache: Option<&Path>) -> Self {
        Self {
            cache: cache.map(Path::to_owned),
            folder: folder.to_owned(),
        }
    }

    /// The folder of a stage in the run, and whether it was taken from an earlier run of the same inputs. `work` fills
    /// it otherwise.
    ///
    /// # Errors
    /// Those of `work`; [`Error::Io`] if folders or files cannot be made.
    pub fn run(
        &self,
        name: &str,
        inputs: &Inputs,
        work: impl FnOnce(&Path) -> Result<()>,
    ) -> Result<(PathBuf, bool)> {
        let target = self.folder.join(name);
        create(&target)?;
        let kept = self.cache.as_ref().map(|cache| {
            // Stages of one kind share results whatever their number in a run.
            let kind = name.trim_start_matches(|c: char| c.is_ascii_digit() || c == '_');
            cache.join(format!("{kind}-{}", inputs.key()))
        });
        if let Some(kept) = kept.as_ref().filter(|k| k.join(DONE).is_file()) {
            copy(kept, &target)?;
            return Ok((target, true));
        }
        work(&target)?;
        if let Some(kept) = kept {
            // Filled beside and renamed: another run sees all of it or nothing.
            let beside = kept.with_extension(format!("partial-{}", std::process::id()));
            create(&beside)?;
            copy(&target, &beside)?;
            std::fs::write(beside.join(DONE), "").map_err(|e| Error::io(&beside, "write", e))?;
            if std::fs::rename(&beside, &kept).is_err() {
                // Another run was first; its results are the same.
                std::fs::remove_dir_all(&beside).map_err(|e| Error::io(&beside, "remove", e))?;
            }
        }
        Ok((target, false))
    }
}

fn create(folder: &Path) -> Result<()> {
    std::fs::create_dir_all(folder).map_err(|e| Error::io(folder, "create", e))
}

/// Copies the files of a folder, which has no folders, all but the mark that it is complete.
fn copy(from: &Path, to: &Path) -> Result<()> {
    let failed = |e| Error::io(from, "read", e);
    for entry in from.read_dir().map_err(failed)? {
        let entry = entry.map_err(failed)?;
        if entry.file_name() != DONE {
            let target = to.join(entry.file_name());
            std::fs::copy(entry.path(), &target).map_err(|e| Error::io(&target, "write", e))?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stage_runs_once_for_the_same_inputs_and_again_for_others() {
        let root = tempfile::tempdir().expect("a temporary folder");
        let cache = root.path().join("cache");
        let mut runs = 0;
        let mut go = |run: &str, input: f64| {
            let stages = Stages::new(&root.path().join(run), Some(&cache));
            let mut inputs = Inputs::new("stage");
            inputs.add(&input);
            let (folder, reused) = stages
                .run("1_stage", &inputs, |folder| {
                    runs += 1;
                    std::fs::write(folder.join("result"), format!("{input}"))
                        .map_err(|e| Error::io(folder, "write", e))
                })
                .expect("it runs");
            let text = std::fs::read_to_string(folder.join("result")).expect("a result");
            assert!(!folder.join(DONE).exists());
            (text, reused)
        };
        assert_eq!(go("a", 1.5), ("1.5".to_owned(), false));
        assert_eq!(go("b", 1.5), ("1.5".to_owned(), true));
        assert_eq!(go("c", 2.5), ("2.5".to_owned(), false));
        assert_eq!(runs, 2);
    }

    #[test]
    fn a_stage_that_fails_is_not_kept() {
        let root = tempfile::tempdir().expect("a temporary folder");
        let cache = root.path().join("cache");
        let stages = Stages::new(&root.path().join("run"), Some(&cache));
        let inputs = Inputs::new("stage");
        let fail = |_: &Path| Err(Error::Study("no".to_owned()));
        assert!(stages.run("1_stage", &inputs, fail).is_err());
        let (_, reused) = stages.run("1_stage", &inputs, |_| Ok(())).expect("it runs");
        assert!(!reused);
    }
}
