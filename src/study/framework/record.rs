//! How a study ran.

use crate::evaluate::gpu::DispatchWatch;
use crate::evaluate::{BackendInfo, FailureCounts, Losses, add_failures, failures_in_words};
use crate::report::HtmlReport;
use serde::{Deserialize, Deserializer, Serialize};
use std::time::Instant;

/// How a study ran: flattened into its summary and its manifest.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct RunRecord {
    /// `cpu`, `simd` or `gpu`: what evaluated in the end.
    pub backend: String,
    /// Instruction set, or name of the adapter.
    pub adapter: String,
    /// Driver of the adapter.
    pub driver: String,
    /// Time taken (s).
    pub elapsed_s: f64,
    /// Candidates evaluated.
    pub evaluations: u64,
    /// Candidates per second of the time in which they were evaluated; not a number, `null` in JSON, where none were.
    #[serde(deserialize_with = "number_or_null")]
    pub evaluations_per_s: f64,
    /// Candidates that failed, by reason.
    pub failures: FailureCounts,
    /// What went wrong with devices. The study got over it: its figures hold all the same.
    pub device_faults: Vec<String>,
    /// The longest that a dispatch kept the device (ms); nothing where none was at work.
    pub longest_dispatch_ms: Option<f64>,
    /// Whether the study was interrupted.
    pub interrupted: bool,
    /// What interrupted it, if it was not the user: `time_limit`.
    pub ended_by: Option<String>,
}

impl RunRecord {
    /// What evaluates.
    pub fn of(backend: &BackendInfo) -> Self {
        Self {
            backend: backend.backend.to_owned(),
            adapter: backend.device.clone(),
            driver: backend.driver.clone(),
            ..Self::default()
        }
    }

    /// Says what evaluates now.
    pub fn moved_to(&mut self, backend: &BackendInfo) {
        self.backend = backend.backend.to_owned();
        self.adapter.clone_from(&backend.device);
        self.driver.clone_from(&backend.driver);
    }

    /// Adds what went wrong in a part of the study, and says what evaluated last in it.
    pub(in crate::study) fn add(&mut self, losses: &Losses, backend: Option<&BackendInfo>) {
        add_failures(&mut self.failures, &losses.failures);
        self.device_faults.extend_from_slice(&losses.device_faults);
        if let Some(backend) = backend {
            self.moved_to(backend);
        }
    }

    /// So many candidates in so much time (s), of which they were evaluated in `busy_s`.
    pub fn took(&mut self, evaluations: u64, elapsed_s: f64, busy_s: f64) {
        self.evaluations = evaluations;
        self.elapsed_s = elapsed_s;
        self.evaluations_per_s = if busy_s > 0.0 {
            evaluations as f64 / busy_s
        } else {
            f64::NAN
        };
    }

    /// What evaluated, as in `simd avx512`.
    pub fn device(&self) -> String {
        format!("{} {}", self.backend, self.adapter)
    }

    /// The last lines of a summary: candidates that failed, as in `Laps that failed`, then what a reader must know.
    pub(in crate::study) fn ending(&self, candidates: &str, warnings: &[String]) -> String {
        let failed = if self.failures.is_empty() {
            String::new()
        } else {
            format!(
                "{candidates} that failed: {}\n",
                failures_in_words(&self.failures)
            )
        };
        let warnings = warnings.iter().map(|warning| format!("Note: {warning}\n"));
        failed + &self.notes() + &warnings.collect::<String>()
    }

    /// What went wrong with devices, a line each.
    pub fn notes(&self) -> String {
        self.device_faults
            .iter()
            .map(|f| format!("Note: {f}\n"))
            .collect()
    }

    /// Tells a page what evaluated, how much of what, and how long it took.
    pub(in crate::study) fn provenance(&self, page: &mut HtmlReport, counted: &str) {
        page.provenance("backend", &self.backend);
        page.provenance("adapter", &self.adapter);
        page.provenance("driver", &self.driver);
        page.provenance(counted, self.evaluations.to_string());
        page.provenance("candidates that failed", failures_in_words(&self.failures));
        if self.evaluations_per_s.is_finite() {
            page.provenance("candidates per second", format!("{:.0}", self.evaluations_per_s));
        }
        page.provenance("time", format!("{:.1} s", self.elapsed_s));
    }
}

/// JSON has no number that is none.
fn number_or_null<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
    Ok(Option::deserialize(deserializer)?.unwrap_or(f64::NAN))
}

/// Watches the clock and the device while a study works.
pub(in crate::study) struct Watch {
    began: Instant,
    dispatches: DispatchWatch,
}

impl Watch {
    /// From now on.
    pub fn begin() -> Self {
        Self {
            began: Instant::now(),
            dispatches: DispatchWatch::begin(),
        }
    }

    /// Since it began (s).
    pub fn elapsed_s(&self) -> f64 {
        self.began.elapsed().as_secs_f64()
    }

    /// The longest dispatch since it began (ms).
    pub fn longest_dispatch_ms(&self) -> Option<f64> {
        self.dispatches.longest_ms()
    }
}
