//! Stages whose results are kept by what went into them.

use crate::error::{Error, Result};
use crate::study::keeper::Keeper;
use crate::study::run_folder;
use crate::swarm::checkpoint::Checkpoint;
use std::fmt::{Debug, Write as _};
use std::hash::{DefaultHasher, Hasher};
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use std::time::Duration;

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
    every: Duration,
}

impl Stages {
    /// Stages of a run in `folder`, kept in `cache` if that is given; the state of one at work is saved `every` so often.
    pub fn new(folder: &Path, cache: Option<&Path>, every: Duration) -> Self {
        Self {
            every,
            cache: cache.map(Path::to_owned),
            folder: folder.to_owned(),
        }
    }

    /// The folder of a stage in the run, and whether it was taken from an earlier run of the same inputs. `work` fills
    /// it otherwise, and has the keeper of its state, which may have that of a run that was broken off.
    ///
    /// # Errors
    /// Those of `work`; [`Error::Io`] if folders or files cannot be made.
    pub fn run(
        &self,
        name: &str,
        inputs: &Inputs,
        work: impl FnOnce(&Path, &mut Keeper) -> Result<()>,
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
        // Where another run is at work on the same stage, that one keeps its state.
        let unfinished = kept.as_ref().and_then(|kept| {
            run_folder::take(&kept.with_extension("unfinished"))
                .inspect_err(|error| tracing::warn!("the state of this stage is not saved: {error}"))
                .ok()
        });
        let mut keeper = match &unfinished {
            Some(folder) => Keeper::new(folder).every(self.every),
            None => Keeper::idle(),
        };
        work(&target, &mut keeper)?;
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
        // Only now: until the stage is kept, its state is all there is of it.
        keeper.done()?;
        if let Some(folder) = unfinished {
            let path = folder.to_path_buf();
            drop(folder);
            // What is in it now is another run's.
            let _ = std::fs::remove_dir(path);
        }
        Ok((target, false))
    }
}

/// Does what `work` does from the state that an earlier run has left, and from the start where there is none or it belongs to
/// something else.
///
/// # Errors
/// Those of `work`.
pub(in crate::study) fn go_on<S: Checkpoint, T>(
    keeper: &mut Keeper,
    mut work: impl FnMut(Option<S>, &mut Keeper) -> Result<T>,
) -> Result<T> {
    if let Some(state) = keeper.saved() {
        match work(Some(state), keeper) {
            Err(error @ Error::Input { .. }) => tracing::warn!("the stage is done anew: {error}"),
            outcome => return outcome,
        }
    }
    work(None, keeper)
}

fn create(folder: &Path) -> Result<()> {
    std::fs::create_dir_all(folder).map_err(|e| Error::io(folder, "create", e))
}

/// Copies the files of a folder, which has no folders, all but the mark that it is complete and what a killed process had half
/// written.
fn copy(from: &Path, to: &Path) -> Result<()> {
    let failed = |e| Error::io(from, "read", e);
    for entry in from.read_dir().map_err(failed)? {
        let entry = entry.map_err(failed)?;
        if entry.file_name() != DONE && !entry.file_name().to_string_lossy().starts_with('.') {
            let target = to.join(entry.file_name());
            std::fs::copy(entry.path(), &target).map_err(|e| Error::io(&target, "write", e))?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::journal::Journal;

    const EVERY: Duration = Duration::ZERO;

    #[test]
    fn a_stage_that_is_broken_off_finds_its_state_again_and_leaves_none_when_it_is_done() {
        let root = tempfile::tempdir().expect("a temporary folder");
        let cache = root.path().join("cache");
        let stages = Stages::new(&root.path().join("run"), Some(&cache), EVERY);
        let inputs = Inputs::new("stage");
        let mut known = Vec::new();
        for round in 0..3u32 {
            let outcome = stages.run("1_stage", &inputs, |_, keeper| {
                go_on(keeper, |state: Option<Journal>, keeper| {
                    let before = state.map(|s| s.settings::<u32>("stage")).transpose()?;
                    known.push(before);
                    keeper.keep(&Journal::new("stage", &round)?)
                })?;
                if round == 2 {
                    Ok(())
                } else {
                    Err(Error::Interrupted(root.path().to_owned()))
                }
            });
            assert_eq!(outcome.is_ok(), round == 2);
        }
        assert_eq!(known, [None, Some(0), Some(1)]);
        let left: Vec<_> = cache.read_dir().expect("the cache").flatten().collect();
        assert_eq!(left.len(), 1, "{left:?}");
        assert!(left[0].path().join(DONE).exists());
    }

    #[test]
    fn a_stage_runs_once_for_the_same_inputs_and_again_for_others() {
        let root = tempfile::tempdir().expect("a temporary folder");
        let cache = root.path().join("cache");
        let mut runs = 0;
        let mut go = |run: &str, input: f64| {
            let stages = Stages::new(&root.path().join(run), Some(&cache), EVERY);
            let mut inputs = Inputs::new("stage");
            inputs.add(&input);
            let (folder, reused) = stages
                .run("1_stage", &inputs, |folder, _| {
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
        let stages = Stages::new(&root.path().join("run"), Some(&cache), EVERY);
        let inputs = Inputs::new("stage");
        let fail = |_: &Path, _: &mut Keeper| Err(Error::Study("no".to_owned()));
        assert!(stages.run("1_stage", &inputs, fail).is_err());
        let (_, reused) = stages.run("1_stage", &inputs, |_, _| Ok(())).expect("it runs");
        assert!(!reused);
    }
}
