//! Circuits of simple shapes with known optima.

use super::circuit::{Circuit, Corner, Section};
use super::cross_sections::CrossSections;
use super::cutting::cross_sections;
use super::relief::{ReliefChange, SurfaceAcross};
use super::road::{Road, RoadFrame, circuit};
use crate::{Error, Result};
use glam::DVec2;
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// A closed circuit of a simple shape about the origin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shape {
    /// Two circles. The road runs clockwise where the right edge is the inner one, anticlockwise where the left one is.
    Circle {
        /// Radius of the right edge (m).
        right_m: f64,
        /// Radius of the left edge (m).
        left_m: f64,
    },
    /// A road about an ellipse, anticlockwise.
    Ellipse {
        /// Half the axis of the middle line along x (m).
        half_x_m: f64,
        /// Half the axis of the middle line along y (m).
        half_y_m: f64,
        /// Width of the road (m).
        width_m: f64,
    },
    /// Two straights joined by half circles, anticlockwise, the straights along x.
    Stadium {
        /// Length of a straight (m).
        straight_m: f64,
        /// Radius of the middle line in the bends (m).
        radius_m: f64,
        /// Width of the road (m).
        width_m: f64,
    },
}

const SYNTAX: &str = "circle:RIGHT:LEFT (radii of the edges), ellipse:HALF_X:HALF_Y:WIDTH or \
                      stadium:STRAIGHT:RADIUS:WIDTH, in metres";
/// Range of radii and lengths (m), and narrowest road.
const SIZE_M: (f64, f64) = (5.0, 20_000.0);
const NARROWEST_M: f64 = 0.5;

impl Shape {
    /// Reads `circle:590:600`, `ellipse:400:250:12` or `stadium:500:100:12`; `None` if the text names no shape.
    ///
    /// # Errors
    /// [`Error::Input`] when a shape is named and its figures are not as many as it takes, or cannot be a road's.
    pub fn parse(text: &str) -> Option<Result<Self>> {
        let (kind, figures) = text.trim().split_once(':')?;
        let takes = match kind {
            "circle" => 2,
            "ellipse" | "stadium" => 3,
            _ => return None,
        };
        let figures: Option<Vec<f64>> = figures.split(':').map(|f| f.trim().parse().ok()).collect();
        let wrong = || Error::input("track", text.trim(), "not the figures of a shape", SYNTAX);
        let shape = match (kind, figures.as_deref()) {
            (_, Some(figures)) if figures.len() != takes => None,
            ("circle", Some(&[right_m, left_m])) => Some(Self::Circle { right_m, left_m }),
            ("ellipse", Some(&[half_x_m, half_y_m, width_m])) => Some(Self::Ellipse {
                half_x_m,
                half_y_m,
                width_m,
            }),
            ("stadium", Some(&[straight_m, radius_m, width_m])) => Some(Self::Stadium {
                straight_m,
                radius_m,
                width_m,
            }),
            _ => None,
        };
        Some(
            shape
                .ok_or_else(wrong)
                .and_then(|shape| shape.check().map(|()| shape)),
        )
    }

    /// A shape as [`Shape::parse`] reads it.
    pub fn name(&self) -> String {
        match self {
            Self::Circle { right_m, left_m } => format!("circle:{right_m}:{left_m}"),
            Self::Ellipse {
                half_x_m,
                half_y_m,
                width_m,
            } => format!("ellipse:{half_x_m}:{half_y_m}:{width_m}"),
            Self::Stadium {
                straight_m,
                radius_m,
                width_m,
            } => format!("stadium:{straight_m}:{radius_m}:{width_m}"),
        }
    }

    fn check(&self) -> Result<()> {
        let refuse = |field: &str, found: f64, expected: String| {
            Err(Error::input(self.name(), field, format!("{found} m"), expected))
        };
        let (sizes, width, tightest) = match *self {
            Self::Circle { right_m, left_m } => {
                let sizes = [
                    ("radius of the right edge", right_m),
                    ("radius of the left edge", left_m),
                ];
                (sizes, (left_m - right_m).abs(), f64::INFINITY)
            }
            Self::Ellipse {
                half_x_m,
                half_y_m,
                width_m,
            } => {
                let (small, great) = (half_x_m.min(half_y_m), half_x_m.max(half_y_m));
                (
                    [("half_x_m", half_x_m), ("half_y_m", half_y_m)],
                    width_m,
                    small * small / great,
                )
            }
            Self::Stadium {
                straight_m,
                radius_m,
                width_m,
            } => (
                [("straight_m", straight_m), ("radius_m", radius_m)],
                width_m,
                radius_m,
            ),
        };
        for (field, size) in sizes {
            if !(SIZE_M.0..=SIZE_M.1).contains(&size) {
                return refuse(field, size, format!("{} to {} m", SIZE_M.0, SIZE_M.1));
            }
        }
        // Half the road lies inside the tightest bend.
        let widest = (2.0 * tightest).min(400.0);
        if !(width >= NARROWEST_M && width < widest) {
            return refuse(
                "width",
                width,
                format!("{NARROWEST_M} m to less than {widest:.1} m"),
            );
        }
        Ok(())
    }

    /// Cross-sections across the road, along the normals.
    ///
    /// # Errors
    /// [`Error::Input`] for a shape or spacing out of range.
    pub fn cross_sections(&self, count: usize) -> Result<CrossSections> {
        self.check()?;
        cross_sections(&Shaped::new(*self), count)
    }

    /// The circuit. Its curvature is sampled every metre, so that the ends of a stadium's bends are ramps of a metre.
    ///
    /// # Errors
    /// [`Error::Input`] for a shape out of range.
    pub fn circuit(&self) -> Result<Circuit> {
        self.check()?;
        Ok(circuit(&Shaped::new(*self))?.0)
    }
}

/// Steps of the table that turns distance along an ellipse into its angle.
const ELLIPSE_STEPS: usize = 20_000;

/// A shape with its length.
struct Shaped {
    shape: Shape,
    name: String,
    length_m: f64,
    /// Distance along an ellipse up to evenly spaced angles (m).
    arc_m: Vec<f64>,
}

impl Shaped {
    fn new(shape: Shape) -> Self {
        let mut arc_m = Vec::new();
        let length_m = match shape {
            Shape::Circle { right_m, left_m } => PI * (right_m + left_m),
            Shape::Stadium {
                straight_m, radius_m, ..
            } => 2.0 * straight_m + TAU * radius_m,
            Shape::Ellipse {
                half_x_m, half_y_m, ..
            } => {
                let speed = |u: f64| (half_x_m * u.sin()).hypot(half_y_m * u.cos());
                let step = TAU / ELLIPSE_STEPS as f64;
                let mut sum = 0.0;
                arc_m.push(0.0);
                for i in 0..ELLIPSE_STEPS {
                    // Simpson's rule on each step.
                    let u = i as f64 * step;
                    sum += step / 6.0 * (speed(u) + 4.0 * speed(u + 0.5 * step) + speed(u + step));
                    arc_m.push(sum);
                }
                sum
            }
        };
        Self {
            shape,
            name: shape.name(),
            length_m,
            arc_m,
        }
    }
}

impl Road for Shaped {
    fn name(&self) -> &str {
        &self.name
    }

    fn source(&self) -> &str {
        &self.name
    }

    fn closed(&self) -> bool {
        true
    }

    fn length_m(&self) -> f64 {
        self.length_m
    }

    fn frame(&self, station_m: f64) -> RoadFrame {
        let s = station_m.rem_euclid(self.length_m);
        match self.shape {
            Shape::Circle { right_m, left_m } => {
                let radius = 0.5 * (right_m + left_m);
                let way = if right_m > left_m { 1.0 } else { -1.0 };
                let out = DVec2::from_angle(way * s / radius);
                RoadFrame {
                    position_m: radius * out,
                    tangent: way * out.perp(),
                    curvature_1pm: way / radius,
                    left_m: 0.5 * (right_m - left_m).abs(),
                    right_m: 0.5 * (right_m - left_m).abs(),
                    surface: SurfaceAcross::LEVEL_AND_DRY,
                }
            }
            Shape::Ellipse {
                half_x_m,
                half_y_m,
                width_m,
            } => {
                let after = self.arc_m.partition_point(|&a| a <= s).clamp(1, ELLIPSE_STEPS);
                let (from, to) = (self.arc_m[after - 1], self.arc_m[after]);
                let step = TAU / ELLIPSE_STEPS as f64;
                let (sin, cos) = (step * ((after - 1) as f64 + (s - from) / (to - from))).sin_cos();
                let first = DVec2::new(-half_x_m * sin, half_y_m * cos);
                RoadFrame {
                    position_m: DVec2::new(half_x_m * cos, half_y_m * sin),
                    tangent: first.normalize_or_zero(),
                    curvature_1pm: half_x_m * half_y_m / first.length().powi(3),
                    left_m: 0.5 * width_m,
                    right_m: 0.5 * width_m,
                    surface: SurfaceAcross::LEVEL_AND_DRY,
                }
            }
            Shape::Stadium {
                straight_m,
                radius_m,
                width_m,
            } => {
                let half = 0.5 * self.length_m;
                // The second half is the first one turned by half a turn.
                let (s, sign) = if s < half { (s, 1.0) } else { (s - half, -1.0) };
                let (position, tangent, curvature_1pm) = if s < straight_m {
                    (DVec2::new(s - 0.5 * straight_m, -radius_m), DVec2::X, 0.0)
                } else {
                    let out = DVec2::from_angle((s - straight_m) / radius_m - FRAC_PI_2);
                    let middle = DVec2::new(0.5 * straight_m, 0.0);
                    (middle + radius_m * out, out.perp(), 1.0 / radius_m)
                };
                RoadFrame {
                    position_m: sign * position,
                    tangent: sign * tangent,
                    curvature_1pm,
                    left_m: 0.5 * width_m,
                    right_m: 0.5 * width_m,
                    surface: SurfaceAcross::LEVEL_AND_DRY,
                }
            }
        }
    }

    fn sections(&self) -> &[Section] {
        &[]
    }

    fn corners(&self) -> &[Corner] {
        &[]
    }

    fn drs_zones_m(&self) -> &[[f64; 2]] {
        &[]
    }

    fn relief_change(&self) -> Option<ReliefChange> {
        None
    }
}
