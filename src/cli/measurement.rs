//! Measurements that are kept in a folder, with a page.

use lapswarm::Result;
use lapswarm::evaluate::BackendChoice;
use lapswarm::report::HtmlReport;
use lapswarm::study::framework::run_folder::{self, Manifest, RunFolder, write_json};
use lapswarm::study::framework::{RunRecord, Subject};
use serde::Serialize;
use std::path::PathBuf;

/// Where a measurement is kept.
#[derive(clap::Args)]
pub struct Kept {
    /// Keep the figures in this folder, with pictures and report.html; refused if it holds anything
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

/// What measured.
pub struct Machine {
    backends: String,
    adapter: String,
    driver: String,
}

impl Machine {
    /// Of the names of backends, the GPU among them being that of the flag `--adapter`.
    pub fn of<'a>(backends: impl IntoIterator<Item = &'a str>, adapter: Option<&str>) -> Result<Self> {
        let mut names: Vec<&str> = backends.into_iter().collect();
        names.sort_unstable();
        names.dedup();
        let gpu = names.contains(&"gpu");
        let choice = if gpu {
            BackendChoice::Gpu
        } else {
            BackendChoice::Simd
        };
        let info = choice.would_be(adapter.filter(|_| gpu))?;
        Ok(Self {
            backends: names.join(", "),
            adapter: info.device,
            driver: info.driver,
        })
    }
}

impl Kept {
    /// The folder, if one is asked for; refused before anything is measured.
    pub fn folder(&self, study: &str) -> Result<Option<RunFolder>> {
        let create = |path| run_folder::create(study, Some(path));
        self.out.as_deref().map(create).transpose()
    }
}

/// Writes `summary.json`, `report.html` and `manifest.json`, and ends the page with what measured.
pub fn write(
    folder: &RunFolder,
    study: &'static str,
    summary: &impl Serialize,
    mut page: HtmlReport,
    machine: &Machine,
) -> Result<()> {
    write_json(&folder.join("summary.json"), summary)?;
    page.provenance("backends", &machine.backends);
    page.provenance("adapter", &machine.adapter);
    page.provenance("driver", &machine.driver);
    page.provenance(
        "threads",
        std::thread::available_parallelism().map_or(String::new(), |n| n.to_string()),
    );
    page.provenance(
        "system",
        format!("{} {}", std::env::consts::OS, std::env::consts::ARCH),
    );
    page.write(folder.join("report.html"))?;
    // Last: it says that the run is whole.
    let subject = Subject {
        seed: 1,
        ..Subject::default()
    };
    let record = RunRecord {
        backend: machine.backends.clone(),
        adapter: machine.adapter.clone(),
        driver: machine.driver.clone(),
        ..RunRecord::default()
    };
    let manifest = Manifest::new(study, &subject, &record, "");
    write_json(&folder.join("manifest.json"), &manifest)
}
