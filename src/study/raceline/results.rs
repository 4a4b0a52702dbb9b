//! What a racing-line study leaves behind: figures for people and scripts, lines, pictures.

mod files;
mod page;
mod surfaces;

use super::{Outcome, RacelineSettings, ReportedLine, Setup};
use crate::error::Result;
use crate::evaluate::failures_in_words;
use crate::study::framework::RunRecord;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;

/// Where the lap time through the cross-sections and the one on the fine spline differ by more than this share, the study says so.
const COARSE_AND_FINE: f64 = 0.003;

/// The figures of one line.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct LineFigures {
    /// Length through the cross-sections (m).
    pub length_m: f64,
    /// Root of the sum of squared second differences through the cross-sections (1/m); grows with their number.
    pub gamma_1pm: f64,
    /// Integral of squared curvature through the cross-sections (1/m).
    pub integral_kappa2_1pm: f64,
    /// Lap time through the cross-sections (s).
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
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Summary {
    /// `raceline`.
    pub study: String,
    /// The track.
    pub track: String,
    /// The car, or the file of its envelope.
    pub car: String,
    /// Seed of all random numbers.
    pub seed: u64,
    /// How the study ran.
    #[serde(flatten)]
    pub record: RunRecord,
    /// Swarms and local search (s).
    pub search_elapsed_s: f64,
    /// Solvers of reference optima (s).
    pub exact_elapsed_s: f64,
    /// Cross-sections of the track.
    pub sections: usize,
    /// Width of the car (m).
    pub car_width_m: f64,
    /// Whether the swarms started from known lines.
    pub warm_start: bool,
    /// Whether gradients finished what they found.
    pub local_search: bool,
    /// The best line by each objective.
    pub best: BTreeMap<String, LineFigures>,
    /// What the swarm alone reached of each objective, in its unit.
    pub swarm: BTreeMap<String, f64>,
    /// The reference optima; `null` where there is no solver.
    pub exact: BTreeMap<String, Option<LineFigures>>,
    /// How their solver ended, in its own words; `null` where there is no solver.
    pub exact_status: BTreeMap<String, Option<String>>,
    /// How much more the best line costs than the reference optimum, of each objective (%); lap times on the fine spline.
    pub above_exact_percent: BTreeMap<String, Option<f64>>,
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
    pub off_road: Vec<String>,
    /// What a reader must know before believing the figures.
    pub warnings: Vec<String>,
}

/// Puts the figures together.
pub(super) fn summarise(settings: &RacelineSettings, setup: &Setup, outcome: &Outcome) -> Summary {
    let each = || {
        outcome
            .objectives
            .iter()
            .map(|o| (o.objective.name().to_owned(), o))
    };
    Summary {
        study: "raceline".to_owned(),
        track: setup.track_name.clone(),
        car: setup.car_name.clone(),
        seed: settings.seed,
        record: outcome.record.clone(),
        search_elapsed_s: outcome.search_s,
        exact_elapsed_s: outcome.exact_s,
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
            .map(|o| o.objective.name().to_owned())
            .collect(),
        warnings: warnings(outcome),
    }
}

/// The lines that a study tells of, the reference line last.
fn reported_lines(outcome: &Outcome) -> Vec<&ReportedLine> {
    let best = outcome.objectives.iter().map(|o| &o.best);
    best.chain(&outcome.compromise)
        .chain([&outcome.reference])
        .collect()
}

fn warnings(outcome: &Outcome) -> Vec<String> {
    let mut warnings = Vec::new();
    for line in reported_lines(outcome) {
        let (coarse, fine) = (line.lap_time_s, line.lap_time_fine_s());
        if (fine / coarse - 1.0).abs() > COARSE_AND_FINE {
            warnings.push(format!(
                "{}: {coarse:.2} s at the cross-sections but {fine:.2} s on the spline through them: believe the latter, \
                 or ask for more sections",
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

/// How far beyond an edge is not worth a word (m): between cross-sections a spline bulges, and edges are straight there.
const CLOSE_M: f64 = 0.1;

impl Summary {
    /// What there is to say of best lines that leave the road, and what to do about it.
    pub fn off_road_text(&self) -> String {
        format!(
            "the best line by {} leaves the road between the cross-sections: {} are too few, ask for more sections",
            self.off_road.join(", "),
            self.sections
        )
    }

    /// The figures in words.
    pub fn to_text(&self) -> String {
        let record = &self.record;
        let mut text = format!(
            "{} with the {}: {} sections, car {} m wide\n{}",
            self.track,
            self.car,
            self.sections,
            self.car_width_m,
            page::lines_table(self).first(7).to_text()
        );
        if let Some(volume) = self.hypervolume {
            text += &format!("Front of {} lines, hypervolume {volume:.4}\n", self.front_size);
        }
        text += &format!(
            "{} lines evaluated in {:.1} s ({:.0} per second) on {}; reference optima {:.1} s\n",
            record.evaluations,
            self.search_elapsed_s,
            record.evaluations_per_s,
            record.device(),
            self.exact_elapsed_s
        );
        if !record.failures.is_empty() {
            text += &format!("Lines that failed: {}\n", failures_in_words(&record.failures));
        }
        text += &record.notes();
        for warning in &self.warnings {
            text += &format!("Note: {warning}\n");
        }
        text
    }
}

/// Writes lines, fronts, figures and the page into `folder`.
///
/// # Errors
/// [`crate::Error::Io`] if one cannot be written.
pub(super) fn report(
    folder: &Path,
    settings: &RacelineSettings,
    setup: &Setup,
    outcome: &Outcome,
    summary: &Summary,
) -> Result<()> {
    files::write(folder, setup, outcome)?;
    page::write(folder, settings, setup, outcome, summary)
}
