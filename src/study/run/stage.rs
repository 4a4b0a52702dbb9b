//! Stages whose results are kept by what went into them.

use crate::config::folder_of;
use crate::error::{Error, Result};
use crate::files::run_folder::{self, RunFolder, STATE};
use crate::files::{sync_folder, write_whole};
use crate::study::framework::state_file::StateFile;
use crate::study::framework::{Inputs, write_json};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Present in a stage's folder once all of its files are: what each of them was then.
const DONE: &str = "done";
/// The folder in that of a run for states of stages that have no place in the cache.
const UNFINISHED: &str = ".unfinished";

/// Where stages are kept between runs.
pub struct Stages {
    cache: PathBuf,
    folder: PathBuf,
    every: Duration,
}

impl Stages {
    /// Stages of a run in `folder`, kept in `cache`; the state of one at work is saved `every` so often.
    pub fn new(folder: &Path, cache: &Path, every: Duration) -> Self {
        Self {
            every,
            cache: cache.to_owned(),
            folder: folder.to_owned(),
        }
    }

    /// The folder of a stage in the run, and whether it was taken from an earlier run of the same inputs. `work` fills
    /// it otherwise, and has the state_file of its state, which may have that of an interrupted run.
    ///
    /// # Errors
    /// Those of `work`; [`Error::Io`] if folders or files cannot be made.
    pub fn run(
        &self,
        name: &str,
        inputs: &Inputs,
        work: impl FnOnce(&Path, &mut StateFile) -> Result<()>,
    ) -> Result<(PathBuf, bool)> {
        let target = self.folder.join(name);
        create(&target)?;
        // Stages of one kind share results whatever their number in a run.
        let kind = name.trim_start_matches(|c: char| c.is_ascii_digit() || c == '_');
        let kind = format!("{kind}-{}", inputs.key());
        let kept = self.cache.join(&kind);
        if let Some(files) = whole(&kept)? {
            for (name, contents) in files {
                write_whole(target.join(name), &contents)?;
            }
            // Of a run that was interrupted while another was at work on the same stage.
            let _ = std::fs::remove_dir_all(self.folder.join(UNFINISHED).join(&kind));
            let _ = std::fs::remove_dir(self.folder.join(UNFINISHED));
            return Ok((target, true));
        }
        let unfinished = self.unfinished(&kept, &self.folder.join(UNFINISHED).join(&kind))?;
        let mut state_file = StateFile::new(&unfinished).every(self.every);
        work(&target, &mut state_file)?;
        keep(&target, &kept)?;
        // Only now: until the stage is kept, its state is all there is of it.
        state_file.done()?;
        let path = unfinished.to_path_buf();
        drop(unfinished);
        // What is in them now is another run's.
        let _ = std::fs::remove_dir(path);
        let _ = std::fs::remove_dir(self.folder.join(UNFINISHED));
        Ok((target, false))
    }

    /// Where the state of a stage is saved: beside its place in the cache, for whichever run comes next; where another run is at
    /// work on the same stage, which saves its state there, in the run's `own` folder.
    fn unfinished(&self, kept: &Path, own: &Path) -> Result<RunFolder> {
        // Of a run that was interrupted while another had the place in the cache.
        if !own.join(STATE).is_file() {
            match run_folder::take(&kept.with_extension("unfinished")) {
                Ok(folder) => return Ok(folder),
                Err(error) => tracing::warn!("the state of this stage is saved in the run's folder: {error}"),
            }
        }
        run_folder::take(own)
    }
}

fn create(folder: &Path) -> Result<()> {
    std::fs::create_dir_all(folder).map_err(|e| Error::io(folder, "create", e))
}

/// Size (bytes) and CRC-32 of each file of a stage, by name.
type Sums = BTreeMap<String, (u64, u32)>;

/// The name of a file and what is in it.
type StoredFile = (String, Vec<u8>);

fn sum(contents: &[u8]) -> (u64, u32) {
    (contents.len() as u64, crc32fast::hash(contents))
}

/// The files of a stage that is kept, each as it was when it was kept; nothing where there is no such stage, and where it is
/// not what it was, as a loss of power may leave it: that one goes.
fn whole(kept: &Path) -> Result<Option<Vec<StoredFile>>> {
    if !kept.join(DONE).is_file() {
        return Ok(None);
    }
    match read_whole(kept) {
        Ok(files) => Ok(Some(files)),
        Err(found) => {
            tracing::warn!("{}: {found}; the stage is done anew", kept.display());
            // Out of the way at once, whoever else looks at it.
            let aside = aside(kept)?;
            match std::fs::rename(kept, &aside).and_then(|()| std::fs::remove_dir_all(&aside)) {
                // Another run has seen it too.
                Err(e) if e.kind() != std::io::ErrorKind::NotFound => Err(Error::io(kept, "remove", e)),
                _ => Ok(None),
            }
        }
    }
}

/// As [`whole`], or what is wrong with it.
fn read_whole(kept: &Path) -> Result<Vec<StoredFile>, String> {
    let mark = std::fs::read(kept.join(DONE)).map_err(|e| e.to_string())?;
    let sums: Sums = serde_json::from_slice(&mark).map_err(|e| format!("the list of its files: {e}"))?;
    let read = |(name, expected): (String, (u64, u32))| {
        // A list that was tampered with reads nothing from elsewhere.
        if Path::new(&name).file_name().is_none_or(|n| n != name.as_str()) {
            return Err(format!("{name} is no name of a file in it"));
        }
        let contents = std::fs::read(kept.join(&name)).map_err(|e| format!("{name}: {e}"))?;
        if sum(&contents) == expected {
            Ok((name, contents))
        } else {
            Err(format!("{name} is not what was kept"))
        }
    };
    sums.into_iter().map(read).collect()
}

/// Keeps the files of a finished stage, which has no folders, all but what a killed process had half written. It is filled beside
/// its place and moved there: another run, or one after a loss of power, sees all of it or nothing.
fn keep(from: &Path, kept: &Path) -> Result<()> {
    let beside = aside(kept)?;
    std::fs::create_dir(&beside).map_err(|e| Error::io(&beside, "create", e))?;
    let filled = fill(from, &beside);
    let moved = filled.and_then(|()| match std::fs::rename(&beside, kept) {
        Ok(()) => Ok(true),
        // Another run was first; its results are the same.
        Err(_) if kept.join(DONE).is_file() => Ok(false),
        Err(e) => Err(Error::io(kept, "create", e)),
    });
    if !matches!(moved, Ok(true)) {
        // The first failure is the one to tell.
        let _ = std::fs::remove_dir_all(&beside);
    }
    sync_folder(folder_of(kept));
    moved.map(|_| ())
}

fn fill(from: &Path, to: &Path) -> Result<()> {
    let failed = |e| Error::io(from, "read", e);
    let mut sums = Sums::new();
    for entry in from.read_dir().map_err(failed)? {
        let entry = entry.map_err(failed)?;
        let name = entry.file_name().to_string_lossy().into_owned();
        if name == DONE || name.starts_with('.') {
            continue;
        }
        let contents = std::fs::read(entry.path()).map_err(|e| Error::io(entry.path(), "read", e))?;
        write_whole(to.join(&name), &contents)?;
        sums.insert(name, sum(&contents));
    }
    write_json(&to.join(DONE), &sums)
}

/// A name beside a kept stage that nothing has.
fn aside(kept: &Path) -> Result<PathBuf> {
    if let Some(cache) = kept.parent() {
        create(cache)?;
    }
    let named = |number: u32| kept.with_extension(format!("partial-{}-{number}", std::process::id()));
    let free = (0..u32::MAX).map(named).find(|path| !path.exists());
    Ok(free.unwrap_or_else(|| named(u32::MAX)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::framework::State;
    use crate::study::framework::journal::Journal;

    /// Stages of a run of this name beside a cache that all runs share.
    fn stages_of(root: &Path, run: &str) -> Stages {
        Stages::new(&root.join(run), &root.join("cache"), Duration::ZERO)
    }

    /// What the state that a state_file finds was begun with.
    fn begun(state_file: &StateFile) -> Option<u32> {
        let state: Journal = state_file.saved::<u32, Journal>()?;
        Some(state.settings("stage").expect("the settings of a stage"))
    }

    #[test]
    fn a_stage_that_is_broken_off_finds_its_state_again_and_leaves_none_when_it_is_done() {
        let root = tempfile::tempdir().expect("a temporary folder");
        let cache = root.path().join("cache");
        let stages = stages_of(root.path(), "run");
        let inputs = Inputs::new("stage");
        let mut known = Vec::new();
        for round in 0..3u32 {
            let outcome = stages.run("1_stage", &inputs, |_, state_file| {
                known.push(begun(state_file));
                state_file.save(&Journal::new("stage", &round)?)?;
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
        let mut runs = 0;
        let mut go = |run: &str, input: f64| {
            let stages = stages_of(root.path(), run);
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
    fn a_stage_that_is_not_what_was_kept_is_done_anew() {
        let root = tempfile::tempdir().expect("a temporary folder");
        let cache = root.path().join("cache");
        let mut inputs = Inputs::new("stage");
        inputs.add(&1);
        let mut runs = 0;
        let mut go = || {
            runs += 1;
            let stages = stages_of(root.path(), &format!("run-{runs}"));
            let work = |folder: &Path, _: &mut StateFile| {
                std::fs::write(folder.join("result"), "what was found").expect("a file");
                std::fs::write(folder.join("table"), "1,2,3").expect("a file");
                Ok(())
            };
            let (folder, reused) = stages.run("1_stage", &inputs, work).expect("it runs");
            for (name, text) in [("result", "what was found"), ("table", "1,2,3")] {
                assert_eq!(std::fs::read_to_string(folder.join(name)).expect("a file"), text);
            }
            reused
        };
        assert!(!go() && go());
        let kept = cache.join(format!("stage-{}", inputs.key()));
        // As a loss of power leaves files whose names were on the disk before what is in them.
        let damages: [&dyn Fn(); 7] = [
            &|| std::fs::write(kept.join("result"), "").expect("a file"),
            &|| std::fs::write(kept.join("result"), "what was f\0\0\0\0").expect("a file"),
            &|| std::fs::remove_file(kept.join("table")).expect("a file"),
            &|| std::fs::write(kept.join(DONE), "").expect("a file"),
            &|| std::fs::write(kept.join(DONE), "{\"result\": [14").expect("a file"),
            &|| std::fs::write(kept.join(DONE), "{\"../stage\": [0, 0]}").expect("a file"),
            &|| std::fs::write(kept.join(DONE), [0; 64]).expect("a file"),
        ];
        for damage in damages {
            damage();
            assert!(!go(), "it is done anew");
            assert!(go(), "and kept again");
        }
        let left: Vec<_> = cache.read_dir().expect("the cache").flatten().collect();
        assert_eq!(left.len(), 1, "{left:?}");
    }

    #[test]
    fn a_stage_that_another_run_is_at_work_on_keeps_its_state_in_its_own_folder() {
        let root = tempfile::tempdir().expect("a temporary folder");
        let cache = root.path().join("cache");
        let inputs = Inputs::new("stage");
        let kept = cache.join(format!("stage-{}", inputs.key()));
        let other = run_folder::take(&kept.with_extension("unfinished")).expect("nobody holds it");
        let stages = stages_of(root.path(), "run");
        let mut known = Vec::new();
        let mut go = |last: bool| {
            stages.run("1_stage", &inputs, |_, state_file| {
                known.push(begun(state_file));
                state_file.save(&Journal::new("stage", &7u32)?)?;
                if last {
                    Ok(())
                } else {
                    Err(Error::Interrupted(root.path().to_owned()))
                }
            })
        };
        assert!(go(false).is_err());
        assert!(go(false).is_err(), "while the other is at work");
        drop(other);
        assert!(go(true).is_ok(), "and after");
        assert_eq!(known, [None, Some(7), Some(7)]);
        assert!(!stages.folder.join(UNFINISHED).exists(), "nothing is left of it");
        assert!(kept.join(DONE).is_file());
    }

    #[test]
    fn a_stage_that_fails_is_not_kept() {
        let root = tempfile::tempdir().expect("a temporary folder");
        let stages = stages_of(root.path(), "run");
        let inputs = Inputs::new("stage");
        let fail = |_: &Path, _: &mut StateFile| Err(Error::Study("no".to_owned()));
        assert!(stages.run("1_stage", &inputs, fail).is_err());
        let (_, reused) = stages.run("1_stage", &inputs, |_, _| Ok(())).expect("it runs");
        assert!(!reused);
    }
}
