//! Files that a process holds locked while it works on what they stand for. The system gives a lock back when its process ends,
//! however it ends.

use crate::error::{Error, Result};
use std::fs::{File, TryLockError};
use std::io::{self, Read, Seek, Write};
use std::path::{Path, PathBuf};

/// How often a lock file may be taken away just when it is locked, before something else is the matter.
const TRIES: usize = 1000;

/// A file that this process holds locked. It goes with the last who holds it.
#[derive(Debug)]
pub struct LockFile {
    file: File,
    path: PathBuf,
    shared: bool,
}

impl LockFile {
    /// Takes it for this process alone; where another holds it, the number of that process.
    ///
    /// # Errors
    /// [`Error::Io`] if it cannot be written.
    pub fn try_take(path: &Path) -> Result<Result<Self, String>> {
        match Self::attempt(path, File::try_lock)? {
            Ok(lock) => lock.named().map(Ok),
            held => Ok(held),
        }
    }

    /// As [`LockFile::try_take`], and waits for whoever holds it.
    ///
    /// # Errors
    /// As [`LockFile::try_take`].
    pub fn take(path: &Path) -> Result<Self> {
        match Self::attempt(path, |file| file.lock().map_err(TryLockError::Error))? {
            Ok(lock) => lock.named(),
            Err(_) => Err(Error::io(path, "lock", io::ErrorKind::WouldBlock.into())),
        }
    }

    /// Takes it beside others that share it; where one has it for itself, the number of that process.
    ///
    /// # Errors
    /// [`Error::Io`] if it cannot be written.
    pub fn try_share(path: &Path) -> Result<Result<Self, String>> {
        let mut locked = Self::attempt(path, File::try_lock_shared)?;
        if let Ok(lock) = &mut locked {
            lock.shared = true;
        }
        Ok(locked)
    }

    /// Lets others share it from now on.
    ///
    /// # Errors
    /// [`Error::Io`] if the system refuses.
    pub fn share(&mut self) -> Result<()> {
        let failed = |e| Error::io(&self.path, "lock", e);
        loop {
            // Not every system turns one kind of lock into the other.
            for step in [File::unlock, File::lock_shared] {
                match step(&self.file) {
                    Err(e) if e.kind() != io::ErrorKind::Unsupported => return Err(failed(e)),
                    _ => {}
                }
            }
            if is_at(&self.file, &self.path) {
                break;
            }
            // Another had it for itself in between, and took it away.
            self.file = open(&self.path)?;
        }
        self.shared = true;
        Ok(())
    }

    fn attempt(
        path: &Path,
        lock: impl Fn(&File) -> Result<(), TryLockError>,
    ) -> Result<Result<Self, String>> {
        for _ in 0..TRIES {
            let mut file = open(path)?;
            #[cfg(test)]
            testing::between_open_and_lock(path);
            match lock(&file) {
                Ok(()) => {}
                Err(TryLockError::WouldBlock) => {
                    let mut owner = String::new();
                    // Not every system lets a locked file be read.
                    let _ = file.read_to_string(&mut owner);
                    return Ok(Err(owner.trim().to_owned()));
                }
                // A file system without locks: what a run leaves behind still keeps others out.
                Err(TryLockError::Error(e)) if e.kind() == io::ErrorKind::Unsupported => {}
                Err(TryLockError::Error(e)) => return Err(Error::io(path, "write", e)),
            }
            // Whoever ends takes the file away, and may take it from under one that waits for it.
            if is_at(&file, path) {
                let path = path.to_owned();
                return Ok(Ok(Self {
                    file,
                    path,
                    shared: false,
                }));
            }
        }
        let changing = io::Error::other("the file there is another one each time");
        Err(Error::io(path, "lock", changing))
    }

    /// Says in the file which process holds it.
    fn named(mut self) -> Result<Self> {
        let written = self
            .file
            .set_len(0)
            .and_then(|()| self.file.rewind())
            .and_then(|()| write!(self.file, "{}", std::process::id()));
        // A full disk: nothing is to stay behind, which dropping it sees to.
        written.map_err(|e| Error::io(&self.path, "write", e))?;
        Ok(self)
    }
}

impl Drop for LockFile {
    fn drop(&mut self) {
        // The last of those that share it takes it away.
        let alone = !self.shared || (self.file.unlock().is_ok() && self.file.try_lock().is_ok());
        if alone && is_at(&self.file, &self.path) {
            // What cannot be removed stands in nobody's way: a lock file that stays behind is nobody's.
            let _ = std::fs::remove_file(&self.path);
        }
    }
}

fn open(path: &Path) -> Result<File> {
    let options = File::options()
        .read(true)
        .write(true)
        .create(true)
        .truncate(false)
        .open(path);
    options.map_err(|e| Error::io(path, "write", e))
}

/// Whether an open file is the one that a path names.
#[cfg(unix)]
fn is_at(file: &File, path: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    match (file.metadata(), path.metadata()) {
        (Ok(open), Ok(there)) => (open.dev(), open.ino()) == (there.dev(), there.ino()),
        _ => false,
    }
}

/// Whether an open file is the one that a path names: here a name is not free again before the file is closed.
#[cfg(not(unix))]
fn is_at(_: &File, path: &Path) -> bool {
    path.exists()
}

#[cfg(test)]
pub(crate) mod testing {
    use std::any::Any;
    use std::cell::RefCell;
    use std::path::{Path, PathBuf};

    thread_local! {
        /// A lock file, and what is let go of when it is about to be locked.
        pub(crate) static BETWEEN: RefCell<Option<(PathBuf, Box<dyn Any>)>> = const { RefCell::new(None) };
    }

    pub(super) fn between_open_and_lock(path: &Path) {
        drop(BETWEEN.with_borrow_mut(|held| held.take_if(|(at, _)| at == path)));
    }

    use super::LockFile;

    #[test]
    fn those_that_share_a_lock_keep_others_out_and_the_last_takes_it_away() {
        let root = tempfile::tempdir().expect("a folder");
        let path = root.path().join("lock");
        let mut first = LockFile::try_take(&path)
            .expect("a file")
            .expect("nobody holds it");
        let owner = LockFile::try_share(&path)
            .expect("a file")
            .expect_err("it is taken");
        assert_eq!(owner, std::process::id().to_string());
        first.share().expect("shared");
        let second = LockFile::try_share(&path).expect("a file").expect("shared");
        drop(first);
        assert!(path.exists());
        assert!(LockFile::try_take(&path).expect("a file").is_err());
        drop(second);
        assert!(!path.exists());
        // As a killed process leaves it.
        std::fs::write(&path, "12345678901234567890").expect("a file");
        drop(LockFile::take(&path).expect("nobody holds it"));
        assert!(!path.exists());
    }
}
