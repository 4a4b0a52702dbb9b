//! Files that appear whole or not at all, and stay after a loss of power.

pub mod lock;
pub mod run_folder;

use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

use crate::config::folder_of;
use crate::hold::{self, Point};
use crate::{Error, Result};

/// Writes a file by way of a temporary one in the same folder, so that a reader, or a run that is stopped half way, never sees
/// part of it.
///
/// # Errors
/// [`Error::Io`] when the folder is missing or cannot be written to.
pub fn write_whole(path: impl AsRef<Path>, contents: &[u8]) -> Result<()> {
    write_whole_by(path, |file| file.write_all(contents))
}

/// As [`write_whole`], of a file that `write` writes piece by piece.
///
/// # Errors
/// As [`write_whole`], and those of `write`.
pub fn write_whole_by(path: impl AsRef<Path>, write: impl FnOnce(&mut File) -> io::Result<()>) -> Result<()> {
    let path = path.as_ref();
    place(path, write, |temporary| fs::rename(temporary, path))
}

/// As [`write_whole`], of a file that is not there yet.
///
/// # Errors
/// As [`write_whole`], and of the kind [`io::ErrorKind::AlreadyExists`] when it is there.
pub fn write_new(path: impl AsRef<Path>, contents: &[u8]) -> Result<()> {
    let path = path.as_ref();
    let write = |file: &mut File| file.write_all(contents);
    place(path, write, |temporary| match fs::hard_link(temporary, path) {
        Ok(()) => fs::remove_file(temporary),
        Err(error) if error.kind() == io::ErrorKind::AlreadyExists => Err(error),
        // A file system without links.
        Err(_) if path.symlink_metadata().is_ok() => Err(io::ErrorKind::AlreadyExists.into()),
        Err(_) => fs::rename(temporary, path),
    })
}

/// Writes several files into a folder, all or none: `write` gets a folder within it, whose files take their places in the end. Folders
/// that are not there yet are made.
///
/// # Errors
/// [`Error::Input`] if a file stands in the folder's place; [`Error::Io`] when the folder cannot be made or written to; those of
/// `write`.
pub fn write_together(folder: &Path, write: impl FnOnce(&Path) -> Result<()>) -> Result<()> {
    if folder.is_file() {
        let expected = "a folder, or a new name for one";
        return Err(Error::input(folder, "the folder", "a file", expected));
    }
    let made = run_folder::missing(folder);
    let staged = folder.join(format!(".lapswarm-{}.tmp", std::process::id()));
    let placed = fs::create_dir_all(&staged)
        .map_err(|e| Error::io(folder, "create", e))
        .and_then(|()| write(&staged))
        .and_then(|()| {
            let failed = |e| Error::io(folder, "write", e);
            for entry in fs::read_dir(&staged).map_err(failed)? {
                let entry = entry.map_err(failed)?;
                let path = folder.join(entry.file_name());
                fs::rename(entry.path(), &path).map_err(|e| Error::io(path, "write", e))?;
            }
            Ok(())
        });
    // The first failure is the one to report.
    let _ = fs::remove_dir_all(&staged);
    if placed.is_err() {
        run_folder::remove_empty(&made);
    }
    sync_folder(folder);
    placed.map_err(|error| match error {
        // Named as it was to be.
        Error::Io { path, action, source } if path.starts_with(&staged) => {
            let name = path.file_name().map(|name| folder.join(name));
            Error::io(name.unwrap_or(path), action, source)
        }
        error => error,
    })
}

/// The user's folder for what can be made again, if the system says where such are kept.
pub fn cache_folder() -> Option<PathBuf> {
    let of = |variable: &str| {
        std::env::var_os(variable)
            .map(PathBuf::from)
            .filter(|path| path.is_absolute())
    };
    let all = if cfg!(windows) {
        of("LOCALAPPDATA")
    } else if cfg!(target_vendor = "apple") {
        of("HOME").map(|home| home.join("Library/Caches"))
    } else {
        of("XDG_CACHE_HOME").or_else(|| of("HOME").map(|home| home.join(".cache")))
    };
    all.map(|folder| folder.join("lapswarm"))
}

/// Makes sure that the names in a folder are on the disk.
pub fn sync_folder(folder: &Path) {
    // Not every system lets a folder be opened; there a move is as safe as it gets.
    if let Ok(folder) = File::open(folder) {
        let _ = folder.sync_all();
    }
}

/// A name as a part of a file's name: letters and digits, and never longer than it was (bytes).
pub fn stem(name: &str) -> String {
    name.chars()
        .map(|c| if c.is_alphanumeric() { c } else { '_' })
        .collect()
}

/// What reports call files: their names without the ending, with the folders where these are not enough.
pub fn names_of(files: &[PathBuf]) -> Vec<String> {
    let text =
        |part: Option<&std::ffi::OsStr>| part.map_or(String::new(), |s| s.to_string_lossy().into_owned());
    let stem = |path: &Path| text(path.file_stem());
    let within = |path: &Path| format!("{}/{}", text(path.parent().and_then(Path::file_name)), stem(path));
    let whole = |path: &Path| path.display().to_string();
    let lone = |of: &dyn Fn(&Path) -> String, path: &Path| {
        let name = of(path);
        (files.iter().filter(|f| of(f) == name).count() == 1).then_some(name)
    };
    files
        .iter()
        .map(|path| {
            lone(&stem, path)
                .or_else(|| lone(&within, path))
                .unwrap_or_else(|| whole(path))
        })
        .collect()
}

/// Whether a name is that of a file which a process that was killed had half written.
pub fn is_temporary(name: &str) -> bool {
    name.starts_with(".lapswarm-") && name.ends_with(".tmp")
}

/// Writes a temporary file beside `path`, and moves it there.
fn place(
    path: &Path,
    write: impl FnOnce(&mut File) -> io::Result<()>,
    put: impl FnOnce(&Path) -> io::Result<()>,
) -> Result<()> {
    let (temporary, mut file) = temporary_beside(path).map_err(|e| Error::io(path, "write", e))?;
    let placed = || {
        write(&mut file)?;
        // On the disk before it takes the place of the last one.
        file.sync_all()?;
        drop(file);
        hold::pass(Point::Written);
        put(&temporary)?;
        hold::pass(Point::Placed);
        sync_folder(folder_of(path));
        Ok(())
    };
    placed().map_err(|source| {
        // The first failure is the one to report; a leftover that cannot be removed changes nothing.
        let _ = fs::remove_file(&temporary);
        Error::io(path, "write", source)
    })
}

/// A new file in the same folder. Its name does not grow with that of the file, which may be as long as names can be.
fn temporary_beside(path: &Path) -> io::Result<(PathBuf, File)> {
    static SERIAL: AtomicU64 = AtomicU64::new(0);
    loop {
        let serial = SERIAL.fetch_add(1, Ordering::Relaxed);
        let name = format!(".lapswarm-{}-{serial}.tmp", std::process::id());
        let temporary = path.with_file_name(name);
        match File::create_new(&temporary) {
            // Of another machine, or of a process that had the same number and was killed.
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
            created => return Ok((temporary, created?)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let entries = folder.read_dir().expect("a folder").flatten();
        let mut names: Vec<String> = entries
            .map(|e| e.file_name().to_string_lossy().into_owned())
            .collect();
        names.sort();
        names
    }

    #[test]
    fn a_file_takes_the_place_of_the_last_one_and_leaves_nothing_beside_it() {
        let folder = tempfile::tempdir().expect("a folder");
        // The longest name there can be: there is none for a temporary file made of it.
        let longest = "n".repeat(255);
        let path = folder.path().join(&longest);
        for contents in ["one", "another"] {
            write_whole(&path, contents.as_bytes()).expect("written");
            assert_eq!(fs::read_to_string(&path).expect("a file"), contents);
        }
        assert_eq!(names(folder.path()), [longest]);
    }

    #[test]
    fn a_file_that_cannot_be_put_in_its_place_leaves_nothing() {
        let folder = tempfile::tempdir().expect("a folder");
        fs::create_dir(folder.path().join("taken")).expect("a folder");
        fs::write(folder.path().join("taken/file"), "").expect("a file");
        let error = write_whole(folder.path().join("taken"), b"text").expect_err("a folder is there");
        assert!(matches!(error, Error::Io { action: "write", .. }), "{error}");
        assert_eq!(names(folder.path()), ["taken"]);
        assert!(write_whole(folder.path().join("none/file"), b"text").is_err());
    }

    #[test]
    fn files_are_written_together_or_not_at_all() {
        let folder = tempfile::tempdir().expect("a folder");
        let new = folder.path().join("a/b");
        let failed = write_together(&new, |within| {
            write_whole(within.join("one"), b"1")?;
            write_whole(within.join("none/two"), b"2")
        });
        let told = failed.expect_err("no such folder").to_string();
        assert!(told.contains("a/b/two"), "{told}");
        assert_eq!(names(folder.path()), [""; 0]);
        for contents in ["1", "2"] {
            write_together(&new, |within| {
                write_whole(within.join("one"), contents.as_bytes())
            })
            .expect("written");
            assert_eq!(fs::read_to_string(new.join("one")).expect("a file"), contents);
            assert_eq!(names(&new), ["one"]);
        }
        let within_a_file = new.join("one");
        let told = write_together(&within_a_file, |_| Ok(())).expect_err("a file");
        assert_eq!(told.exit_code(), 2);
        assert!(write_together(&within_a_file.join("c"), |_| Ok(())).is_err());
        assert_eq!(fs::read_to_string(&within_a_file).expect("a file"), "2");
    }

    #[test]
    fn a_new_file_overwrites_nothing() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("file");
        write_new(&path, b"first").expect("written");
        let error = write_new(&path, b"second").expect_err("it is there");
        let Error::Io { source, .. } = error else {
            panic!("{error}");
        };
        assert_eq!(source.kind(), io::ErrorKind::AlreadyExists);
        assert_eq!(fs::read_to_string(&path).expect("a file"), "first");
        assert_eq!(names(folder.path()), ["file"]);
    }

    #[test]
    fn names_that_lead_elsewhere_become_names_of_files() {
        for (name, expected) in [
            ("../../evil", "______evil"),
            ("/evil", "_evil"),
            ("C:\\evil", "C__evil"),
            ("..", "__"),
            ("nul\0", "nul_"),
            ("Kurve Größe 1", "Kurve_Größe_1"),
        ] {
            assert_eq!(stem(name), expected);
        }
        let longest = "中\u{2028}".repeat(30);
        assert!(stem(&longest).len() <= longest.len());
    }

    #[cfg(all(unix, feature = "studies"))]
    #[test]
    fn cars_and_laps_take_the_place_of_the_last_ones() {
        use crate::telemetry::{ChannelMap, Log, LogOptions, NativeFormat, write_native};
        let folder = tempfile::tempdir().expect("a folder");
        let of = |name: &str| folder.path().join(name);
        for name in ["car.toml", "car.tir", "lap.csv"] {
            fs::write(of(name), "the last one").expect("a file");
            // What is written in place shows through every name of a file.
            fs::hard_link(of(name), of("other ").with_extension(name)).expect("a link");
        }
        crate::vehicle::Car::bundled()
            .and_then(|car| car.write(folder.path(), "car"))
            .expect("a car");
        let lap = Path::new(env!("CARGO_MANIFEST_DIR")).join("data/laps/gt_silverstone.csv");
        let log = Log::read(lap, &ChannelMap::default(), &LogOptions::default()).expect("a log");
        write_native(&log, of("lap.csv"), &NativeFormat::exact()).expect("written");
        for name in ["car.toml", "car.tir", "lap.csv"] {
            let other = fs::read_to_string(of("other ").with_extension(name)).expect("a file");
            assert_eq!(other, "the last one", "{name}");
            assert_ne!(fs::read_to_string(of(name)).expect("a file"), other);
        }
    }

    /// What a program writes and a loss of power may cut in two goes through this module.
    #[test]
    fn nothing_else_writes_files() {
        fn sources(folder: &Path, found: &mut Vec<PathBuf>) {
            for entry in folder.read_dir().expect("a folder").flatten() {
                let path = entry.path();
                if path.is_dir() {
                    sources(&path, found);
                } else if path.extension().is_some_and(|e| e == "rs") {
                    found.push(path);
                }
            }
        }
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
        let mut found = Vec::new();
        sources(&root, &mut found);
        assert!(found.len() > 100);
        for path in found {
            let name = path.file_name().unwrap_or_default().to_string_lossy();
            if path == root.join("files.rs") || name.ends_with("tests.rs") {
                continue;
            }
            let text = fs::read_to_string(&path).expect("a source");
            let tests = [
                "#[cfg(test)]\nmod tests {",
                "#[cfg(test)]\npub(crate) mod testing {",
            ];
            let program = tests.iter().fold(text.as_str(), |program, start| {
                program.split(start).next().unwrap_or_default()
            });
            for line in program.lines() {
                let writes = ["fs::write(", "File::create", "fs::copy(", "create_new("]
                    .iter()
                    .any(|call| line.contains(call));
                // A switch of the system's, which is no file.
                assert!(
                    !writes || line.contains("/proc/self/"),
                    "{}: {line}",
                    path.display()
                );
            }
        }
    }
}
