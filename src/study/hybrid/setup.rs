//! Track, car and line.

use super::settings::HybridStudySettings;
use crate::config::settings::Settings;
use crate::error::{Error, Result};
use crate::evaluate::energy::{HybridLine, HybridObjective, HybridProblem, Strategy};
use crate::evaluate::line::LineObjective;
use crate::line::energy::{EnergyCar, EnergyPlan, GAP_M, Gates, Mode, hybrid_parts, late_bend};
use crate::line::{FineLine, read_line_apart};
use crate::study::raceline;
use crate::track::{CrossSections, Surface};
use crate::vehicle::{Car, Traction};
use glam::DVec2;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Metres of the reference line for each control point of free lines.
const CONTROL_SPACING_M: f64 = 40.0;

/// Control points of lines across these cross-sections.
pub(super) fn control_points(cross_sections: &CrossSections) -> usize {
    ((cross_sections.length_m / CONTROL_SPACING_M) as usize).clamp(4, cross_sections.len().max(4))
}

/// Everything that laps are driven with.
#[derive(Clone, Debug)]
pub struct HybridSetup {
    /// Track and limits as racing lines know them.
    pub raceline: raceline::Setup,
    /// The car with its energy.
    pub car: EnergyCar,
    /// What the line is, in words.
    pub line_name: String,
    /// Share of the usable width at every cross-section, where the line was found here.
    pub alpha: Option<Vec<f64>>,
    /// Points of the line (m).
    pub points_m: Vec<DVec2>,
    /// Length of the line (m).
    pub length_m: f64,
    /// Whether it is closed.
    pub closed: bool,
    /// Whether the DRS may be open from each point to the next; nowhere if empty.
    pub drs: Vec<bool>,
    /// The surface at each point; empty on a level and dry road.
    pub surface: Vec<Surface>,
    /// The sharpest bend late in the lap.
    pub run_in: usize,
    /// Greatest speed at the start of an open line (m/s).
    pub entry_mps: f64,
}

/// Track, car and limits as they are read; the line may be still to be found.
#[derive(Clone, Debug)]
pub struct HybridInputs {
    /// Track and limits as racing lines know them.
    pub raceline: raceline::Setup,
    /// The car.
    pub car: EnergyCar,
    /// The points of a line that is given (m).
    pub given: Option<Vec<DVec2>>,
}

/// Reads all that the settings name: the car, the line where one is given, track and limits. What is least work comes first, so
/// that a mistake shows at once.
///
/// # Errors
/// [`Error::Input`] and [`Error::Io`] for what cannot be read or used, such as a car without a hybrid drive.
pub fn read_inputs(settings: &HybridStudySettings) -> Result<HybridInputs> {
    settings.validate()?;
    let mut car = Car::load(&settings.car)?;
    hybrid_parts(&car)?;
    if settings.store_overflow {
        car.hybrid = car.hybrid.map(|hybrid| hybrid.with_overflow());
    }
    let read = |path: &PathBuf| read_line_apart(path, settings.spacing_m);
    let given = settings.line.as_ref().map(read).transpose()?;
    let raceline_settings = settings.raceline();
    let raceline = raceline::set_up(&raceline_settings)?;
    let traction = Traction::of(&car, &raceline.car.envelope);
    let car = EnergyCar::of(car, raceline.car.clone(), traction)?;
    if let Some(points) = &given {
        // As it will be driven, so that what is no line is refused before anything is begun.
        let closed = raceline.cross_sections.closed;
        FineLine::new(points, closed, settings.spacing_m, None, settings.entry_mps)?;
    }
    Ok(HybridInputs { raceline, car, given })
}

impl HybridInputs {
    /// The most variables of a strategy and a line on this track.
    pub(super) fn variables(&self) -> usize {
        let zones = (self.raceline.cross_sections.length_m / GAP_M).ceil() as usize;
        // The motor's power is one more.
        zones + control_points(&self.raceline.cross_sections) + 1
    }

    /// All that laps are driven with. The line is found if none is given; nothing if `stop` was raised before it was found.
    ///
    /// # Errors
    /// [`Error::Study`] if the solver of the fastest line refuses.
    pub fn with_line(
        &self,
        settings: &HybridStudySettings,
        stop: &Arc<AtomicBool>,
    ) -> Result<Option<HybridSetup>> {
        let Self { raceline, car, given } = self.clone();
        let closed = raceline.cross_sections.closed;
        let (line_name, alpha, through) = match (&settings.line, given) {
            (Some(path), Some(points)) => (path.display().to_string(), None, points),
            _ => {
                let found = raceline
                    .solvers(&settings.raceline(), stop)?
                    .best(LineObjective::LapTime)?;
                if stop.load(Ordering::Relaxed) {
                    return Ok(None);
                }
                let Some(found) = found else {
                    return Err(Error::Study("there is no solver for the fastest line".to_owned()));
                };
                let Some(alpha) = raceline.brought_in(&found.alpha, &settings.raceline())? else {
                    let text = "the fastest line leaves the road between the cross-sections: ask for more with --sections";
                    return Err(Error::Study(text.to_owned()));
                };
                let points = raceline.cross_sections.points(&alpha);
                ("fastest".to_owned(), Some(alpha), points)
            }
        };
        let cross_sections = &raceline.cross_sections;
        let given = match alpha {
            Some(_) => cross_sections.relief_of(&through),
            None => cross_sections.relief_along(&through),
        };
        let (spacing_m, entry_mps) = (settings.spacing_m, settings.entry_mps);
        let fine = FineLine::on(&through, given.as_deref(), closed, spacing_m, None, entry_mps)?;
        Ok(Some(HybridSetup {
            drs: cross_sections.drs_along(&fine.points_m),
            surface: fine.relief.map_or(Vec::new(), |relief| relief.surface),
            run_in: late_bend(&fine.curvature_1pm),
            length_m: fine.length_m,
            points_m: fine.points_m,
            closed,
            car,
            line_name,
            alpha,
            entry_mps: settings.entry_mps,
            raceline,
        }))
    }
}

/// Reads track and car and finds the line.
///
/// # Errors
/// Those of [`read_inputs`] and [`HybridInputs::with_line`].
pub fn set_up(settings: &HybridStudySettings) -> Result<HybridSetup> {
    let found = read_inputs(settings)?.with_line(settings, &Arc::default())?;
    found.ok_or_else(|| Error::Study("the search for the line was interrupted".to_owned()))
}

impl HybridSetup {
    /// The problem of laps on the line, which stays as it is.
    ///
    /// # Errors
    /// Those of [`HybridProblem::new`].
    pub fn problem(
        &self,
        plan: EnergyPlan<f64>,
        strategy: Strategy,
        objectives: &[HybridObjective],
    ) -> Result<HybridProblem> {
        let line = HybridLine::Fixed {
            points_m: self.points_m.clone(),
            closed: self.closed,
            drs: self.drs.clone(),
            surface: self.surface.clone(),
        };
        HybridProblem::new(line, self.car.clone(), plan, strategy, objectives, self.entry_mps)
    }

    /// The same with gates that hold for the whole lap.
    ///
    /// # Errors
    /// As [`HybridSetup::problem`].
    pub fn gated(&self, mode: Mode, gates: Gates) -> Result<HybridProblem> {
        let plan = EnergyPlan::whole(self.points_m.len(), self.run_in, mode);
        self.problem(plan, Strategy::fixed(gates, 1), &[HybridObjective::LapTime])
    }

    /// The same with a strategy of every segment by itself, the motor beside the engine.
    ///
    /// # Errors
    /// As [`HybridSetup::problem`].
    pub fn by_segment(&self, strategy: Strategy) -> Result<HybridProblem> {
        let plan = EnergyPlan::single(self.points_m.len(), self.run_in, Mode::Additional);
        self.problem(plan, strategy, &[HybridObjective::LapTime])
    }

    /// What may be deployed in a lap (J): of what is asked for, the rules and a full store the least.
    pub fn budget_j(&self, asked_mj: Option<f64>) -> f64 {
        let hybrid = &self.car.hybrid;
        let rules = hybrid.rules.deployed_on(self.length_m).unwrap_or(f64::INFINITY);
        let store = hybrid.store.capacity_j * hybrid.store.start_soc;
        asked_mj.map_or(rules.min(store), |mj| 1e6 * mj)
    }
}
