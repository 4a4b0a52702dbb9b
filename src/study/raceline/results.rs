//! What a racing-line study leaves behind: figures for people and scripts, lines, pictures.

mod page;
pub(super) mod sectors;
mod setups;

pub(super) use page::write as write_page;
pub use sectors::SectorFigures;
pub use setups::{ParameterWorth, SetupFigures, SetupsSummary};

use super::{Outcome, Raceline, ReportedLine, Setup};
use crate::error::Result;
use crate::evaluate::line::LineObjective;
use crate::report::{Table, write_whole};
use crate::study::framework::{Head, Solved};
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
    /// Least distance from the car, with the margin about it, to the edges (m).
    pub clearance_m: f64,
    /// Distance along the line where that is (m).
    pub clearance_station_m: f64,
    /// The fastest turn of the front wheels on the fine spline (deg/s), without regard to the side of the bend.
    pub steering_rate_deg_s: f64,
}

impl LineFigures {
    fn of(line: &ReportedLine) -> Self {
        Self {
            length_m: line.objective(LineObjective::Length),
            gamma_1pm: line.objective(LineObjective::Gamma),
            integral_kappa2_1pm: line.objective(LineObjective::Kappa2),
            lap_time_s: line.objective(LineObjective::LapTime),
            lap_time_fine_s: line.lap_time_fine_s(),
            length_fine_m: line.fine.length_m,
            integral_kappa2_fine_1pm: line.fine.integral_kappa2_1pm,
            clearance_m: line.clearance.margin_m,
            clearance_station_m: line.clearance.station_m,
            steering_rate_deg_s: line
                .fine
                .lap
                .as_ref()
                .map_or(0.0, |lap| lap.steering_rate_radps().to_degrees()),
        }
    }
}

/// The figures of a study; `--json` prints this.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Summary {
    /// The study; the car may be the file of its envelope.
    #[serde(flatten)]
    pub head: Head,
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
    /// How their solver ended, in plain words; `null` where there is no solver.
    pub exact_status: BTreeMap<String, Option<String>>,
    /// What the solver says may be left to gain of each objective (%): down to its lower bound for `length`, `length_squared` and `gamma`,
    /// and for the others what its last cone program promised, of which steps keep a part.
    #[serde(default)]
    pub exact_left_percent: BTreeMap<String, Option<f64>>,
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
    /// Set-ups of the car with their own fastest lines; `null` where none are asked for.
    #[serde(default)]
    pub setups: Option<SetupsSummary>,
    /// The sectors of the best line, where it was looked for in several.
    #[serde(default)]
    pub sectors: Vec<SectorFigures>,
    /// Best lines on which the car is more than a centimetre beyond an edge, by the names of their objectives: only a study that
    /// was interrupted has any.
    pub off_road: Vec<String>,
    /// What a reader must know before believing the figures.
    pub warnings: Vec<String>,
}

/// Puts the figures together.
pub(super) fn summarise(solved: &Solved<'_, Raceline>) -> Summary {
    let (settings, outcome) = (solved.settings, solved.outcome);
    let objectives = || outcome.objectives.iter();
    let each = || objectives().map(|o| (o.objective.name().to_owned(), o));
    let front = outcome.front.as_ref();
    Summary {
        head: solved.head(),
        search_elapsed_s: outcome.search_s,
        exact_elapsed_s: outcome.exact_s,
        sections: solved.prepared.cross_sections.len(),
        car_width_m: settings.car_width_m,
        warm_start: settings.starts_warm(),
        local_search: settings.searches_locally(),
        best: each().map(|(name, o)| (name, LineFigures::of(&o.best))).collect(),
        swarm: each().map(|(name, o)| (name, o.swarm_cost)).collect(),
        exact: each()
            .map(|(name, o)| (name, o.exact.as_ref().map(LineFigures::of)))
            .collect(),
        exact_status: each().map(|(name, o)| (name, o.exact_status.clone())).collect(),
        exact_left_percent: each()
            .map(|(name, o)| (name, o.exact_left.map(|left| 100.0 * left)))
            .collect(),
        above_exact_percent: each()
            .map(|(name, o)| {
                let exact = o.exact.as_ref().map(|line| line.worth(o.objective));
                (name, exact.map(|e| 100.0 * (o.best.worth(o.objective) / e - 1.0)))
            })
            .collect(),
        reference: LineFigures::of(&outcome.reference),
        compromise: outcome.compromise.as_ref().map(LineFigures::of),
        hypervolume: front.map(|f| f.hypervolume),
        hypervolume_reference: front.map(|f| f.reference.clone()),
        front_size: front.map_or(0, |f| f.alpha.len()),
        setups: outcome
            .setups
            .as_ref()
            .map(|found| setups::summarise(found, settings.share)),
        sectors: outcome
            .objectives
            .first()
            .map_or_else(Vec::new, |o| sectors::of(settings, solved.prepared, &o.best)),
        off_road: objectives()
            .filter(|o| !o.best.clearance.is_on_road())
            .map(|o| o.objective.name().to_owned())
            .collect(),
        warnings: bridges(solved.prepared)
            .into_iter()
            .chain(unused_drs(solved.prepared))
            .chain(solved.prepared.surface_notes())
            .chain(warnings(outcome))
            .collect(),
    }
}

/// A word on each bridge.
fn bridges(setup: &Setup) -> Vec<String> {
    let crossed = setup.road.bridges().into_iter();
    crossed
        .map(|[a, b]| format!("the road crosses itself at {a:.0} m and {b:.0} m: taken as a bridge"))
        .collect()
}

/// A word on a DRS that opens nowhere.
fn unused_drs(setup: &Setup) -> Option<String> {
    let unused = setup.car.envelope.open().is_some() && setup.cross_sections.drs.is_empty();
    unused.then(|| {
        "the car has a DRS, and the track names no drs_zones where it may be open: it stays shut".to_owned()
    })
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
        let (coarse, fine) = (line.objective(LineObjective::LapTime), line.lap_time_fine_s());
        if (fine / coarse - 1.0).abs() > COARSE_AND_FINE {
            warnings.push(format!(
                "{}: {coarse:.2} s at the cross-sections but {fine:.2} s on the spline through them: believe the latter, \
                 or ask for more sections",
                line.name
            ));
        }
        if !line.clearance.is_on_road() {
            warnings.push(format!(
                "{}: the car is {:.2} m beyond {}",
                line.name,
                -line.clearance.margin_m,
                line.clearance.place()
            ));
        }
        if let Some(share) = line.gave_way {
            warnings.push(format!(
                "{}: it left the road between the cross-sections, and gave way by {:.0} % of the way to the reference line",
                line.name,
                100.0 * share
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

impl Summary {
    /// The figures in words.
    pub fn to_text(&self) -> String {
        let record = &self.head.record;
        let mut text = format!(
            "{}: {} sections, car {} m wide\n{}",
            self.head.subject.words(),
            self.sections,
            self.car_width_m,
            page::lines_table(self).first(7).to_text()
        );
        for (name, line) in &self.best {
            text += &format!(
                "Least clearance of the best line by {name}: {:.3} m at {:.0} m\n",
                line.clearance_m, line.clearance_station_m
            );
        }
        if let Some(words) = sectors::words(&self.sectors) {
            text += &format!("{words}\n");
        }
        if let Some(volume) = self.hypervolume {
            text += &format!("Front of {} lines, hypervolume {volume:.4}\n", self.front_size);
        }
        if let Some(setups) = &self.setups {
            text += &setups.to_text();
        }
        text += &format!(
            "{} lines evaluated in {:.1} s ({:.0} per second) on {}; reference optima {:.1} s\n",
            record.evaluations,
            self.search_elapsed_s,
            record.evaluations_per_s,
            record.device(),
            self.exact_elapsed_s
        );
        text + &record.ending("Lines", &self.warnings)
    }
}

/// Writes the envelope, the lines and the front into `folder`.
///
/// # Errors
/// [`crate::Error::Io`] if one cannot be written.
pub(super) fn write_files(folder: &Path, setup: &Setup, outcome: &Outcome) -> Result<()> {
    let envelope = setup.car.envelope.to_csv();
    write_whole(folder.join("envelope.csv"), envelope.as_bytes())?;
    for line in reported_lines(outcome) {
        let name = line.stem();
        write_line(&folder.join(format!("line_{name}.csv")), setup, line)?;
        // Replaces what an interrupted run has left, since it is resumed in the same folder.
        let racetrack = setup.racetrack_csv(line);
        write_whole(folder.join(format!("racetrack_{name}.csv")), racetrack.as_bytes())?;
    }
    write_front(folder, outcome)
}

/// The line on its fine spline: station, place, alpha, curvature, speed, accelerations, steering, time, the gear that gives most
/// (from 1) where there is a gearbox, and the share of the grip that is used. Where the DRS is open anywhere, 1 says where. On a road
/// that is not level and dry height, sine of the gradient, banking, friction and load over mass follow.
fn write_line(path: &Path, setup: &Setup, line: &ReportedLine) -> Result<()> {
    let fine = &line.fine;
    let (x, y): (Vec<f64>, Vec<f64>) = fine.points_m.iter().map(|p| (p.x, p.y)).unzip();
    let mut table = Table::new()
        .numbers("station", "m", &fine.station_m)
        .numbers("x", "m", x)
        .numbers("y", "m", y)
        .numbers("alpha", "-", fine.between(&line.alpha))
        .numbers("curvature", "1/m", &fine.curvature_1pm);
    if let Some(lap) = &fine.lap {
        table = table
            .numbers("v", "m/s", &lap.v_mps)
            .numbers("ax", "m/s^2", &lap.ax_mps2)
            .numbers("ay", "m/s^2", &lap.ay_mps2)
            .numbers("steering", "rad", &lap.steering_rad)
            .numbers("time", "s", lap.elapsed_s());
        if let Some(gear) = setup.gears(&lap.v_mps) {
            table = table.numbers("gear", "-", gear);
        }
        table = table.numbers("grip_used", "-", lap.grip_used(&setup.car));
    }
    if let Some(lap) = fine.lap.as_ref().filter(|lap| lap.drs_open.contains(&true)) {
        let last = lap.drs_open.last().filter(|_| !fine.closed);
        let open = lap
            .drs_open
            .iter()
            .chain(last)
            .map(|open| f64::from(u8::from(*open)));
        table = table.numbers("drs", "-", open.collect::<Vec<f64>>());
    }
    if let Some(relief) = &fine.relief {
        let mut gradient = relief.gradient.clone();
        // An open line ends with the gradient that leads to its end.
        gradient.extend(relief.gradient.last().filter(|_| !fine.closed).copied());
        let figure = |k: usize| relief.surface.iter().map(|s| s[k]).collect::<Vec<f64>>();
        table = table
            .numbers("z", "m", figure(0))
            .numbers("gradient", "-", gradient)
            .numbers("bank", "rad", figure(1))
            .numbers("friction", "-", figure(2));
        if let Some(lap) = &fine.lap {
            let load: Vec<f64> = lap.forces_mps2.iter().map(|forces| forces[2]).collect();
            table = table.numbers("load", "m/s^2", load);
        }
    }
    table.write_csv(path)
}

/// Objectives of the front's lines, and their `alpha` at every cross-section.
fn write_front(folder: &Path, outcome: &Outcome) -> Result<()> {
    let Some(front) = outcome.front.as_ref().filter(|f| !f.alpha.is_empty()) else {
        return Ok(());
    };
    let objectives = outcome.objectives.iter().map(|o| o.objective);
    let objectives = Table::rows(&front.objectives).each(objectives.map(|o| (o.name(), o.unit())));
    objectives.table().write_csv(folder.join("front.csv"))?;
    let alphas = (0..front.alpha[0].len()).map(|i| (format!("alpha_{i}"), "-"));
    let lines = Table::rows(&front.alpha).each(alphas);
    lines.table().write_csv(folder.join("front_lines.csv"))
}
