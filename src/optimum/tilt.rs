//! What a car can do at one place of a road that is not level and dry, as the solvers use it.
//!
//! A step's model takes the banking of each place and the load's curvature as they are on the line that it starts from: a line that moves
//! across the road moves within the surface, so that the latter stays to first order. Gradient and friction have what they gain across
//! the road. Laps by which steps are judged have the figures of their own line. What rotates counts as
//! lifted with the car on a climb, which moves a lap by less than a ten-thousandth.

use super::geometry::Shape;
use super::lap::{BendGrip, Grip, GripEnvelope, Slope};
use crate::line::MOST_LOAD;
use crate::vehicle::powertrain::GRAVITY_MPS2;

/// One place of the road, see [`crate::line::ground`].
#[derive(Clone, Copy, Debug, PartialEq)]
struct Tilt {
    /// Curvature square to the surface (1/m).
    dip: f64,
    /// Gravity along the car, to its left, and square to the surface (m/s^2).
    climb: f64,
    lean: f64,
    press: f64,
    /// As a share of the car's own.
    friction: f64,
}

/// The envelope of a car at a place.
struct Tilted<'a> {
    level: &'a dyn GripEnvelope,
    tilt: Tilt,
    open: Option<Box<Self>>,
}

impl<'a> Tilted<'a> {
    fn of(level: &'a dyn GripEnvelope, tilt: Tilt) -> Self {
        Self {
            level,
            tilt,
            open: level.open().map(|open| Box::new(Self::of(open, tilt))),
        }
    }

    /// The envelopes on both sides of the load at a speed (m/s), the share of the way from the first to the second, and the
    /// derivative of that by speed.
    fn between(&self, v: f64) -> Option<([&dyn GripEnvelope; 2], f64, f64)> {
        let load = self.tilt.press + v * v * self.tilt.dip;
        let held = load.clamp(0.0, MOST_LOAD * GRAVITY_MPS2);
        let [(low, below), (high, above)] = self.level.loaded(held)?;
        let by_speed = if held == load {
            2.0 * v * self.tilt.dip
        } else {
            0.0
        };
        Some((
            [below, above],
            (held - low) / (high - low),
            by_speed / (high - low),
        ))
    }
}

impl GripEnvelope for Tilted<'_> {
    fn at(&self, v: f64) -> Grip {
        let level = ([self.level; 2], 0.0, 0.0);
        let ([below, above], share, by_speed) = self.between(v).unwrap_or(level);
        let (low, high, friction) = (below.at(v), above.at(v), self.tilt.friction);
        let between = |figure: fn(&Grip) -> Slope| {
            let (a, b) = (figure(&low), figure(&high));
            Slope {
                value: a.value + share * (b.value - a.value),
                by_speed: a.by_speed + share * (b.by_speed - a.by_speed) + by_speed * (b.value - a.value),
            }
        };
        let of_tyres = |slope: Slope| {
            // A car without load has next to no grip.
            if friction * slope.value < LEAST_GRIP {
                return Slope {
                    value: LEAST_GRIP,
                    by_speed: 0.0,
                };
            }
            Slope {
                value: friction * slope.value,
                by_speed: friction * slope.by_speed,
            }
        };
        let mut grip = Grip {
            lateral: of_tyres(between(|grip| grip.lateral)),
            longitudinal: of_tyres(between(|grip| grip.longitudinal)),
            drive: between(|grip| grip.drive),
            drag: between(|grip| grip.drag),
        };
        grip.drag.value += self.tilt.climb;
        grip
    }

    fn traction(&self, v: f64, root: f64, friction: f64) -> Option<BendGrip> {
        let friction = friction * self.tilt.friction;
        let Some(([below, above], share, by_speed)) = self.between(v) else {
            return self.level.traction(v, root, friction);
        };
        let of = |envelope: &dyn GripEnvelope| {
            envelope.traction(v, root, friction).unwrap_or_else(|| {
                let grip = envelope.at(v).longitudinal;
                BendGrip {
                    value: friction * grip.value * root,
                    by_speed: friction * grip.by_speed * root,
                    by_root: friction * grip.value,
                }
            })
        };
        if [below, above]
            .iter()
            .all(|envelope| envelope.traction(v, root, friction).is_none())
        {
            return None;
        }
        let (low, high) = (of(below), of(above));
        let between = |a: f64, b: f64| a + share * (b - a);
        let value = between(low.value, high.value);
        let grip = self.at(v);
        // Beyond the loads that were swept the tyres give nothing back.
        let most = grip.drive.value.min(grip.longitudinal.value * root);
        (value > 0.0 && value < most).then(|| BendGrip {
            value,
            by_speed: between(low.by_speed, high.by_speed) + by_speed * (high.value - low.value),
            by_root: between(low.by_root, high.by_root),
        })
    }

    fn open(&self) -> Option<&dyn GripEnvelope> {
        self.open.as_deref().map(|open| open as &dyn GripEnvelope)
    }

    fn top_speed_mps(&self) -> f64 {
        self.level.top_speed_mps()
    }

    fn lock_1pm(&self) -> f64 {
        self.level.lock_1pm()
    }

    fn curvature_rate(&self) -> f64 {
        self.level.curvature_rate()
    }

    fn lean_mps2(&self) -> f64 {
        self.tilt.lean
    }
}

/// Least lateral limit and least grip of a car without load (m/s^2).
const LEAST_GRIP: f64 = 0.05;

impl Shape {
    /// What `of` makes of the envelope at point `i`.
    pub fn at_point<T>(
        &self,
        i: usize,
        envelope: &dyn GripEnvelope,
        of: impl FnOnce(&dyn GripEnvelope) -> T,
    ) -> T {
        let Some(relief) = &self.relief else {
            return of(envelope);
        };
        let [dip, climb, lean, press, friction] = relief.place(i);
        let tilt = Tilt {
            dip,
            climb,
            lean,
            press,
            friction,
        };
        of(&Tilted::of(envelope, tilt))
    }

    /// What `of` makes of the envelope on segment `s`, which is driven with these shares of its ends.
    pub fn on_segment<T>(
        &self,
        s: usize,
        [from, to]: [f64; 2],
        envelope: &dyn GripEnvelope,
        of: impl FnOnce(&dyn GripEnvelope) -> T,
    ) -> T {
        let Some(relief) = &self.relief else {
            return of(envelope);
        };
        let here = relief.place(s);
        let there = relief.place((s + 1) % self.turn_rad.len());
        let both = |k: usize| from * here[k] + to * there[k];
        let tilt = Tilt {
            dip: both(0),
            climb: here[1],
            lean: both(2),
            press: both(3),
            friction: both(4),
        };
        of(&Tilted::of(envelope, tilt))
    }

    /// The curvature that the tyres feel at each point (1/m): that along the surface.
    pub fn bends_1pm(&self) -> &[f64] {
        self.relief
            .as_ref()
            .map_or(&self.curvature_1pm, |relief| &relief.bend_1pm)
    }

    /// The length of each segment that is driven (m): that along the slope.
    pub fn driven_m(&self) -> &[f64] {
        self.relief
            .as_ref()
            .map_or(&self.length_m, |relief| &relief.length_m)
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Bounds, DescentSettings, LineMap, PointMassEnvelope, ReferenceProblem, fastest};
    use super::*;
    use crate::line::{FineLine, PointMass};
    use crate::track::{CrossSections, FrictionAcross, SectionRelief, Shape};
    use crate::vehicle::{BendTraction, Envelope, EnvelopeRow};
    use std::f64::consts::TAU;

    /// An ellipse with hills, 8 m high, and banking of up to eight degrees, as much of both as is asked for.
    fn road(share: f64) -> CrossSections {
        let shape = Shape::parse("ellipse:260:150:12").unwrap().unwrap();
        let level = shape.cross_sections(150).unwrap();
        let angle = |i: usize| TAU * i as f64 / 150.0;
        let relief = SectionRelief {
            foot_m: level.points(&[0.5; 150]),
            z_m: (0..150)
                .map(|i| share * 4.0 * (2.0 * angle(i) + 0.4).sin())
                .collect(),
            bank_rad: (0..150)
                .map(|i| -share * 0.07 * (1.0 + (2.0 * angle(i)).cos()))
                .collect(),
            friction: vec![FrictionAcross::DRY; 150],
        };
        CrossSections {
            relief: Some(relief),
            ..level
        }
    }

    fn car() -> PointMass {
        let rows = (1..=70).map(|i| {
            let v_mps = f64::from(i);
            let ay_mps2 = 14.0 + 4.0 * (v_mps / 70.0).powi(2);
            EnvelopeRow {
                v_mps,
                ay_mps2,
                ax_grip_mps2: 0.9 * ay_mps2,
                ax_drive_mps2: 250.0 / v_mps,
                drag_mps2: 4e-4 * v_mps * v_mps,
            }
        });
        PointMass {
            relief: true,
            ..PointMass::new(Envelope::new("made up", rows.collect()).unwrap(), 2.6)
        }
    }

    /// The solvers' lap is that of the fine spline, on hills as on the level: both are of second order, and sections are 9 m apart.
    /// Without height it is the level lap to rounding.
    #[test]
    fn the_solvers_lap_is_the_reported_one_on_hills() {
        let car = car();
        let envelope = PointMassEnvelope::new(&car).unwrap();
        let times = |road: &CrossSections| {
            let map = LineMap::at_every_cross_section(road);
            let problem = ReferenceProblem {
                envelope: Some(&envelope),
                bend: super::super::SegmentBend::Mean,
                ..ReferenceProblem::of(&map)
            };
            let points = road.points(&[0.5; 150]);
            let relief = road.relief_of(&points);
            let fine = FineLine::on(&points, relief.as_deref(), true, 1.0, Some((&car, &[])), 0.0).unwrap();
            [problem.measures(&[0.5; 150]).time_s, fine.lap_time_s().unwrap()]
        };
        let level = times(&CrossSections {
            relief: None,
            ..road(0.0)
        });
        let zero = times(&road(0.0));
        assert!((zero[0] / level[0] - 1.0).abs() < 1e-9, "{zero:?} {level:?}");
        let hills = times(&road(1.0));
        assert!((hills[0] / level[0] - 1.0).abs() > 5e-3, "{hills:?} {level:?}");
        let off = (hills[0] / hills[1]) / (level[0] / level[1]) - 1.0;
        assert!(off.abs() < 2e-3, "{hills:?} {level:?}");
        // The same where it is slippery along the road and across it.
        let mut wet = road(1.0);
        let angle = |i: usize| TAU * i as f64 / 150.0;
        wet.relief.as_mut().unwrap().friction = (0..150)
            .map(|i| [0.7 + 0.2 * (3.0 * angle(i)).sin(), 0.02 * (2.0 * angle(i)).cos()])
            .map(|of| FrictionAcross::linear(of, [6.0; 2]))
            .collect();
        let wet = times(&wet);
        assert!(wet[0] / hills[0] > 1.1, "{wet:?} {hills:?}");
        let off = (wet[0] / wet[1]) / (hills[0] / hills[1]) - 1.0;
        assert!(off.abs() < 2e-3, "{wet:?} {hills:?}");
    }

    /// On a ring, driven clockwise, whose outside has more friction the fastest lap is along the outer edge, which without it would be
    /// the slowest. The lap on a circle takes `2 pi sqrt(r / (f a))`.
    #[test]
    fn the_fastest_line_goes_where_the_friction_pays() {
        let rows = (1..=70).map(|i| EnvelopeRow {
            v_mps: f64::from(i),
            ay_mps2: 12.0,
            ax_grip_mps2: 11.0,
            ax_drive_mps2: 6.0,
            drag_mps2: 0.0,
        });
        let car = PointMass {
            relief: true,
            ..PointMass::new(Envelope::new("made up", rows.collect()).unwrap(), 2.6)
        };
        let envelope = PointMassEnvelope::new(&car).unwrap();
        let ring = Shape::parse("circle:95:105").unwrap().unwrap();
        let level = ring.cross_sections(120).unwrap();
        let fastest_on = |friction: FrictionAcross| {
            let road = CrossSections {
                relief: Some(SectionRelief {
                    foot_m: level.points(&[0.5; 120]),
                    z_m: vec![0.0; 120],
                    bank_rad: vec![0.0; 120],
                    friction: vec![friction; 120],
                }),
                ..level.clone()
            };
            let map = LineMap::at_every_cross_section(&road);
            let problem = ReferenceProblem {
                envelope: Some(&envelope),
                ..ReferenceProblem::of(&map)
            };
            let bounds = Bounds::road(120);
            fastest(&problem, &bounds, &[0.5; 120], &DescentSettings::default()).unwrap()
        };
        // Driven clockwise, the outside is the left. The last has its grip in the middle of the road alone.
        let linear = |of: [f64; 2]| FrictionAcross::linear(of, [5.0; 2]);
        let ridge = FrictionAcross {
            of: [0.5, 0.5, 0.9, 0.5, 0.5],
            ..linear([1.0, 0.0])
        };
        for (friction, radius, there) in [
            (linear([0.7, 0.04]), 105.0, 0.9),
            (linear([0.7, 0.0]), 95.0, 0.7),
            (ridge, 100.0, 0.9),
        ] {
            let found = fastest_on(friction);
            let wanted_s = TAU * (radius / (there * 12.0f64)).sqrt();
            // A ring of 120 chords is a part in ten thousand shorter than its circle.
            let off = found.value / wanted_s - 1.0;
            assert!(
                off.abs() < 3e-4,
                "{} for {wanted_s}: {:?}",
                found.value,
                found.status
            );
        }
    }

    /// Tyres that lose less of the engine the more they carry leave no more than all of it, however much that is.
    #[test]
    fn the_engine_gives_no_more_than_it_has_beyond_the_loads_that_were_swept() {
        let under = |lost: f64| {
            let limits = car().envelope;
            let rows = limits.rows().len();
            let in_bends = BendTraction {
                shares: vec![0.0, 1.0],
                rows: vec![vec![100.0; 2]; rows],
                lost: vec![vec![lost; 2]; rows],
            };
            limits.with_bend_traction(in_bends).unwrap()
        };
        let loads = vec![(0.6, under(2.0)), (1.0, under(1.25)), (1.4, under(0.5))];
        let car = PointMass {
            envelope: under(1.25).with_loads(loads).unwrap(),
            ..car()
        };
        let envelope = PointMassEnvelope::new(&car).unwrap();
        for share in [1.2, 1.8, 2.4] {
            let tilt = Tilt {
                dip: 0.0,
                climb: 0.0,
                lean: 0.0,
                press: share * GRAVITY_MPS2,
                friction: 1.0,
            };
            let there = Tilted::of(&envelope, tilt);
            let drive = there.at(40.0).drive.value;
            let left = there.traction(40.0, 1.0, 1.0).map(|bend| bend.value);
            assert_eq!(left.is_some(), share < 1.6, "{share}: {left:?} of {drive}");
            assert!(
                left.is_none_or(|left| left < drive),
                "{share}: {left:?} of {drive}"
            );
        }
    }

    /// A line that the solver finds on hills is faster there than the one it finds for the level road.
    #[test]
    fn the_fastest_line_on_hills_is_not_that_of_the_level_road() {
        let car = car();
        let envelope = PointMassEnvelope::new(&car).unwrap();
        let (hills, bounds) = (road(1.0), Bounds::road(150));
        let level = CrossSections {
            relief: None,
            ..hills.clone()
        };
        let maps = [&level, &hills].map(LineMap::at_every_cross_section);
        let [of_level, of_hills] = [0, 1].map(|k| {
            let problem = ReferenceProblem {
                envelope: Some(&envelope),
                ..ReferenceProblem::of(&maps[k])
            };
            let found = fastest(&problem, &bounds, &[0.5; 150], &DescentSettings::default()).unwrap();
            let judged = ReferenceProblem {
                envelope: Some(&envelope),
                ..ReferenceProblem::of(&maps[1])
            };
            judged.measures(&found.x).time_s
        });
        let middle = ReferenceProblem {
            envelope: Some(&envelope),
            ..ReferenceProblem::of(&maps[1])
        };
        let middle = middle.measures(&[0.5; 150]).time_s;
        assert!(of_hills <= of_level + 1e-6 * of_level, "{of_hills} {of_level}");
        assert!(of_hills < 0.99 * middle, "{of_hills} {middle}");
    }
}
