//! Settings of a run.

use crate::config::Table;
use crate::config::kinds::{Choice, Kind, count, number, of, quoted};
use crate::config::settings::{Declared, Flag, Role, Setting, Settings, Written, Wrong, settings};
use crate::error::{Error, Result};
use crate::evaluate::BackendChoice;
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
        linked()
    }
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

/// What identification and line have in common, set for both.
fn linked() -> Vec<Setting<RunSettings>> {
    let declared = |key, value_name, meaning| Declared {
        key,
        unit: "-",
        meaning,
        value_name,
        range: String::new(),
        flag: Flag::Value(key),
        role: Role::Problem,
        example: None,
    };
    let place = |declared| Declared {
        role: Role::Place,
        ..declared
    };
    let no_cache = Declared {
        flag: Flag::Switch("no_cache", true),
        ..declared(
            "no_cache",
            "true|false",
            "Every stage is done anew, and none is kept",
        )
    };
    let backend = declared("backend", "NAME", "Where candidates are evaluated");
    vec![
        Setting::linked(
            declared("log", "FILE", "The log, for the identification"),
            |s, text| {
                s.identify.log = Some(PathBuf::from(text));
                Ok(())
            },
            |from, to| to.identify.log.clone_from(&from.identify.log),
        ),
        Setting::linked(
            declared("car", "NAME|FILE", "The car that fixed parameters come from"),
            |s, text| {
                text.clone_into(&mut s.identify.car);
                Ok(())
            },
            |from, to| to.identify.car.clone_from(&from.identify.car),
        ),
        Setting::linked(
            declared("track", "NAME|FILE", "The circuit, for identification and line"),
            |s, text| {
                s.identify.track = Some(text.to_owned());
                text.clone_into(&mut s.raceline.track);
                Ok(())
            },
            |from, to| {
                to.identify.track.clone_from(&from.identify.track);
                to.raceline.track.clone_from(&from.raceline.track);
            },
        ),
        Setting::linked(
            place(Declared {
                range: BackendChoice::names(),
                ..backend
            }),
            |s, text| {
                let expected = || format!("expected {}", BackendChoice::names());
                let backend = BackendChoice::named(text).ok_or_else(expected)?;
                (s.identify.backend, s.raceline.backend) = (backend, backend);
                Ok(())
            },
            |from, to| {
                to.identify.backend = from.identify.backend;
                to.raceline.backend = from.raceline.backend;
            },
        ),
        Setting::linked(
            place(declared("adapter", "NAME", "Part of the name of the GPU to use")),
            |s, text| {
                s.identify.adapter = Some(text.to_owned());
                s.raceline.adapter = Some(text.to_owned());
                Ok(())
            },
            |from, to| {
                to.identify.adapter.clone_from(&from.identify.adapter);
                to.raceline.adapter.clone_from(&from.raceline.adapter);
            },
        ),
        Setting::linked(
            declared("seed", "N", "Seed of all random numbers"),
            |s, text| {
                let seed = text
                    .parse()
                    .map_err(|_| "expected a whole number, 0 or more".to_owned())?;
                (s.identify.seed, s.raceline.seed) = (seed, seed);
                Ok(())
            },
            |from, to| {
                to.identify.seed = from.identify.seed;
                to.raceline.seed = from.raceline.seed;
            },
        ),
        Setting::linked(
            no_cache,
            |s, text| {
                if text == "true" {
                    s.cache = None;
                }
                Ok(())
            },
            |from, to| to.cache.clone_from(&from.cache),
        ),
    ]
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
