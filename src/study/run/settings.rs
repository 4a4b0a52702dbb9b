//! Settings of a run.

use crate::config::Table;
use crate::config::kinds::{Kind, count, number, of, quoted};
use crate::config::settings::{Declared, Flag, Lens, Role, Setting, Settings, Written, Wrong, settings};
use crate::error::{Error, Result};
use crate::study::identify::IdentifySettings;
use crate::study::raceline::RacelineSettings;
use std::path::{Path, PathBuf};

settings! {
    /// Settings of a run: those of its stages, and its own.
    pub struct RunSettings {
        identify: IdentifySettings ["-"] = hybrid_car(), of(Stage).example("\"identify.toml\""),
            "How the car is identified: a study file of identify, or its settings in a table";
        raceline: RacelineSettings ["-"] = RacelineSettings::default(), of(Stage).example("\"raceline.toml\""),
            "How its line is found: a study file of raceline, or its settings in a table; car and envelope are those of the run";
        margin_m: f64 ["m"] = 0.5, number(0.0, 5.0),
            "Room that the line leaves on either side of the car for the driver's errors";
        rounds: usize ["-"] = 2, count(1, 20),
            "Most lines that are driven, each within the limits that the one before it left";
        cache: Option<PathBuf> ["-"] = Some(PathBuf::from("runs/cache")), of(Cache).place(),
            "Where results of stages are kept for runs of the same inputs; an empty name keeps none";
    }

    fn linked() -> Vec<Setting<Self>> {
        let identify = Lens::new(|s: &Self| &s.identify, |s: &mut Self| &mut s.identify);
        let raceline = Lens::new(|s: &Self| &s.raceline, |s: &mut Self| &mut s.raceline);
        let cache = Lens::new(|s: &Self| &s.cache, |s: &mut Self| &mut s.cache);
        let named = LINKED.iter().filter_map(|(key, meaning)| {
            let stage = setting_of::<IdentifySettings>(key)?;
            let declared = Declared {
                meaning,
                flag: Flag::Value(key),
                role: if stage.declared.role == Role::Place { Role::Place } else { Role::Problem },
                example: None,
                ..stage.declared.clone()
            };
            // The car of the line is the one that was identified.
            let line = setting_of::<RacelineSettings>(key).filter(|_| *key != "car");
            let parts = std::iter::once(stage.within(&identify)).chain(line.map(|line| line.within(&raceline)));
            Some(Setting::linked(declared, parts.collect()))
        });
        let no_cache = of(NoCache).flag(Flag::Switch("no_cache", true));
        let meaning = "Every stage is done anew, and none is kept";
        named.chain(no_cache.declare("no_cache", "-", meaning, &cache)).collect()
    }
}

/// Settings of the identification that have a flag here, and mean the line's of the same name as well.
const LINKED: [(&str, &str); 6] = [
    ("log", "The log, for the identification"),
    ("car", "The car that fixed parameters come from"),
    ("track", "The circuit, for identification and line"),
    ("backend", "Where candidates are evaluated"),
    ("adapter", "Part of the name of the GPU to use"),
    ("seed", "Seed of all random numbers"),
];

/// The setting of a stage that has this key.
fn setting_of<S: Settings>(key: &str) -> Option<Setting<S>> {
    S::settings()
        .into_iter()
        .find(|setting| setting.declared.key == key)
}

/// The bundled car with all that a run tells of: an engine map and a hybrid drive.
fn hybrid_car() -> IdentifySettings {
    IdentifySettings {
        car: "gt_hybrid".to_owned(),
        ..IdentifySettings::default()
    }
}

impl RunSettings {
    /// How a line of `car` is found, within an envelope from a file where there is one: with room for the driver's errors.
    pub fn line_of(&self, car: &str, envelope: Option<PathBuf>) -> RacelineSettings {
        RacelineSettings {
            car: car.to_owned(),
            envelope,
            car_width_m: self.raceline.car_width_m + 2.0 * self.margin_m,
            ..self.raceline.clone()
        }
    }
}

/// Settings of a stage: a study file, or a table.
struct Stage;

impl<T: Settings> Kind<T> for Stage {
    fn read(&self, table: &Table<'_>, key: &str, _: &str, folder: &Path) -> Result<Option<T>> {
        if table.is_table(key) {
            let stage = table.table(key)?;
            return stage.map(|stage| T::read_table(stage, folder)).transpose();
        }
        let name = table.string(key)?;
        name.map(|name| T::read(&folder.join(name))).transpose()
    }

    fn write(&self, settings: &T) -> Option<Written> {
        Some(Written::Within(settings.to_toml()))
    }

    fn parse(&self, text: &str, _: &T) -> Result<T, String> {
        T::read(Path::new(text)).map_err(|e| e.to_string())
    }

    fn check(&self, settings: &T) -> Result<(), Wrong> {
        settings.validate().map_err(|error| match error {
            Error::Input {
                place,
                found,
                expected,
                ..
            } => Wrong {
                found: format!("{place} {found}"),
                expected,
            },
            other => Wrong {
                found: other.to_string(),
                expected: "settings that can be used".to_owned(),
            },
        })
    }

    fn make_absolute(&self, settings: &mut T) {
        *settings = settings.clone().absolute();
    }

    fn value_name(&self) -> &'static str {
        "FILE"
    }
}

/// A folder; an empty name for none.
struct Cache;

impl Kind<Option<PathBuf>> for Cache {
    fn read(&self, table: &Table<'_>, key: &str, _: &str, folder: &Path) -> Result<Option<Option<PathBuf>>> {
        let name = table.string(key)?;
        Ok(name.map(|name| (!name.is_empty()).then(|| folder.join(name))))
    }

    fn write(&self, path: &Option<PathBuf>) -> Option<Written> {
        let name = path.as_ref().map_or(String::new(), |p| p.display().to_string());
        Some(Written::Value(quoted(&name)))
    }

    fn parse(&self, text: &str, _: &Option<PathBuf>) -> Result<Option<PathBuf>, String> {
        Ok((!text.is_empty()).then(|| PathBuf::from(text)))
    }

    fn make_absolute(&self, path: &mut Option<PathBuf>) {
        if let Some(path) = path
            && let Ok(whole) = std::path::absolute(&*path)
        {
            *path = whole;
        }
    }

    fn value_name(&self) -> &'static str {
        "DIR"
    }
}

/// A switch that empties the name of the cache.
struct NoCache;

impl Kind<Option<PathBuf>> for NoCache {
    fn read(&self, table: &Table<'_>, key: &str, _: &str, _: &Path) -> Result<Option<Option<PathBuf>>> {
        Ok(table.boolean(key)?.filter(|none| *none).map(|_| None))
    }

    fn write(&self, _: &Option<PathBuf>) -> Option<Written> {
        None
    }

    fn parse(&self, text: &str, present: &Option<PathBuf>) -> Result<Option<PathBuf>, String> {
        Ok(present.clone().filter(|_| text != "true"))
    }

    fn value_name(&self) -> &'static str {
        "true|false"
    }
}
