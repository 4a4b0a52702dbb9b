//! `lapswarm sweep`.

use super::study::{pause, print_plan, print_results};
use super::{Common, Memory, progress::Bar, stop_flag, stopped, to_json};
use lapswarm::config::limit_memory;
use lapswarm::files::run_folder::{self, RunFolder};
use lapswarm::study::framework::Plan;
use lapswarm::study::sweep::{RowsRequest, SWEEP_FILE, SweepSettings, begin, gather, plan, run_rows};
use lapswarm::{Error, Result};
use std::ops::Range;
use std::path::PathBuf;
use std::time::Duration;

/// Flags of `sweep`.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  lapswarm sweep thesis_inertia --out tuning\n  lapswarm sweep my_sweep.toml --out s1\n  lapswarm \
                  sweep my_sweep.toml --out s1 --resume\n  lapswarm sweep my_sweep.toml --out s1 --rows 0..500\n  lapswarm sweep \
                  my_sweep.toml --out s1 --gather\n\nA sweep file:\n  study = \"identify\"\n  [base]\n  polish = false\n  \
                  [grid]\n  \"swarm.population\" = [25, 50, 100]\n  seed = [1, 2, 3]"
)]
pub struct Arguments {
    /// A sweep file, or a bundled sweep: thesis_inertia, thesis_population, thesis_lines, front, norms, sections
    sweep: String,
    #[command(flatten)]
    common: Common,
    #[command(flatten)]
    memory: Memory,
    /// Resume the sweep that --out holds a part of, beside other processes that are at work on it
    #[arg(long, requires = "out", conflicts_with = "dry_run")]
    resume: bool,
    /// Do these rows only, which no other process does: `0..500`, `500..`, `..` or `37`. --out may hold a part of the sweep
    #[arg(long, requires = "out", conflicts_with_all = ["dry_run", "resume"], value_name = "A..B", value_parser = rows)]
    rows: Option<Range<usize>>,
    /// Make the tables (sweep and medians, as CSV and Parquet) and the page of the rows that --out holds, and run none
    #[arg(long, requires = "out", conflicts_with_all = ["dry_run", "resume", "rows", "time_limit_s"])]
    gather: bool,
    /// Time after which the sweep ends in order with what it has, s; the runs at work keep their states
    #[arg(long, value_name = "SECONDS", value_parser = pause)]
    time_limit_s: Option<f64>,
}

/// Parses `--rows`.
fn rows(text: &str) -> Result<Range<usize>, String> {
    let number = |text: &str, otherwise: usize| match text {
        "" => Some(otherwise),
        text => text.parse().ok(),
    };
    let range = match text.split_once("..") {
        Some((from, to)) => number(from, 0).zip(number(to, usize::MAX)),
        None => text
            .parse()
            .ok()
            .and_then(|row: usize| Some((row, row.checked_add(1)?))),
    };
    let range = range.filter(|(from, to)| from < to).map(|(from, to)| from..to);
    range.ok_or_else(|| "expected rows such as 0..500, 500.., .. or 37".to_owned())
}

/// Runs the sweep.
pub fn run(arguments: &Arguments) -> Result<()> {
    let common = &arguments.common;
    limit_memory(arguments.memory.memory_limit_mib);
    let settings = SweepSettings::load(&arguments.sweep)?;
    if common.dry_run {
        let planned = plan(&settings)?;
        let told = Plan::of_file("sweep", settings.text())
            .reads(planned.to_string())
            .polish_drives(planned.polish_drives)
            .memory_mib(planned.memory_mib)
            .on_device_of(&planned.plan);
        let told = match planned.evaluations {
            Some(evaluations) => told.evaluations(evaluations),
            None => told,
        };
        return print_plan(common, &told.into_folder(common.out.as_deref())?);
    }
    let folder = open(arguments, &settings)?;
    let mut ended_by = None;
    if !arguments.gather {
        let stop = stop_flag();
        let mut bar = Bar::new(common.quiet);
        let part = run_rows(
            &settings,
            &folder,
            RowsRequest {
                rows: arguments.rows.clone().unwrap_or(0..settings.runs()),
                to_the_end: arguments.rows.is_none(),
                time_limit: arguments
                    .time_limit_s
                    .and_then(|s| Duration::try_from_secs_f64(s).ok()),
                stop: stop.clone(),
                observe: &mut |progress| {
                    bar.show(progress);
                    stopped(&stop)
                },
            },
        );
        bar.finish();
        let part = part?;
        if arguments.rows.is_some() {
            print_results(common, &part.to_text(), Some(&folder), &to_json(&part)?);
            return verdict(&part.failed_runs);
        }
        ended_by = part.ended_by;
    }
    let mut summary = gather(&settings, &folder)?;
    if ended_by.is_some() && summary.rows.is_empty() {
        return Err(Error::Study(format!(
            "the time limit came before there was a row; what was reached is saved in {}, for --resume",
            folder.display()
        )));
    }
    summary.ended_by = ended_by;
    print_results(common, &summary.to_text(), Some(&folder), &to_json(&summary)?);
    verdict(&summary.failed_runs)
}

/// The folder of the sweep, beside other processes that are at work on it.
fn open(arguments: &Arguments, settings: &SweepSettings) -> Result<RunFolder> {
    let out: Option<&PathBuf> = arguments.common.out.as_ref();
    let begun = |folder: &std::path::Path| begin(settings, folder);
    match out {
        Some(folder) if arguments.resume || arguments.gather => run_folder::join(folder, SWEEP_FILE),
        Some(folder) if arguments.rows.is_some() => {
            run_folder::create_or_join("sweep", folder, SWEEP_FILE, begun)
        }
        out => {
            let mut created = run_folder::create("sweep", out.map(PathBuf::as_path))?;
            begun(&created)?;
            created.share()?;
            Ok(created)
        }
    }
}

/// Says that runs have failed, once all that did not are kept.
pub fn verdict(failed: &[String]) -> Result<()> {
    match failed {
        [] => Ok(()),
        [alone] => Err(Error::Study(alone.clone())),
        [first, ..] => Err(Error::Study(format!("{} runs failed; {first}", failed.len()))),
    }
}
