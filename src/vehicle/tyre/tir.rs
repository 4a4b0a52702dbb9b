//! Tyre property files (`.tir`): read, changed in place, and written.

use super::TyreCoefficients;
use crate::config::{LARGEST_TEXT, read_bytes};
use crate::error::{Error, Place, Result};
use std::fmt::Write as _;
use std::path::Path;

/// A `.tir` file and its coefficients. Lines that lapswarm does not use are kept and written back unchanged.
#[derive(Clone, Debug, PartialEq)]
pub struct TyreFile {
    /// The MF 5.2 coefficients.
    pub coefficients: TyreCoefficients<f64>,
    lines: Vec<Line>,
}

#[derive(Clone, Debug, PartialEq)]
enum Line {
    /// A comment, header text, a section name, or a key that lapswarm does not use.
    Other(String),
    /// The start of a section.
    Section(String),
    /// The coefficient at this place of [`TyreCoefficients::PARAMETERS`].
    Coefficient { index: usize, comment: String },
}

/// The `FITTYP` values that mean Magic Formula 5.2 (or 2002, its other name).
const FIT_TYPES: [&str; 3] = ["6", "21", "52"];

/// A parameter's key in a `.tir` file.
fn tir_key(name: &str) -> String {
    match name {
        "R0" => "UNLOADED_RADIUS".to_owned(),
        // With the letter O instead of a zero, as every tool writes it.
        "lFz0" => "LFZO".to_owned(),
        _ => name.to_uppercase(),
    }
}

/// The section in which a parameter stands.
fn tir_section(name: &str) -> &'static str {
    match name.as_bytes() {
        b"R0" => "DIMENSION",
        b"FNOMIN" => "VERTICAL",
        b"TYRESIDE" => "MODEL",
        [b'l', ..] => "SCALING_COEFFICIENTS",
        [b'q' | b's', ..] => "ALIGNING_COEFFICIENTS",
        [b'p', _, axis, ..] | [b'r', _, axis, ..] if *axis == b'x' => "LONGITUDINAL_COEFFICIENTS",
        _ => "LATERAL_COEFFICIENTS",
    }
}

/// The value before any comment (`$` or `!`), and the comment with its mark.
fn split_comment(text: &str) -> (&str, &str) {
    match text.find(['$', '!']) {
        Some(at) => (text[..at].trim(), text[at..].trim_end()),
        None => (text.trim(), ""),
    }
}

/// The key whose value is a word.
const SIDE: &str = "TYRESIDE";
/// Its words and their values.
const SIDES: [(&str, f64); 4] = [
    ("LEFT", 1.0),
    ("RIGHT", -1.0),
    ("SYMMETRIC", 0.0),
    ("UNKNOWN", 0.0),
];

/// The line of a parameter.
fn entry(name: &str, value: f64) -> String {
    let key = tir_key(name);
    let is = |side: f64| side.to_bits() == value.to_bits();
    match SIDES.iter().find(|(_, side)| key == SIDE && is(*side)) {
        Some((word, _)) => format!("{key:<24} = '{word}'"),
        None => format!("{key:<24} = {value}"),
    }
}

fn unquote(value: &str) -> &str {
    value.trim_matches(|c| c == '\'' || c == '"').trim()
}

impl TyreFile {
    /// Reads a `.tir` file.
    ///
    /// # Errors
    /// [`Error::Io`] if it cannot be read; [`Error::Input`] naming line and key for a wrong `FITTYP`, units other
    /// than SI, a coefficient that is not a number or out of its range, a repeated or a missing one.
    pub fn read(path: &Path) -> Result<Self> {
        let bytes = read_bytes(path, LARGEST_TEXT)?;
        // Comments of real files are often Latin-1. Keys and figures are ASCII in any case.
        Self::parse(path, &String::from_utf8_lossy(&bytes))
    }

    /// Parses the text of a `.tir` file; `file` is only named in errors.
    ///
    /// # Errors
    /// [`Error::Input`] as for [`TyreFile::read`].
    pub fn parse(file: &Path, text: &str) -> Result<Self> {
        let table = TyreCoefficients::<f64>::PARAMETERS;
        let keys: Vec<String> = table.iter().map(|p| tir_key(p.name)).collect();
        let mut values: Vec<Option<f64>> = vec![None; table.len()];
        let mut lines = Vec::new();
        let mut section = String::new();
        let mut fit_type = None;
        for (number, line) in text.lines().enumerate() {
            let place = |key: &str| Place::line(number + 1).key(key);
            let trimmed = line.trim();
            if let Some(name) = trimmed.strip_prefix('[') {
                let Some(end) = name.find(']') else {
                    return Err(Error::input(
                        file,
                        Place::line(number + 1),
                        trimmed,
                        "a section name in [brackets]",
                    ));
                };
                section = name[..end].trim().to_uppercase();
                lines.push(Line::Section(line.trim_end().to_owned()));
                continue;
            }
            let entry = trimmed
                .split_once('=')
                .filter(|_| !trimmed.starts_with(['$', '!', '{']));
            let Some((key, rest)) = entry else {
                lines.push(Line::Other(line.trim_end().to_owned()));
                continue;
            };
            let key = key.trim().to_uppercase();
            let (value, comment) = split_comment(rest);
            let value = unquote(value);
            if section == "UNITS" {
                check_unit(file, place(&key), &key, value)?;
            }
            if section == "MODEL" && key == "FITTYP" {
                if !FIT_TYPES.contains(&value) {
                    return Err(Error::input(
                        file,
                        place(&key),
                        value,
                        "6, 21 or 52 (Magic Formula 5.2)",
                    ));
                }
                fit_type = Some(());
            }
            let Some(index) = keys.iter().position(|k| *k == key) else {
                lines.push(Line::Other(line.trim_end().to_owned()));
                continue;
            };
            let info = &table[index];
            let side = SIDES.iter().find(|(word, _)| value.eq_ignore_ascii_case(word));
            let side = side.filter(|_| key == SIDE).map(|(_, side)| *side);
            let number = side.or_else(|| value.parse::<f64>().ok());
            let parsed = number.filter(|x| info.admits(*x)).ok_or_else(|| {
                let expected = format!(
                    "a number from {} to {} ({})",
                    info.minimum, info.maximum, info.meaning
                );
                Error::input(file, place(&key), value, expected)
            })?;
            if values[index].replace(parsed).is_some() {
                return Err(Error::input(
                    file,
                    place(&key),
                    "the key a second time",
                    "each key once",
                ));
            }
            lines.push(Line::Coefficient {
                index,
                comment: comment.to_owned(),
            });
        }
        if fit_type.is_none() {
            return Err(Error::input(
                file,
                Place::default().key("FITTYP"),
                "nothing",
                "6, 21 or 52 (Magic Formula 5.2) in section [MODEL]",
            ));
        }
        let mut flat = Vec::with_capacity(table.len());
        for (info, value) in table.iter().zip(values) {
            flat.push(value.or(info.default).ok_or_else(|| {
                let expected = format!(
                    "a number ({}) in section [{}]",
                    info.meaning,
                    tir_section(info.name)
                );
                Error::input(
                    file,
                    Place::default().key(tir_key(info.name)),
                    "nothing",
                    expected,
                )
            })?);
        }
        Ok(Self {
            coefficients: TyreCoefficients::from_flat(&flat),
            lines,
        })
    }

    /// A new file for coefficients that were not read from one.
    pub fn new(coefficients: TyreCoefficients<f64>) -> Self {
        let header = "[MDI_HEADER]\nFILE_TYPE = 'tir'\nFILE_VERSION = 3.0\nFILE_FORMAT = 'ASCII'\n[UNITS]\nLENGTH = 'meter'\nFORCE = 'newton'\nANGLE = 'radians'\nMASS = 'kg'\nTIME = 'second'\n[MODEL]\nPROPERTY_FILE_FORMAT = 'PAC2002'\nFITTYP = 6";
        Self {
            coefficients,
            lines: header
                .lines()
                .map(|line| {
                    if line.starts_with('[') {
                        Line::Section(line.to_owned())
                    } else {
                        Line::Other(line.to_owned())
                    }
                })
                .collect(),
        }
    }

    /// The text of the file with the present coefficients. Figures read back bit for bit.
    pub fn to_text(&self) -> String {
        let table = TyreCoefficients::<f64>::PARAMETERS;
        let flat = self.coefficients.to_flat();
        let written: Vec<usize> = self
            .lines
            .iter()
            .filter_map(|line| match line {
                Line::Coefficient { index, .. } => Some(*index),
                _ => None,
            })
            .collect();
        // A coefficient that the file did not have gets a line only if it differs from its default.
        let mut missing: Vec<usize> = (0..table.len())
            .filter(|i| {
                !written.contains(i) && table[*i].default.map(f64::to_bits) != Some(flat[*i].to_bits())
            })
            .collect();
        let entry = |index: usize| entry(table[index].name, flat[index]);
        let mut text = String::new();
        for line in &self.lines {
            match line {
                Line::Other(line) => text.push_str(line),
                Line::Coefficient { index, comment } => {
                    let _ = write!(text, "{} {comment}", entry(*index));
                    text.truncate(text.trim_end().len());
                }
                Line::Section(line) => {
                    text.push_str(line);
                    missing.retain(|&index| {
                        let here = line
                            .to_uppercase()
                            .contains(&format!("[{}]", tir_section(table[index].name)));
                        if here {
                            let _ = write!(text, "\n{}", entry(index));
                        }
                        !here
                    });
                }
            }
            text.push('\n');
        }
        while let Some(&first) = missing.first() {
            let section = tir_section(table[first].name);
            let _ = writeln!(text, "[{section}]");
            missing.retain(|&index| {
                let here = tir_section(table[index].name) == section;
                if here {
                    let _ = writeln!(text, "{}", entry(index));
                }
                !here
            });
        }
        text
    }
}

fn check_unit(file: &Path, place: Place, key: &str, value: &str) -> Result<()> {
    let allowed: &[&str] = match key {
        "LENGTH" => &["meter", "metre", "m"],
        "FORCE" => &["newton", "n"],
        "ANGLE" => &["radians", "radian", "rad"],
        "MASS" => &["kg", "kilogram"],
        "TIME" => &["second", "sec", "s"],
        _ => return Ok(()),
    };
    if allowed.contains(&value.to_lowercase().as_str()) {
        Ok(())
    } else {
        Err(Error::input(
            file,
            place,
            value,
            format!("'{}': lapswarm reads tyre files in SI units", allowed[0]),
        ))
    }
}
