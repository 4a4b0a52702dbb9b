//! What a run writes beside its results: its settings, its manifest, figures as JSON.

use super::Head;
use crate::error::{Error, Result};
use crate::files::run_folder::SETTINGS;
use crate::files::write_whole;
use serde::Serialize;
use std::path::Path;

/// Writes `study.toml`. One that says something else, as after an edit of a run that is resumed or from before that was
/// moved to another backend, is kept beside it as `study.before.toml` or the next free of its kind.
///
/// # Errors
/// [`Error::Io`] if it cannot be written.
pub fn write_study(folder: &Path, toml: &str) -> Result<()> {
    let path = folder.join(SETTINGS);
    match std::fs::read(&path) {
        Ok(before) if before == toml.as_bytes() => return Ok(()),
        Ok(_) => {
            let mut names = (1u32..).map(|number| match number {
                1 => folder.join("study.before.toml"),
                _ => folder.join(format!("study.before-{number}.toml")),
            });
            if let Some(free) = names.find(|name| !name.exists()) {
                std::fs::rename(&path, &free).map_err(|e| Error::io(&path, "move", e))?;
                tracing::warn!(
                    "{} did not say what the run goes by now; it is kept as {}",
                    path.display(),
                    free.display()
                );
            }
        }
        Err(_) => {}
    }
    write_whole(&path, toml.as_bytes())
}

/// Who made a run and of what, as `manifest.json` says it.
#[derive(Clone, Debug, Serialize)]
pub struct Manifest<'a> {
    /// `lapswarm`.
    pub program: &'static str,
    /// Its version.
    pub version: &'static str,
    /// The study, what it was about and how it ran.
    #[serde(flatten)]
    pub head: Head,
    /// The file of resolved settings.
    pub settings: &'a str,
}

impl<'a> Manifest<'a> {
    /// The manifest of a study whose settings are in the file `settings`.
    pub fn new(head: Head, settings: &'a str) -> Self {
        Self {
            program: "lapswarm",
            version: env!("CARGO_PKG_VERSION"),
            head,
            settings,
        }
    }
}

/// Writes a value as JSON, whole or not at all.
///
/// # Errors
/// [`Error::Io`] if it cannot be written.
pub fn write_json(path: &Path, value: &impl serde::Serialize) -> Result<()> {
    let text = serde_json::to_string_pretty(value)
        .map_err(|e| Error::io(path, "write", std::io::Error::other(e)))?;
    write_whole(path, text.as_bytes())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn edited_settings_are_kept() {
        let root = tempfile::tempdir().expect("a temporary folder");
        let text = |name: &str| std::fs::read_to_string(root.path().join(name)).ok();
        write_study(root.path(), "a = 1").expect("written");
        write_study(root.path(), "a = 1").expect("written");
        assert_eq!(text("study.before.toml"), None);
        for (edit, kept) in [("a = 2", "study.before.toml"), ("a = 3", "study.before-2.toml")] {
            std::fs::write(root.path().join(SETTINGS), edit).expect("a file");
            write_study(root.path(), "a = 1").expect("written");
            assert_eq!(text(SETTINGS).as_deref(), Some("a = 1"));
            assert_eq!(text(kept).as_deref(), Some(edit));
        }
    }
}
