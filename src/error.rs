//! The library's one error type. Its variants follow the exit codes of the command line.

use serde::Serialize;
use std::borrow::Cow;
use std::path::{Path, PathBuf};

/// Everything that can go wrong, grouped by what the user can do about it.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A file or setting holds something it must not (exit code 2).
    #[error("{file}: {place}: found {found}, expected {expected}")]
    Input {
        /// The file, or the name of the bundled resource or flag.
        file: String,
        /// The line, field or channel, as in `line 12, field mass_kg`.
        place: String,
        /// What stands there.
        found: String,
        /// What should stand there.
        expected: String,
    },
    /// A file could not be read or written (exit code 2).
    #[error("{path}: cannot {action}: {source}")]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// The verb that failed: `read`, `write`, `create`.
        action: &'static str,
        /// The operating system's reason.
        source: std::io::Error,
    },
    /// No device fits what was asked for (exit code 3).
    #[error("no usable device: {0}")]
    NoDevice(String),
    /// A device failed while it worked (exit code 3).
    #[error("device failure: {0}")]
    Device(String),
    /// The study ran and did not reach what it was asked to reach (exit code 1).
    #[error("{0}")]
    Study(String),
    /// The user stopped the run (exit code 130).
    #[error("interrupted; what was reached is saved in {}", .0.display())]
    Interrupted(PathBuf),
}

/// Where an error is.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Location<'a> {
    /// The file, or the name of the bundled resource or flag.
    pub file: Cow<'a, str>,
    /// The line, from one.
    pub line: Option<usize>,
    /// The field, column or channel.
    pub field: Option<&'a str>,
}

/// `Result` with this crate's [`Error`].
pub type Result<T, E = Error> = std::result::Result<T, E>;

/// Text from a file as a message tells it: not endless, and with nothing in it that a terminal would obey.
fn told(text: &str) -> String {
    const LONGEST: usize = 500;
    let mut out = String::new();
    for c in text.chars().take(LONGEST) {
        if c.is_control() && c != '\n' {
            out.extend(c.escape_debug());
        } else {
            out.push(c);
        }
    }
    if text.chars().nth(LONGEST).is_some() {
        out.push_str("...");
    }
    out
}

impl Error {
    /// An [`Error::Input`] from anything printable.
    pub fn input(
        file: impl AsRef<Path>,
        place: impl Into<String>,
        found: impl Into<String>,
        expected: impl Into<String>,
    ) -> Self {
        Self::Input {
            file: file.as_ref().display().to_string(),
            place: told(&place.into()),
            found: told(&found.into()),
            expected: expected.into(),
        }
    }

    /// An [`Error::Io`]; `action` is the verb that failed.
    pub fn io(path: impl AsRef<Path>, action: &'static str, source: std::io::Error) -> Self {
        Self::Io {
            path: path.as_ref().to_owned(),
            action,
            source,
        }
    }

    /// The file, line and field that the error is about, where it is about one.
    pub fn location(&self) -> Option<Location<'_>> {
        match self {
            Self::Input { file, place, .. } => {
                let mut location = Location {
                    file: file.into(),
                    line: None,
                    field: None,
                };
                for part in place.split(", ") {
                    let line = part.strip_prefix("line ").and_then(|n| n.parse().ok());
                    if line.is_some() {
                        location.line = line;
                    } else {
                        location.field = Some(part.strip_prefix("field ").unwrap_or(part));
                    }
                }
                Some(location)
            }
            Self::Io { path, .. } => Some(Location {
                file: path.to_string_lossy(),
                line: None,
                field: None,
            }),
            _ => None,
        }
    }

    /// The exit code the command line ends with (see the README).
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Study(_) => 1,
            Self::Input { .. } | Self::Io { .. } => 2,
            Self::NoDevice(_) | Self::Device(_) => 3,
            Self::Interrupted(_) => 130,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_say_where_they_are() {
        let at = |place: &str| {
            let error = Error::input("car.toml", place, "1", "2");
            let location = error.location().expect("a file");
            assert_eq!(location.file, "car.toml");
            (location.line, location.field.map(str::to_owned))
        };
        let field = |name: &str| Some(name.to_owned());
        assert_eq!(at("line 12, field mass_kg"), (Some(12), field("mass_kg")));
        assert_eq!(at("line 3"), (Some(3), None));
        assert_eq!(at("sections"), (None, field("sections")));
        assert_eq!(Error::Device("lost".to_owned()).location(), None);
    }
}
