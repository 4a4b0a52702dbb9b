//! A circuit sampled at even steps along its centreline, with its positions, headings and curvatures.

use glam::DVec2;

use super::clothoid::displacement;
use super::crossing::bridges;
use super::friction::FrictionAcross;
use super::relief::{Relief, ReliefFacts, SurfaceAcross, cubic};
use crate::{Error, Result};

/// A named stretch of a circuit.
#[derive(Debug, Clone, PartialEq)]
pub struct Section {
    /// Name, such as `Abbey`; alternative names are separated by `/`.
    pub name: String,
    /// Station where it starts (m).
    pub start_m: f64,
    /// Station where it ends (m), beyond `start_m`.
    pub end_m: f64,
}

impl Section {
    /// Length along the centreline (m).
    pub fn length_m(&self) -> f64 {
        self.end_m - self.start_m
    }

    /// Whether a station (m, within the lap) lies in the section.
    pub fn contains(&self, station_m: f64) -> bool {
        (self.start_m..self.end_m).contains(&station_m)
    }
}

/// A named corner, at the station where its curvature peaks.
#[derive(Debug, Clone, PartialEq)]
pub struct Corner {
    /// Name, such as `Copse`.
    pub name: String,
    /// Station of the greatest curvature (m).
    pub station_m: f64,
}

/// A point expressed along and across a centreline.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Projection {
    /// Station of the foot of the perpendicular (m), within the lap on a closed circuit.
    pub station_m: f64,
    /// Distance from the centreline (m), positive to the left.
    pub lateral_offset_m: f64,
    /// Heading of the centreline at the foot (rad), unwrapped as [`Circuit::heading_at`] gives it.
    pub heading_rad: f64,
    /// Curvature of the centreline at the foot (1/m), positive in left turns.
    pub curvature_1pm: f64,
}

impl Projection {
    /// How far a car with this yaw angle (rad) points to the left of the centreline (rad, within
    /// plus or minus pi).
    pub fn heading_error_rad(&self, yaw_rad: f64) -> f64 {
        let (sin, cos) = (yaw_rad - self.heading_rad).sin_cos();
        sin.atan2(cos)
    }
}

/// A circuit, sampled at even steps of its centreline.
///
/// Between samples curvature is linear, heading its exact integral and position the integral of
/// the heading. A closed circuit does not repeat its first sample at the end; an open one has its
/// last sample at `length_m`. Positions start at the origin.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Circuit {
    /// Name for titles and messages.
    pub name: String,
    /// Whether the end joins the start.
    pub closed: bool,
    /// Length of the centreline (m).
    pub length_m: f64,
    /// Stations of the samples (m), evenly spaced from 0.
    pub station_m: Vec<f64>,
    /// Positions of the samples (m).
    pub centreline_m: Vec<DVec2>,
    /// Heading at the samples (rad), anticlockwise from +x, unwrapped.
    pub heading_rad: Vec<f64>,
    /// Curvature at the samples (1/m), positive in left turns.
    pub curvature_1pm: Vec<f64>,
    /// Distance from the centreline to the left edge at the samples (m).
    pub width_left_m: Vec<f64>,
    /// Distance from the centreline to the right edge at the samples (m).
    pub width_right_m: Vec<f64>,
    /// Named stretches, in the order of the file.
    pub sections: Vec<Section>,
    /// Named corners, in the order of the lap.
    pub corners: Vec<Corner>,
    /// Stretches where the DRS may be open: start and end (m) of each. One whose end lies before its start passes the start line.
    pub drs_zones_m: Vec<[f64; 2]>,
    /// Height and banking at the samples; none of a level road.
    pub relief: Option<Relief>,
}

/// Whether a station (m) lies in one of these zones.
pub(crate) fn in_a_zone(zones_m: &[[f64; 2]], station_m: f64) -> bool {
    zones_m.iter().any(|&[start, end]| {
        let (after, before) = (station_m >= start, station_m < end);
        if start < end {
            after && before
        } else {
            after || before
        }
    })
}

/// The centreline at one station.
struct Frame {
    position_m: DVec2,
    heading_rad: f64,
    curvature_1pm: f64,
}

/// A station as the samples before and after it and the distance from the sample before.
struct Place {
    laps: f64,
    before: usize,
    after: usize,
    past_m: f64,
}

impl Circuit {
    /// Distance between samples (m).
    pub fn spacing_m(&self) -> f64 {
        let steps = self.station_m.len() - usize::from(!self.closed);
        self.length_m / steps as f64
    }

    /// Turn of the heading over the whole length (rad): plus or minus 2 pi on a simple closed lap.
    pub fn total_turn_rad(&self) -> f64 {
        let last = self.station_m.len() - 1;
        let turned = self.heading_rad[last] - self.heading_rad[0];
        if self.closed {
            let closing = self.curvature_1pm[last] + self.curvature_1pm[0];
            turned + 0.5 * closing * self.spacing_m()
        } else {
            turned
        }
    }

    /// A station brought into the lap (m): wrapped on a closed circuit, held at the ends of an
    /// open one.
    pub fn wrap(&self, station_m: f64) -> f64 {
        if !self.closed {
            return station_m.clamp(0.0, self.length_m);
        }
        let wrapped = station_m.rem_euclid(self.length_m);
        // rem_euclid rounds to the length itself for stations just below zero.
        if wrapped >= self.length_m { 0.0 } else { wrapped }
    }

    fn locate(&self, station_m: f64) -> Place {
        let n = self.station_m.len();
        let h = self.spacing_m();
        let s = self.wrap(station_m);
        let last_step = if self.closed { n - 1 } else { n - 2 };
        let before = ((s / h) as usize).min(last_step);
        Place {
            laps: if self.closed {
                (station_m / self.length_m).floor()
            } else {
                0.0
            },
            before,
            after: (before + 1) % n,
            past_m: s - before as f64 * h,
        }
    }

    fn slope(&self, at: &Place) -> f64 {
        (self.curvature_1pm[at.after] - self.curvature_1pm[at.before]) / self.spacing_m()
    }

    /// Curvature at a station (1/m), positive in left turns.
    pub fn curvature_at(&self, station_m: f64) -> f64 {
        let at = self.locate(station_m);
        self.curvature_1pm[at.before] + self.slope(&at) * at.past_m
    }

    /// Heading at a station (rad), anticlockwise from +x. It is unwrapped: a station one lap on
    /// gives the heading plus the lap's turn.
    pub fn heading_at(&self, station_m: f64) -> f64 {
        let at = self.locate(station_m);
        self.heading_rad[at.before]
            + at.past_m * (self.curvature_1pm[at.before] + 0.5 * self.slope(&at) * at.past_m)
            + at.laps * self.total_turn_rad()
    }

    /// Whether the DRS may be open at a station (m).
    pub fn drs_at(&self, station_m: f64) -> bool {
        in_a_zone(&self.drs_zones_m, self.wrap(station_m))
    }

    /// Position at a station (m).
    pub fn position_at(&self, station_m: f64) -> DVec2 {
        self.frame_in_lap(station_m).position_m
    }

    /// Distance from the centreline to the left and right edges at a station (m).
    pub fn widths_at(&self, station_m: f64) -> (f64, f64) {
        let at = self.locate(station_m);
        let share = at.past_m / self.spacing_m();
        let between = |w: &[f64]| w[at.before] + share * (w[at.after] - w[at.before]);
        (between(&self.width_left_m), between(&self.width_right_m))
    }

    /// The surface about the centreline at a station (m), of a road that is not level and dry: height and banking by the cubic through the four
    /// samples about it, friction linear between two.
    pub fn relief_at(&self, station_m: f64) -> Option<SurfaceAcross> {
        let relief = self.relief.as_ref()?;
        let at = self.locate(station_m);
        let n = self.station_m.len();
        let (before, after) = if self.closed {
            ((at.before + n - 1) % n, (at.after + 1) % n)
        } else {
            (at.before.saturating_sub(1), (at.after + 1).min(n - 1))
        };
        let t = at.past_m / self.spacing_m();
        let value = |of: &[f64]| cubic([before, at.before, at.after, after].map(|i| of[i]), t);
        Some(SurfaceAcross {
            z_m: value(&relief.z_m),
            bank_rad: value(&relief.bank_rad),
            friction: FrictionAcross::mixed(&relief.friction[at.before], &relief.friction[at.after], t),
        })
    }

    /// What the road's height comes to, if it has one.
    pub fn relief_facts(&self) -> Option<ReliefFacts> {
        let relief = self.relief.as_ref()?;
        Some(relief.facts(&self.station_m, self.spacing_m(), self.closed))
    }

    fn frame_in_lap(&self, station_m: f64) -> Frame {
        let at = self.locate(station_m);
        let (heading, curvature) = (self.heading_rad[at.before], self.curvature_1pm[at.before]);
        let slope = self.slope(&at);
        Frame {
            position_m: self.centreline_m[at.before] + displacement(heading, curvature, slope, at.past_m),
            heading_rad: heading + at.past_m * (curvature + 0.5 * slope * at.past_m),
            curvature_1pm: curvature + slope * at.past_m,
        }
    }

    /// The section of this name. Case does not matter. The beginning of a name is enough if it fits one section only. A section
    /// called `Village/The Loop` has two names.
    ///
    /// # Errors
    /// [`Error::Input`] listing the names when none or several fit.
    pub fn section(&self, name: &str) -> Result<&Section> {
        let wanted = name.trim().to_lowercase();
        let names = |s: &Section| {
            let whole = s.name.to_lowercase();
            let mut all: Vec<String> = whole.split('/').map(|p| p.trim().to_owned()).collect();
            all.push(whole);
            all
        };
        let matching = |fits: &dyn Fn(&str) -> bool| -> Vec<&Section> {
            self.sections
                .iter()
                .filter(|s| names(s).iter().any(|n| fits(n)))
                .collect()
        };
        let exact = matching(&|n| n == wanted);
        let begun = matching(&|n| !wanted.is_empty() && n.starts_with(&wanted));
        match (exact.as_slice(), begun.as_slice()) {
            ([one], _) | ([], [one]) => Ok(one),
            _ => {
                let known: Vec<&str> = self.sections.iter().map(|s| s.name.as_str()).collect();
                Err(Error::input(
                    &self.name,
                    "section",
                    format!("`{name}`"),
                    if known.is_empty() {
                        "a circuit with sections".to_owned()
                    } else {
                        format!("exactly one of {}", known.join(", "))
                    },
                ))
            }
        }
    }

    /// The foot of the perpendicular from a point, found from a station nearby.
    ///
    /// Newton's method takes two or three steps if the hint is the foot of a millisecond ago. The search is local: on a hairpin,
    /// a hint on the wrong leg finds a foot on the wrong leg. [`Circuit::project_anywhere`] needs no hint.
    pub fn project(&self, point_m: DVec2, station_hint_m: f64) -> Projection {
        /// Far smaller than any effect on a driver, far larger than rounding at 10 km.
        const SETTLED_M: f64 = 1e-9;
        /// Longest step of Newton's method, so that a bad hint does not lead to another part of the circuit.
        const LONGEST_STEP_M: f64 = 10.0;
        let mut station = self.wrap(station_hint_m);
        for _ in 0..25 {
            let frame = self.frame_in_lap(station);
            let (along, left) = frame.resolve(point_m);
            // Beyond the centre of curvature the distance has no minimum to converge to.
            let stretch = (1.0 - frame.curvature_1pm * left).max(0.2);
            let step = (along / stretch).clamp(-LONGEST_STEP_M, LONGEST_STEP_M);
            let next = self.wrap(station + step);
            if step.abs() < SETTLED_M || (!self.closed && next == station) {
                return frame.project(station, left);
            }
            station = next;
        }
        let spread = (50.0 / self.spacing_m()).ceil() as isize;
        let centre = self.locate(station_hint_m).before as isize;
        let n = self.station_m.len() as isize;
        let nearby = (centre - spread..=centre + spread).map(|i| {
            if self.closed {
                i.rem_euclid(n) as usize
            } else {
                i.clamp(0, n - 1) as usize
            }
        });
        self.at_sample(point_m, self.nearest(point_m, nearby))
    }

    /// The nearest foot of a perpendicular from a point anywhere, without a hint. It looks at every sample, so it is meant for
    /// starting points and not for every step.
    pub fn project_anywhere(&self, point_m: DVec2) -> Projection {
        let nearest = self.nearest(point_m, 0..self.station_m.len());
        let refined = self.project(point_m, self.station_m[nearest]);
        let rough = self.at_sample(point_m, nearest);
        let distance = |p: &Projection| self.position_at(p.station_m).distance(point_m);
        if distance(&refined) <= distance(&rough) {
            refined
        } else {
            rough
        }
    }

    fn nearest(&self, point_m: DVec2, samples: impl Iterator<Item = usize>) -> usize {
        let distance = |i: usize| self.centreline_m[i].distance_squared(point_m);
        samples
            .min_by(|&i, &j| distance(i).total_cmp(&distance(j)))
            .unwrap_or(0)
    }

    fn at_sample(&self, point_m: DVec2, sample: usize) -> Projection {
        let station = self.station_m[sample];
        let frame = self.frame_in_lap(station);
        let (_, left) = frame.resolve(point_m);
        frame.project(station, left)
    }

    /// Where the centreline crosses itself on bridges: both stations (m) of each.
    pub fn bridges(&self) -> Vec<[f64; 2]> {
        bridges(&self.centreline_m, &self.station_m, self.closed)
    }

    /// The left edge as a polyline (m), one point per sample.
    pub fn left_edge(&self) -> Vec<DVec2> {
        self.edge(|i| self.width_left_m[i])
    }

    /// The right edge as a polyline (m), one point per sample.
    pub fn right_edge(&self) -> Vec<DVec2> {
        self.edge(|i| -self.width_right_m[i])
    }

    fn edge(&self, leftward: impl Fn(usize) -> f64) -> Vec<DVec2> {
        self.centreline_m
            .iter()
            .zip(&self.heading_rad)
            .enumerate()
            .map(|(i, (&p, &heading))| p + leftward(i) * DVec2::from_angle(heading).perp())
            .collect()
    }
}

impl Frame {
    /// A point's distance along and to the left of this place (m).
    fn resolve(&self, point_m: DVec2) -> (f64, f64) {
        let tangent = DVec2::from_angle(self.heading_rad);
        let away = point_m - self.position_m;
        (away.dot(tangent), away.dot(tangent.perp()))
    }

    fn project(&self, station_m: f64, lateral_offset_m: f64) -> Projection {
        Projection {
            station_m,
            lateral_offset_m,
            heading_rad: self.heading_rad,
            curvature_1pm: self.curvature_1pm,
        }
    }
}
