//! Kinds of settings: how each is read, written, checked and given as a flag.

mod lists;
mod places;

pub use lists::{
    Counts, Files, Numbers, SomeOf, Texts, TwoTexts, choices, counts, files, numbers, texts, two_texts,
};
pub use places::{FileOrTable, Folder, NoFolder, file_or_table, folder_or_none, no_folder};

use super::Table;
pub use super::choice::Choice;
use super::choice::listed;
pub(crate) use super::choice::named;
use super::settings::{Declared, Flag, Lens, Role, Setting, Settings, Written, Wrong};
use crate::error::Result;
use std::path::{Path, PathBuf};

/// How values of a type are read, written and checked.
pub trait Kind<T>: Send + Sync {
    /// The value in a TOML table, if the key is there. Files are relative to `folder`.
    ///
    /// # Errors
    /// [`crate::Error::Input`] naming line and field.
    fn read(&self, table: &Table<'_>, key: &str, unit: &str, folder: &Path) -> Result<Option<T>>;

    /// The value in TOML; nothing where there is none.
    fn write(&self, value: &T) -> Option<Written>;

    /// The value of a flag, over the one that is there.
    ///
    /// # Errors
    /// What is expected, in words.
    fn parse(&self, text: &str, present: &T) -> Result<T, String>;

    /// # Errors
    /// What is wrong with the value.
    fn check(&self, _: &T) -> Result<(), Wrong> {
        Ok(())
    }

    /// Makes paths absolute.
    fn make_absolute(&self, _: &mut T) {}

    /// What it may be.
    fn range(&self) -> String {
        String::new()
    }

    /// What a help text calls it.
    fn value_name(&self) -> &'static str {
        "TEXT"
    }

    /// The flag of a setting of this kind.
    fn flag(&self, name: &'static str) -> Flag {
        Flag::Value(name)
    }
}

/// A kind, and what is to be told of a setting besides.
pub struct Spec<K> {
    kind: K,
    flag: Option<Flag>,
    role: Role,
    example: Option<&'static str>,
}

impl<K> Spec<K> {
    fn of(kind: K) -> Self {
        Self {
            kind,
            flag: None,
            role: Role::Problem,
            example: None,
        }
    }

    /// With this flag instead of the usual one.
    pub fn flag(self, flag: Flag) -> Self {
        let flag = Some(flag);
        Self { flag, ..self }
    }

    /// It says how the study searches.
    pub fn search(self) -> Self {
        let role = Role::Search;
        Self { role, ..self }
    }

    /// It says where candidates are evaluated.
    pub fn place(self) -> Self {
        let role = Role::Place;
        Self { role, ..self }
    }

    /// A value, as TOML, to show where there is no default.
    pub fn example(self, example: &'static str) -> Self {
        let example = Some(example);
        Self { example, ..self }
    }

    /// The settings of a field.
    pub(crate) fn declare<S: 'static, T: Clone + 'static>(
        self,
        key: &'static str,
        unit: &'static str,
        meaning: &'static str,
        lens: &Lens<S, T>,
    ) -> Vec<Setting<S>>
    where
        K: Kind<T> + 'static,
    {
        let name = key.split_once('.').map_or(key, |(_, key)| key);
        let declared = Declared {
            key,
            unit,
            meaning,
            value_name: self.kind.value_name(),
            range: self.kind.range(),
            flag: self.flag.unwrap_or_else(|| self.kind.flag(name)),
            role: self.role,
            example: self.example,
        };
        vec![Setting::new(declared, lens.clone(), self.kind)]
    }
}

/// A number from the least to the greatest.
pub fn number(least: f64, greatest: f64) -> Spec<Number> {
    Spec::of(Number { least, greatest })
}

/// See [`number`].
pub struct Number {
    least: f64,
    greatest: f64,
}

impl Kind<f64> for Number {
    fn read(&self, table: &Table<'_>, key: &str, unit: &str, _: &Path) -> Result<Option<f64>> {
        table.number(key, self.least, self.greatest, unit.trim_matches('-'))
    }

    fn write(&self, value: &f64) -> Option<Written> {
        Some(Written::Value(format!("{value:?}")))
    }

    fn parse(&self, text: &str, _: &f64) -> Result<f64, String> {
        let number = text.trim().parse().ok().filter(|x: &f64| !x.is_nan());
        number.ok_or_else(|| format!("expected a number, {}", self.range()))
    }

    fn check(&self, value: &f64) -> Result<(), Wrong> {
        if (self.least..=self.greatest).contains(value) {
            return Ok(());
        }
        Err(Wrong {
            found: value.to_string(),
            expected: self.range(),
        })
    }

    fn range(&self) -> String {
        format!("{} to {}", self.least, self.greatest)
    }

    fn value_name(&self) -> &'static str {
        "X"
    }
}

/// A whole number from the least to the greatest.
pub fn count(least: u64, greatest: u64) -> Spec<Count> {
    Spec::of(Count { least, greatest })
}

/// See [`count`].
pub struct Count {
    least: u64,
    greatest: u64,
}

impl<T: Copy + TryFrom<u64> + TryInto<u64>> Kind<T> for Count {
    fn read(&self, table: &Table<'_>, key: &str, _: &str, _: &Path) -> Result<Option<T>> {
        let number = table.integer(key, self.least, self.greatest)?;
        Ok(number.and_then(|n| T::try_from(n).ok()))
    }

    fn write(&self, value: &T) -> Option<Written> {
        let number: u64 = (*value).try_into().ok()?;
        Some(Written::Value(number.to_string()))
    }

    fn parse(&self, text: &str, _: &T) -> Result<T, String> {
        let number = text.trim().parse().ok().and_then(|n: u64| T::try_from(n).ok());
        number.ok_or_else(|| format!("expected a whole number, {}", Kind::<T>::range(self)))
    }

    fn check(&self, value: &T) -> Result<(), Wrong> {
        let number: u64 = (*value).try_into().unwrap_or(u64::MAX);
        if (self.least..=self.greatest).contains(&number) {
            return Ok(());
        }
        Err(Wrong {
            found: number.to_string(),
            expected: Kind::<T>::range(self),
        })
    }

    fn range(&self) -> String {
        if self.greatest == u64::MAX {
            format!("{} or more", self.least)
        } else {
            format!("{} to {}", self.least, self.greatest)
        }
    }

    fn value_name(&self) -> &'static str {
        "N"
    }
}

/// True or false. The flag says what the default is not.
pub fn switch(default: bool) -> Spec<Switch> {
    Spec::of(Switch { default })
}

/// See [`switch`].
pub struct Switch {
    default: bool,
}

impl Kind<bool> for Switch {
    fn read(&self, table: &Table<'_>, key: &str, _: &str, _: &Path) -> Result<Option<bool>> {
        table.boolean(key)
    }

    fn write(&self, value: &bool) -> Option<Written> {
        Some(Written::Value(value.to_string()))
    }

    fn parse(&self, text: &str, _: &bool) -> Result<bool, String> {
        text.parse().map_err(|_| "expected true or false".to_owned())
    }

    fn flag(&self, name: &'static str) -> Flag {
        Flag::Switch(name, !self.default)
    }
}

/// Any text.
pub fn text() -> Spec<Text> {
    Spec::of(Text)
}

/// See [`text`].
pub struct Text;

/// A text in TOML.
pub(crate) fn quoted(text: &str) -> String {
    toml::Value::String(text.to_owned()).to_string()
}

impl Kind<String> for Text {
    fn read(&self, table: &Table<'_>, key: &str, _: &str, _: &Path) -> Result<Option<String>> {
        Ok(table.string(key)?.map(str::to_owned))
    }

    fn write(&self, value: &String) -> Option<Written> {
        Some(Written::Value(quoted(value)))
    }

    fn parse(&self, text: &str, _: &String) -> Result<String, String> {
        Ok(text.to_owned())
    }

    fn value_name(&self) -> &'static str {
        "NAME"
    }
}

/// The name of something bundled, or a file.
pub fn name_or_file() -> Spec<NameOrFile> {
    Spec::of(NameOrFile)
}

/// See [`name_or_file`].
pub struct NameOrFile;

/// Whether a name is a file's: bundled names have no extension, and what follows the last point of a shape's is digits.
fn is_file(name: &str) -> bool {
    let extension = Path::new(name).extension();
    extension.is_some_and(|e| !e.to_string_lossy().chars().all(|c| c.is_ascii_digit()))
}

impl Kind<String> for NameOrFile {
    fn read(&self, table: &Table<'_>, key: &str, _: &str, folder: &Path) -> Result<Option<String>> {
        Ok(table.string(key)?.map(|name| {
            if is_file(name) {
                folder.join(name).display().to_string()
            } else {
                name.to_owned()
            }
        }))
    }

    fn write(&self, value: &String) -> Option<Written> {
        Some(Written::Value(quoted(value)))
    }

    fn parse(&self, text: &str, _: &String) -> Result<String, String> {
        Ok(text.to_owned())
    }

    fn make_absolute(&self, name: &mut String) {
        if is_file(name)
            && let Ok(path) = std::path::absolute(&*name)
        {
            *name = path.display().to_string();
        }
    }

    fn value_name(&self) -> &'static str {
        "NAME|FILE"
    }
}

/// A file.
pub fn file() -> Spec<File> {
    Spec::of(File)
}

/// See [`file()`].
pub struct File;

impl Kind<PathBuf> for File {
    fn read(&self, table: &Table<'_>, key: &str, _: &str, folder: &Path) -> Result<Option<PathBuf>> {
        Ok(table.string(key)?.map(|name| folder.join(name)))
    }

    fn write(&self, value: &PathBuf) -> Option<Written> {
        Some(Written::Value(quoted(&value.display().to_string())))
    }

    fn parse(&self, text: &str, _: &PathBuf) -> Result<PathBuf, String> {
        Ok(PathBuf::from(text))
    }

    fn make_absolute(&self, path: &mut PathBuf) {
        if let Ok(whole) = std::path::absolute(&*path) {
            *path = whole;
        }
    }

    fn value_name(&self) -> &'static str {
        "FILE"
    }
}

/// One of the named values.
pub fn choice() -> Spec<OneOf> {
    Spec::of(OneOf)
}

/// See [`choice`].
pub struct OneOf;

impl<T: Choice> Kind<T> for OneOf {
    fn read(&self, table: &Table<'_>, key: &str, _: &str, _: &Path) -> Result<Option<T>> {
        let Some(name) = table.string(key)? else {
            return Ok(None);
        };
        let names = || listed(T::ALL.iter().map(|value| format!("\"{}\"", value.name())));
        T::named(name).map(Some).ok_or_else(|| table.refuse(key, names()))
    }

    fn write(&self, value: &T) -> Option<Written> {
        Some(Written::Value(quoted(value.name())))
    }

    fn parse(&self, text: &str, _: &T) -> Result<T, String> {
        T::named(text).ok_or_else(|| format!("expected {}", T::names()))
    }

    fn range(&self) -> String {
        T::names()
    }

    fn value_name(&self) -> &'static str {
        "NAME"
    }
}

/// A value that need not be there.
pub fn optional<K>(spec: Spec<K>) -> Spec<Optional<K>> {
    Spec {
        kind: Optional(spec.kind),
        flag: spec.flag,
        role: spec.role,
        example: spec.example,
    }
}

/// See [`optional`].
pub struct Optional<K>(K);

impl<T: Default, K: Kind<T>> Kind<Option<T>> for Optional<K> {
    fn read(&self, table: &Table<'_>, key: &str, unit: &str, folder: &Path) -> Result<Option<Option<T>>> {
        Ok(self.0.read(table, key, unit, folder)?.map(Some))
    }

    fn write(&self, value: &Option<T>) -> Option<Written> {
        value.as_ref().and_then(|value| self.0.write(value))
    }

    fn parse(&self, text: &str, present: &Option<T>) -> Result<Option<T>, String> {
        let present = present.as_ref();
        let parsed = match present {
            Some(present) => self.0.parse(text, present),
            None => self.0.parse(text, &T::default()),
        };
        parsed.map(Some)
    }

    fn check(&self, value: &Option<T>) -> Result<(), Wrong> {
        value.as_ref().map_or(Ok(()), |value| self.0.check(value))
    }

    fn make_absolute(&self, value: &mut Option<T>) {
        if let Some(value) = value {
            self.0.make_absolute(value);
        }
    }

    fn range(&self) -> String {
        self.0.range()
    }

    fn value_name(&self) -> &'static str {
        self.0.value_name()
    }

    fn flag(&self, name: &'static str) -> Flag {
        self.0.flag(name)
    }
}

/// Any kind that is a struct of its own.
pub fn of<K>(kind: K) -> Spec<K> {
    Spec::of(kind)
}

/// Settings that a study shares with another: their keys stand in its file as they are.
pub fn shared<T: Settings>() -> Shared<T> {
    Shared {
        without_flags: |_| false,
        renamed: &[],
        kept: std::marker::PhantomData,
    }
}

/// See [`shared`].
pub struct Shared<T> {
    without_flags: fn(&Declared) -> bool,
    renamed: &'static [(&'static str, Flag)],
    kept: std::marker::PhantomData<T>,
}

impl<T: Settings> Shared<T> {
    /// Those that `which` picks have no flag here.
    pub fn without_flags(self, which: fn(&Declared) -> bool) -> Self {
        Self {
            without_flags: which,
            ..self
        }
    }

    /// Keys that have another flag here.
    pub fn renamed(self, renamed: &'static [(&'static str, Flag)]) -> Self {
        Self { renamed, ..self }
    }

    pub(crate) fn declare<S: 'static>(
        self,
        _: &'static str,
        _: &'static str,
        _: &'static str,
        lens: &Lens<S, T>,
    ) -> Vec<Setting<S>> {
        T::settings()
            .into_iter()
            .map(|mut setting| {
                let declared = &mut setting.declared;
                if (self.without_flags)(declared) {
                    declared.flag = Flag::None;
                }
                if let Some((_, flag)) = self.renamed.iter().find(|(key, _)| *key == declared.key) {
                    declared.flag = *flag;
                }
                setting.within(lens)
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_shape_with_decimals_is_no_file() {
        for name in [
            "gt",
            "circle:590:600",
            "circle:99.25:100.75",
            "ellipse:400:250:12.5",
        ] {
            assert!(!is_file(name), "{name}");
        }
        for name in ["car.toml", "../tracks/club.csv", "lap.7z"] {
            assert!(is_file(name), "{name}");
        }
    }
}
