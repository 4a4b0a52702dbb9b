//! What a racing-line study leaves behind: figures for people and scripts, lines, pictures.

mod files;
mod page;
mod pictures;
mod surfaces;

use super::{Outcome, RacelineSettings, ReportedLine, Setup};
use crate::error::Result;
use crate::evaluate::{FailureCounts, failures_in_words};
use crate::study::run_folder::write_study;
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::Path;

/// Where the lap time through the cuts and the one on the fine spline differ by more than this share, the study says so.
const COARSE_AND_FINE: f64 = 0.003;

/// The figures of one line.
#[derive(Clone, Debug, Serialize)]
pub struct LineFigures {
    /// Length through the cuts (m).
    pub length_m: f64,
    /// Root of the sum of squared second differences through the cuts (1/m); grows with their number.
    pub gamma_1pm: f64,
    /// Integral of squared curvature through the cuts (1/m).
    pub integral_kappa2_1pm: f64,
    /// Lap time through the cuts (s).
    pub lap_time_s: f64,
    /// Lap time on the fine spline (s).
    pub lap_time_fine_s: f64,
    /// Length on the fine spline (m).
    pub length_fine_m: f64,
    /// Integral of squared curvature on the fine spline (1/m).
    pub integral_kappa2_fine_1pm: f64,
    /// Least distance from the sides of the car to the edges (m).
    pub clearance_m: f64,
}

impl LineFigures {
    fn of(line: &ReportedLine) -> Self {
        Self {
            length_m: line.length_m,
            gamma_1pm: line.gamma_1pm,
            integral_kappa2_1pm: line.integral_kappa2_1pm,
            lap_time_s: line.lap_time_s,
            lap_time_fine_s: line.lap_time_fine_s(),
            length_fine_m: line.fine.length_m,
            integral_kappa2_fine_1pm: line.fine.integral_kappa2_1pm,
            clearance_m: line.clearance.margin_m,
        }
    }
}

/// The figures of a study; `--json` prints this.
#[derive(Clone, Debug, Serialize)]
pub struct Summary {
    /// `raceline`.
    pub study: &'static str,
    /// The track.
    pub track: String,
    /// The car, or the file of its envelope.
    pub car: String,
    /// Seed of all random numbers.
    pub seed: u64,
    /// `cpu`, `simd` or `gpu`.
    pub backend: &'static str,
    /// Instruction set, or name of the adapter.
    pub adapter: String,
    /// Driver of the adapter.
    pub driver: String,
    /// Exact solvers, swarms and local search (s).
    pub elapsed_s: f64,
    /// Swarms and local search (s).
    pub search_elapsed_s: f64,
    /// Exact solvers (s).
    pub exact_elapsed_s: f64,
    /// Lines evaluated by the swarms.
    pub evaluations: u64,
    /// Lines that failed, by reason.
    pub failures: FailureCounts,
    /// What went wrong with devices and was got over; the study's figures hold all the same.
    pub device_faults: Vec<String>,
    /// Lines per second of the search.
    pub evaluations_per_s: f64,
    /// Cuts across the track.
    pub sections: usize,
    /// Width of the car (m).
    pub car_width_m: f64,
    /// Whether the swarms started from known lines.
    pub warm_start: bool,
    /// Whether gradients finished what they found.
    pub local_search: bool,
    /// The best line by each objective.
    pub best: BTreeMap<&'static str, LineFigures>,
    /// What the swarm alone reached of each objective, in its unit.
    pub swarm: BTreeMap<&'static str, f64>,
    /// The exact solvers' lines; `null` where there is no solver.
    pub exact: BTreeMap<&'static str, Option<LineFigures>>,
    /// How the exact solver ended, in its own words; `null` where there is no solver.
    pub exact_status: BTreeMap<&'static str, Option<String>>,
    /// How much more the best line costs than the exact one, of each objective (%); lap times on the fine spline.
    pub above_exact_percent: BTreeMap<&'static str, Option<f64>>,
    /// The reference line.
    pub reference: LineFigures,
    /// The compromise of the front nearest to the ideal.
    pub compromise: Option<LineFigures>,
    /// Volume of the front as a share of the box from the ideal to the reference point.
    pub hypervolume: Option<f64>,
    /// The reference point, in the order of the objectives.
    pub hypervolume_reference: Option<Vec<f64>>,
    /// Lines on the front.
    pub front_size: usize,
    /// Best lines on which the car's side is more than 0.1 m beyond an edge, by the names of their objectives.
    pub off_road: Vec<&'static str>,
    /// What a reader must know before believing the figures.
    pub warnings: Vec<String>,
    /// Whether the study was broken off.
    pub interrupted: bool,
}

/// Puts the figures together.
pub fn summarise(settings: &RacelineSettings, setup: &Setup, outcome: &Outcome) -> Summary {
    let each = || outcome.objectives.iter().map(|o| (o.objective.name(), o));
    let elapsed_s = outcome.search_s + outcome.waited_s;
    Summary {
        study: "raceline",
        track: setup.track_name.clone(),
        car: setup.car_name.clone(),
        seed: settings.seed,
        backend: outcome.backend.backend,
        adapter: outcome.backend.device.clone(),
        driver: outcome.backend.driver.clone(),
        elapsed_s,
        search_elapsed_s: outcome.search_s,
        exact_elapsed_s: outcome.exact_s,
        evaluations: outcome.evaluations,
        failures: outcome.failures.clone(),
        device_faults: outcome.device_faults.clone(),
        evaluations_per_s: outcome.evaluations as f64 / outcome.search_s.max(1e-9),
        sections: setup.cuts.len(),
        car_width_m: settings.car_width_m,
        warm_start: settings.warm_start,
        local_search: settings.local_search,
        best: each().map(|(name, o)| (name, LineFigures::of(&o.best))).collect(),
        swarm: each().map(|(name, o)| (name, o.swarm_cost)).collect(),
        exact: each()
            .map(|(name, o)| (name, o.exact.as_ref().map(LineFigures::of)))
            .collect(),
        exact_status: each()
            .map(|(name, o)| (name, o.exact_status.as_ref().map(|(status, _)| status.clone())))
            .collect(),
        above_exact_percent: each()
            .map(|(name, o)| {
                let exact = o.exact.as_ref().map(|line| line.worth(o.objective));
                (name, exact.map(|e| 100.0 * (o.best.worth(o.objective) / e - 1.0)))
            })
            .collect(),
        reference: LineFigures::of(&outcome.reference),
        compromise: outcome.compromise.as_ref().map(LineFigures::of),
        hypervolume: outcome.front.as_ref().map(|f| f.hypervolume),
        hypervolume_reference: outcome.front.as_ref().map(|f| f.reference.clone()),
        front_size: outcome.front.as_ref().map_or(0, |f| f.alpha.len()),
        off_road: outcome
            .objectives
            .iter()
            .filter(|o| o.best.clearance.margin_m < -CLOSE_M)
            .map(|o| o.objective.name())
            .collect(),
        warnings: warnings(outcome),
        interrupted: outcome.interrupted,
    }
}

/// The lines that a study tells of, the reference line last.
fn told_lines(outcome: &Outcome) -> Vec<&ReportedLine> {
    let best = outcome.objectives.iter().map(|o| &o.best);
    best.chain(&outcome.compromise)
        .chain([&outcome.reference])
        .collect()
}

fn warnings(outcome: &Outcome) -> Vec<String> {
    let mut warnings = Vec::new();
    for line in told_lines(outcome) {
        let (coarse, fine) = (line.lap_time_s, line.lap_time_fine_s());
        if (fine / coarse - 1.0).abs() > COARSE_AND_FINE {
            warnings.push(format!(
                "{}: {coarse:.2} s through the cuts but {fine:.2} s on the spline between them; believe the latter, or \
                 ask for more --sections",
                line.name
            ));
        }
        if line.clearance.margin_m < -CLOSE_M {
            warnings.push(format!(
                "{}: the car's side is {:.2} m beyond the {} edge at {:.0} m",
                line.name,
                -line.clearance.margin_m,
                if line.clearance.left { "left" } else { "right" },
                line.clearance.station_m
            ));
        }
        if let Some(lap) = line.fine.lap.as_ref().filter(|lap| lap.beyond_lock > 0) {
            warnings.push(format!(
                "{}: steering beyond the lock at {} places",
                line.name, lap.beyond_lock
            ));
        }
    }
    warnings
}

/// How far beyond an edge is not worth a word (m): between cuts a spline bulges, and edges are straight there.
const CLOSE_M: f64 = 0.1;

impl Summary {
    /// What there is to say of best lines that leave the road, and what to do about it.
    pub fn off_road_text(&self) -> String {
        format!(
            "the best line by {} leaves the road between the cuts: {} of them are too few, ask for more --sections",
            self.off_road.join(", "),
            self.sections
        )
    }

    /// The figures in words.
    pub fn to_text(&self) -> String {
        let mut text = format!(
            "{} with the {}: {} sections, car {} m wide\n{:24}{:>10}{:>10}{:>12}{:>10}{:>10}{:>12}\n",
            self.track,
            self.car,
            self.sections,
            self.car_width_m,
            "line",
            "length m",
            "Gamma 1/m",
            "kappa2 1/m",
            "lap s",
            "fine s",
            "to exact %"
        );
        let mut row = |name: &str, f: &LineFigures, gap: Option<f64>| {
            text += &format!(
                "{name:24}{:>10.2}{:>10.4}{:>12.4}{:>10.3}{:>10.3}{:>12}\n",
                f.length_m,
                f.gamma_1pm,
                f.integral_kappa2_1pm,
                f.lap_time_s,
                f.lap_time_fine_s,
                gap.map_or(String::new(), |g| format!("{g:+.3}"))
            );
        };
        for (name, figures) in &self.best {
            row(
                &format!("best {name}"),
                figures,
                self.above_exact_percent.get(name).copied().flatten(),
            );
        }
        for (name, figures) in &self.exact {
            if let Some(figures) = figures {
                row(&format!("exact {name}"), figures, None);
            }
        }
        if let Some(figures) = &self.compromise {
            row("compromise", figures, None);
        }
        row("reference", &self.reference, None);
        if let Some(volume) = self.hypervolume {
            text += &format!("Front of {} lines, hypervolume {volume:.4}\n", self.front_size);
        }
        text += &format!(
            "{} lines evaluated in {:.1} s ({:.0} per second) on {} {}; exact solvers {:.1} s\n",
            self.evaluations,
            self.search_elapsed_s,
            self.evaluations_per_s,
            self.backend,
            self.adapter,
            self.exact_elapsed_s
        );
        if !self.failures.is_empty() {
            text += &format!("Lines that failed: {}\n", failures_in_words(&self.failures));
        }
        for fault in &self.device_faults {
            text += &format!("Note: {fault}\n");
        }
        for warning in &self.warnings {
            text += &format!("Note: {warning}\n");
        }
        text
    }
}

/// Writes the resolved settings into `folder`, as a study file that repeats the run.
///
/// # Errors
/// [`crate::Error::Io`] if it cannot be written.
pub fn write_settings(folder: &Path, settings: &RacelineSettings) -> Result<()> {
    write_study(folder, &settings.to_toml())
}

/// Writes all files of a run into `folder`.
///
/// # Errors
/// [`crate::Error::Io`] if one cannot be written.
pub fn write_results(
    folder: &Path,
    settings: &RacelineSettings,
    setup: &Setup,
    outcome: &Outcome,
    summary: &Summary,
) -> Result<()> {
    files::write(folder, settings, setup, outcome, summary)?;
    pictures::draw(folder, setup, outcome)?;
    surfaces::draw(folder, settings, setup, outcome)?;
    page::write(folder, settings, setup, outcome, summary)?;
    files::write_manifest(folder, settings, setup, outcome)
}
