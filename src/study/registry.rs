//! Every study there is.

use super::envelope::EnvelopeStudy;
use super::framework::{AnyStudy, Entry};
use super::hybrid::Hybrid;
use super::identify::Identify;
use super::raceline::Raceline;
use super::run::Run;
use super::sensitivity::Sensitivity;
use super::surface::Surface;
use super::sweep::Swept;
use super::transient::Transient;

/// A study in the registry: it has a subcommand, a template, a check, and can be swept.
pub trait Registered: AnyStudy + Swept {}

impl<T: AnyStudy + Swept> Registered for T {}

impl std::fmt::Debug for dyn Registered {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name())
    }
}

/// Every study. A line here gives it its subcommand, its files for `init`, its place in `check` and `sweep`, its page of
/// settings in the book, and its share of the tests.
pub static STUDIES: &[&dyn Registered] = &[
    &Entry::<Run>::NEW,
    &Entry::<Identify>::NEW,
    &Entry::<EnvelopeStudy>::NEW,
    &Entry::<Raceline>::NEW,
    &Entry::<Hybrid>::NEW,
    &Entry::<Transient>::NEW,
    &Entry::<Sensitivity>::NEW,
    &Entry::<Surface>::NEW,
];

/// The study of this name.
pub fn named(name: &str) -> Option<&'static dyn Registered> {
    STUDIES.iter().copied().find(|study| study.name() == name)
}

/// The names of all studies.
pub fn names() -> Vec<&'static str> {
    STUDIES.iter().map(|study| study.name()).collect()
}

/// The reference page of all settings, as Markdown: the chapter "Settings" of the book.
pub fn settings_page() -> String {
    let mut page = "# Settings\n\nEvery setting of every study, with its key in study files, its flag, its unit, what it may be and \
                    its default. This page is generated from the declarations in the code.\n"
        .to_owned();
    for study in STUDIES {
        let (name, about) = (study.name(), study.about());
        page += &format!(
            "\n## {name}\n\n{about}\n\n| key | flag | unit | range | default | meaning |\n|---|---|---|---|---|---|\n"
        );
        for d in study.declared() {
            let flag = d.typed().map_or(String::new(), |flag| format!("`{flag}`"));
            let default = study
                .default_of(d.key)
                .map_or(String::new(), |v| format!("`{v}`"));
            let cells = [
                format!("`{}`", d.key),
                flag,
                d.unit.to_owned(),
                d.range.clone(),
                default,
                d.meaning.to_owned(),
            ];
            page += &format!("| {} |\n", cells.map(|cell| cell.replace('|', "\\|")).join(" | "));
        }
    }
    page
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The page in the book is what the declarations say. `LAPSWARM_WRITE_BOOK=1` writes it anew.
    #[test]
    fn the_book_has_every_setting() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/book/src/settings.md");
        if std::env::var_os("LAPSWARM_WRITE_BOOK").is_some() {
            std::fs::write(path, settings_page()).expect("the book");
        }
        let page = std::fs::read_to_string(path).expect("the book");
        assert!(
            page == settings_page(),
            "book/src/settings.md is out of date: run this test with LAPSWARM_WRITE_BOOK=1"
        );
    }

    /// Templates are what they say: every study's defaults, in its own words.
    #[test]
    fn templates_are_complete_and_can_be_read() {
        let folder = tempfile::tempdir().expect("a folder");
        for study in STUDIES {
            let template = study.template();
            for d in study.declared() {
                let key = d.key_within();
                assert!(template.contains(key), "{}: {key} is missing", study.name());
            }
            let path = folder.path().join(format!("{}.toml", study.name()));
            std::fs::write(&path, &template).expect("a file");
            assert!(toml::from_str::<toml::Table>(&template).is_ok(), "{template}");
        }
    }

    /// No two settings of a study have one flag.
    #[test]
    fn flags_are_distinct() {
        for study in STUDIES {
            let mut flags: Vec<&str> = study.declared().iter().filter_map(|d| d.flag.name()).collect();
            flags.sort_unstable();
            let count = flags.len();
            flags.dedup();
            assert_eq!(flags.len(), count, "{}", study.name());
        }
    }
}
