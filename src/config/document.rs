//! TOML reading that knows its lines: every refusal names file, line and field, and no key goes unread.

use super::LONGEST_NAME;
use crate::error::{Error, Place, Result};
use std::cell::RefCell;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// A parsed TOML file.
pub struct Document<'a> {
    file: PathBuf,
    text: &'a str,
    root: Spanned<DeTable<'a>>,
}

/// The line (from 1) where a byte of a text lies.
pub(crate) fn line_of(text: &str, offset: usize) -> usize {
    text.as_bytes()[..offset.min(text.len())]
        .iter()
        .filter(|&&b| b == b'\n')
        .count()
        + 1
}

/// What a reader of TOML refuses, in words that know nothing of the program; `what` is what the text should be.
pub(crate) fn refused(file: impl AsRef<Path>, text: &str, error: &toml::de::Error, what: &str) -> Error {
    let line = error.span().map_or(1, |span| line_of(text, span.start));
    let message = error.message().trim().replace('\n', ", ");
    let (found, expected) = message.split_once(", expected ").unwrap_or((&message, what));
    let found = match found.split_once(": ") {
        // As in "invalid type: floating point `1.5`".
        Some(("invalid type" | "invalid value" | "invalid length", value)) => told_value(value),
        _ => found.to_owned(),
    };
    Error::input(file, Place::line(line), found, told_type(expected))
}

/// A value that stands in the wrong place.
fn told_value(value: &str) -> String {
    const KINDS: [&str; 4] = ["integer ", "floating point ", "boolean ", "string "];
    match value {
        "map" => "a table".to_owned(),
        "sequence" => "a list".to_owned(),
        _ => {
            let bare = KINDS
                .iter()
                .find_map(|kind| value.strip_prefix(kind))
                .unwrap_or(value);
            bare.trim_matches('`').to_owned()
        }
    }
}

/// What a type is called in TOML.
fn told_type(expected: &str) -> &str {
    match expected {
        "f64" | "f32" => "a number",
        "u8" | "u16" | "u32" | "u64" | "usize" => "a whole number of 0 or more",
        "i8" | "i16" | "i32" | "i64" | "isize" => "a whole number",
        "a map" | "map" => "a table",
        "a sequence" => "a list",
        "a boolean" => "true or false",
        _ if expected.starts_with("struct ") => "a table",
        _ if expected.starts_with("a sequence") => "a list",
        _ => expected,
    }
}

impl<'a> Document<'a> {
    /// Parses `text`, which came from `file`.
    ///
    /// # Errors
    /// [`Error::Input`] naming the line if it is no TOML.
    pub fn parse(file: &Path, text: &'a str) -> Result<Self> {
        let root = DeTable::parse(text).map_err(|e| refused(file, text, &e, "valid TOML"))?;
        Ok(Self {
            file: file.to_owned(),
            text,
            root,
        })
    }

    /// The top-level table.
    pub fn root(&'a self) -> Table<'a> {
        Table {
            document: self,
            name: String::new(),
            line: 1,
            entries: self.root.get_ref(),
            read: RefCell::default(),
        }
    }
}

/// One table of a [`Document`]. Call [`Table::finish`] when all keys were asked for.
pub struct Table<'a> {
    document: &'a Document<'a>,
    name: String,
    line: usize,
    entries: &'a DeTable<'a>,
    read: RefCell<BTreeSet<String>>,
}

impl<'a> Table<'a> {
    fn value(&self, key: &str) -> Option<&'a Spanned<DeValue<'a>>> {
        self.read.borrow_mut().insert(key.to_owned());
        self.entries.get(key)
    }

    fn field(&self, key: &str) -> String {
        if self.name.is_empty() {
            key.to_owned()
        } else {
            format!("{}.{key}", self.name)
        }
    }

    fn describe(value: &DeValue<'_>) -> String {
        match value {
            DeValue::String(s) => format!("\"{s}\""),
            DeValue::Integer(i) => i.as_str().to_owned(),
            DeValue::Float(f) => f.as_str().to_owned(),
            DeValue::Boolean(b) => b.to_string(),
            DeValue::Array(items) => {
                let items: Vec<String> = items.iter().map(|item| Self::describe(item.get_ref())).collect();
                format!("[{}]", items.join(", "))
            }
            DeValue::Table(_) => "a table".to_owned(),
            DeValue::Datetime(_) => "a date".to_owned(),
        }
    }

    fn wrong(&self, key: &str, value: &Spanned<DeValue<'_>>, expected: impl Into<String>) -> Error {
        let line = line_of(self.document.text, value.span().start);
        Error::input(
            &self.document.file,
            Place::line(line).field(self.field(key)),
            Self::describe(value.get_ref()),
            expected,
        )
    }

    /// An error at this key: what stands there is wrong for the reason `expected`.
    pub fn refuse(&self, key: &str, expected: impl Into<String>) -> Error {
        match self.entries.get(key) {
            Some(value) => self.wrong(key, value, expected),
            None => self.missing(key, expected),
        }
    }

    fn missing(&self, key: &str, expected: impl Into<String>) -> Error {
        let place = if self.name.is_empty() {
            Place::default()
        } else {
            Place::line(self.line)
        };
        Error::input(
            &self.document.file,
            place.field(self.field(key)),
            "nothing",
            expected,
        )
    }

    fn as_number(value: &DeValue<'_>) -> Option<f64> {
        match value {
            DeValue::Float(f) => f.as_str().replace('_', "").parse().ok(),
            DeValue::Integer(i) => i64::from_str_radix(&i.as_str().replace('_', ""), i.radix())
                .ok()
                .map(|i| i as f64),
            _ => None,
        }
    }

    /// A finite number within `minimum..=maximum`, if the key is there.
    ///
    /// # Errors
    /// [`Error::Input`] naming line and field if something else stands there.
    pub fn number(&self, key: &str, minimum: f64, maximum: f64, unit: &str) -> Result<Option<f64>> {
        let Some(value) = self.value(key) else {
            return Ok(None);
        };
        let expected = || format!("a number from {minimum} to {maximum} {unit}");
        match Self::as_number(value.get_ref()) {
            Some(x) if x >= minimum && x <= maximum => Ok(Some(x)),
            _ => Err(self.wrong(key, value, expected().trim_end())),
        }
    }

    /// As [`Table::number`], but the key must be there.
    ///
    /// # Errors
    /// As [`Table::number`]; [`Error::Input`] if nothing stands there.
    pub fn required_number(&self, key: &str, minimum: f64, maximum: f64, unit: &str) -> Result<f64> {
        self.number(key, minimum, maximum, unit)?.ok_or_else(|| {
            self.missing(
                key,
                format!("a number from {minimum} to {maximum} {unit}").trim_end(),
            )
        })
    }

    /// A whole number within `minimum..=maximum`, if the key is there.
    ///
    /// # Errors
    /// [`Error::Input`] naming line and field if something else stands there.
    pub fn integer(&self, key: &str, minimum: u64, maximum: u64) -> Result<Option<u64>> {
        let Some(value) = self.value(key) else {
            return Ok(None);
        };
        let number = match value.get_ref() {
            DeValue::Integer(i) => u64::from_str_radix(&i.as_str().replace('_', ""), i.radix()).ok(),
            _ => None,
        };
        match number {
            Some(x) if (minimum..=maximum).contains(&x) => Ok(Some(x)),
            _ => Err(self.wrong(key, value, format!("a whole number from {minimum} to {maximum}"))),
        }
    }

    /// A string, if the key is there.
    ///
    /// # Errors
    /// [`Error::Input`] naming line and field if something else stands there.
    pub fn string(&self, key: &str) -> Result<Option<&'a str>> {
        let Some(value) = self.value(key) else {
            return Ok(None);
        };
        match value.get_ref() {
            DeValue::String(s) => Ok(Some(s.as_ref())),
            _ => Err(self.wrong(key, value, "a string")),
        }
    }

    /// A name of at most [`LONGEST_NAME`] bytes, if the key is there.
    ///
    /// # Errors
    /// As [`Table::string`]; [`Error::Input`] if the name is too long.
    pub fn name(&self, key: &str) -> Result<Option<&'a str>> {
        match self.string(key)? {
            Some(name) if name.len() > LONGEST_NAME => {
                Err(self.refuse(key, format!("a name of at most {LONGEST_NAME} bytes")))
            }
            name => Ok(name),
        }
    }

    /// As [`Table::string`], but the key must be there.
    ///
    /// # Errors
    /// As [`Table::string`]; [`Error::Input`] if nothing stands there.
    pub fn required_string(&self, key: &str, meaning: &str) -> Result<&'a str> {
        self.string(key)?.ok_or_else(|| self.missing(key, meaning))
    }

    /// Whether the key is there and stands for a table.
    pub fn is_table(&self, key: &str) -> bool {
        let value = self.entries.get(key);
        value.is_some_and(|value| matches!(value.get_ref(), DeValue::Table(_)))
    }

    /// A truth value, if the key is there.
    ///
    /// # Errors
    /// [`Error::Input`] naming line and field if something else stands there.
    pub fn boolean(&self, key: &str) -> Result<Option<bool>> {
        let Some(value) = self.value(key) else {
            return Ok(None);
        };
        match value.get_ref() {
            DeValue::Boolean(b) => Ok(Some(*b)),
            _ => Err(self.wrong(key, value, "true or false")),
        }
    }

    /// A list of strings, if the key is there.
    ///
    /// # Errors
    /// [`Error::Input`] naming line and field if something else stands there.
    pub fn strings(&self, key: &str) -> Result<Option<Vec<&'a str>>> {
        let Some(value) = self.value(key) else {
            return Ok(None);
        };
        value
            .get_ref()
            .as_array()
            .and_then(|items| items.iter().map(|item| item.get_ref().as_str()).collect())
            .map(Some)
            .ok_or_else(|| self.wrong(key, value, "a list of strings"))
    }

    /// A list of finite numbers, if the key is there.
    ///
    /// # Errors
    /// [`Error::Input`] naming line and field if something else stands there.
    pub fn numbers(&self, key: &str) -> Result<Option<Vec<f64>>> {
        let Some(value) = self.value(key) else {
            return Ok(None);
        };
        value
            .get_ref()
            .as_array()
            .and_then(|items| {
                items
                    .iter()
                    .map(|item| Self::as_number(item.get_ref()).filter(|x| x.is_finite()))
                    .collect()
            })
            .map(Some)
            .ok_or_else(|| self.wrong(key, value, "a list of numbers"))
    }

    /// A list of lists of finite numbers, if the key is there.
    ///
    /// # Errors
    /// [`Error::Input`] naming line and field if something else stands there.
    pub fn number_rows(&self, key: &str) -> Result<Option<Vec<Vec<f64>>>> {
        let Some(value) = self.value(key) else {
            return Ok(None);
        };
        let row = |row: &Spanned<DeValue<'_>>| -> Option<Vec<f64>> {
            let items = row.get_ref().as_array()?;
            items
                .iter()
                .map(|item| Self::as_number(item.get_ref()).filter(|x| x.is_finite()))
                .collect()
        };
        value
            .get_ref()
            .as_array()
            .and_then(|rows| rows.iter().map(row).collect())
            .map(Some)
            .ok_or_else(|| self.wrong(key, value, "a list of lists of numbers"))
    }

    /// A sub-table, if the key is there.
    ///
    /// # Errors
    /// [`Error::Input`] naming line and field if something else stands there.
    pub fn table(&self, key: &str) -> Result<Option<Table<'a>>> {
        let Some(value) = self.value(key) else {
            return Ok(None);
        };
        match value.get_ref() {
            DeValue::Table(entries) => Ok(Some(Table {
                document: self.document,
                name: self.field(key),
                line: line_of(self.document.text, value.span().start),
                entries,
                read: RefCell::default(),
            })),
            _ => Err(self.wrong(key, value, "a table")),
        }
    }

    /// As [`Table::table`], but the key must be there.
    ///
    /// # Errors
    /// As [`Table::table`]; [`Error::Input`] if nothing stands there.
    pub fn required_table(&self, key: &str) -> Result<Table<'a>> {
        self.table(key)?
            .ok_or_else(|| self.missing(key, format!("a table [{}]", self.field(key))))
    }

    /// The keys of the table, in alphabetical order.
    pub fn keys(&self) -> impl Iterator<Item = &'a str> {
        let entries = self.entries;
        entries.keys().map(|key| key.get_ref().as_ref())
    }

    /// Refuses any key that nobody asked for.
    ///
    /// # Errors
    /// [`Error::Input`] naming line and field of the first such key.
    pub fn finish(self) -> Result<()> {
        let read = self.read.borrow();
        for key in self.entries.keys() {
            let name: &str = key.get_ref();
            if !read.contains(name) {
                let line = line_of(self.document.text, key.span().start);
                let known = read.iter().map(String::as_str).collect::<Vec<_>>().join(", ");
                return Err(Error::input(
                    &self.document.file,
                    Place::line(line).field(self.field(name)),
                    "an unknown key",
                    format!("one of {known}"),
                ));
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::telemetry::ChannelMap;
    use crate::track::Circuit;

    /// What is wrong in a file is told in TOML's words and the file's, by every reader.
    #[test]
    fn refusals_know_nothing_of_the_program() {
        let folder = tempfile::tempdir().expect("a folder");
        let track = |text: &str| {
            let path = folder.path().join("t.toml");
            std::fs::write(&path, text).expect("room");
            Circuit::load(&path).map(drop)
        };
        let map = |text: &str| ChannelMap::parse(text, "m.toml").map(drop);
        let own = |text: &str| {
            let document = Document::parse(Path::new("s.toml"), text)?;
            let root = document.root();
            root.number("x", 0.0, 1.0, "m").map(drop)
        };
        type Reader<'a> = &'a dyn Fn(&str) -> Result<()>;
        let (track, map, own): (Reader<'_>, Reader<'_>, Reader<'_>) = (&track, &map, &own);
        for (read, text, words) in [
            (
                map,
                "[channels]\nay = \"G Force Lat\"\n",
                ["line 2", "expected a table"],
            ),
            (
                map,
                "[channels.ay]\nsign = \"minus\"\n",
                ["line 2", "expected a number"],
            ),
            (map, "vehicle = [1]\n", ["line 1", "a table"]),
            (map, "[channels.ay]\nname = 5\n", ["found 5", "expected a string"]),
            (map, "[channels.ay\n", ["line 1", "expected"]),
            (track, "survey = 5\n", ["found 5", "expected a string"]),
            (
                track,
                "survey = \"a.csv\"\nlap = -1\n",
                ["found -1", "a whole number of 0 or more"],
            ),
            (
                track,
                "survey = \"a.csv\"\nsections = \"Abbey\"\n",
                ["Abbey", "expected a list"],
            ),
            (
                track,
                "survey = \"a.csv\"\nsections = [7]\n",
                ["found 7", "expected a table"],
            ),
            (own, "x = [1, 2]\n", ["found [1, 2]", "a number"]),
            (own, "x = 1979-05-27\n", ["found a date", "a number"]),
            (own, "x = 1\nx = 2\n", ["line 2", "duplicate"]),
            (own, "x = wide\n", ["line 1", "expected"]),
            (own, "x = \n", ["line 1", "expected"]),
        ] {
            let said = read(text).expect_err(text).to_string();
            let said = said.replace(&folder.path().display().to_string(), "");
            for leak in [
                "struct",
                "Entry",
                "f64",
                "u32",
                "sequence",
                "a array",
                "map",
                "integer `",
            ] {
                let named = said.replace("m.toml", "").contains(leak);
                assert!(!named, "{text}: {said}");
            }
            assert!(words.iter().all(|word| said.contains(word)), "{text}: {said}");
        }
    }
}
