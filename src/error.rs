//! The library's one error type. Its variants follow the exit codes of the command line.

use std::borrow::Cow;
use std::fmt;
use std::path::{Path, PathBuf};

/// Everything that can go wrong, grouped by what the user can do about it.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A file or setting holds something it must not (exit code 2).
    #[error("{file}: {place}: found {found}, expected {expected}")]
    Input {
        /// The file, or the name of what the library was given: a bundled resource, the study, the problem.
        file: String,
        /// Where in it.
        place: Place,
        /// What stands there.
        found: String,
        /// What should stand there.
        expected: String,
    },
    /// Something takes more memory than is allowed (exit code 2).
    #[error("{file}: {what}: found {found}, for which some {needed_mib} MiB are needed, expected {expected}")]
    Memory {
        /// The file, or the name of what the library was given.
        file: String,
        /// The setting that is too large, or `file size`.
        what: &'static str,
        /// How large it is.
        found: String,
        /// The memory that it needs (MiB).
        needed_mib: u64,
        /// How large it may be.
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

/// Where an error is: in a file, a table, a log, on a road, or among settings. It is shown as `line 12, field mass_kg`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Place {
    /// How far into the file, the table, the log or the road.
    pub position: Option<Position>,
    /// The setting, field, column or channel.
    pub field: Option<Field>,
}

/// How far into a file, a table, a log or a road an error is.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Position {
    /// A line of a text file, from 1.
    Line(usize),
    /// A row of a table that is no file, from 1.
    Row(usize),
    /// A point of a line, from 1.
    Point(usize),
    /// A sample of a log, from 0.
    Sample(usize),
    /// A time of a log (s).
    Time(f64),
    /// A station of a road (m).
    Station(f64),
}

/// What holds a wrong value.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Field {
    /// A setting, or a part of a file such as its header.
    Named(String),
    /// A field of a file's table.
    Field(String),
    /// A key of a tyre file.
    Key(String),
    /// A column of a table.
    Column(String),
    /// A channel of a log.
    Channel(String),
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

impl Place {
    fn at(position: Position) -> Self {
        Self {
            position: Some(position),
            field: None,
        }
    }

    /// A line of a text file, from 1.
    pub fn line(line: usize) -> Self {
        Self::at(Position::Line(line))
    }

    /// A row of a table that is no file, from 1.
    pub fn row(row: usize) -> Self {
        Self::at(Position::Row(row))
    }

    /// A point of a line, from 1.
    pub fn point(point: usize) -> Self {
        Self::at(Position::Point(point))
    }

    /// A sample of a log, from 0.
    pub fn sample(sample: usize) -> Self {
        Self::at(Position::Sample(sample))
    }

    /// A time of a log (s).
    pub fn time(time_s: f64) -> Self {
        Self::at(Position::Time(time_s))
    }

    /// A station of a road (m).
    pub fn station(station_m: f64) -> Self {
        Self::at(Position::Station(station_m))
    }

    fn of(self, kind: fn(String) -> Field, name: impl ToString) -> Self {
        Self {
            field: Some(kind(told(&name.to_string()))),
            ..self
        }
    }

    /// A setting or a part of a file there.
    pub fn named(self, name: impl ToString) -> Self {
        self.of(Field::Named, name)
    }

    /// A field there.
    pub fn field(self, name: impl ToString) -> Self {
        self.of(Field::Field, name)
    }

    /// A key of a tyre file there.
    pub fn key(self, name: impl ToString) -> Self {
        self.of(Field::Key, name)
    }

    /// A column there.
    pub fn column(self, name: impl ToString) -> Self {
        self.of(Field::Column, name)
    }

    /// A channel there.
    pub fn channel(self, name: impl ToString) -> Self {
        self.of(Field::Channel, name)
    }

    /// The line of the text file, from 1, if the place is in one.
    pub fn line_number(&self) -> Option<usize> {
        match self.position {
            Some(Position::Line(line)) => Some(line),
            _ => None,
        }
    }

    /// The name of the setting, field, column or channel.
    pub fn name(&self) -> Option<&str> {
        self.field.as_ref().map(Field::name)
    }

    /// Whether it says nothing.
    pub fn is_empty(&self) -> bool {
        self.position.is_none() && self.name().is_none_or(str::is_empty)
    }
}

impl From<&str> for Place {
    fn from(name: &str) -> Self {
        Self::default().named(name)
    }
}

impl From<&String> for Place {
    fn from(name: &String) -> Self {
        Self::default().named(name)
    }
}

impl From<String> for Place {
    fn from(name: String) -> Self {
        Self::default().named(name)
    }
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (&self.position, &self.field) {
            (Some(position), Some(field)) => write!(f, "{position}, {field}"),
            (Some(position), None) => write!(f, "{position}"),
            (None, Some(field)) => write!(f, "{field}"),
            (None, None) => Ok(()),
        }
    }
}

impl fmt::Display for Position {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Line(line) => write!(f, "line {line}"),
            Self::Row(row) => write!(f, "row {row}"),
            Self::Point(point) => write!(f, "point {point}"),
            Self::Sample(sample) => write!(f, "sample {sample}"),
            Self::Time(time) => write!(f, "t = {time:.3} s"),
            Self::Station(station) => write!(f, "station {station:.1} m"),
        }
    }
}

impl Field {
    /// Its name.
    pub fn name(&self) -> &str {
        match self {
            Self::Named(name)
            | Self::Field(name)
            | Self::Key(name)
            | Self::Column(name)
            | Self::Channel(name) => name,
        }
    }
}

impl fmt::Display for Field {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let kind = match self {
            Self::Named(_) => "",
            Self::Field(_) => "field ",
            Self::Key(_) => "key ",
            Self::Column(_) => "column ",
            Self::Channel(_) => "channel ",
        };
        write!(f, "{kind}{}", self.name())
    }
}

impl Error {
    /// An [`Error::Input`] from anything printable.
    pub fn input(
        file: impl AsRef<Path>,
        place: impl Into<Place>,
        found: impl Into<String>,
        expected: impl Into<String>,
    ) -> Self {
        Self::Input {
            file: file.as_ref().display().to_string(),
            place: place.into(),
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

    /// The same error, said of another file, if it is about input.
    #[must_use]
    pub fn of_file(self, name: impl AsRef<Path>) -> Self {
        match self {
            Self::Input {
                place,
                found,
                expected,
                ..
            } => Self::input(name, place, found, expected),
            other => other,
        }
    }

    /// The file that the error is about, or the name of what the library was given.
    pub fn file(&self) -> Option<Cow<'_, str>> {
        match self {
            Self::Input { file, .. } | Self::Memory { file, .. } => Some(file.into()),
            Self::Io { path, .. } => Some(path.to_string_lossy()),
            _ => None,
        }
    }

    /// Where in [`Error::file`] it is.
    pub fn place(&self) -> Option<Cow<'_, Place>> {
        match self {
            Self::Input { place, .. } => Some(Cow::Borrowed(place)),
            Self::Memory { what, .. } => Some(Cow::Owned(Place::from(*what))),
            _ => None,
        }
    }

    /// The exit code the command line ends with (see the README).
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Study(_) => 1,
            Self::Input { .. } | Self::Memory { .. } | Self::Io { .. } => 2,
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
        let at = |place: Place, words: &str, line: Option<usize>, name: Option<&str>| {
            let error = Error::input("car.toml", place.clone(), "1", "2");
            assert_eq!(error.file().as_deref(), Some("car.toml"));
            assert_eq!(error.place().as_deref(), Some(&place));
            assert_eq!((place.line_number(), place.name()), (line, name));
            assert_eq!(
                error.to_string(),
                format!("car.toml: {words}: found 1, expected 2")
            );
        };
        let field = Place::line(12).field("mass_kg");
        at(field, "line 12, field mass_kg", Some(12), Some("mass_kg"));
        at(Place::line(3), "line 3", Some(3), None);
        at("sections".into(), "sections", None, Some("sections"));
        at(
            Place::time(0.25).channel("Yaw"),
            "t = 0.250 s, channel Yaw",
            None,
            Some("Yaw"),
        );
        let bell = Place::from("a\u{7}b");
        assert_eq!(bell.name(), Some("a\\u{7}b"));
        let device = Error::Device("lost".to_owned());
        assert!(device.file().is_none() && device.place().is_none());
    }
}
