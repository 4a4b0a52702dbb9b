//! Height, banking and friction of roads.
//!
//! The plan view of a road is a matter of [`Circuit`](super::Circuit) and [`CrossSections`](super::CrossSections). Its surface is
//! added to it: the height of the reference line, the angle about the direction of driving by which the left side of the road lies
//! above the right, and the friction, as a share of what the car's own tyres have. A level and dry road has no relief at all, so its
//! laps are those of the plane.

use super::friction::{FRICTION_PLACES, FrictionAcross, mixed};
use super::spline::Spline;
use crate::{Error, Place, Result};
use glam::DVec2;

/// Range of heights (m).
pub(super) const HEIGHTS_M: (f64, f64) = (-1000.0, 10_000.0);
/// Greatest banking, either way (degrees). Daytona's is 31, the steepest of Monza's old bowl about 39.
pub(super) const STEEPEST_BANK_DEG: f64 = 40.0;
/// Greatest gradient of a road.
const STEEPEST: f64 = 0.4;
/// A step of the survey from the end to the start that is steeper than this is a gap in height and no slope.
const STEEPEST_CLOSING: f64 = 0.25;
/// Greatest gap in height of a closed road, as a share of its length: a barometer drifts by this in a lap.
const LARGEST_GAP: f64 = 0.005;
/// Heights that differ by less are the same (m), and banking below this is none (rad).
const LEVEL_M: f64 = 1e-9;
const LEVEL_RAD: f64 = 1e-9;
/// Waves of the height that are longer than this are kept, whatever deviation is allowed (m): the shortest crests are longer.
const LONGEST_WAVE_M: f64 = 150.0;
/// The same of the banking (m).
const LONGEST_BANK_WAVE_M: f64 = 100.0;

/// A road's surface at a place: height (m), banking (rad, the left side up), friction as a share of the car's own, and what that
/// gains per metre to the left (1/m).
pub type Surface = [f64; 4];

/// A road's surface from edge to edge: a plane, and the friction on it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceAcross {
    /// Height of a point of it (m).
    pub z_m: f64,
    /// Angle about the direction of driving by which the left side lies above the right (rad).
    pub bank_rad: f64,
    /// Friction to the left and right of that point.
    pub friction: FrictionAcross,
}

impl SurfaceAcross {
    /// The surface of a level and dry road.
    pub const LEVEL_AND_DRY: Self = Self {
        z_m: 0.0,
        bank_rad: 0.0,
        friction: FrictionAcross::DRY,
    };

    /// The surface so far (m) to the left of the point.
    pub fn at(&self, left_m: f64) -> Surface {
        let [friction, per_m] = self.friction.at(left_m);
        [
            self.z_m + self.bank_rad.tan() * left_m,
            self.bank_rad,
            friction,
            per_m,
        ]
    }

    /// The same as seen from so far to the left of the point (m).
    pub(super) fn seen_from(&self, left_m: f64) -> Self {
        Self {
            z_m: self.z_m + self.bank_rad.tan() * left_m,
            bank_rad: self.bank_rad,
            friction: self.friction.seen_from(left_m),
        }
    }
}

/// What smoothing and closing changed of a road's height and banking.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ReliefChange {
    /// Greatest change of the height by smoothing (m).
    pub height_m: f64,
    /// Its root mean square (m).
    pub height_rms_m: f64,
    /// Greatest change of the banking by smoothing (rad).
    pub bank_rad: f64,
    /// Gap in height between the end and the start of a closed road, which was spread over its length (m).
    pub gap_m: f64,
}

/// Height, banking and friction at the samples of a [`Circuit`](super::Circuit).
#[derive(Clone, Debug, PartialEq)]
pub struct Relief {
    /// Height of the centreline (m).
    pub z_m: Vec<f64>,
    /// Angle about the direction of driving by which the left side lies above the right (rad).
    pub bank_rad: Vec<f64>,
    /// Friction to the left and right of it.
    pub friction: Vec<FrictionAcross>,
    /// What was changed of what was given.
    pub change: ReliefChange,
}

/// What a road's height comes to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReliefFacts {
    /// The sum of all that the road rises (m).
    pub climb_m: f64,
    /// Greatest height less the least (m).
    pub range_m: f64,
    /// Greatest gradient, up or down, as a share of the distance on the map.
    pub gradient: f64,
    /// Where that is (m).
    pub gradient_at_m: f64,
    /// Greatest banking, either way (rad).
    pub bank_rad: f64,
    /// Where that is (m).
    pub bank_at_m: f64,
    /// The least and the greatest friction on the road, as a share of the car's own.
    pub friction: [f64; 2],
}

impl Relief {
    /// The relief of these surfaces.
    pub(crate) fn of(surfaces: impl Iterator<Item = SurfaceAcross>, change: ReliefChange) -> Self {
        let mut relief = Self {
            z_m: Vec::new(),
            bank_rad: Vec::new(),
            friction: Vec::new(),
            change,
        };
        for surface in surfaces {
            relief.z_m.push(surface.z_m);
            relief.bank_rad.push(surface.bank_rad);
            relief.friction.push(surface.friction);
        }
        relief
    }

    /// Its surfaces.
    pub(crate) fn surfaces(&self) -> impl Iterator<Item = SurfaceAcross> {
        let planes = self.z_m.iter().zip(&self.bank_rad).zip(&self.friction);
        planes.map(|((z_m, bank_rad), friction)| SurfaceAcross {
            z_m: *z_m,
            bank_rad: *bank_rad,
            friction: *friction,
        })
    }

    /// Whether it is all of one height, without banking.
    pub fn is_level(&self) -> bool {
        is_level(&self.z_m, &self.bank_rad)
    }

    /// Whether the friction is the car's own everywhere.
    pub fn is_dry(&self) -> bool {
        is_dry(&self.friction)
    }

    /// What it comes to at stations (m) of a road that is closed or not.
    pub fn facts(&self, station_m: &[f64], spacing_m: f64, closed: bool) -> ReliefFacts {
        let n = self.z_m.len();
        let steps = n - usize::from(!closed);
        let rise = |i: &usize| self.z_m[(i + 1) % n] - self.z_m[*i];
        let steepest = (0..steps).max_by(|i, j| rise(i).abs().total_cmp(&rise(j).abs()));
        let bank = |i: &usize| self.bank_rad[*i].abs();
        let banked = (0..n).max_by(|i, j| bank(i).total_cmp(&bank(j)));
        let (steepest, banked) = (steepest.unwrap_or(0), banked.unwrap_or(0));
        let ends = self
            .z_m
            .iter()
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(least, most), z| {
                (least.min(*z), most.max(*z))
            });
        let frictions = self.friction.iter().flat_map(|across| across.of);
        let friction = frictions.fold([f64::INFINITY, f64::NEG_INFINITY], |[least, most], f| {
            [least.min(f), most.max(f)]
        });
        ReliefFacts {
            friction,
            climb_m: (0..steps).map(|i| rise(&i).max(0.0)).sum(),
            range_m: ends.1 - ends.0,
            gradient: rise(&steepest).abs() / spacing_m,
            gradient_at_m: station_m[steepest],
            bank_rad: bank(&banked),
            bank_at_m: station_m[banked],
        }
    }
}

/// Planes across a road: height, banking and friction at each of its [`CrossSections`](super::CrossSections).
#[derive(Clone, Debug, PartialEq)]
pub struct SectionRelief {
    /// A point of each cross-section (m),
    pub foot_m: Vec<DVec2>,
    /// its height (m),
    pub z_m: Vec<f64>,
    /// the angle about the direction of driving by which the cross-section rises to the left (rad),
    pub bank_rad: Vec<f64>,
    /// and the friction to the left and right of the point.
    pub friction: Vec<FrictionAcross>,
}

impl SectionRelief {
    /// Some of the planes, in this order.
    pub(crate) fn some(&self, of: impl Iterator<Item = usize> + Clone) -> Self {
        Self {
            foot_m: of.clone().map(|i| self.foot_m[i]).collect(),
            z_m: of.clone().map(|i| self.z_m[i]).collect(),
            bank_rad: of.clone().map(|i| self.bank_rad[i]).collect(),
            friction: of.map(|i| self.friction[i]).collect(),
        }
    }

    /// Whether it is all of one height, without banking.
    pub fn is_level(&self) -> bool {
        is_level(&self.z_m, &self.bank_rad)
    }

    /// Whether the friction is the car's own everywhere.
    pub fn is_dry(&self) -> bool {
        is_dry(&self.friction)
    }

    /// The surface at a point (m) of cross-section `i`, whose leftward unit vector is `left`.
    pub fn at(&self, i: usize, left: DVec2, point: DVec2) -> Surface {
        self.plane(i).at((point - self.foot_m[i]).dot(left))
    }

    /// The plane of cross-section `i`, about its foot.
    pub(super) fn plane(&self, i: usize) -> SurfaceAcross {
        SurfaceAcross {
            z_m: self.z_m[i],
            bank_rad: self.bank_rad[i],
            friction: self.friction[i],
        }
    }
}

fn is_level(z_m: &[f64], bank_rad: &[f64]) -> bool {
    let first = z_m.first().copied().unwrap_or_default();
    z_m.iter().all(|z| (z - first).abs() <= LEVEL_M) && bank_rad.iter().all(|bank| bank.abs() <= LEVEL_RAD)
}

fn is_dry(friction: &[FrictionAcross]) -> bool {
    friction.iter().all(FrictionAcross::is_dry)
}

/// Height (m), banking (rad), and friction from the right edge to the left.
pub(super) type ToEdges = ([f64; 2], [f64; FRICTION_PLACES]);

/// The surface of a reference line from that up to edges which are so far to its left and right (m).
pub(super) fn between_edges(([z_m, bank_rad], of): ToEdges, [left_m, right_m]: [f64; 2]) -> SurfaceAcross {
    SurfaceAcross {
        z_m,
        bank_rad,
        friction: FrictionAcross { right_m, left_m, of },
    }
}

/// Heights, bankings and frictions as read, at the points of a line.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Given {
    /// Heights (m), or none.
    pub z_m: Vec<f64>,
    /// Banking (rad), or none.
    pub bank_rad: Vec<f64>,
    /// Friction from the right edge to the left, as [`FrictionAcross::of`], or none.
    pub friction: Vec<[f64; FRICTION_PLACES]>,
    /// The gap in height that was spread (m).
    pub gap_m: f64,
}

impl Given {
    /// Whether there is nothing that a level and dry road lacks.
    pub fn is_level(&self) -> bool {
        is_level(&self.z_m, &self.bank_rad) && self.friction.iter().all(|of| *of == FrictionAcross::DRY.of)
    }

    /// Closes the heights at these stations of a closed line of this length (m). The last row of a line that repeats its first
    /// point is the end of the lap and goes; `points` are those that are left. A gap is spread evenly over the length.
    ///
    /// # Errors
    /// [`Error::Input`] for a gap that no measuring error explains.
    pub fn close(&mut self, source: &str, points: usize, station_m: &[f64], length_m: f64) -> Result<()> {
        self.bank_rad.truncate(points);
        self.friction.truncate(points);
        if self.z_m.len() < points || points < 2 {
            return Ok(());
        }
        let (first, last) = (self.z_m[0], self.z_m[points - 1]);
        let (end, reach_m) = match self.z_m.get(points) {
            Some(repeated) => (*repeated, length_m),
            None if (first - last).abs() > STEEPEST_CLOSING * (length_m - station_m[points - 1]) => {
                (last, station_m[points - 1])
            }
            None => (first, length_m),
        };
        self.z_m.truncate(points);
        let gap_m = end - first;
        if gap_m.abs() > LARGEST_GAP * length_m {
            return Err(Error::input(
                source,
                "height",
                format!("an end {gap_m:.1} m above the start of a closed road"),
                format!(
                    "heights that close to within {:.1} m, which is {}% of the length",
                    LARGEST_GAP * length_m,
                    100.0 * LARGEST_GAP
                ),
            ));
        }
        self.gap_m = gap_m;
        for (z, station) in self.z_m.iter_mut().zip(station_m) {
            *z -= gap_m * station / reach_m;
        }
        Ok(())
    }

    /// Smooth curves within these deviations of the figures (m, rad), over the knots of the line, and the friction, linear between
    /// them; nothing of a level and dry road.
    pub fn smoothed(
        &self,
        knots: &[f64],
        closed: bool,
        [height_m, bank_rad]: [f64; 2],
    ) -> Option<SmoothRelief> {
        if self.is_level() {
            return None;
        }
        let points = knots.len() - usize::from(closed);
        let fit = |given: &[f64], greatest: f64, longest_wave_m: f64| {
            if given.is_empty() {
                return Spline::smoothing(knots, &vec![0.0; points], closed, 0.0);
            }
            if greatest > 0.0 {
                Spline::within(knots, given, closed, greatest, longest_wave_m)
            } else {
                Spline::smoothing(knots, given, closed, 0.0)
            }
        };
        let height = fit(&self.z_m, height_m, LONGEST_WAVE_M);
        let bank = fit(&self.bank_rad, bank_rad, LONGEST_BANK_WAVE_M);
        let mut change = ReliefChange {
            gap_m: self.gap_m,
            ..ReliefChange::default()
        };
        if !self.z_m.is_empty() {
            let deviation = height.deviation(&self.z_m);
            (change.height_m, change.height_rms_m) = (deviation.greatest_m, deviation.rms_m);
        }
        if !self.bank_rad.is_empty() {
            change.bank_rad = bank.deviation(&self.bank_rad).greatest_m;
        }
        let mut friction = self.friction.clone();
        friction.resize(points, FrictionAcross::DRY.of);
        if closed {
            friction.push(friction[0]);
        }
        Some(SmoothRelief {
            height,
            bank,
            friction,
            change,
        })
    }
}

/// The surface along a line, as a function of its parameter.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct SmoothRelief {
    height: Spline<f64>,
    bank: Spline<f64>,
    /// At the knots, from the right edge to the left.
    friction: Vec<[f64; FRICTION_PLACES]>,
    /// What was changed.
    pub change: ReliefChange,
}

impl SmoothRelief {
    /// The surface on an interval of the line.
    pub fn on(&self, interval: usize, t: f64) -> ToEdges {
        let (from, to) = (self.height.knots[interval], self.height.knots[interval + 1]);
        let share = ((t - from) / (to - from)).clamp(0.0, 1.0);
        let plane = [&self.height, &self.bank].map(|curve| curve.on(interval, t).value);
        (
            plane,
            mixed(self.friction[interval], self.friction[interval + 1], share),
        )
    }

    /// The surface at a parameter.
    pub fn at(&self, t: f64) -> ToEdges {
        let t = self.height.wrap(t);
        self.on(self.height.interval(t), t)
    }

    /// Refuses a road that is too steep anywhere.
    ///
    /// # Errors
    /// [`Error::Input`] naming the station.
    pub fn check(&self, source: &str) -> Result<()> {
        let knots = &self.height.knots;
        let middles = knots.windows(2).map(|pair| 0.5 * (pair[0] + pair[1]));
        for t in knots.iter().copied().chain(middles) {
            let gradient = self.height.at(t).first;
            if gradient.is_nan() || gradient.abs() > STEEPEST {
                let found = format!("a gradient of {:.0}%", 100.0 * gradient);
                let expected = format!("at most {:.0}% up or down", 100.0 * STEEPEST);
                return Err(Error::input(
                    source,
                    Place::station(t).named("height"),
                    found,
                    expected,
                ));
            }
        }
        Ok(())
    }
}

/// The cubic through four figures at even steps, `t` of the way from the second to the third (E. Catmull, R. Rom, *A class of local
/// interpolating splines*, 1974).
pub(super) fn cubic([a, b, c, d]: [f64; 4], t: f64) -> f64 {
    let (second, third) = (2.0 * a - 5.0 * b + 4.0 * c - d, 3.0 * (b - c) + d - a);
    b + 0.5 * t * (c - a + t * (second + t * third))
}

/// A smooth curve through `data` at knots (ascending; a closed curve has one more, where it repeats its start), at some places.
pub(crate) fn interpolated(knots: &[f64], data: &[f64], closed: bool, at: &[f64]) -> Vec<f64> {
    let curve = Spline::smoothing(knots, data, closed, 0.0);
    at.iter().map(|t| curve.at(*t).value).collect()
}
