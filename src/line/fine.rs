//! A line on a fine spline through its points. Reports give figures of this line.

use super::kernel::Within;
use super::point_mass::PointMass;
use super::profile::{LapProfile, lap_profile_on};
use super::relief::LineRelief;
use super::spline::Spline;
use crate::error::{Error, Place, Result};
use crate::track::Surface;
use glam::DVec2;

/// Distance between the points of the fine spline that lines are reported on (m), on laps of [`WHOLE_M`] or more.
const FINE_M: f64 = 1.0;
/// Length of a lap (m) below which distances shrink with it, and the least share of them. The bends of shorter laps, as those of karts
/// and of Formula Student, are tighter in proportion.
const WHOLE_M: f64 = 3000.0;
const SMALLEST: f64 = 0.1;

/// By what share distances that suit a long lap are smaller on one of `length_m` (m).
pub fn scale_of(length_m: f64) -> f64 {
    (length_m / WHOLE_M).clamp(SMALLEST, 1.0)
}

/// Distance between the points of the fine spline that lines of a road of `length_m` are reported on (m).
pub fn fine_m(length_m: f64) -> f64 {
    FINE_M * scale_of(length_m)
}

/// A line on a fine grid, which shows oscillations between coarse points.
#[derive(Clone, Debug, PartialEq)]
pub struct FineLine {
    /// Whether the end joins the start.
    pub closed: bool,
    /// Points (m), the given ones among them.
    pub points_m: Vec<DVec2>,
    /// For each point, the given point at or before it, and its position towards the next one as a share.
    pub section: Vec<(usize, f64)>,
    /// Distance along the curve from the start at each point (m).
    pub station_m: Vec<f64>,
    /// Length of the curve from each point to the next (m), one fewer than points on an open line.
    pub segment_m: Vec<f64>,
    /// The curve's own curvature at each point (1/m), positive in left turns.
    pub curvature_1pm: Vec<f64>,
    /// Length of the curve (m).
    pub length_m: f64,
    /// Root of the sum of the squared curvatures at the given points (1/m).
    pub gamma_1pm: f64,
    /// Integral of the curvature squared over the length (1/m).
    pub integral_kappa2_1pm: f64,
    /// The lap, if a car was given.
    pub lap: Option<LapProfile>,
    /// The surface under a line on a road that is not level and dry. All other figures but the lap's are those of the plan view.
    pub relief: Option<LineRelief>,
}

impl FineLine {
    /// The cubic spline through `points_m`, cut into pieces of at most `spacing_m`, and the lap of `car` on it;
    /// `entry_mps` is the greatest speed at the start of an open line (m/s). With the car stands whether its DRS may be open from each
    /// given point to the next; nowhere if that is empty.
    ///
    /// # Errors
    /// [`Error::Input`] if there are too few points, if neighbours coincide, or if the car or the spacing is out of range.
    pub fn new(
        points_m: &[DVec2],
        closed: bool,
        spacing_m: f64,
        car: Option<(&PointMass, &[bool])>,
        entry_mps: f64,
    ) -> Result<Self> {
        Self::on(points_m, None, closed, spacing_m, car, entry_mps)
    }

    /// As [`FineLine::new`], on a road that is not level and dry, with the surface at each of the points.
    ///
    /// # Errors
    /// As [`FineLine::new`].
    pub fn on(
        points_m: &[DVec2],
        relief: Option<&[Surface]>,
        closed: bool,
        spacing_m: f64,
        car: Option<(&PointMass, &[bool])>,
        entry_mps: f64,
    ) -> Result<Self> {
        let n = points_m.len();
        let least = if closed { 3 } else { 2 };
        if n < least {
            let expected = format!("at least {least}");
            return Err(Error::input("line", "points", n.to_string(), expected));
        }
        let apart = |i: usize| points_m[i].distance(points_m[(i + 1) % n]);
        let segments = n - usize::from(!closed);
        if let Some(i) = (0..segments).find(|&i| !(apart(i) > 1e-6 && apart(i).is_finite())) {
            let found = format!("{} m to the next", apart(i));
            return Err(Error::input("line", Place::point(i + 1), found, "points apart"));
        }
        if !(0.01..=1000.0).contains(&spacing_m) {
            return Err(Error::input(
                "line",
                "spacing",
                format!("{spacing_m} m"),
                "0.01 to 1000 m",
            ));
        }
        let spline = Spline::through(points_m, closed);
        let mut line = Self {
            closed,
            points_m: Vec::new(),
            section: Vec::new(),
            station_m: Vec::new(),
            segment_m: Vec::new(),
            curvature_1pm: Vec::new(),
            length_m: 0.0,
            gamma_1pm: 0.0,
            integral_kappa2_1pm: 0.0,
            lap: None,
            relief: None,
        };
        let mut gamma_squared = 0.0;
        for segment in 0..spline.segments() {
            let chord = spline.chord(segment);
            // The curve is longer than its chord, and its parameter speed differs between the ends.
            let fastest = (0..=4)
                .map(|i| spline.at(segment, chord * f64::from(i) / 4.0).speed)
                .fold(1.0, f64::max);
            let pieces = (chord * fastest / spacing_m).ceil().max(1.0) as usize;
            for piece in 0..pieces {
                let t = |piece: usize| chord * piece as f64 / pieces as f64;
                line.push(
                    &spline,
                    segment,
                    t(piece),
                    Some((piece as f64 / pieces as f64, t(piece + 1))),
                );
                if piece == 0 {
                    gamma_squared += line.curvature_1pm[line.curvature_1pm.len() - 1].powi(2);
                }
            }
        }
        if !closed {
            let last = spline.segments() - 1;
            line.push(&spline, last, spline.chord(last), None);
            gamma_squared += line.curvature_1pm[line.curvature_1pm.len() - 1].powi(2);
        }
        line.gamma_1pm = gamma_squared.sqrt();
        line.relief = relief.map(|given| LineRelief::along(&line, given));
        if let Some((car, drs)) = car {
            let table = car.table()?;
            let drs = line.drs_of(drs);
            line.lap = Some(line.driven(car, &table, entry_mps, &drs)?);
        }
        Ok(line)
    }

    /// The lap of `car` on it within its table or one for each point; see [`lap_profile`](super::lap_profile) for the rest.
    ///
    /// # Errors
    /// As [`lap_profile`](super::lap_profile).
    pub fn driven(
        &self,
        car: &PointMass,
        within: &impl Within<f64>,
        entry_mps: f64,
        drs: &[bool],
    ) -> Result<LapProfile> {
        let plan_view = (self.segment_m.as_slice(), self.curvature_1pm.as_slice());
        lap_profile_on(car, within, plan_view, self.relief.as_ref(), entry_mps, drs)
    }

    /// Adds the place at `t` of a segment, with the piece from there to the parameter `end` if one follows.
    fn push(&mut self, spline: &Spline, segment: usize, t: f64, piece: Option<(f64, f64)>) {
        let place = spline.at(segment, t);
        self.points_m.push(place.point);
        self.curvature_1pm.push(place.curvature);
        self.station_m.push(self.length_m);
        let Some((share, end)) = piece else {
            self.section.push((segment + 1, 0.0));
            return;
        };
        self.section.push((segment, share));
        let length = spline.integral(segment, t, end, |p| p.speed);
        self.segment_m.push(length);
        self.length_m += length;
        self.integral_kappa2_1pm += spline.integral(segment, t, end, |p| p.curvature * p.curvature * p.speed);
    }

    /// Whether the DRS may be open from each point of the spline to the next, from what is known of the given points; empty where
    /// that is.
    pub fn drs_of(&self, drs: &[bool]) -> Vec<bool> {
        let sections = self.section.iter();
        sections
            .filter_map(|(section, _)| drs.get(*section).copied())
            .collect()
    }

    /// A quantity that is known at the given points, at each point of the spline: linear in between.
    pub fn between(&self, at_given: &[f64]) -> Vec<f64> {
        let n = at_given.len();
        let value = |&(section, share): &(usize, f64)| {
            let next = if self.closed {
                (section + 1) % n
            } else {
                (section + 1).min(n - 1)
            };
            let here = section.min(n - 1);
            at_given[here] + share * (at_given[next] - at_given[here])
        };
        self.section.iter().map(value).collect()
    }

    /// The time that this line loses on another (s), after each of these shares of the lap; nothing without a lap of both.
    pub fn time_lost_s(&self, other: &Self, shares: &[f64]) -> Option<Vec<f64>> {
        let clock = |line: &Self| {
            let lap = line.lap.as_ref()?;
            let (elapsed, end) = (lap.elapsed_s(), (line.length_m, lap.time_s));
            let station = line.station_m.clone();
            Some(move |share: f64| {
                let at = share * end.0;
                let after = station.partition_point(|s| *s <= at).max(1);
                let (s0, t0) = (station[after - 1], elapsed[after - 1]);
                let s1 = station.get(after).copied().unwrap_or(end.0);
                let t1 = elapsed.get(after).copied().unwrap_or(end.1);
                if s1 > s0 {
                    t0 + (at - s0) / (s1 - s0) * (t1 - t0)
                } else {
                    t0
                }
            })
        };
        let (own, others) = (clock(self)?, clock(other)?);
        Some(shares.iter().map(|&share| own(share) - others(share)).collect())
    }

    /// Time of the lap (s), if a car was given.
    pub fn lap_time_s(&self) -> Option<f64> {
        self.lap.as_ref().map(|lap| lap.time_s)
    }
}
