//! Measurements that are kept in a folder, with a page.

use lapswarm::Result;
use lapswarm::evaluate::BackendChoice;
use lapswarm::report::HtmlReport;
use lapswarm::study::framework::run_folder::{self, Manifest, RunFolder, write_json};
use lapswarm::study::framework::{RunRecord, Subject};
use serde::Serialize;
use std::collections::BTreeSet;
use std::path::PathBuf;

/// Where a measurement is kept.
#[derive(clap::Args)]
pub struct Kept {
    /// Keep the figures in this folder, with pictures and report.html; refused if it holds anything
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

impl Kept {
    /// The folder, if one is asked for; refused before anything is measured.
    pub fn folder(&self, study: &str) -> Result<Option<RunFolder>> {
        let create = |path| run_folder::create(study, Some(path));
        self.out.as_deref().map(create).transpose()
    }
}

/// Names, each once.
pub fn distinct<'a>(names: impl IntoIterator<Item = &'a str>) -> Vec<&'a str> {
    let names: BTreeSet<&str> = names.into_iter().collect();
    names.into_iter().collect()
}

/// Keeps what was measured: writes `summary.json`, `manifest.json` and `report.html`, whose page ends with what measured. The GPU
/// among the backends is that of the flag `--adapter`.
pub fn keep<'a>(
    folder: &RunFolder,
    study: &'static str,
    summary: &impl Serialize,
    mut page: HtmlReport,
    (backends, adapter): (impl IntoIterator<Item = &'a str>, Option<&str>),
) -> Result<()> {
    let backends = distinct(backends);
    let measured_by = if backends.contains(&"gpu") {
        BackendChoice::Gpu.would_be(adapter)?
    } else {
        BackendChoice::Simd.would_be(None)?
    };
    let record = RunRecord {
        backend: backends.join(", "),
        ..RunRecord::of(&measured_by)
    };
    write_json(&folder.join("summary.json"), summary)?;
    let threads = std::thread::available_parallelism().map_or(String::new(), |n| n.to_string());
    page.facts(&[
        ("backends", &record.backend),
        ("adapter", &record.adapter),
        ("driver", &record.driver),
        ("threads", &threads),
        (
            "system",
            &format!("{} {}", std::env::consts::OS, std::env::consts::ARCH),
        ),
    ]);
    page.write(folder.join("report.html"))?;
    // Last: it says that the run is whole.
    let subject = Subject {
        seed: 1,
        ..Subject::default()
    };
    let manifest = Manifest::new(study, &subject, &record, "");
    write_json(&folder.join("manifest.json"), &manifest)
}
