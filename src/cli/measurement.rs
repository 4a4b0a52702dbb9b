//! Measurements that are kept in a folder, with a page.

use super::output::{outln, set_silent};
use super::print_json;
use lapswarm::Result;
use lapswarm::evaluate::BackendChoice;
use lapswarm::files::run_folder::{self, MANIFEST, RunFolder, SUMMARY};
use lapswarm::report::HtmlReport;
use lapswarm::study::framework::{Head, Manifest, RunRecord, Subject, write_json};
use serde::Serialize;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// The flags of what becomes of a measurement.
#[derive(clap::Args)]
pub struct MeasurementFlags {
    /// Keep the figures in this folder, with pictures and report.html; refused if it holds anything
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Print one JSON object on stdout; words go to stderr
    #[arg(long)]
    json: bool,
    /// No words and no table
    #[arg(long)]
    quiet: bool,
}

impl MeasurementFlags {
    /// The folder is refused before anything is measured; `adapter` is what the flag `--adapter` says.
    pub fn begin<'a>(&self, study: &'static str, adapter: Option<&'a str>) -> Result<Keeping<'a>> {
        if self.quiet {
            set_silent();
        }
        let create = |path| run_folder::create(study, Some(path));
        Ok(Keeping {
            study,
            folder: self.out.as_deref().map(create).transpose()?,
            adapter,
            json: self.json,
        })
    }
}

/// What becomes of a measurement.
pub struct Keeping<'a> {
    study: &'static str,
    folder: Option<RunFolder>,
    adapter: Option<&'a str>,
    json: bool,
}

impl Keeping<'_> {
    /// Keeps what was measured, if a folder is asked for, and prints it as JSON, if that is. The folder gets `summary.json`,
    /// `manifest.json` and `report.html`, whose page ends with what measured.
    pub fn finish<'b>(
        self,
        summary: &impl Serialize,
        backends: impl IntoIterator<Item = &'b str>,
        page: impl FnOnce(&Path) -> Result<HtmlReport>,
    ) -> Result<()> {
        if let Some(folder) = &self.folder {
            self.write(folder, summary, &distinct(backends), page(folder)?)?;
            outln!("Results: {}", folder.display());
        }
        if self.json {
            print_json(summary)?;
        }
        Ok(())
    }

    fn write(
        &self,
        folder: &Path,
        summary: &impl Serialize,
        backends: &[&str],
        mut page: HtmlReport,
    ) -> Result<()> {
        let measured_by = if backends.contains(&"gpu") {
            BackendChoice::Gpu.would_be(self.adapter)?
        } else {
            BackendChoice::Simd.would_be(None)?
        };
        let record = RunRecord {
            backend: backends.join(", "),
            ..RunRecord::of(&measured_by)
        };
        write_json(&folder.join(SUMMARY), summary)?;
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
        let head = Head {
            study: self.study.to_owned(),
            subject: Subject {
                seed: 1,
                ..Subject::default()
            },
            record,
        };
        write_json(&folder.join(MANIFEST), &Manifest::new(head, ""))
    }
}

/// Names, each once.
pub fn distinct<'a>(names: impl IntoIterator<Item = &'a str>) -> Vec<&'a str> {
    let names: BTreeSet<&str> = names.into_iter().collect();
    names.into_iter().collect()
}
