//! The resolved settings as a study file that repeats the run.

use super::settings::{Algorithm, IdentifySettings, ObjectiveChoice};
use crate::error::Result;
use crate::evaluate::replay::{CHANNEL_NAMES, norm_name};
use crate::study::run_folder::write_study;
use crate::swarm::Mutation;
use std::path::Path;

/// Writes the resolved settings into `folder`, as a study file that repeats the run.
///
/// # Errors
/// [`crate::Error::Io`] if it cannot be written.
pub fn write_settings(folder: &Path, settings: &IdentifySettings) -> Result<()> {
    write_study(folder, &settings.to_toml())
}

impl IdentifySettings {
    /// The study file that repeats this study.
    pub fn to_toml(&self) -> String {
        let s = self;
        let quoted = |text: &str| toml::Value::String(text.to_owned()).to_string();
        let path = |p: &Path| {
            quoted(
                &std::path::absolute(p)
                    .unwrap_or_else(|_| p.to_owned())
                    .display()
                    .to_string(),
            )
        };
        let named = |name: &str| {
            if Path::new(name).extension().is_some() {
                path(Path::new(name))
            } else {
                quoted(name)
            }
        };
        let mut lines = vec![format!("car = {}", named(&s.car)), format!("seed = {}", s.seed)];
        let mut push = |key: &str, value: Option<String>| lines.extend(value.map(|v| format!("{key} = {v}")));
        push("log", s.log.as_deref().map(path));
        push("channel_map", s.channel_map.as_deref().map(path));
        push("track", s.track.as_deref().map(named));
        push("truth", s.truth.as_deref().map(named));
        push("section", s.section.as_deref().map(quoted));
        let objectives: Vec<&str> = s
            .objectives
            .iter()
            .map(|o| match o {
                ObjectiveChoice::All => "all",
                ObjectiveChoice::Channel(k) => CHANNEL_NAMES[*k],
            })
            .collect();
        push("objectives", Some(format!("{objectives:?}")));
        push("norm", Some(quoted(norm_name(s.norm))));
        push("window_s", s.window_s.map(|x| format!("{x:?}")));
        push("settle_s", Some(format!("{:?}", s.settle_s)));
        push("least_speed_mps", Some(format!("{:?}", s.least_speed_mps)));
        push("rate_hz", s.rate_hz.map(|x| format!("{x:?}")));
        push("substeps", s.substeps.map(|x| x.to_string()));
        push(
            "laps",
            Some(format!("{:?}", s.laps)).filter(|_| !s.laps.is_empty()),
        );
        push(
            "holdout",
            Some(format!("{:?}", s.holdout)).filter(|_| !s.holdout.is_empty()),
        );
        push("polish", Some(s.polish.to_string()));
        push("hops", Some(s.hops.to_string()));
        let backend = format!("{:?}", s.backend).to_lowercase();
        push("backend", Some(quoted(&backend)));
        push("adapter", s.adapter.as_deref().map(quoted));
        lines.push("\n[swarm]".to_owned());
        let mut push = |key: &str, value: Option<String>| lines.extend(value.map(|v| format!("{key} = {v}")));
        let algorithm = match s.algorithm {
            Algorithm::Adaptive => "adaptive",
            Algorithm::Pso => "pso",
            Algorithm::Thesis => "thesis",
        };
        push("algorithm", Some(quoted(algorithm)));
        push("population", s.population.map(|x| x.to_string()));
        push("iterations", s.iterations.map(|x| x.to_string()));
        let schedule = |x: crate::swarm::Schedule| match x {
            crate::swarm::Schedule::Fixed(v) => format!("{v:?}"),
            crate::swarm::Schedule::Linear { from, to } => format!("[{from:?}, {to:?}]"),
        };
        push("inertia", s.inertia.map(schedule));
        push("cognitive", s.cognitive.map(schedule));
        push("social", s.social.map(schedule));
        push("archive", Some(s.archive.to_string()));
        push(
            "mutation",
            s.mutation.map(|m| match m {
                Mutation::None => "0".to_owned(),
                Mutation::Fixed(mu) => format!("{mu:?}"),
                Mutation::Random => quoted("random"),
                Mutation::Polynomial { .. } => quoted("polynomial"),
            }),
        );
        lines.push("\n[calibration]".to_owned());
        let c = &s.calibration;
        for (key, switch) in [
            ("signs", c.signs),
            ("delays", c.delays),
            ("offsets", c.offsets),
            ("rolling_radius", c.rolling_radius),
        ] {
            use crate::telemetry::Switch;
            match switch {
                Switch::Auto => {}
                Switch::On => lines.push(format!("{key} = true")),
                Switch::Off => lines.push(format!("{key} = false")),
            }
        }
        lines.push("\n[free]".to_owned());
        for free in &s.free {
            let key = if free.name.contains('.') {
                quoted(&free.name)
            } else {
                free.name.clone()
            };
            lines.push(format!("{key} = [{:?}, {:?}]", free.lower, free.upper));
        }
        lines.push(String::new());
        lines.join("\n")
    }
}
