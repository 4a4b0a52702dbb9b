//! Reading and checking the TOML files of roads, with the line of every value in errors.

use std::ops::Range;

use serde::Deserialize;
use serde::de::DeserializeOwned;
use toml::Spanned;

use super::circuit::Section;
use crate::config::{LONGEST_NAME, line_of, refused};
use crate::files::stem;
use crate::{Error, Place, Result};

/// A named stretch of a road.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct SectionEntry {
    name: Spanned<String>,
    start_m: Spanned<f64>,
    end_m: Spanned<f64>,
}

/// A stretch where the DRS may be open.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct DrsZoneEntry {
    start_m: Spanned<f64>,
    end_m: Spanned<f64>,
}

/// Reads a TOML text; `what` is what errors expect it to be.
pub(super) fn parse_toml<T: DeserializeOwned>(file: &str, text: &str, what: &str) -> Result<T> {
    toml::from_str(text).map_err(|error| refused(file, text, &error, what))
}

/// A checked value of the TOML file.
pub(super) struct Checker<'a> {
    pub file: &'a str,
    pub text: &'a str,
}

impl Checker<'_> {
    pub fn refuse(&self, span: Range<usize>, field: &str, found: String, expected: &str) -> Error {
        let place = Place::line(line_of(self.text, span.start)).field(field);
        Error::input(self.file, place, found, expected)
    }

    /// The value, which must lie from `low` to `high`.
    ///
    /// # Errors
    /// [`Error::Input`] naming line and field if the value is out of range.
    pub fn within(&self, value: &Spanned<f64>, field: &str, low: f64, high: f64) -> Result<f64> {
        let x = *value.get_ref();
        if x >= low && x <= high {
            Ok(x)
        } else {
            Err(self.refuse(value.span(), field, x.to_string(), &format!("{low} to {high}")))
        }
    }

    /// A name that is short enough.
    ///
    /// # Errors
    /// [`Error::Input`] naming line and field if the name is too long.
    pub fn name(&self, name: &Spanned<String>, field: &str) -> Result<String> {
        let text = name.get_ref();
        if text.len() > LONGEST_NAME {
            let expected = format!("a name of at most {LONGEST_NAME} bytes");
            return Err(self.refuse(name.span(), field, format!("{} bytes", text.len()), &expected));
        }
        Ok(text.clone())
    }

    /// Named stretches within a length (m).
    ///
    /// # Errors
    /// [`Error::Input`] naming line and field for a stretch that does not lie within the length.
    pub fn sections(&self, entries: &[SectionEntry], length_m: f64) -> Result<Vec<Section>> {
        let mut sections: Vec<Section> = Vec::with_capacity(entries.len());
        for entry in entries {
            let name = self.name(&entry.name, "name")?.trim().to_owned();
            let start_m = self.within(&entry.start_m, "start_m", 0.0, length_m)?;
            let end_m = self.within(&entry.end_m, "end_m", 0.0, length_m)?;
            if end_m <= start_m {
                return Err(self.refuse(
                    entry.end_m.span(),
                    "end_m",
                    end_m.to_string(),
                    &format!("a station beyond start_m, {start_m}"),
                ));
            }
            // Sections give names to files, and not every file system distinguishes case.
            let file_name = |name: &str| stem(name).to_lowercase();
            let taken = sections.iter().find(|s| file_name(&s.name) == file_name(&name));
            let expected = match taken {
                None if name.is_empty() => Some("a name".to_owned()),
                None => None,
                Some(other) => Some(format!(
                    "a name that no other section has: one that differs from `{}` in its letters and digits",
                    other.name
                )),
            };
            if let Some(expected) = expected {
                return Err(self.refuse(entry.name.span(), "name", format!("`{name}`"), &expected));
            }
            sections.push(Section { name, start_m, end_m });
        }
        Ok(sections)
    }

    /// Stretches within a length (m) where the DRS may be open. On a closed road one may pass the start line.
    ///
    /// # Errors
    /// [`Error::Input`] naming line and field for a stretch that does not lie within the length.
    pub fn drs_zones(&self, entries: &[DrsZoneEntry], length_m: f64, closed: bool) -> Result<Vec<[f64; 2]>> {
        let zone = |entry: &DrsZoneEntry| {
            let start_m = self.within(&entry.start_m, "start_m", 0.0, length_m)?;
            let end_m = self.within(&entry.end_m, "end_m", 0.0, length_m)?;
            if end_m == start_m || (end_m < start_m && !closed) {
                let expected = format!("another station than start_m, {start_m}; beyond it on an open road");
                return Err(self.refuse(entry.end_m.span(), "end_m", end_m.to_string(), &expected));
            }
            Ok([start_m, end_m])
        };
        entries.iter().map(zone).collect()
    }
}
