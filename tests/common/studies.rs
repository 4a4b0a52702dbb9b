//! The studies of the registry at sizes that tests can run. A new study has a row here.

use lapswarm::config::settings::Flag;
use lapswarm::study::registry::Registered;
use std::path::Path;

/// A study, the settings that make it small, and those with which it has more steps to be killed at. `@` is the folder of
/// [`FILES`].
type Row = (
    &'static str,
    &'static [(&'static str, &'static str)],
    &'static [(&'static str, &'static str)],
);

const ROWS: &[Row] = &[
    (
        "run",
        &[
            ("identify", "@/car.toml"),
            ("raceline", "@/line.toml"),
            ("rounds", "1"),
            ("no_cache", "true"),
        ],
        &[],
    ),
    (
        "identify",
        &[
            ("section", "Abbey"),
            ("swarm.population", "16"),
            ("swarm.iterations", "8"),
            ("polish", "false"),
            ("backend", "simd"),
        ],
        &[
            ("swarm.population", "24"),
            ("swarm.iterations", "20"),
            ("free", "rBy1,rCy1,K"),
            ("polish", "true"),
            ("hops", "0"),
        ],
    ),
    (
        "envelope",
        &[("step_mps", "25"), ("steers", "8"), ("backend", "simd")],
        &[],
    ),
    (
        "raceline",
        &[
            ("track", "stadium:400:120:14"),
            ("sections", "60"),
            ("objectives", "gamma,length"),
            ("population", "16"),
            ("iterations", "8"),
            ("backend", "simd"),
        ],
        &[
            ("track", "stadium:300:80:12"),
            ("sections", "120"),
            ("objectives", "length,lap_time"),
            ("population", "24"),
            ("iterations", "6"),
        ],
    ),
    (
        "hybrid",
        &[
            ("track", "stadium:400:120:14"),
            ("sections", "60"),
            ("budgets_mj", "0.5"),
            ("objectives", "lap_time_s"),
            ("population", "16"),
            ("iterations", "8"),
            ("backend", "simd"),
        ],
        &[("track", "stadium:300:80:12"), ("sections", "120")],
    ),
    (
        "transient",
        &[
            ("line", "@/ring.csv"),
            ("track", "circle:294:306"),
            ("setups", "3"),
            ("backend", "simd"),
        ],
        &[("setups", "8")],
    ),
    (
        "sensitivity",
        &[
            ("free", "K,C"),
            ("section", "Abbey"),
            ("samples", "8"),
            ("backend", "simd"),
        ],
        &[("free", "rBy1,rCy1,K"), ("samples", "64")],
    ),
    (
        "surface",
        &[("section", "Abbey"), ("grid", "3"), ("backend", "simd")],
        &[("grid", "30")],
    ),
];

/// What rows name. The car of the run is without a hybrid drive, whose stage would take longer than all others.
const FILES: [(&str, &str); 2] = [
    (
        "car.toml",
        "car = \"gt\"\nsection = \"Abbey\"\nbackend = \"simd\"\npolish = false\n[free]\nK = [3e4, 3e5]\n[swarm]\n\
         population = 16\niterations = 8\n",
    ),
    (
        "line.toml",
        "track = \"stadium:300:80:12\"\nsections = 120\nobjectives = [\"lap_time\"]\nbackend = \"simd\"\n",
    ),
];

/// Settings by their keys.
pub type Given = Vec<(String, String)>;

fn row(study: &str, folder: &Path) -> (Given, Given) {
    for (name, text) in FILES {
        std::fs::write(folder.join(name), text).expect("a file");
    }
    let points = (0..400).map(|i| {
        let angle = std::f64::consts::TAU * f64::from(i) / 400.0;
        format!("{},{}\n", 300.0 * angle.cos(), 300.0 * angle.sin())
    });
    let ring = format!("x_m,y_m\n{}", points.collect::<String>());
    std::fs::write(folder.join("ring.csv"), ring).expect("a line");
    let row = ROWS.iter().find(|(name, ..)| *name == study);
    let (_, small, longer) = row.unwrap_or_else(|| panic!("{study} is new: say how it is made small"));
    let place = folder.display().to_string();
    let given = |settings: &[(&str, &str)]| {
        let owned = settings
            .iter()
            .map(|(key, value)| (*key, value.replace('@', &place)));
        owned.map(|(key, value)| (key.to_owned(), value)).collect()
    };
    (given(small), given(longer))
}

/// The settings of a small study. Files that it reads are left in `folder`.
pub fn small(study: &str, folder: &Path) -> Given {
    row(study, folder).0
}

/// The settings of a study that is small and has steps enough to be killed at any of them.
pub fn longer(study: &str, folder: &Path) -> Given {
    let (mut given, longer) = row(study, folder);
    given.retain(|(key, _)| longer.iter().all(|(other, _)| other != key));
    given.extend(longer);
    given
}

/// A study on the command line: its name, and its settings as flags.
pub fn command(study: &dyn Registered, given: &[(String, String)]) -> Vec<String> {
    let mut command = vec![study.name().to_owned()];
    for d in study.declared() {
        let value = given.iter().find(|(key, _)| key == d.key).map(|(_, value)| value);
        match (d.flag, d.typed(), value) {
            (Flag::Switch(_, on), Some(flag), Some(value)) if *value == on.to_string() => command.push(flag),
            (Flag::Switch(..), ..) => {}
            (_, Some(flag), Some(value)) => command.extend([flag, value.clone()]),
            _ => {}
        }
    }
    command
}
