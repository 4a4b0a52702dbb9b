//! All figures of a lap on one line.

use super::ground::{Ground, Grounds, LevelRoad, SlopedRoad};
use super::kernel::{Course, Within, acceleration, driving_at, lap_time, may_open};
use super::point_mass::{EnvelopeTable, PointMass};
use super::relief::LineRelief;
use crate::error::{Error, Result};

/// A lap, section by section.
#[derive(Clone, Debug, PartialEq)]
pub struct LapProfile {
    /// Time (s).
    pub time_s: f64,
    /// Distance from the start at each section (m).
    pub station_m: Vec<f64>,
    /// Speed at each section (m/s).
    pub v_mps: Vec<f64>,
    /// Mean longitudinal acceleration from each section to the next (m/s^2); the last of an open line has that before it.
    pub ax_mps2: Vec<f64>,
    /// Lateral acceleration at each section (m/s^2), positive to the left.
    pub ay_mps2: Vec<f64>,
    /// Steering angle at the wheels that the curvature asks for (rad), positive to the left: wheelbase times curvature.
    pub steering_rad: Vec<f64>,
    /// Time of each segment (s).
    pub segment_time_s: Vec<f64>,
    /// Sections where the steering passes the lock, if there is one.
    pub beyond_lock: usize,
    /// Whether the driver has the DRS open from each section to the next.
    pub drs_open: Vec<bool>,
    /// Specific forces of the road on a road that is not level and dry (m/s^2): along the car, to its left, and square to the surface;
    /// and the friction. Empty on a level and dry road, where they are the accelerations, gravity and 1.
    pub forces_mps2: Vec<[f64; 4]>,
}

impl LapProfile {
    /// A lap of `time_s` on a line of this plan view (lengths of segments in m, and curvatures in 1/m), with the surface under it if that
    /// is not level and dry, from its speeds squared (m^2/s^2) at the sections; `drs_open` says of each segment whether the driver has
    /// the flap open.
    pub fn of_speeds(
        car: &PointMass,
        (segment_m, curvature_1pm): (&[f64], &[f64]),
        relief: Option<&LineRelief>,
        speed_squared: &[f64],
        time_s: f64,
        drs_open: Vec<bool>,
    ) -> Self {
        let (n, w) = (curvature_1pm.len(), speed_squared);
        let v_mps: Vec<f64> = w.iter().map(|w| w.sqrt()).collect();
        let next = |i: usize| (i + 1) % n;
        let length_m = relief.map_or(segment_m, |relief| &relief.length_m);
        let mut ax_mps2: Vec<f64> = length_m
            .iter()
            .enumerate()
            .map(|(i, h)| (w[next(i)] - w[i]) / (2.0 * h))
            .collect();
        if segment_m.len() < n {
            ax_mps2.push(ax_mps2[n - 2]);
        }
        let station_m = (0..n)
            .scan(0.0, |station, i| {
                let here = *station;
                *station += segment_m.get(i).copied().unwrap_or(0.0);
                Some(here)
            })
            .collect();
        let steering_rad: Vec<f64> = curvature_1pm.iter().map(|k| car.wheelbase_m * k).collect();
        Self {
            time_s,
            drs_open,
            station_m,
            ay_mps2: curvature_1pm.iter().zip(w).map(|(k, w)| k * w).collect(),
            beyond_lock: car
                .max_steer_rad
                .map_or(0, |lock| steering_rad.iter().filter(|s| s.abs() > lock).count()),
            steering_rad,
            forces_mps2: relief.map_or(Vec::new(), |relief| relief.forces_mps2(&v_mps, &ax_mps2)),
            segment_time_s: length_m
                .iter()
                .enumerate()
                .map(|(i, h)| 2.0 * h / (v_mps[i] + v_mps[next(i)]))
                .collect(),
            ax_mps2,
            v_mps,
        }
    }

    /// The fastest turn of the front wheels (rad/s): the change of the steering angle along a segment, without regard to its sign, at
    /// the speed at its end.
    pub fn steering_rate_radps(&self) -> f64 {
        let n = self.steering_rad.len();
        let rate = |(i, time): (usize, &f64)| {
            let next = (i + 1) % n;
            let length = 0.5 * time * (self.v_mps[i] + self.v_mps[next]);
            let change = self.steering_rad[next].abs() - self.steering_rad[i].abs();
            change.abs() * self.v_mps[next] / length
        };
        self.segment_time_s
            .iter()
            .enumerate()
            .map(rate)
            .fold(0.0, f64::max)
    }

    /// The share of `car`'s grip that is used at each section.
    pub fn grip_used(&self, car: &PointMass) -> Vec<f64> {
        if !self.forces_mps2.is_empty() {
            let places = self.v_mps.iter().zip(&self.forces_mps2);
            return places
                .map(|(v, forces)| car.grip_used_under(*v, *forces))
                .collect();
        }
        let places = self.v_mps.iter().zip(&self.ax_mps2).zip(&self.ay_mps2);
        places
            .map(|((v, ax), ay)| car.grip_used(*v, [*ax, *ay]))
            .collect()
    }

    /// Time at each section (s), from zero at the first.
    pub fn elapsed_s(&self) -> Vec<f64> {
        let mut time = 0.0;
        let mut elapsed = Vec::with_capacity(self.v_mps.len());
        for i in 0..self.v_mps.len() {
            elapsed.push(time);
            time += self.segment_time_s.get(i).copied().unwrap_or(0.0);
        }
        elapsed
    }
}

/// Drives `car` along a line of these segments (m) and curvatures (1/m, with sign). A line is closed if it has as many
/// segments as sections; `entry_mps` is the greatest speed (m/s) at the start of an open one. `within` is the car's
/// table, or one for each section. `drs` says on
/// which segments the DRS may be open; nowhere if it is empty.
///
/// # Errors
/// [`Error::Input`] if lengths are not positive, the numbers of figures do not fit each other, or the car comes to a
/// standstill.
pub fn lap_profile(
    car: &PointMass,
    within: &impl Within<f64>,
    segment_m: &[f64],
    curvature_1pm: &[f64],
    entry_mps: f64,
    drs: &[bool],
) -> Result<LapProfile> {
    lap_profile_on(car, within, (segment_m, curvature_1pm), None, entry_mps, drs)
}

/// As [`lap_profile`], on a line of this plan view (lengths of segments and curvatures) with the surface under it.
///
/// # Errors
/// As [`lap_profile`]; also if the car has no tables for roads in three dimensions.
pub fn lap_profile_on(
    car: &PointMass,
    within: &impl Within<f64>,
    (segment_m, curvature_1pm): (&[f64], &[f64]),
    relief: Option<&LineRelief>,
    entry_mps: f64,
    drs: &[bool],
) -> Result<LapProfile> {
    let n = curvature_1pm.len();
    let wrong =
        |place: &str, found: String, expected: &str| Err(Error::input("line", place, found, expected));
    let closed = segment_m.len() == n;
    if n < 2 || !(closed || segment_m.len() + 1 == n) {
        let found = format!("{} segments and {n} sections", segment_m.len());
        return wrong(
            "sections",
            found,
            "two or more, and as many segments or one fewer",
        );
    }
    if let Some(i) = segment_m.iter().position(|h| !(*h > 0.0 && h.is_finite())) {
        return wrong(
            &format!("segment {i}"),
            segment_m[i].to_string(),
            "a positive length (m)",
        );
    }
    if let Some(i) = curvature_1pm.iter().position(|k| !k.is_finite()) {
        return wrong(
            &format!("section {i}"),
            curvature_1pm[i].to_string(),
            "a curvature (1/m)",
        );
    }
    let mut course = Course {
        length: segment_m.to_vec(),
        curvature: curvature_1pm.iter().map(|k| k.abs()).collect(),
        drs: drs.to_vec(),
        ..Course::default()
    };
    if let Some(relief) = relief {
        if within.at(0).loads.tables == 0 {
            let found = "limits for level roads";
            return wrong(
                "car",
                found.to_owned(),
                "limits under loads, for a road in three dimensions",
            );
        }
        course.length.clone_from(&relief.length_m);
        course.curvature.clone_from(&relief.bend_1pm);
        course.relief.clone_from(&relief.course);
    }
    let start = slowest(&course.curvature);
    let time_s = lap_time::<f64>(within, closed, start, entry_mps * entry_mps, &mut course);
    if !time_s.is_finite() {
        return wrong(
            "lap",
            "a standstill".to_owned(),
            "a car that moves along the whole line",
        );
    }
    let drs_open = (0..segment_m.len())
        .map(|i| match relief {
            Some(_) => opens::<SlopedRoad>(within.at(i), &course, i),
            None => opens::<LevelRoad>(within.at(i), &course, i),
        })
        .collect();
    let shape = (segment_m, curvature_1pm);
    let w = &course.speed_squared;
    Ok(LapProfile::of_speeds(car, shape, relief, w, time_s, drs_open))
}

/// Whether the driver has the DRS open on a segment: it may be, he does not brake, and it gains him speed.
fn opens<G: Grounds<f64>>(table: &EnvelopeTable<f64>, course: &Course<f64>, segment: usize) -> bool {
    let next = (segment + 1) % course.curvature.len();
    let [from, to] = [segment, next].map(|i| course.speed_squared[i]);
    let middle = 0.5 * (from + to);
    let [here, there] = [segment, next].map(|section| G::at(course, section, segment));
    let bend = here.half_way(there);
    let gained = 0.5 * (to - from) / course.length[segment];
    let most = |drs: bool| acceleration::<f64>(table, drs, middle, bend);
    let [.., drag, _] = driving_at::<f64>(table, middle, bend);
    may_open(&course.drs, segment) && most(false) < most(true) && gained > bend.uphill(-drag)
}

/// The section of the greatest curvature, where a car is slowest.
pub(crate) fn slowest(curvature: &[f64]) -> usize {
    (0..curvature.len())
        .max_by(|&i, &j| curvature[i].abs().total_cmp(&curvature[j].abs()))
        .unwrap_or(0)
}
