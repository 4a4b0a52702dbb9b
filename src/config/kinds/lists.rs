//! Kinds of settings that are lists.

use super::{Choice, File, Kind, Number, Spec, quoted};
use crate::config::Table;
use crate::config::settings::{Flag, Written, Wrong};
use crate::error::Result;
use std::path::{Path, PathBuf};

/// Several of the named values, at least one and each once.
pub fn choices() -> Spec<SomeOf> {
    Spec::of(SomeOf)
}

/// See [`choices`].
pub struct SomeOf;

impl<T: Choice> Kind<Vec<T>> for SomeOf {
    fn read(&self, table: &Table<'_>, key: &str, _: &str, _: &Path) -> Result<Option<Vec<T>>> {
        let Some(names) = table.strings(key)? else {
            return Ok(None);
        };
        let parsed: Option<Vec<T>> = names.iter().map(|name| T::named(name)).collect();
        let parsed = parsed.filter(|found| !found.is_empty());
        parsed
            .map(Some)
            .ok_or_else(|| table.refuse(key, format!("a list of {}", T::names())))
    }

    fn write(&self, values: &Vec<T>) -> Option<Written> {
        let names: Vec<String> = values.iter().map(|value| quoted(value.name())).collect();
        Some(Written::Value(format!("[{}]", names.join(", "))))
    }

    fn parse(&self, text: &str, _: &Vec<T>) -> Result<Vec<T>, String> {
        let named = |name: &str| T::named(name).ok_or_else(|| format!("expected some of {}", T::names()));
        text.split(',').map(named).collect()
    }

    fn check(&self, values: &Vec<T>) -> Result<(), Wrong> {
        let twice = (1..values.len()).find(|&i| values[..i].contains(&values[i]));
        let wrong = |found: String, expected: String| Err(Wrong { found, expected });
        match (values.is_empty(), twice) {
            (true, _) => wrong("none".to_owned(), format!("some of {}", T::names())),
            (_, Some(i)) => wrong(
                format!("{} twice", values[i].name()),
                "each at most once".to_owned(),
            ),
            _ => Ok(()),
        }
    }

    fn range(&self) -> String {
        format!("some of {}", T::names())
    }

    fn value_name(&self) -> &'static str {
        "LIST"
    }

    fn flag(&self, name: &'static str) -> Flag {
        Flag::List(name)
    }
}

/// A list of texts.
pub fn texts() -> Spec<Texts> {
    Spec::of(Texts)
}

/// See [`texts`].
pub struct Texts;

impl Kind<Vec<String>> for Texts {
    fn read(&self, table: &Table<'_>, key: &str, _: &str, _: &Path) -> Result<Option<Vec<String>>> {
        let found = table.strings(key)?;
        Ok(found.map(|texts| texts.into_iter().map(str::to_owned).collect()))
    }

    fn write(&self, values: &Vec<String>) -> Option<Written> {
        let texts: Vec<String> = values.iter().map(|text| quoted(text)).collect();
        Some(Written::Value(format!("[{}]", texts.join(", "))))
    }

    fn parse(&self, text: &str, _: &Vec<String>) -> Result<Vec<String>, String> {
        Ok(text.split(',').map(|part| part.trim().to_owned()).collect())
    }

    fn value_name(&self) -> &'static str {
        "LIST"
    }

    fn flag(&self, name: &'static str) -> Flag {
        Flag::List(name)
    }
}

/// Two different texts.
pub fn two_texts() -> Spec<TwoTexts> {
    Spec::of(TwoTexts)
}

/// See [`two_texts`].
pub struct TwoTexts;

impl Kind<[String; 2]> for TwoTexts {
    fn read(&self, table: &Table<'_>, key: &str, _: &str, _: &Path) -> Result<Option<[String; 2]>> {
        match table.strings(key)?.as_deref() {
            None => Ok(None),
            Some([a, b]) => Ok(Some([(*a).to_owned(), (*b).to_owned()])),
            Some(_) => Err(table.refuse(key, "a list of two names")),
        }
    }

    fn write(&self, [a, b]: &[String; 2]) -> Option<Written> {
        Some(Written::Value(format!("[{}, {}]", quoted(a), quoted(b))))
    }

    fn parse(&self, text: &str, _: &[String; 2]) -> Result<[String; 2], String> {
        match text.split(',').collect::<Vec<_>>()[..] {
            [a, b] => Ok([a, b].map(|name| name.trim().to_owned())),
            _ => Err("expected two names with a comma between".to_owned()),
        }
    }

    fn check(&self, [a, b]: &[String; 2]) -> Result<(), Wrong> {
        if a != b {
            return Ok(());
        }
        Err(Wrong {
            found: format!("{a}, {b}"),
            expected: "two different ones".to_owned(),
        })
    }

    fn value_name(&self) -> &'static str {
        "X,Y"
    }
}

/// A list of files.
pub fn files() -> Spec<Files> {
    Spec::of(Files)
}

/// See [`files`].
pub struct Files;

impl Kind<Vec<PathBuf>> for Files {
    fn read(&self, table: &Table<'_>, key: &str, _: &str, folder: &Path) -> Result<Option<Vec<PathBuf>>> {
        let found = table.strings(key)?;
        Ok(found.map(|names| names.into_iter().map(|name| folder.join(name)).collect()))
    }

    fn write(&self, values: &Vec<PathBuf>) -> Option<Written> {
        let names: Vec<String> = values.iter().map(|p| quoted(&p.display().to_string())).collect();
        Some(Written::Value(format!("[{}]", names.join(", "))))
    }

    fn parse(&self, text: &str, _: &Vec<PathBuf>) -> Result<Vec<PathBuf>, String> {
        Ok(text.split('\n').map(PathBuf::from).collect())
    }

    fn make_absolute(&self, paths: &mut Vec<PathBuf>) {
        for path in paths {
            File.make_absolute(path);
        }
    }

    fn value_name(&self) -> &'static str {
        "FILE"
    }

    fn flag(&self, name: &'static str) -> Flag {
        Flag::Repeated(name)
    }
}

/// A list of numbers, each from the least to the greatest.
pub fn numbers(least: f64, greatest: f64) -> Spec<Numbers> {
    Spec::of(Numbers(Number { least, greatest }))
}

/// See [`numbers`].
pub struct Numbers(Number);

impl Kind<Vec<f64>> for Numbers {
    fn read(&self, table: &Table<'_>, key: &str, unit: &str, _: &Path) -> Result<Option<Vec<f64>>> {
        let found = table.numbers(key)?;
        match &found {
            Some(values) if self.check(values).is_err() => {
                let expected = format!("numbers from {} {}", self.range(), unit.trim_matches('-'));
                Err(table.refuse(key, expected.trim_end()))
            }
            _ => Ok(found),
        }
    }

    fn write(&self, values: &Vec<f64>) -> Option<Written> {
        Some(Written::Value(format!("{values:?}")))
    }

    fn parse(&self, text: &str, _: &Vec<f64>) -> Result<Vec<f64>, String> {
        text.split(',').map(|part| self.0.parse(part, &0.0)).collect()
    }

    fn check(&self, values: &Vec<f64>) -> Result<(), Wrong> {
        values.iter().try_for_each(|value| self.0.check(value))
    }

    fn range(&self) -> String {
        self.0.range()
    }

    fn value_name(&self) -> &'static str {
        "LIST"
    }

    fn flag(&self, name: &'static str) -> Flag {
        Flag::List(name)
    }
}

/// A list of whole numbers up to a million, such as those of laps.
pub fn counts() -> Spec<Counts> {
    Spec::of(Counts)
}

/// See [`counts`].
pub struct Counts;

/// The greatest of [`counts`].
const GREATEST_COUNT: f64 = 1e6;

impl Kind<Vec<u32>> for Counts {
    fn read(&self, table: &Table<'_>, key: &str, _: &str, _: &Path) -> Result<Option<Vec<u32>>> {
        let whole = |x: &f64| (0.0..=GREATEST_COUNT).contains(x) && x.fract() == 0.0;
        match table.numbers(key)? {
            Some(found) if found.iter().all(whole) => Ok(Some(found.iter().map(|x| *x as u32).collect())),
            Some(_) => Err(table.refuse(key, "a list of whole numbers")),
            None => Ok(None),
        }
    }

    fn write(&self, values: &Vec<u32>) -> Option<Written> {
        (!values.is_empty()).then(|| Written::Value(format!("{values:?}")))
    }

    fn parse(&self, text: &str, _: &Vec<u32>) -> Result<Vec<u32>, String> {
        let number = |part: &str| part.trim().parse().ok();
        let found: Option<Vec<u32>> = text.split(',').map(number).collect();
        found.ok_or_else(|| "expected whole numbers with commas between".to_owned())
    }

    fn value_name(&self) -> &'static str {
        "LIST"
    }

    fn flag(&self, name: &'static str) -> Flag {
        Flag::List(name)
    }
}
