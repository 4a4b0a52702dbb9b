//! The folder that a run writes into: one run each, nothing overwritten, one process at a time.

use super::is_temporary;
use super::lock::LockFile;
use crate::error::{Error, Result};
use std::ops::Deref;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Where runs go that were given no folder.
const RUNS: &str = "runs";
/// The file that the process that writes into a folder holds locked; it says which process that is. The system gives the
/// lock back when the process ends, however it ends.
const LOCK: &str = ".lock";
/// How long one that joins others waits for the first of them to begin.
const PATIENCE: Duration = Duration::from_secs(60);
/// How long it waits between two looks.
const LOOK: Duration = Duration::from_millis(20);
/// The state of a run that can be resumed.
pub const STATE: &str = "state.lapswarm";
/// What a run writes before it begins: its resolved settings.
pub const SETTINGS: &str = "study.toml";
/// The figures of a run.
pub const SUMMARY: &str = "summary.json";
/// What a finished or interrupted run leaves last: who made it, and of what.
pub const MANIFEST: &str = "manifest.json";

/// The folder of a run, which no other process writes into while this lives, unless it is shared.
#[derive(Debug)]
pub struct RunFolder {
    path: PathBuf,
    /// Whether this run is the first in it.
    first: bool,
    /// The folders that it made for that, the innermost first.
    made: Vec<PathBuf>,
    lock: Option<LockFile>,
}

impl Deref for RunFolder {
    type Target = Path;

    fn deref(&self) -> &Path {
        &self.path
    }
}

impl AsRef<Path> for RunFolder {
    fn as_ref(&self) -> &Path {
        &self.path
    }
}

impl Drop for RunFolder {
    fn drop(&mut self) {
        if self.first && !holds_more_than(&self.path, &[LOCK, SETTINGS]) {
            // A run that has come to nothing, not even to a state. What cannot be removed stands in nobody's way.
            let _ = std::fs::remove_file(self.path.join(SETTINGS));
        }
        drop(self.lock.take());
        remove_empty(&self.made);
    }
}

impl RunFolder {
    fn of(path: &Path, lock: LockFile) -> Self {
        Self {
            path: path.to_owned(),
            first: false,
            made: Vec::new(),
            lock: Some(lock),
        }
    }

    /// Takes the folder for this process.
    fn lock(path: &Path) -> Result<Self> {
        match LockFile::try_take(&path.join(LOCK))? {
            Ok(lock) => Ok(Self::of(path, lock)),
            Err(owner) => Err(Self::held(path, &owner)),
        }
    }

    /// Another process holds the folder.
    fn held(path: &Path, owner: &str) -> Error {
        let found = format!("a folder that process {owner} writes into");
        Error::input(path, "out", found, "one that no run is at work in")
    }

    /// Lets other processes [join] this one in the folder.
    ///
    /// # Errors
    /// [`Error::Io`] if the system refuses.
    pub fn share(&mut self) -> Result<()> {
        self.lock.as_mut().map_or(Ok(()), LockFile::share)
    }
}

/// Whether a folder has anything in it but what a run leaves that has come to nothing: its lock, its settings, and what it had
/// half written. Settings without a lock are a user's own.
fn holds_something(folder: &Path) -> bool {
    let began = folder.join(LOCK).is_file();
    holds_more_than(folder, if began { &[LOCK, SETTINGS] } else { &[] })
}

/// The folder that [`create`] would create, which is not touched.
///
/// # Errors
/// [`Error::Input`] if the folder asked for holds anything already.
pub fn would_be(study: &str, asked: Option<&Path>) -> Result<PathBuf> {
    match asked {
        Some(folder) => check_free(folder).map(|()| folder.to_owned()),
        None => {
            let numbered = |number: u32| Path::new(RUNS).join(format!("{study}-{number:03}"));
            Ok((1..u32::MAX)
                .map(numbered)
                .find(|folder| !folder.exists())
                .unwrap_or_else(|| numbered(u32::MAX)))
        }
    }
}

/// Refuses a folder that holds anything, and what is no folder.
fn check_free(folder: &Path) -> Result<()> {
    match folder.read_dir() {
        Err(e) if e.kind() != std::io::ErrorKind::NotFound && !folder.is_file() => {
            Err(Error::io(folder, "read", e))
        }
        _ if folder.is_file() || holds_something(folder) => Err(taken(folder)),
        _ if folder.is_symlink() && !folder.exists() => {
            let expected = "a new or empty folder";
            Err(Error::input(folder, "out", "a link to nowhere", expected))
        }
        _ => Ok(()),
    }
}

fn taken(folder: &Path) -> Error {
    let found = "a folder that holds another run, or a file";
    let expected = "a new or empty folder: nothing is overwritten";
    Error::input(folder, "out", found, expected)
}

fn holds_more_than(folder: &Path, names: &[&str]) -> bool {
    match folder.read_dir() {
        // What cannot be read may hold anything.
        Ok(mut entries) => entries.any(|entry| {
            entry.map_or(true, |e| {
                let name = e.file_name();
                !names.iter().any(|n| name == *n) && !is_temporary(&name.to_string_lossy())
            })
        }),
        Err(error) => error.kind() != std::io::ErrorKind::NotFound,
    }
}

/// Removes those of folders that are empty.
pub(super) fn remove_empty(folders: &[PathBuf]) {
    for folder in folders {
        let _ = std::fs::remove_dir(folder);
    }
}

/// The folder and those around it that are not there, the innermost first.
pub(super) fn missing(folder: &Path) -> Vec<PathBuf> {
    let around = folder.ancestors().filter(|path| !path.as_os_str().is_empty());
    around
        .take_while(|path| !path.exists())
        .map(Path::to_owned)
        .collect()
}

/// Creates the folder of a run: `asked`, or the next free `runs/<study>-NNN`. It goes again with a run that leaves nothing in it
/// but its settings.
///
/// # Errors
/// [`Error::Input`] if the folder asked for holds anything already or another process writes into it; [`Error::Io`] if it
/// cannot be created.
pub fn create(study: &str, asked: Option<&Path>) -> Result<RunFolder> {
    if let Some(folder) = asked {
        check_free(folder)?;
        let made = missing(folder);
        std::fs::create_dir_all(folder).map_err(|e| Error::io(folder, "create", e))?;
        let mut locked = RunFolder::lock(folder).inspect_err(|_| remove_empty(&made))?;
        // Another run may have come and gone between the look and the lock.
        if holds_something(folder) {
            return Err(taken(folder));
        }
        clean(folder, 0)?;
        (locked.first, locked.made) = (true, made);
        return Ok(locked);
    }
    let mut made = missing(Path::new(RUNS));
    std::fs::create_dir_all(RUNS).map_err(|e| Error::io(RUNS, "create", e))?;
    let mut number = 1u32;
    loop {
        let folder = Path::new(RUNS).join(format!("{study}-{number:03}"));
        match std::fs::create_dir(&folder) {
            Ok(()) => {
                let mut locked = RunFolder::lock(&folder)?;
                made.insert(0, folder);
                (locked.first, locked.made) = (true, made);
                return Ok(locked);
            }
            // Taken, perhaps just now by another process.
            Err(e) if e.kind() == std::io::ErrorKind::AlreadyExists => number += 1,
            Err(e) => return Err(Error::io(folder, "create", e)),
        }
    }
}

/// Takes a folder for this process, whatever is in it; what a killed one had half written goes.
///
/// # Errors
/// [`Error::Input`] if another process writes into it; [`Error::Io`] if it cannot be created.
pub fn take(folder: &Path) -> Result<RunFolder> {
    std::fs::create_dir_all(folder).map_err(|e| Error::io(folder, "create", e))?;
    let locked = RunFolder::lock(folder)?;
    clean(folder, 0)?;
    Ok(locked)
}

/// Takes the folder of an interrupted run, to resume it.
///
/// # Errors
/// [`Error::Input`] if there is nothing in it to resume, or another process writes into it.
pub fn reopen(folder: &Path) -> Result<RunFolder> {
    reopen_by(folder, STATE)
}

/// As [`reopen`], for a study whose state is in the file `state`.
///
/// # Errors
/// As [`reopen`].
pub fn reopen_by(folder: &Path, state: &str) -> Result<RunFolder> {
    check_begun(folder, state)?;
    let locked = RunFolder::lock(folder)?;
    check_begun(folder, state)?;
    clean(folder, DEEPEST)?;
    Ok(locked)
}

/// Refuses a folder without the file that says that something is begun.
fn check_begun(folder: &Path, state: &str) -> Result<()> {
    let refused = |found: &str, expected: &str| Err(Error::input(folder, "resume", found, expected));
    if !folder.is_dir() {
        refused("no such folder", "the folder of an interrupted run")
    } else if folder.join(state).is_file() {
        Ok(())
    } else if folder.join(MANIFEST).is_file() {
        refused("a run that is finished", "one that was interrupted")
    } else {
        refused(
            "no saved state",
            "an interrupted run; one that had not begun is started anew, not resumed",
        )
    }
}

/// Takes the folder of work that several processes share, beside those that are at it. The file `begun` in it says that the work
/// is begun; the first process writes it.
///
/// # Errors
/// [`Error::Input`] if there is no such file, or a process has the folder for itself.
pub fn join(folder: &Path, begun: &str) -> Result<RunFolder> {
    check_begun(folder, begun)?;
    let path = folder.join(LOCK);
    let until = Instant::now() + PATIENCE;
    let lock = loop {
        if let Ok(mut lock) = LockFile::try_take(&path)? {
            // Nobody else is at it: what is half written is nobody's.
            clean(folder, DEEPEST)?;
            lock.share()?;
            break lock;
        }
        match LockFile::try_share(&path)? {
            Ok(lock) => break lock,
            Err(owner) if Instant::now() > until => return Err(RunFolder::held(folder, &owner)),
            Err(_) => std::thread::sleep(LOOK),
        }
    };
    check_begun(folder, begun)?;
    Ok(RunFolder::of(folder, lock))
}

/// Joins the work that is begun in a folder, or takes the folder to begin it with `begin`.
///
/// # Errors
/// Those of [`create`], [`join`] and `begin`.
pub fn create_or_join(
    study: &str,
    folder: &Path,
    begun: &str,
    begin: impl Fn(&Path) -> Result<()>,
) -> Result<RunFolder> {
    let until = Instant::now() + PATIENCE;
    loop {
        if folder.join(begun).is_file() {
            return join(folder, begun);
        }
        match create(study, Some(folder)) {
            Ok(mut created) => {
                begin(&created)?;
                created.share()?;
                return Ok(created);
            }
            // Another begins it just now.
            Err(_)
                if (folder.join(LOCK).exists() || folder.join(begun).exists()) && Instant::now() < until =>
            {
                std::thread::sleep(LOOK);
            }
            Err(error) => return Err(error),
        }
    }
}

/// Folders within folders of a run: its stages, what they keep, and no more.
const DEEPEST: usize = 4;

/// Removes what a killed process had half written, under names of its own, in a folder and those in it.
fn clean(folder: &Path, deepest: usize) -> Result<()> {
    let entries = folder.read_dir().map_err(|e| Error::io(folder, "read", e))?;
    for entry in entries.flatten() {
        let path = entry.path();
        let kind = entry.file_type().map_err(|e| Error::io(&path, "read", e))?;
        if kind.is_dir() && deepest > 0 {
            clean(&path, deepest - 1)?;
        } else if kind.is_file() && is_temporary(&entry.file_name().to_string_lossy()) {
            std::fs::remove_file(&path).map_err(|e| Error::io(&path, "remove", e))?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::super::lock::testing::BETWEEN;
    use super::*;

    #[cfg(unix)]
    #[test]
    fn a_lock_file_that_is_taken_away_while_another_waits_for_it_is_held_by_nobody() {
        let root = tempfile::tempdir().expect("a temporary folder");
        let first = take(root.path()).expect("nobody holds it");
        BETWEEN.set(Some((root.path().join(LOCK), Box::new(first))));
        let second = take(root.path()).expect("the first has let go of it");
        assert!(BETWEEN.take().is_none(), "it was let go of just then");
        assert!(second.join(LOCK).is_file());
        let refused = take(root.path()).expect_err("the second holds it");
        assert!(refused.to_string().contains("process"), "{refused}");
        drop(second);
        drop(take(root.path()).expect("nobody holds it"));
    }

    #[test]
    fn what_was_half_written_goes_wherever_it_is() {
        let root = tempfile::tempdir().expect("a temporary folder");
        for folder in ["", "1_identify", ".stages/raceline-1"] {
            let folder = root.path().join(folder);
            std::fs::create_dir_all(&folder).expect("a folder");
            std::fs::write(folder.join(".lapswarm-7-0.tmp"), "hal").expect("a file");
            std::fs::write(folder.join("kept.tmp"), "whole").expect("a file");
        }
        std::fs::write(root.path().join(STATE), "a state").expect("a file");
        drop(reopen(root.path()).expect("a state"));
        for folder in ["", "1_identify", ".stages/raceline-1"] {
            let folder = root.path().join(folder);
            assert!(!folder.join(".lapswarm-7-0.tmp").exists(), "{folder:?}");
            assert!(folder.join("kept.tmp").exists(), "{folder:?}");
        }
        std::fs::write(root.path().join(".lapswarm-7-0.tmp"), "hal").expect("a file");
        drop(take(root.path()).expect("nobody holds it"));
        assert!(!root.path().join(".lapswarm-7-0.tmp").exists());
    }

    #[test]
    fn one_process_at_a_time_and_a_dead_one_holds_nothing() {
        let root = tempfile::tempdir().expect("a temporary folder");
        let folder = root.path().join("run");
        let held = create("study", Some(&folder)).expect("a new folder");
        let second = create("study", Some(&folder)).expect_err("it is taken");
        assert_eq!(second.exit_code(), 2);
        let said = second.to_string();
        assert!(
            said.contains(&format!("process {}", std::process::id())),
            "{said}"
        );
        std::fs::write(folder.join(STATE), "a state").expect("a file");
        let resumed = reopen(&folder).expect_err("its owner lives").to_string();
        assert!(resumed.contains("process"), "{resumed}");
        drop(held);
        drop(reopen(&folder).expect("nobody holds it"));
        std::fs::remove_file(folder.join(STATE)).expect("the file goes");
        // As a killed process leaves it.
        std::fs::write(folder.join(LOCK), "1").expect("a file");
        drop(create("study", Some(&folder)).expect("a lock that nobody holds"));
        assert!(!folder.join(LOCK).exists());
    }

    #[test]
    fn the_folder_that_would_be_is_the_one_that_is() {
        let root = tempfile::tempdir().expect("a temporary folder");
        let folder = root.path().join("run");
        assert_eq!(would_be("study", Some(&folder)).expect("a new one"), folder);
        assert!(!folder.exists(), "it is looked at only");
        drop(create("study", Some(&folder)).expect("a new folder"));
        assert!(!folder.exists(), "a run that leaves nothing leaves no folder");
        std::fs::create_dir(&folder).expect("an empty folder");
        assert_eq!(would_be("study", Some(&folder)).expect("an empty one"), folder);
        std::fs::write(folder.join("a"), "something").expect("a file");
        for taken in [&folder, &folder.join("a")] {
            let said = would_be("study", Some(taken)).expect_err("taken").to_string();
            let refused = create("study", Some(taken)).expect_err("taken").to_string();
            assert_eq!(said, refused);
        }
    }

    #[test]
    fn of_many_that_want_one_folder_one_gets_it() {
        let root = tempfile::tempdir().expect("a temporary folder");
        let folder = root.path().join("run");
        let together = std::sync::Barrier::new(8);
        let got: Vec<bool> = std::thread::scope(|scope| {
            let contend = || {
                together.wait();
                let folder = create("study", Some(&folder));
                let got = folder.is_ok();
                // Held until all have tried.
                together.wait();
                got
            };
            let all: Vec<_> = (0..8).map(|_| scope.spawn(contend)).collect();
            all.into_iter().map(|t| t.join().expect("no panic")).collect()
        });
        assert_eq!(got.iter().filter(|g| **g).count(), 1);
    }

    #[test]
    fn a_run_that_comes_to_nothing_takes_its_folder_with_it() {
        let root = tempfile::tempdir().expect("a temporary folder");
        let folder = root.path().join("run");
        let begin = |leaves: &[&str]| {
            let held = create("study", Some(&folder)).expect("a new folder");
            for name in leaves {
                std::fs::write(held.join(name), "something").expect("a file");
            }
        };
        begin(&[]);
        assert!(!folder.exists());
        let deep = root.path().join("a/b/run");
        drop(create("study", Some(&deep)).expect("a new folder"));
        assert!(!root.path().join("a").exists() && root.path().is_dir());
        begin(&[SETTINGS]);
        assert!(!folder.exists());
        // Of a folder that was there before, only what the run wrote goes.
        std::fs::create_dir(&folder).expect("a folder");
        begin(&[SETTINGS]);
        assert!(folder.is_dir() && !holds_something(&folder));
        begin(&[SETTINGS, STATE]);
        assert!(folder.join(SETTINGS).is_file() && folder.join(STATE).is_file());
        drop(reopen(&folder).expect("a state"));
        assert!(folder.join(SETTINGS).is_file() && folder.join(STATE).is_file());
    }

    /// What a run leaves that was killed before its first state: neither it nor the next may be in the way, and a user's own
    /// settings are no such thing.
    #[test]
    fn what_a_run_killed_at_its_beginning_leaves_is_in_nobodys_way() {
        let root = tempfile::tempdir().expect("a temporary folder");
        let folder = root.path().join("run");
        std::fs::create_dir(&folder).expect("a folder");
        for leaves in [
            &[LOCK][..],
            &[LOCK, ".lapswarm-7-0.tmp"],
            &[LOCK, SETTINGS, ".lapswarm-7-0.tmp"],
        ] {
            for name in leaves {
                std::fs::write(folder.join(name), "").expect("a file");
            }
            assert_eq!(
                would_be("study", Some(&folder)).expect("as good as empty"),
                folder
            );
            let held = create("study", Some(&folder)).expect("as good as empty");
            assert!(!held.join(".lapswarm-7-0.tmp").exists());
            drop(held);
            std::fs::create_dir_all(&folder).expect("a folder");
        }
        std::fs::write(folder.join(SETTINGS), "a user's own").expect("a file");
        create("study", Some(&folder)).expect_err("not ours to overwrite");
        std::fs::write(folder.join(LOCK), "7").expect("a file");
        std::fs::write(folder.join("notes.txt"), "a user's own").expect("a file");
        create("study", Some(&folder)).expect_err("not ours to overwrite");
    }

    #[test]
    fn names_that_cannot_be_are_refused_for_that() {
        let root = tempfile::tempdir().expect("a temporary folder");
        let long = root.path().join("n".repeat(300));
        let refused = create("study", Some(&long)).expect_err("too long").to_string();
        assert!(!refused.contains("another run"), "{refused}");
    }

    #[test]
    fn only_interrupted_runs_are_resumed() {
        let root = tempfile::tempdir().expect("a temporary folder");
        let refused = |folder: &Path| {
            let error = reopen(folder).expect_err("nothing to resume");
            assert_eq!(error.exit_code(), 2);
            error.to_string()
        };
        assert!(refused(&root.path().join("nowhere")).contains("no such folder"));
        assert!(refused(root.path()).contains("no saved state"));
        std::fs::write(root.path().join(MANIFEST), "{}").expect("a file");
        assert!(refused(root.path()).contains("finished"));
    }
}
