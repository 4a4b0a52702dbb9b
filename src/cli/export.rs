//! `lapswarm export`.

use super::{print_json, write_new};
use crate::cli::output::outln;
use lapswarm::files::stem;
use lapswarm::report::compare::Run;
use lapswarm::telemetry::{LapLabels, SampledLap};
use lapswarm::{Error, Result};
use std::path::{Path, PathBuf};

/// Flags of `export`.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  lapswarm export runs/raceline-001\n  lapswarm export drive.csv --rate 100 --out motec"
)]
pub struct Arguments {
    /// Folders of runs, tables of laps such as line_fastest.csv, or logs
    #[arg(value_name = "RUN|FILE", required = true)]
    laps: Vec<PathBuf>,
    /// Where the files go; none may be there yet
    #[arg(long, value_name = "DIR", default_value = "export")]
    out: PathBuf,
    /// Sample rate, Hz
    #[arg(long, value_name = "HZ", default_value_t = 50)]
    rate: u16,
    /// Print one JSON object on stdout; words go to stderr
    #[arg(long)]
    json: bool,
    /// Say nothing
    #[arg(long)]
    quiet: bool,
}

#[derive(serde::Serialize)]
struct Written {
    study: &'static str,
    files: Vec<PathBuf>,
}

/// Writes each lap as MoTeC CSV, and as `.ld` with its `.ldx`.
pub fn run(arguments: &Arguments) -> Result<()> {
    let mut files = Vec::new();
    for given in &arguments.laps {
        let (tables, mut labels) = if given.is_dir() {
            let run = Run::read(given)?;
            let said = |key: &str| run.manifest_text(key).unwrap_or_default().to_owned();
            let tables: Vec<PathBuf> = run
                .traces
                .iter()
                .map(|t| given.join(format!("{}.csv", t.name)))
                .collect();
            if tables.is_empty() {
                let expected = "a lap: line_NAME.csv, drive.csv, traces.csv or lap.csv";
                return Err(Error::input(
                    given,
                    "folder",
                    format!("a run of {} without one", run.study),
                    expected,
                ));
            }
            (
                tables,
                LapLabels {
                    vehicle: said("car"),
                    venue: said("track"),
                    ..LapLabels::default()
                },
            )
        } else {
            (vec![given.clone()], LapLabels::default())
        };
        for table in &tables {
            let lap = SampledLap::read(table, arguments.rate)?;
            let text =
                |part: Option<&std::ffi::OsStr>| part.unwrap_or_default().to_string_lossy().into_owned();
            let name = text(table.file_stem());
            labels.comment = format!("{name} of lapswarm");
            let run = if given.is_dir() {
                stem(&text(given.file_name())) + "_"
            } else {
                String::new()
            };
            let path = |ending: &str| arguments.out.join(format!("{run}{name}.{ending}"));
            make(&arguments.out)?;
            let (csv, ldx) = (lap.to_motec_csv(&labels), lap.to_ldx());
            let written = [
                (path("csv"), csv.as_bytes()),
                (path("ld"), &lap.to_ld(&labels)?[..]),
                (path("ldx"), ldx.as_bytes()),
            ];
            write_new(&written)?;
            files.extend(written.map(|(path, _)| path));
        }
    }
    if !arguments.quiet && !arguments.json {
        for file in &files {
            outln!("{}", file.display());
        }
    }
    if arguments.json {
        print_json(&Written {
            study: "export",
            files,
        })?;
    }
    Ok(())
}

fn make(folder: &Path) -> Result<()> {
    std::fs::create_dir_all(folder).map_err(|e| Error::io(folder, "create", e))
}
