//! `lapswarm parity`.

use super::backend_flag;
use super::measurement::MeasurementFlags;
use crate::cli::output::{Columns, line_of, outln};
use lapswarm::evaluate::BackendChoice;
use lapswarm::evaluate::gpu::{DeviceSummary, devices};
use lapswarm::files::write_whole;
use lapswarm::parity::{Agreement, Subject, compare, subjects};
use lapswarm::report::{BarPanel, Bars, HtmlReport, Table, significant};
use lapswarm::{Error, Result};
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Flags of `parity`.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  lapswarm parity\n  lapswarm parity --backend gpu --adapter radeon --file parity.json"
)]
pub struct Arguments {
    /// What to hold against the f64 reference [default: all there is]
    #[arg(long, value_parser = backend_flag, default_value = "auto", hide_default_value = true)]
    backend: BackendChoice,
    /// Part of the name of the GPU to use
    #[arg(long)]
    adapter: Option<String>,
    /// Write the findings into this file, to go with a bug report; refused if it exists
    #[arg(long, value_name = "FILE")]
    file: Option<PathBuf>,
    #[command(flatten)]
    kept: MeasurementFlags,
}

#[derive(Serialize)]
struct Report {
    study: &'static str,
    version: &'static str,
    seed: u64,
    backend: String,
    adapter: Option<String>,
    driver: Option<String>,
    elapsed_s: f64,
    evaluations: usize,
    evaluations_per_s: f64,
    kernels: BTreeMap<String, Agreement>,
    pass: bool,
}

/// The table on a terminal.
const COLUMNS: &Columns<Agreement> = &[
    ("kernel", -46, Agreement::key),
    ("figures", 10, |a| a.figures.to_string()),
    ("relative", 12, |a| format!("{:.1e}", a.max_relative)),
    ("ULP", 10, |a| format!("{:.1}", a.max_ulp)),
    ("of what may be", 16, |a| {
        format!("{:.1}%", 100.0 * a.share_of_tolerance)
    }),
];

/// Whether the bits are those of the plain scalar.
fn bits(agreement: &Agreement) -> &'static str {
    match agreement.bits_as_scalar {
        Some(true) => "yes",
        Some(false) => "no",
        None => "-",
    }
}

/// Compares and prints.
pub fn run(arguments: &Arguments) -> Result<()> {
    if let Some(path) = arguments.file.as_ref().filter(|p| p.exists()) {
        return Err(Error::input(
            path,
            "--file",
            "a file",
            "one that does not exist: nothing is overwritten",
        ));
    }
    let began = Instant::now();
    let subjects = subjects(arguments.backend, arguments.adapter.as_deref())?;
    if subjects.is_empty() {
        let expected = "auto, simd or gpu: cpu is the reference that these are held against";
        return Err(Error::input("the command line", "--backend", "cpu", expected));
    }
    let keeping = arguments.kept.begin("parity", arguments.adapter.as_deref())?;
    let device: Option<&DeviceSummary> = subjects.iter().find_map(|s| match s {
        Subject::Device(context) => Some(context.summary()),
        Subject::Lanes(_) => None,
    });
    if device.is_none() && arguments.backend == BackendChoice::Auto && devices().is_empty() {
        outln!("no GPU: neither Vulkan, Metal nor DX12 found an adapter");
    }
    outln!("{}  bits as f32", line_of(COLUMNS, None));
    let found = compare(&subjects, |a| {
        let fails = if a.pass {
            String::new()
        } else {
            format!("  FAILS: {}", a.worst)
        };
        outln!("{}  {}{fails}", line_of(COLUMNS, Some(a)), bits(a));
    })?;
    let pass = found.iter().all(|a| a.pass);
    let evaluations = found.iter().map(|a| a.figures).sum();
    let elapsed_s = began.elapsed().as_secs_f64();
    let mut backends: Vec<String> = subjects.iter().map(Subject::name).collect();
    backends.dedup();
    let report = Report {
        study: "parity",
        version: env!("CARGO_PKG_VERSION"),
        seed: 1,
        backend: backends.join(", "),
        adapter: device.map(|d| d.name.clone()),
        driver: device.map(|d| format!("{} {}", d.driver, d.driver_info).trim().to_owned()),
        elapsed_s,
        evaluations,
        evaluations_per_s: evaluations as f64 / elapsed_s,
        kernels: found.into_iter().map(|a| (a.key(), a)).collect(),
        pass,
    };
    if let Some(path) = &arguments.file {
        let text = serde_json::to_string_pretty(&report)
            .map_err(|e| Error::io(path, "write", std::io::Error::other(e)))?;
        write_whole(path, text.as_bytes())?;
    }
    if let Some(device) = device {
        outln!("{device}");
    }
    let verdict = if pass {
        "all agree with the f64 reference"
    } else {
        "NOT ALL AGREE"
    };
    outln!("{verdict}");
    let names = subjects.iter().map(|s| match s {
        Subject::Device(_) => "gpu",
        Subject::Lanes(_) => "simd",
    });
    keeping.finish(&report, names, |folder| page_of(folder, &report))?;
    if pass {
        return Ok(());
    }
    let failing = report.kernels.iter().filter(|(_, a)| !a.pass);
    let failing: Vec<&str> = failing.map(|(key, _)| key.as_str()).collect();
    Err(Error::Study(format!(
        "off the reference by more than may be: {}",
        failing.join("; ")
    )))
}

/// Comparisons that bars are drawn of; the table has all.
const DRAWN: usize = 30;

/// The page, and `kernels.csv` beside it.
fn page_of(folder: &Path, report: &Report) -> Result<HtmlReport> {
    let mut page = HtmlReport::new("parity", "Kernels held against the f64 reference");
    let mut found: Vec<(&String, &Agreement)> = report.kernels.iter().collect();
    found.sort_by(|a, b| b.1.share_of_tolerance.total_cmp(&a.1.share_of_tolerance));
    let failing: Vec<&str> = found
        .iter()
        .filter(|(_, a)| !a.pass)
        .map(|(k, _)| k.as_str())
        .collect();
    page.sentence(if failing.is_empty() {
        format!("All {} comparisons agree with the reference.", found.len())
    } else {
        format!(
            "{} of {} comparisons do not agree with the reference.",
            failing.len(),
            found.len()
        )
    });
    page.tile("Comparisons", found.len().to_string(), "");
    page.tile("Failing", failing.len().to_string(), "");
    if let Some((key, worst)) = found.first() {
        let share = significant(100.0 * worst.share_of_tolerance, 3);
        page.sentence(format!(
            "Closest to its tolerance is {key}, which takes {share} % of it."
        ));
        page.tile("Most of a tolerance", share, "%");
    }
    for key in failing {
        page.warning(format!("{key}: {}", report.kernels[key].worst));
    }
    page.section(
        "How much of what may be",
        "Greatest difference of each kernel as a share of its tolerance: 100 % would fail.",
    );
    let drawn = &found[..found.len().min(DRAWN)];
    let panel = BarPanel::new(
        "Share of the tolerance",
        "greatest difference (% of what may be)",
        drawn.iter().map(|(key, _)| *key),
    );
    let shares = drawn.iter().map(|(_, a)| 100.0 * a.share_of_tolerance);
    page.place(&Bars::new("Share of the tolerance", [panel.bars("", shares)]))?;
    let table = Table::rows(found.iter().map(|(_, a)| *a))
        .text("on", |a| &*a.subject)
        .text("kernel", |a| &*a.kernel)
        .text("verdict", |a| if a.pass { "agrees" } else { "FAILS" })
        .number("figures", "", |a| a.figures as f64)
        .number("greatest relative difference", "", |a| a.max_relative)
        .number("greatest difference", "ULP", |a| a.max_ulp)
        .number("of what may be", "%", |a| 100.0 * a.share_of_tolerance)
        .text("bits as f32", |a| bits(a))
        .text("furthest off", |a| &*a.worst)
        .table();
    table.write_csv(folder.join("kernels.csv"))?;
    page.table("Every comparison", "", &table)?;
    page.provenance("figures compared", report.evaluations.to_string());
    page.provenance("time", format!("{:.1} s", report.elapsed_s));
    Ok(page)
}
