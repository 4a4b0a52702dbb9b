//! Settings of a run.

use crate::config::kinds::{count, file_or_table, folder_or_none, no_folder, number};
use crate::config::settings::{Declared, Flag, Lens, Role, Setting, Settings, settings};
use crate::study::identify::IdentifySettings;
use crate::study::raceline::RacelineSettings;
use std::path::PathBuf;

settings! {
    /// Settings of a run: those of its stages, and its own.
    pub struct RunSettings {
        identify: IdentifySettings ["-"] = hybrid_car(), file_or_table().example("\"identify.toml\""),
            "How the car is identified: a study file of identify, or its settings in a table";
        raceline: RacelineSettings ["-"] = RacelineSettings::default(), file_or_table().example("\"raceline.toml\""),
            "How its line is found: a study file of raceline, or its settings in a table; car and envelope are those of the run";
        margin_m: f64 ["m"] = 0.5, number(0.0, 5.0),
            "Room that the line leaves on either side of the car for the driver's errors";
        rounds: usize ["-"] = 2, count(1, 20),
            "Most lines that are driven, each within the limits that the one before it left";
        cache: Option<PathBuf> ["-"] = Some(PathBuf::from("runs/cache")), folder_or_none().place(),
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
        let no_cache = no_folder().flag(Flag::Switch("no_cache", true));
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
    (
        "adapter",
        "Part of the name of the GPU to use, its place on the PCI bus, or all for several",
    ),
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
