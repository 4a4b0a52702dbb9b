//! Kinds of settings that name a place: other studies' settings, and folders.

use super::{File, Kind, Spec, quoted};
use crate::config::Table;
use crate::config::settings::{Settings, Written, Wrong};
use crate::error::{Error, Result};
use std::path::{Path, PathBuf};

/// Settings of another study: its study file, or a table.
pub fn file_or_table() -> Spec<FileOrTable> {
    Spec::of(FileOrTable)
}

/// See [`file_or_table`].
pub struct FileOrTable;

impl<T: Settings> Kind<T> for FileOrTable {
    fn read(&self, table: &Table<'_>, key: &str, _: &str, folder: &Path) -> Result<Option<T>> {
        if table.is_table(key) {
            let inner = table.table(key)?;
            return inner.map(|inner| T::read_table(inner, folder)).transpose();
        }
        let name = table.string(key)?;
        name.map(|name| T::read(&folder.join(name))).transpose()
    }

    fn write(&self, settings: &T) -> Option<Written> {
        Some(Written::Within(settings.to_toml()))
    }

    fn parse(&self, text: &str, _: &T) -> Result<T, String> {
        T::read(Path::new(text)).map_err(|e| e.to_string())
    }

    fn check(&self, settings: &T) -> Result<(), Wrong> {
        settings.validate().map_err(|error| match error {
            Error::Input {
                place,
                found,
                expected,
                ..
            } => Wrong {
                found: format!("{place} {found}"),
                expected,
            },
            other => Wrong {
                found: other.to_string(),
                expected: "settings that can be used".to_owned(),
            },
        })
    }

    fn make_absolute(&self, settings: &mut T) {
        *settings = settings.clone().absolute();
    }

    fn value_name(&self) -> &'static str {
        "FILE"
    }
}

/// A folder; an empty name for none.
pub fn folder_or_none() -> Spec<Folder> {
    Spec::of(Folder)
}

/// See [`folder_or_none`].
pub struct Folder;

impl Kind<Option<PathBuf>> for Folder {
    fn read(&self, table: &Table<'_>, key: &str, _: &str, folder: &Path) -> Result<Option<Option<PathBuf>>> {
        let name = table.string(key)?;
        Ok(name.map(|name| (!name.is_empty()).then(|| folder.join(name))))
    }

    fn write(&self, path: &Option<PathBuf>) -> Option<Written> {
        let name = path.as_ref().map_or(String::new(), |p| p.display().to_string());
        Some(Written::Value(quoted(&name)))
    }

    fn parse(&self, text: &str, _: &Option<PathBuf>) -> Result<Option<PathBuf>, String> {
        Ok((!text.is_empty()).then(|| PathBuf::from(text)))
    }

    fn make_absolute(&self, path: &mut Option<PathBuf>) {
        if let Some(path) = path {
            File.make_absolute(path);
        }
    }

    fn value_name(&self) -> &'static str {
        "DIR"
    }
}

/// A switch that empties the name of [`folder_or_none`].
pub fn no_folder() -> Spec<NoFolder> {
    Spec::of(NoFolder)
}

/// See [`no_folder`].
pub struct NoFolder;

impl Kind<Option<PathBuf>> for NoFolder {
    fn read(&self, table: &Table<'_>, key: &str, _: &str, _: &Path) -> Result<Option<Option<PathBuf>>> {
        Ok(table.boolean(key)?.filter(|none| *none).map(|_| None))
    }

    fn write(&self, _: &Option<PathBuf>) -> Option<Written> {
        None
    }

    fn parse(&self, text: &str, present: &Option<PathBuf>) -> Result<Option<PathBuf>, String> {
        Ok(present.clone().filter(|_| text != "true"))
    }

    fn value_name(&self) -> &'static str {
        "true|false"
    }
}
