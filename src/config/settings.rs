//! Settings that are declared once.
//!
//! A declaration holds the name, type, unit, default, range and meaning of a setting. From it come the field of the struct,
//! its check, its reading from and writing to TOML, its flag, its line in the files that `init` writes and its row in the
//! reference page of the book.

use super::kinds::Kind;
use super::{Document, Table, folder_of, read_text};
use crate::error::{Error, Result};
use std::path::Path;
use std::sync::Arc;

/// What a setting is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// The problem that the study solves.
    Problem,
    /// How the study searches: studies that differ in such settings alone solve the same problem.
    Search,
    /// Where candidates are evaluated. A run that is resumed may move.
    Place,
}

/// The flag of a setting.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Flag {
    /// `--name VALUE`.
    Value(&'static str),
    /// `--name VALUE,VALUE`; given again it adds more.
    List(&'static str),
    /// `--name VALUE`, which may be given several times.
    Repeated(&'static str),
    /// `--name`, which sets a truth value.
    Switch(&'static str, bool),
    /// No flag: the setting is a table of its own.
    None,
}

impl Flag {
    /// The flag's name, without dashes.
    pub fn name(self) -> Option<&'static str> {
        match self {
            Self::Value(name) | Self::List(name) | Self::Repeated(name) | Self::Switch(name, _) => Some(name),
            Self::None => None,
        }
    }
}

/// A value in TOML.
#[derive(Clone, Debug, PartialEq)]
pub enum Written {
    /// What follows `key = `.
    Value(String),
    /// A table with its head, lines and all.
    Table(String),
    /// Settings of their own, as a file has them: they stand in the table of the key.
    Within(String),
}

/// Settings of their own as the table of a key.
fn placed(key: &str, text: &str) -> String {
    let line = |line: &str| match line.strip_prefix('[') {
        Some(rest) => format!("[{key}.{rest}\n"),
        None => format!("{line}\n"),
    };
    let lines: String = text.lines().map(line).collect();
    format!("[{key}]\n{lines}")
}

/// What stands in a setting and what should.
#[derive(Clone, Debug, PartialEq)]
pub struct Wrong {
    /// What stands there.
    pub found: String,
    /// What should.
    pub expected: String,
}

/// What is declared of a setting, whatever it belongs to.
#[derive(Clone, Debug)]
pub struct Declared {
    /// The key in files; that of a table's entry has a dot, as in `swarm.population`.
    pub key: &'static str,
    /// The unit, `-` for none.
    pub unit: &'static str,
    /// What it means.
    pub meaning: &'static str,
    /// What a help text calls its value.
    pub value_name: &'static str,
    /// What it may be, as in `0 to 10`; empty where anything of its type goes.
    pub range: String,
    /// Its flag.
    pub flag: Flag,
    /// What it is about.
    pub role: Role,
    /// A value to show where there is no default.
    pub example: Option<&'static str>,
}

impl Declared {
    /// The table that its key is in, if it is in one.
    pub fn table(&self) -> Option<&'static str> {
        self.key.split_once('.').map(|(table, _)| table)
    }

    /// What it means, with range and unit.
    pub fn described(&self) -> String {
        let unit = Some(self.unit).filter(|unit| *unit != "-");
        let range = Some(self.range.as_str()).filter(|range| !range.is_empty());
        let meaning = self.meaning;
        match (unit, range) {
            (Some(unit), Some(range)) => format!("{meaning} ({range} {unit})"),
            (Some(words), None) | (None, Some(words)) => format!("{meaning} ({words})"),
            (None, None) => meaning.to_owned(),
        }
    }

    /// Its flag as it is typed, if it has one.
    pub fn typed(&self) -> Option<String> {
        let name = self.flag.name()?;
        Some(format!("--{}", name.replace('_', "-")))
    }

    /// Its key within its table.
    pub fn key_within(&self) -> &'static str {
        self.key.split_once('.').map_or(self.key, |(_, key)| key)
    }
}

/// A way from a struct to one of its parts.
pub struct Lens<S, T> {
    get: Arc<dyn Fn(&S) -> &T + Send + Sync>,
    get_mut: Arc<dyn Fn(&mut S) -> &mut T + Send + Sync>,
}

impl<S, T> Clone for Lens<S, T> {
    fn clone(&self) -> Self {
        Self {
            get: Arc::clone(&self.get),
            get_mut: Arc::clone(&self.get_mut),
        }
    }
}

impl<S: 'static, T: 'static> Lens<S, T> {
    /// To a field.
    pub fn new(get: fn(&S) -> &T, get_mut: fn(&mut S) -> &mut T) -> Self {
        Self {
            get: Arc::new(get),
            get_mut: Arc::new(get_mut),
        }
    }

    /// Further in.
    pub fn to<U: 'static>(&self, inner: &Lens<T, U>) -> Lens<S, U> {
        let (outer, further) = (self.clone(), inner.clone());
        let (outer_mut, further_mut) = (self.clone(), inner.clone());
        Lens {
            get: Arc::new(move |s| (further.get)((outer.get)(s))),
            get_mut: Arc::new(move |s| (further_mut.get_mut)((outer_mut.get_mut)(s))),
        }
    }
}

/// What can be done with a setting, whatever its type.
trait Access<S>: Send + Sync {
    fn read(&self, s: &mut S, table: &Table<'_>, declared: &Declared, folder: &Path) -> Result<()>;
    fn write(&self, s: &S) -> Option<Written>;
    fn parse(&self, s: &mut S, text: &str) -> Result<(), String>;
    fn check(&self, s: &S) -> Result<(), Wrong>;
    fn make_absolute(&self, s: &mut S);
    fn copy(&self, from: &S, to: &mut S);
}

struct At<S, T, K> {
    lens: Lens<S, T>,
    kind: K,
}

impl<S, T: Clone, K: Kind<T>> Access<S> for At<S, T, K> {
    fn read(&self, s: &mut S, table: &Table<'_>, declared: &Declared, folder: &Path) -> Result<()> {
        if let Some(value) = self
            .kind
            .read(table, declared.key_within(), declared.unit, folder)?
        {
            *(self.lens.get_mut)(s) = value;
        }
        Ok(())
    }

    fn write(&self, s: &S) -> Option<Written> {
        self.kind.write((self.lens.get)(s))
    }

    fn parse(&self, s: &mut S, text: &str) -> Result<(), String> {
        let value = self.kind.parse(text, (self.lens.get)(s))?;
        *(self.lens.get_mut)(s) = value;
        Ok(())
    }

    fn check(&self, s: &S) -> Result<(), Wrong> {
        self.kind.check((self.lens.get)(s))
    }

    fn make_absolute(&self, s: &mut S) {
        self.kind.make_absolute((self.lens.get_mut)(s));
    }

    fn copy(&self, from: &S, to: &mut S) {
        (self.lens.get_mut)(to).clone_from((self.lens.get)(from));
    }
}

struct Inner<S, T> {
    lens: Lens<S, T>,
    access: Arc<dyn Access<T>>,
}

impl<S, T> Access<S> for Inner<S, T> {
    fn read(&self, s: &mut S, table: &Table<'_>, declared: &Declared, folder: &Path) -> Result<()> {
        self.access.read((self.lens.get_mut)(s), table, declared, folder)
    }

    fn write(&self, s: &S) -> Option<Written> {
        self.access.write((self.lens.get)(s))
    }

    fn parse(&self, s: &mut S, text: &str) -> Result<(), String> {
        self.access.parse((self.lens.get_mut)(s), text)
    }

    fn check(&self, s: &S) -> Result<(), Wrong> {
        self.access.check((self.lens.get)(s))
    }

    fn make_absolute(&self, s: &mut S) {
        self.access.make_absolute((self.lens.get_mut)(s));
    }

    fn copy(&self, from: &S, to: &mut S) {
        self.access.copy((self.lens.get)(from), (self.lens.get_mut)(to));
    }
}

/// Several settings that one key sets.
struct Linked<S>(Vec<Setting<S>>);

impl<S> Access<S> for Linked<S> {
    fn read(&self, s: &mut S, table: &Table<'_>, declared: &Declared, folder: &Path) -> Result<()> {
        let mut parts = self.0.iter();
        parts.try_for_each(|part| part.access.read(s, table, declared, folder))
    }

    fn write(&self, _: &S) -> Option<Written> {
        None
    }

    fn parse(&self, s: &mut S, text: &str) -> Result<(), String> {
        self.0.iter().try_for_each(|part| part.access.parse(s, text))
    }

    fn check(&self, _: &S) -> Result<(), Wrong> {
        Ok(())
    }

    fn make_absolute(&self, _: &mut S) {}

    fn copy(&self, from: &S, to: &mut S) {
        self.0.iter().for_each(|part| part.access.copy(from, to));
    }
}

/// A setting of a struct `S`.
pub struct Setting<S> {
    /// What is declared of it.
    pub declared: Declared,
    access: Arc<dyn Access<S>>,
}

impl<S: 'static> Setting<S> {
    pub(super) fn new<T: Clone + 'static, K: Kind<T> + 'static>(
        declared: Declared,
        lens: Lens<S, T>,
        kind: K,
    ) -> Self {
        Self {
            declared,
            access: Arc::new(At { lens, kind }),
        }
    }

    /// One key that sets several others.
    pub fn linked(declared: Declared, parts: Vec<Self>) -> Self {
        Self {
            declared,
            access: Arc::new(Linked(parts)),
        }
    }

    /// The same setting of a struct that `S` is a part of.
    pub(crate) fn within<O: 'static>(self, lens: &Lens<O, S>) -> Setting<O> {
        Setting {
            declared: self.declared,
            access: Arc::new(Inner {
                lens: lens.clone(),
                access: self.access,
            }),
        }
    }

    /// As a flag sets it.
    ///
    /// # Errors
    /// What is expected, in words.
    pub fn parse(&self, settings: &mut S, text: &str) -> Result<(), String> {
        self.access.parse(settings, text)
    }

    /// Its value in TOML; nothing where it is not set.
    pub fn write(&self, settings: &S) -> Option<Written> {
        self.access.write(settings)
    }

    /// Takes its value from other settings.
    pub fn copy(&self, from: &S, to: &mut S) {
        self.access.copy(from, to);
    }
}

/// A struct of settings.
pub trait Settings: Clone + Default + PartialEq + Send + Sync + 'static {
    /// Its settings, in the order of its fields.
    fn settings() -> Vec<Setting<Self>>;

    /// Settings that are no fields: each sets several at once.
    fn linked() -> Vec<Setting<Self>> {
        Vec::new()
    }

    /// Checks what ranges alone do not tell.
    ///
    /// # Errors
    /// [`Error::Input`] naming the setting.
    fn consistent(&self) -> Result<()> {
        Ok(())
    }

    /// Reads a study file. Files that it names are relative to it.
    ///
    /// # Errors
    /// [`Error::Io`] if it cannot be read, [`Error::Input`] naming line and field if it says something wrong.
    fn read(path: &Path) -> Result<Self> {
        Self::parse(path, &read_text(path)?, folder_of(path))
    }

    /// As [`Settings::read`], of a file's text; `path` is its name in messages, and paths are relative to `folder`.
    ///
    /// # Errors
    /// As [`Settings::read`].
    fn parse(path: &Path, text: &str, folder: &Path) -> Result<Self> {
        let document = Document::parse(path, text)?;
        let settings = Self::read_table(document.root(), folder)?;
        settings.validate().map_err(|error| error.of_file(path))?;
        Ok(settings)
    }

    /// Reads the settings of a table, in which nothing else may stand. Files are relative to `folder`.
    ///
    /// # Errors
    /// [`Error::Input`] naming line and field.
    fn read_table(root: Table<'_>, folder: &Path) -> Result<Self> {
        let mut settings = Self::default();
        let declared = Self::settings();
        for setting in declared.iter().filter(|s| s.declared.table().is_none()) {
            setting
                .access
                .read(&mut settings, &root, &setting.declared, folder)?;
        }
        for name in tables(&declared) {
            if let Some(table) = root.table(name)? {
                for setting in declared.iter().filter(|s| s.declared.table() == Some(name)) {
                    setting
                        .access
                        .read(&mut settings, &table, &setting.declared, folder)?;
                }
                table.finish()?;
            }
        }
        root.finish()?;
        Ok(settings)
    }

    /// Checks every setting.
    ///
    /// # Errors
    /// [`Error::Input`] naming the first setting that is out of its range.
    fn validate(&self) -> Result<()> {
        for setting in Self::settings() {
            if let Err(wrong) = setting.access.check(self) {
                let key = setting.declared.key_within();
                return Err(Error::input("the study", key, wrong.found, wrong.expected));
            }
        }
        self.consistent()
    }

    /// The study file that repeats this study, with the paths of files absolute.
    fn to_toml(&self) -> String {
        let whole = self.clone().absolute();
        let declared = Self::settings();
        let mut text = String::new();
        let mut last = String::new();
        let mut line = |text: &mut String, setting: &Setting<Self>| match setting.write(&whole) {
            Some(Written::Value(value)) => {
                *text += &format!("{} = {value}\n", setting.declared.key_within());
            }
            Some(Written::Table(table)) => last += &format!("\n{table}"),
            Some(Written::Within(text)) => {
                last += &format!("\n{}", placed(setting.declared.key, &text));
            }
            None => {}
        };
        for setting in declared.iter().filter(|s| s.declared.table().is_none()) {
            line(&mut text, setting);
        }
        for name in tables(&declared) {
            let mut rows = String::new();
            for setting in declared.iter().filter(|s| s.declared.table() == Some(name)) {
                line(&mut rows, setting);
            }
            if !rows.is_empty() {
                text += &format!("\n[{name}]\n{rows}");
            }
        }
        text + &last
    }

    /// The same with the paths of files absolute, so that they mean the same from every folder.
    fn absolute(mut self) -> Self {
        for setting in Self::settings() {
            setting.access.make_absolute(&mut self);
        }
        self
    }

    /// The same with all settings of a role as `other` has them.
    fn with_role_of(mut self, role: Role, other: &Self) -> Self {
        for setting in Self::settings() {
            if setting.declared.role == role {
                setting.copy(other, &mut self);
            }
        }
        self
    }

    /// A commented study file with every setting at its default; those without one are commented out. `head` is its first
    /// lines, without number signs.
    fn template(head: &str) -> String {
        let defaults = Self::default();
        let declared = Self::settings();
        let mut text: String = head.lines().map(|line| format!("# {line}\n")).collect();
        text.push('\n');
        let mut last = String::new();
        let mut line = |text: &mut String, setting: &Setting<Self>| {
            let d = &setting.declared;
            let said = d.described();
            let key = d.key_within();
            match (setting.write(&defaults), d.example) {
                (Some(Written::Value(value)), _) => {
                    *text += &aligned(&format!("{key} = {value}"), &said);
                }
                (Some(Written::Table(table)), _) => {
                    last += &format!("\n# {said}\n{table}");
                }
                (None | Some(Written::Within(_)), Some(example)) => {
                    *text += &aligned(&format!("# {key} = {example}"), &said)
                }
                (None | Some(Written::Within(_)), None) => {
                    *text += &aligned(&format!("# {key} = ..."), &said)
                }
            }
        };
        for setting in declared.iter().filter(|s| s.declared.table().is_none()) {
            line(&mut text, setting);
        }
        for name in tables(&declared) {
            text += &format!("\n[{name}]\n");
            for setting in declared.iter().filter(|s| s.declared.table() == Some(name)) {
                line(&mut text, setting);
            }
        }
        text + &last
    }
}

/// The tables of the settings, in the order in which they come first.
fn tables<S>(declared: &[Setting<S>]) -> Vec<&'static str> {
    let mut names: Vec<&str> = Vec::new();
    for name in declared.iter().filter_map(|s| s.declared.table()) {
        if !names.contains(&name) {
            names.push(name);
        }
    }
    names
}

/// A line with a comment, which begins at the same column as the others' where there is room.
fn aligned(line: &str, comment: &str) -> String {
    format!("{line:<31} # {comment}\n")
}

/// Declares a struct of settings: its fields with unit, default, kind and meaning.
///
/// A field reads `name: Type [unit] = default, kind, meaning;`, with `as "table.key"` after the type where its key in files is
/// another one. Kinds are in [`crate::config::kinds`]. A setting that several studies have reads `name: Type = shared_name;`; a
/// macro of that name says its unit, default, kind and meaning.
macro_rules! settings {
    (
        $(#[$doc:meta])*
        pub struct $name:ident {
            $(
                $field:ident: $ty:ty $(as $key:literal)?
                $([$unit:literal] = $default:expr, $kind:expr, $meaning:literal)?
                $(= $shared:ident)?;
            )*
        }
        $($rest:tt)*
    ) => {
        $(#[$doc])*
        #[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
        pub struct $name {
            $(
                #[doc = concat!($($meaning)? $($shared!(meaning))?, " (", $($unit)? $($shared!(unit))?, ").")]
                pub $field: $ty,
            )*
        }

        impl Default for $name {
            fn default() -> Self {
                Self { $($field: $($default)? $($shared!(default))?,)* }
            }
        }

        impl $crate::config::settings::Settings for $name {
            fn settings() -> Vec<$crate::config::settings::Setting<Self>> {
                let mut all = Vec::new();
                $(all.extend(($($kind)? $($shared!(kind))?).declare(
                    $crate::config::settings::key_of(&[stringify!($field) $(, $key)?]),
                    $($unit)? $($shared!(unit))?,
                    $($meaning)? $($shared!(meaning))?,
                    &$crate::config::settings::Lens::new(|s: &Self| &s.$field, |s: &mut Self| &mut s.$field),
                ));)*
                all.extend(Self::linked());
                all
            }

            $($rest)*
        }
    };
}
pub(crate) use settings;

/// The last of a field's names.
pub(crate) const fn key_of(names: &[&'static str]) -> &'static str {
    names[names.len() - 1]
}

/// What the tests of every study's settings share.
#[cfg(test)]
pub(crate) mod testing {
    use super::Settings;
    use std::fmt::Debug;

    /// A study file of these settings says them again.
    pub(crate) fn assert_repeated<S: Settings + Debug>(settings: &S) {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("study.toml");
        std::fs::write(&path, settings.to_toml()).expect("a file");
        assert_eq!(S::read(&path).expect("settings"), *settings);
    }

    /// Each of these study files is refused in words that say so.
    pub(crate) fn assert_refused<S: Settings + Debug>(cases: &[(&str, &str)]) {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("study.toml");
        for (text, wanted) in cases {
            std::fs::write(&path, text).expect("a file");
            let error = S::read(&path).expect_err("a mistake").to_string();
            assert!(error.contains(wanted), "{error} should say {wanted}");
        }
    }
}
