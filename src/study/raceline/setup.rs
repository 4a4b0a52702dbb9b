//! The track, the car and lines as a study reports them.

use super::settings::RacelineSettings;
use crate::config::settings::Settings;
use crate::error::{Error, Result};
use crate::evaluate::Evaluator;
use crate::evaluate::line::{CpuLineEvaluator, LineObjective, LineProblem};
use crate::line::{Clearance, FineLine, Parametrisation, PointMass, RoadEdges, TERMS, fine_m, scale_of};
use crate::optimum::{ReferenceSolvers, mended};
use crate::study::framework::Plan;
use crate::track::{CrossSections, Track, racetrack_csv};
use crate::vehicle::limits::{SpeedRange, car_envelope, car_envelope_under_loads};
use crate::vehicle::powertrain::Powertrain;
use crate::vehicle::{Car, Envelope};
use glam::DVec2;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// Waves of a survey's reference line that are shorter than this are noise (m), on long laps: the tightest bend of a road is longer.
const REFERENCE_M: f64 = 60.0;
/// Cross-sections that tell the length of a track.
const FEW: usize = 960;
/// Distance between the points of the edges that lines are held within (m), on long laps: an edge of 10 m radius is straight to a
/// centimetre.
const EDGE_M: f64 = 1.0;

/// The track and the car, ready for lines.
#[derive(Clone, Debug)]
pub struct Setup {
    /// Title of the track.
    pub track_name: String,
    /// The cross-sections from edge to edge.
    pub road: CrossSections,
    /// The cross-sections that the car's middle may use.
    pub cross_sections: CrossSections,
    /// The edges at close steps (m), right and left, which no cross-section has a part in.
    pub edges_m: [Vec<DVec2>; 2],
    /// The car.
    pub car: PointMass,
    /// Its name.
    pub car_name: String,
    /// Its gearbox and the rolling radius of the driven wheels (m), where the limits are its own.
    pub gearbox: Option<(Powertrain, f64)>,
}

/// Reads track and car.
///
/// # Errors
/// [`Error::Input`] and [`Error::Io`] for what cannot be read or used.
pub fn set_up(settings: &RacelineSettings) -> Result<Setup> {
    settings.validate()?;
    let track = Track::load(&settings.track)?;
    let few = track.cross_sections(FEW, settings.as_surveyed)?;
    let sections = settings.sections_on(few.length_m);
    settings.check_sectors_of(sections)?;
    let scale = scale_of(few.length_m);
    let road = track
        .cross_sections(sections, settings.as_surveyed)?
        .with_smooth_reference(scale * REFERENCE_M);
    let cut = |step_m: f64| {
        let close = ((road.length_m / step_m).ceil() as usize).clamp(sections, 1_000_000);
        track.cross_sections(close, settings.as_surveyed)
    };
    // Inside a bend that is hardly wider than its road, cross-sections may be too close to one another to be turned apart.
    let dense = cut(scale * EDGE_M)
        .or_else(|_| cut(EDGE_M))
        .or_else(|_| cut(2.0 * EDGE_M))?;
    let close = dense.len();
    let (road, dense) = match &settings.section {
        Some(name) => {
            let (first_m, length_m) = road.section_named(name)?;
            let stretch = road.stretch_from(first_m, length_m, 0)?;
            if stretch.len() < TERMS {
                let found = format!("{sections}, of which {} lie in {name}", stretch.len());
                let expected = format!("so many that at least {TERMS} lie in it");
                return Err(Error::input("the study", "sections", found, expected));
            }
            // The edges reach past the stretch's own ends, wherever its cross-sections have put these.
            let from_m = road.station_m[road.first_from(first_m)];
            let edges = dense.stretch_from(from_m - road.length_m / close as f64, stretch.length_m, 3)?;
            (stretch, edges)
        }
        None => (road, dense),
    };
    let plan = settings.plan_with_margin();
    let mut cross_sections = road.narrowed(plan.width_m)?;
    RoadEdges::new(&dense.right_m, &dense.left_m, dense.closed).draw_in(&mut cross_sections, plan.width_m);
    let car = Car::load(&settings.car)?;
    let (envelope, car_name) = match &settings.envelope {
        Some(path) => (Envelope::load(path)?, path.display().to_string()),
        None => (envelope_on(&road, &car)?, car.name.clone()),
    };
    let gearbox = car.powertrain.clone().filter(|_| settings.envelope.is_none());
    let gearbox = gearbox.map(|powertrain| (powertrain, car.chassis.radius_rear));
    let car = point_mass(&road, &car, envelope, settings)?;
    Ok(Setup {
        track_name: track.name(),
        road,
        cross_sections,
        edges_m: [dense.right_m, dense.left_m],
        car,
        car_name,
        gearbox,
    })
}

/// A car's own envelope on a road. On a level road its weight is the only load.
///
/// # Errors
/// Those of [`car_envelope`].
pub(super) fn envelope_on(road: &CrossSections, car: &Car) -> Result<Envelope> {
    let limits = match &road.relief {
        Some(relief) if !relief.is_level() => car_envelope_under_loads(car, &SpeedRange::of(car))?,
        _ => car_envelope(car, &SpeedRange::of(car))?,
    };
    Ok(limits.envelope)
}

/// The point mass of a car within an envelope on a road.
///
/// # Errors
/// Those of [`PointMass::check`].
pub(super) fn point_mass(
    road: &CrossSections,
    car: &Car,
    envelope: Envelope,
    settings: &RacelineSettings,
) -> Result<PointMass> {
    let wheelbase = car.chassis.cg_to_front + car.chassis.cg_to_rear;
    let car = PointMass {
        ellipse_exponent: settings.ellipse_exponent,
        max_steer_rad: Some(car.max_steer_rad),
        max_steer_rate_radps: Some(
            settings
                .steering_rate_deg_s
                .map_or(car.max_steer_rate_radps, f64::to_radians),
        ),
        rotating_mass_factor: car.rotating_mass_factor(),
        relief: road.relief.is_some(),
        ..PointMass::new(envelope, wheelbase)
    };
    car.check()?;
    Ok(car)
}

/// Says that the track and the car's g-g-v envelope were read.
pub fn road_read(plan: Plan, setup: &Setup) -> Plan {
    let (road, envelope) = (&setup.road, &setup.car.envelope);
    plan.reads(format!(
        "track {}, {:.1} m, {} cross-sections",
        setup.track_name,
        road.length_m,
        road.len()
    ))
    .reads(format!(
        "g-g-v envelope of {} at {} speeds up to {:.1} m/s",
        setup.car_name,
        envelope.rows().len(),
        envelope.top_speed_mps()
    ))
}

/// One line with everything that is reported of it.
#[derive(Clone, Debug)]
pub struct ReportedLine {
    /// What it is, as in `shortest`.
    pub name: String,
    /// Share of the usable width from the right at every cross-section.
    pub alpha: Vec<f64>,
    /// What each objective comes to through the cross-sections, in the order of [`LineObjective::ALL`].
    pub at_cross_sections: Vec<f64>,
    /// The line on the fine spline, with its lap.
    pub fine: FineLine,
    /// How close the car comes to the edges.
    pub clearance: Clearance,
    /// Share of the way to the reference line by which it gave way, where it left the road so far that bending did not help.
    pub gave_way: Option<f64>,
}

impl ReportedLine {
    /// What its files are named after, as in `line_fastest.csv`. Scripts read `line_least_curved.csv`.
    pub fn stem(&self) -> String {
        if self.name == LineObjective::Kappa2.line_name() {
            return "least_curved".to_owned();
        }
        crate::files::stem(&self.name)
    }

    /// Lap time on the fine spline (s): the one to believe.
    pub fn lap_time_fine_s(&self) -> f64 {
        self.fine.lap_time_s().unwrap_or(f64::NAN)
    }

    /// What an objective comes to where lines are compared: lap times on the fine spline, so that no line wins by zigzag
    /// between the cross-sections, the others through the cross-sections.
    pub fn worth(&self, objective: LineObjective) -> f64 {
        match objective {
            LineObjective::LapTime => self.lap_time_fine_s(),
            _ => self.objective(objective),
        }
    }

    /// What an objective comes to through the cross-sections.
    pub fn objective(&self, objective: LineObjective) -> f64 {
        self.at_cross_sections[objective as usize]
    }

    /// Whether this line is the better one by an objective. Any line on the road is better than one that leaves it.
    pub fn betters(&self, other: &Self, objective: LineObjective) -> bool {
        let rank = |line: &Self| (!line.clearance.is_on_road(), line.worth(objective));
        rank(self) < rank(other)
    }
}

/// Shares of the way to the reference line by which a line gives way that bending does not bring onto the road.
const TOWARDS_REFERENCE: [f64; 6] = [0.0025, 0.005, 0.01, 0.02, 0.04, 0.08];
/// The same for the line of a swarm alone, which may zigzag from cross-section to cross-section, and for a line that nothing else brings
/// onto the road.
const FAR_TOWARDS_REFERENCE: [f64; 3] = [0.16, 0.32, 0.64];

/// The gear that gives most (from 1) at each speed (m/s), on driven wheels of a radius (m); the top gear beyond the last engine speed.
pub(in crate::study) fn best_gears(powertrain: &Powertrain, radius_m: f64, v_mps: &[f64]) -> Vec<f64> {
    let top = powertrain.gear_ratios.len();
    let gear = |v: &f64| powertrain.gear(*v, radius_m).map_or(top, |gear| gear.index + 1) as f64;
    v_mps.iter().map(gear).collect()
}

impl Setup {
    /// The problem of lines through the cross-sections that are given `way`.
    ///
    /// # Errors
    /// Those of [`LineProblem::new`].
    pub fn problem(
        &self,
        way: Parametrisation,
        objectives: &[LineObjective],
        settings: &RacelineSettings,
    ) -> Result<LineProblem> {
        self.problem_on(self.cross_sections.clone(), way, objectives, settings)
    }

    /// The problem of lines through other cross-sections, such as those of a sector.
    ///
    /// # Errors
    /// Those of [`LineProblem::new`].
    pub(super) fn problem_on(
        &self,
        cross_sections: CrossSections,
        way: Parametrisation,
        objectives: &[LineObjective],
        settings: &RacelineSettings,
    ) -> Result<LineProblem> {
        let car = Some(self.car.clone());
        LineProblem::new(cross_sections, way, objectives, car, settings.entry_mps)
    }

    /// The solvers of reference optima, ended by `stop`. Their fastest lines keep the car between the edges.
    ///
    /// # Errors
    /// Those of [`ReferenceSolvers::stopped_by`].
    pub fn solvers(&self, settings: &RacelineSettings, stop: &Arc<AtomicBool>) -> Result<ReferenceSolvers> {
        let solvers = ReferenceSolvers::stopped_by(
            &self.cross_sections,
            &self.car,
            settings.entry_mps,
            Arc::clone(stop),
        )?;
        Ok(solvers.kept_between(&self.edges_m, settings.plan_with_margin()))
    }

    /// A line's points at the cross-sections in the racetrack database's format, with the distances square to the line from it to
    /// the edges of the road.
    pub(super) fn racetrack_csv(&self, line: &ReportedLine) -> String {
        let (fine, n) = (&line.fine, line.fine.points_m.len());
        let edges = RoadEdges::new(&self.edges_m[0], &self.edges_m[1], fine.closed);
        let abreast = edges.abreast(&fine.points_m);
        let given = (0..n).filter(|&i| fine.section[i].1 == 0.0);
        let points: Vec<DVec2> = given.clone().map(|i| fine.points_m[i]).collect();
        let relief = self.cross_sections.relief_across_of(&points);
        let rows = given.map(|i| {
            let (before, after) = if fine.closed {
                ((i + n - 1) % n, (i + 1) % n)
            } else {
                (i.max(1) - 1, (i + 1).min(n - 1))
            };
            let leftward = (fine.points_m[after] - fine.points_m[before])
                .perp()
                .normalize_or_zero();
            let point = fine.points_m[i];
            let room = |way: DVec2, left: bool| {
                let nearest_m = edges.inside(point, abreast[i], left);
                // Beyond an edge there is none ahead.
                let ahead_m = edges.meets(point, way, abreast[i], left);
                ahead_m.filter(|_| nearest_m > 0.0).unwrap_or(nearest_m)
            };
            (point, room(-leftward, false), room(leftward, true))
        });
        racetrack_csv(rows, relief.as_deref())
    }

    /// What is left out of a road that is not level and dry, in words.
    pub(in crate::study) fn surface_notes(&self) -> Vec<String> {
        let Some(relief) = &self.road.relief else {
            return Vec::new();
        };
        if relief.is_level() {
            return Vec::new();
        }
        let mut words = vec![
            "the road has height or banking: laps are those of three dimensions, lengths and curvatures those of the map"
                .to_owned(),
        ];
        if self.car.envelope.loads().is_empty() {
            words.push(
                "the table of limits was not swept under loads: on crests, in dips and on banked road its grip goes with the load"
                    .to_owned(),
            );
        }
        words
    }

    /// The gear that gives most (from 1) at each speed (m/s), of a car whose limits are its own.
    pub fn gears(&self, v_mps: &[f64]) -> Option<Vec<f64>> {
        let (powertrain, radius_m) = self.gearbox.as_ref()?;
        Some(best_gears(powertrain, *radius_m, v_mps))
    }

    /// The line on its fine spline, and the clearance of the car with its margin on both sides at every point (m).
    fn measured(&self, alpha: &[f64], settings: &RacelineSettings) -> Result<(FineLine, Vec<[f64; 2]>)> {
        let cross_sections = &self.cross_sections;
        let points = cross_sections.points(alpha);
        let spacing_m = fine_m(cross_sections.length_m);
        let fine = FineLine::new(
            &points,
            cross_sections.closed,
            spacing_m,
            None,
            settings.entry_mps,
        )?;
        let edges = RoadEdges::new(&self.edges_m[0], &self.edges_m[1], cross_sections.closed);
        let clearances = edges.clearances(&fine, &settings.plan_with_margin());
        Ok((fine, clearances))
    }

    /// The line, moved in where the car leaves the road between the cross-sections; nothing where it cannot be.
    ///
    /// # Errors
    /// Those of [`mended`].
    pub fn brought_in(&self, alpha: &[f64], settings: &RacelineSettings) -> Result<Option<Vec<f64>>> {
        let (fine, clearances) = self.measured(alpha, settings)?;
        let least = Clearance::least(&fine, &clearances);
        if least.margin_m >= 0.0 {
            return Ok(Some(alpha.to_vec()));
        }
        let found = (fine, clearances);
        let mended = mended(&self.cross_sections, alpha, found, |line| {
            self.measured(line, settings)
        })?;
        if mended.is_some() {
            return Ok(mended);
        }
        if least.is_on_road() {
            return Ok(Some(alpha.to_vec()));
        }
        // Where bending alone does not help, the whole line gives way a little towards the reference line.
        let given_way = self.given_way(alpha, &TOWARDS_REFERENCE, settings)?;
        Ok(given_way.map(|(line, _)| line))
    }

    /// The line that is this share of the way from a line to the reference line.
    fn towards_reference(&self, alpha: &[f64], share: f64) -> Vec<f64> {
        let both = alpha.iter().zip(&self.cross_sections.reference);
        both.map(|(a, r)| a + share * (r - a)).collect()
    }

    /// The line that has given way towards the reference line by the first of the shares that brings it onto the road, and that share.
    fn given_way(
        &self,
        alpha: &[f64],
        shares: &[f64],
        settings: &RacelineSettings,
    ) -> Result<Option<(Vec<f64>, f64)>> {
        for share in shares {
            let line = self.towards_reference(alpha, *share);
            let (fine, clearances) = self.measured(&line, settings)?;
            if Clearance::least(&fine, &clearances).is_on_road() {
                return Ok(Some((line, *share)));
            }
        }
        Ok(None)
    }

    /// A line that nothing else has brought onto the road, given way far towards the reference line; nothing where that does not help
    /// either.
    ///
    /// # Errors
    /// Those of [`Setup::report`].
    pub fn report_given_way(
        &self,
        line: &ReportedLine,
        settings: &RacelineSettings,
    ) -> Result<Option<ReportedLine>> {
        for share in FAR_TOWARDS_REFERENCE {
            let alpha = self.towards_reference(&line.alpha, share);
            if let Some(alpha) = self.brought_in(&alpha, settings)? {
                let line = self.report(&line.name, &alpha, settings)?;
                return Ok(Some(ReportedLine {
                    gave_way: Some(share),
                    ..line
                }));
            }
        }
        Ok(None)
    }

    /// Works out everything that is reported of a line. Where the car leaves the road between the cross-sections, the line is moved
    /// in first; where that cannot be, it stays as it is.
    ///
    /// # Errors
    /// [`Error::Study`] if the line cannot be driven at all.
    pub fn report(&self, name: &str, alpha: &[f64], settings: &RacelineSettings) -> Result<ReportedLine> {
        let (mut brought_in, mut gave_way) = (self.brought_in(alpha, settings)?, None);
        if brought_in.is_none() && !settings.searches_locally() {
            (brought_in, gave_way) = self.given_way(alpha, &FAR_TOWARDS_REFERENCE, settings)?.unzip();
        }
        let alpha = brought_in.as_deref().unwrap_or(alpha);
        let problem = self.problem(Parametrisation::sections(), &LineObjective::ALL, settings)?;
        let found = CpuLineEvaluator::new(&problem).evaluate(alpha)?;
        if let Some(failure) = found.failures.first().copied().flatten() {
            return Err(Error::Study(format!(
                "the line `{name}` cannot be driven: {failure}"
            )));
        }
        let (points, closed, car) = (
            self.cross_sections.points(alpha),
            self.cross_sections.closed,
            Some((&self.car, self.cross_sections.drs.as_slice())),
        );
        let relief = self.cross_sections.relief_of(&points);
        let fine = FineLine::on(
            &points,
            relief.as_deref(),
            closed,
            fine_m(self.cross_sections.length_m),
            car,
            settings.entry_mps,
        )?;
        let edges = RoadEdges::new(&self.edges_m[0], &self.edges_m[1], closed);
        let clearance = Clearance::least(&fine, &edges.clearances(&fine, &settings.plan_with_margin()));
        Ok(ReportedLine {
            name: name.to_owned(),
            alpha: alpha.to_vec(),
            at_cross_sections: found.objectives,
            clearance,
            gave_way,
            fine,
        })
    }
}
