//! Flags of the studies that replay a lap.

use super::{Common, backend_flag};
use lapswarm::evaluate::replay::{BackendChoice, Norm};
use lapswarm::study::identify::{IdentifySettings, parse_norm};
use std::path::PathBuf;

/// The car, the lap, and where it is replayed.
#[derive(clap::Args, Clone, Default)]
pub struct ReplayFlags {
    /// The car: a bundled name (gt) or a TOML file
    #[arg(long, value_name = "NAME|FILE")]
    car: Option<String>,
    /// The log: our CSV, a MoTeC i2 CSV export or a MoTeC .ld file [default: the bundled lap]
    #[arg(long, value_name = "FILE")]
    log: Option<PathBuf>,
    /// Channel names, units, signs and delays of the log, as TOML [default: guessed]
    #[arg(long, value_name = "FILE")]
    channel_map: Option<PathBuf>,
    /// The circuit that sections are named on
    #[arg(long, value_name = "NAME|FILE")]
    track: Option<String>,
    /// Score only this section of the track
    #[arg(long, value_name = "NAME")]
    section: Option<String>,
    /// Norm of the costs: 1, 2, infinity or mse
    #[arg(long, value_name = "NORM", value_parser = norm_flag)]
    norm: Option<Norm>,
    /// Length of the windows that restart from the log, s
    #[arg(long, value_name = "SECONDS")]
    window_s: Option<f64>,
    /// Laps to replay [default: all complete ones]
    #[arg(long, value_name = "LIST", value_delimiter = ',')]
    laps: Option<Vec<u32>>,
    /// Where to evaluate: auto, cpu, simd or gpu
    #[arg(long, value_name = "BACKEND", value_parser = backend_flag)]
    backend: Option<BackendChoice>,
    /// Part of the name of the GPU to use
    #[arg(long, value_name = "NAME")]
    adapter: Option<String>,
}

fn norm_flag(name: &str) -> Result<Norm, String> {
    parse_norm(name).ok_or_else(|| "expected 1, 2, infinity or mse".to_owned())
}

impl ReplayFlags {
    /// Whether a backend or an adapter is named.
    pub fn moves(&self) -> bool {
        self.backend.is_some() || self.adapter.is_some()
    }

    /// Overrides what a study file says.
    pub fn apply(&self, common: &Common, s: &mut IdentifySettings) {
        fn set<T: Clone>(setting: &mut T, flag: &Option<T>) {
            if let Some(value) = flag {
                setting.clone_from(value);
            }
        }
        fn set_optional<T: Clone>(setting: &mut Option<T>, flag: &Option<T>) {
            if flag.is_some() {
                setting.clone_from(flag);
            }
        }
        set(&mut s.car, &self.car);
        set_optional(&mut s.log, &self.log);
        set_optional(&mut s.channel_map, &self.channel_map);
        set_optional(&mut s.track, &self.track);
        set_optional(&mut s.section, &self.section);
        set(&mut s.norm, &self.norm);
        set_optional(&mut s.window_s, &self.window_s);
        set(&mut s.laps, &self.laps);
        set(&mut s.backend, &self.backend);
        set_optional(&mut s.adapter, &self.adapter);
        set(&mut s.seed, &common.seed);
    }
}
