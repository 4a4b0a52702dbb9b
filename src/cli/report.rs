//! `lapswarm report`.

use super::print_json;
use crate::cli::output::outln;
use lapswarm::report::compare::{Figure, Run, Trace, compare};
use lapswarm::telemetry::{ChannelMap, Log, LogOptions};
use lapswarm::{Error, Result};
use std::ops::Range;
use std::path::{Path, PathBuf};

/// Flags of `report`.
#[derive(clap::Args)]
pub struct Arguments {
    /// Folders of runs, as in runs/raceline-001, and logs, whose laps stand beside theirs
    #[arg(value_name = "RUN", required = true)]
    runs: Vec<PathBuf>,
    /// The page to write; refused if it is there already
    #[arg(long, value_name = "FILE", default_value = "comparison.html")]
    out: PathBuf,
    /// Print one JSON object on stdout; words go to stderr
    #[arg(long)]
    json: bool,
    /// Say nothing
    #[arg(long)]
    quiet: bool,
}

#[derive(serde::Serialize)]
struct Written<'a> {
    study: &'static str,
    runs: &'a [PathBuf],
    file: &'a PathBuf,
}

/// A log as a run: its fastest complete lap, or all of it where none is complete.
fn of_log(path: &Path) -> Result<Run> {
    let log = Log::read(path, &ChannelMap::default(), &LogOptions::default())?;
    let complete = log.laps.iter().filter(|lap| lap.complete);
    let fastest = complete.map(|lap| lap.start..lap.end).min_by_key(Range::len);
    let range = fastest.unwrap_or(0..log.samples());
    let trace = {
        let column = |values: &[f64]| values[range.clone()].to_vec();
        let since = |values: &[f64]| column(values).iter().map(|x| x - values[range.start]).collect();
        let columns = [
            ("time", since(&log.time_s)),
            ("distance", since(&log.distance_m)),
            ("vx", column(&log.vx_mps)),
            ("ax", column(&log.ax_mps2)),
            ("ay", column(&log.ay_mps2)),
            ("yaw_rate", column(&log.yaw_rate_radps)),
            ("steer", column(&log.steer_rad)),
        ];
        Trace {
            name: "lap".to_owned(),
            columns: columns.map(|(name, values)| (name.to_owned(), values)).into(),
        }
    };
    Ok(Run {
        folder: path.to_owned(),
        name: path
            .file_name()
            .map_or_else(String::new, |name| name.to_string_lossy().into_owned()),
        study: "log".to_owned(),
        manifest: Vec::new(),
        figures: vec![Figure {
            name: "lap_time_s".to_owned(),
            value: range.len() as f64 * log.dt_s,
        }],
        settings: None,
        traces: vec![trace],
        road: None,
        envelope: None,
        convergence: None,
    })
}

/// Writes the page.
pub fn run(arguments: &Arguments) -> Result<()> {
    let out = &arguments.out;
    if out.exists() {
        let expected = "a new file: nothing is overwritten";
        return Err(Error::input(
            out,
            "--out",
            "a file that is there already",
            expected,
        ));
    }
    let runs = arguments
        .runs
        .iter()
        .map(|given| {
            if given.is_file() {
                of_log(given)
            } else {
                Run::read(given)
            }
        })
        .collect::<Result<Vec<Run>>>()?;
    compare(&runs)?.write(out)?;
    if !arguments.quiet {
        outln!("Written: {}", out.display());
    }
    if arguments.json {
        print_json(&Written {
            study: "report",
            runs: &arguments.runs,
            file: out,
        })?;
    }
    Ok(())
}
