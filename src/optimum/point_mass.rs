//! The g-g-v envelope of a [`PointMass`], as the solvers use it.

use super::lap::{BendGrip, Grip, GripEnvelope, Slope};
use crate::line::PointMass;
use crate::vehicle::envelope::traction_at_root;
use crate::vehicle::powertrain::GRAVITY_MPS2;
use crate::vehicle::{BendTraction, Envelope, EnvelopeRow};
use crate::{Error, Result};

/// The envelope of a point mass, linear in speed between its rows, its steering lock and its steering rate.
#[derive(Clone, Debug, PartialEq)]
pub struct PointMassEnvelope {
    rows: Vec<EnvelopeRow>,
    in_bends: Option<BendTraction>,
    lock_1pm: f64,
    curvature_rate: f64,
    open: Option<Box<Self>>,
    /// The same under loads over the mass (m/s^2), rising; none for level roads.
    loads: Vec<(f64, Self)>,
}

impl PointMassEnvelope {
    /// The envelope of `car`.
    ///
    /// # Errors
    /// [`Error::Input`] for settings out of range, and for a friction ellipse whose exponent is not 2, the only one that the
    /// solvers handle.
    pub fn new(car: &PointMass) -> Result<Self> {
        car.check()?;
        if car.ellipse_exponent != 2.0 {
            return Err(Error::input(
                car.envelope.name(),
                "ellipse_exponent",
                car.ellipse_exponent.to_string(),
                "2 for a reference optimum",
            ));
        }
        let lock_1pm = car
            .max_steer_rad
            .map_or(f64::INFINITY, |lock| lock / car.wheelbase_m);
        Ok(Self {
            open: car
                .envelope
                .open()
                .map(|open| Box::new(Self::under_loads(open, car.relief, lock_1pm))),
            curvature_rate: car.curvature_rate().unwrap_or(f64::INFINITY),
            ..Self::under_loads(&car.envelope, car.relief, lock_1pm)
        })
    }

    fn of(envelope: &Envelope, lock_1pm: f64) -> Self {
        Self {
            rows: envelope.rows().to_vec(),
            in_bends: envelope.bend_traction().cloned(),
            lock_1pm,
            curvature_rate: f64::INFINITY,
            open: None,
            loads: Vec::new(),
        }
    }

    /// The envelope and, for roads in three dimensions, those under loads. Limits that were not swept under any go with the load.
    fn under_loads(envelope: &Envelope, relief: bool, lock_1pm: f64) -> Self {
        let level = Self::of(envelope, lock_1pm);
        if !relief {
            return level;
        }
        let swept = envelope.loads().iter();
        let mut loads: Vec<(f64, Self)> = swept
            .map(|(share, limits)| (share * GRAVITY_MPS2, Self::of(limits, lock_1pm)))
            .collect();
        if loads.is_empty() {
            let mut weightless = level.clone();
            for row in &mut weightless.rows {
                (row.ay_mps2, row.ax_grip_mps2) = (0.0, 0.0);
            }
            for figures in weightless.in_bends.iter_mut().flat_map(|table| &mut table.rows) {
                figures.fill(0.0);
            }
            loads = vec![(0.0, weightless), (GRAVITY_MPS2, level.clone())];
        }
        Self { loads, ..level }
    }
}

impl PointMassEnvelope {
    /// The rows on both sides of a speed.
    fn around(&self, v_mps: f64) -> [usize; 2] {
        let after = self.rows.partition_point(|row| row.v_mps <= v_mps);
        [after.saturating_sub(1), after.min(self.rows.len() - 1)]
    }
}

impl GripEnvelope for PointMassEnvelope {
    fn at(&self, v_mps: f64) -> Grip {
        let [low, high] = self.around(v_mps).map(|i| self.rows[i]);
        let span = high.v_mps - low.v_mps;
        let between = |figure: fn(&EnvelopeRow) -> f64| {
            let by_speed = if span > 0.0 {
                (figure(&high) - figure(&low)) / span
            } else {
                0.0
            };
            Slope {
                value: figure(&low) + by_speed * (v_mps - low.v_mps).max(0.0),
                by_speed,
            }
        };
        Grip {
            lateral: between(|row| row.ay_mps2),
            longitudinal: between(|row| row.ax_grip_mps2),
            drive: between(|row| row.ax_drive_mps2),
            drag: between(|row| row.drag_mps2),
        }
    }

    fn traction(&self, v_mps: f64, root: f64, friction: f64) -> Option<BendGrip> {
        let BendTraction { shares, rows, lost } = self.in_bends.as_ref()?;
        let [low, high] = self.around(v_mps);
        let (start, span) = (self.rows[low].v_mps, self.rows[high].v_mps - self.rows[low].v_mps);
        let share = if span > 0.0 {
            ((v_mps - start) / span).max(0.0)
        } else {
            0.0
        };
        let within = |rows: &[Vec<f64>], factor: f64| {
            let [from, to] = [low, high].map(|i| {
                let (value, by_root) = traction_at_root(shares, &rows[i], root);
                (factor * value, factor * by_root)
            });
            BendGrip {
                value: from.0 + share * (to.0 - from.0),
                by_speed: if span > 0.0 { (to.0 - from.0) / span } else { 0.0 },
                by_root: from.1 + share * (to.1 - from.1),
            }
        };
        // What tyres take from the drive goes with their force and their slip angle, both of them with the friction.
        let (tyres, lost) = (within(rows, friction), within(lost, friction * friction));
        let grip = self.at(v_mps);
        let engine = BendGrip {
            value: grip.drive.value - lost.value,
            by_speed: grip.drive.by_speed - lost.by_speed,
            by_root: -lost.by_root,
        };
        let least = if engine.value < tyres.value { engine } else { tyres };
        // Tyres that drive never have more than the ellipse.
        (least.value < friction * grip.longitudinal.value * root).then_some(least)
    }

    fn loaded(&self, load_mps2: f64) -> Option<[(f64, &dyn GripEnvelope); 2]> {
        let after = self.loads.partition_point(|(load, _)| *load <= load_mps2);
        let after = after.clamp(1, self.loads.len().checked_sub(1).filter(|last| *last > 0)?);
        let [below, above] = [after - 1, after].map(|i| &self.loads[i]);
        Some([(below.0, &below.1), (above.0, &above.1)])
    }

    fn open(&self) -> Option<&dyn GripEnvelope> {
        self.open.as_deref().map(|open| open as &dyn GripEnvelope)
    }

    fn lock_1pm(&self) -> f64 {
        self.lock_1pm
    }

    fn curvature_rate(&self) -> f64 {
        self.curvature_rate
    }

    fn top_speed_mps(&self) -> f64 {
        self.rows.last().map_or(0.0, |row| row.v_mps)
    }
}

#[cfg(test)]
mod tests {
    use super::super::lap::{SegmentBend, corner_square};
    use super::super::{LineMap, ReferenceProblem, Weights};
    use super::*;
    use crate::line::FineLine;
    use crate::line::kernel::{acceleration, corner};
    use crate::track::Shape;
    use crate::vehicle::Car;
    use crate::vehicle::limits::{SpeedRange, car_envelope};

    /// Both have the sweep's table: the solvers as it is, the kernels in cells of a thirty-second of the root, over which traction
    /// bends by less than a tenth of a m/s^2.
    #[test]
    fn the_solvers_know_the_traction_in_bends_as_the_kernels_do() {
        let car = Car::bundled().unwrap();
        let swept = car_envelope(&car, &SpeedRange::USUAL).unwrap().envelope;
        // The engine is out of the way.
        let strong = |_: &Envelope, row: &EnvelopeRow| EnvelopeRow {
            ax_drive_mps2: 100.0,
            ..*row
        };
        let car = PointMass::new(swept.with_rows("strong", &strong).unwrap(), 2.6);
        let (table, solvers) = (car.table().unwrap(), PointMassEnvelope::new(&car).unwrap());
        let mut compared = 0;
        for v in [20.0, 33.0, 50.0, 65.0f64] {
            let grip = solvers.at(v);
            for root in [0.0, 0.1, 0.3, 0.5, 0.7, 0.9, 0.99f64] {
                let used = (1.0 - root * root).sqrt() * grip.lateral.value / (v * v);
                let kernel = acceleration::<f64>(&table, false, v * v, used) + grip.drag.value;
                let bend = solvers.traction(v, root, 1.0);
                let value = bend.map_or(grip.longitudinal.value * root, |bend| bend.value);
                assert!((kernel - value).abs() < 0.15, "{v}, {root}: {kernel} {value}");
                // Away from the shares that were swept the slopes are those of differences.
                let step = |v: f64, root: f64| solvers.traction(v, root, 1.0).map(|bend| bend.value);
                if let (Some(bend), Some(faster), Some(wider)) =
                    (bend, step(v + 1e-6, root), step(v, root + 1e-7))
                {
                    let (by_speed, by_root) = ((faster - value) / 1e-6, (wider - value) / 1e-7);
                    assert!(
                        (by_root - bend.by_root).abs() < 1e-4,
                        "{v}, {root}: {by_root} {bend:?}"
                    );
                    assert!(
                        (by_speed - bend.by_speed).abs() < 1e-4,
                        "{v}, {root}: {by_speed} {bend:?}"
                    );
                    compared += 1;
                }
            }
        }
        assert!(compared > 12, "{compared}");
    }

    /// Solvers and kernels gain the same by a DRS on two thirds of an ellipse. Both laps are of second order on segments of 3.5 m.
    #[test]
    fn the_solvers_open_the_drs_as_the_kernels_do() {
        let shape = Shape::parse("ellipse:300:60:12").unwrap().unwrap();
        let mut road = shape.cross_sections(400).unwrap();
        let swept = car_envelope(&Car::bundled().unwrap(), &SpeedRange::USUAL)
            .unwrap()
            .envelope;
        let less = |_: &Envelope, row: &EnvelopeRow| EnvelopeRow {
            ay_mps2: 0.96 * row.ay_mps2,
            drag_mps2: 0.6 * row.drag_mps2,
            ..*row
        };
        let open = swept.with_rows("open", &less).unwrap();
        let car = PointMass::new(swept.with_open(open).unwrap(), 2.6);
        let solvers = PointMassEnvelope::new(&car).unwrap();
        let middle = vec![0.5; road.len()];
        let mut gained = |drs: bool| {
            road.drs = (0..400).map(|i| drs && i % 150 < 100).collect();
            let map = LineMap::at_every_cross_section(&road);
            let problem = ReferenceProblem {
                envelope: Some(&solvers),
                bend: SegmentBend::Mean,
                ..ReferenceProblem::of(&map)
            };
            let time = Weights {
                time: 1.0,
                ..Weights::default()
            };
            let points = road.points(&middle);
            let line = FineLine::new(&points, true, 1000.0, Some((&car, &road.drs)), 0.0).unwrap();
            (problem.cost(&time, &middle).0, line.lap_time_s().unwrap())
        };
        let (without, with) = (gained(false), gained(true));
        let [by_solver, by_kernel] = [without.0 - with.0, without.1 - with.1];
        assert!(by_kernel > 0.05, "{by_kernel} s");
        assert!(
            (by_solver / by_kernel - 1.0).abs() < 0.02,
            "{by_solver} and {by_kernel} s"
        );
    }

    /// A lock of 0.012 rad at a wheelbase of 2.6 m turns a circle of 217 m. In one of 144.4 m, which takes 0.018 rad, the squared
    /// speed is (0.012 / 0.018)^4 of what the tyres hold.
    #[test]
    fn the_solvers_know_the_steering_lock_as_the_kernels_do() {
        let text = "v_mps,ay_mps2,ax_grip_mps2,ax_drive_mps2,drag_mps2\n10,14,14,9,0.1\n70,18,18,4,4\n";
        let free = PointMass::new(Envelope::from_csv("own.csv", text).unwrap(), 2.6);
        let locked = PointMass {
            max_steer_rad: Some(0.012),
            ..free.clone()
        };
        let table = locked.table().unwrap();
        let [free, locked] = [free, locked].map(|car| PointMassEnvelope::new(&car).unwrap());
        let tight = 0.018 / 2.6;
        let share = corner_square(&locked, tight).0 / corner_square(&free, tight).0;
        assert!((share - (2.0f64 / 3.0).powi(4)).abs() < 1e-12, "{share}");
        for curvature in [0.5 / 217.0, 0.99 / 217.0, 1.1 / 217.0, -1.5 / 217.0, 3.0 / 217.0] {
            let (square, slope) = corner_square(&locked, curvature);
            // The kernels' table has steps of 0.3 m of radius.
            let kernel = corner::<f64>(&table, curvature.abs());
            assert!(
                (kernel / square - 1.0).abs() < 1e-3,
                "{curvature}: {kernel} {square}"
            );
            let step = 1e-6 * curvature.abs();
            let ends = [curvature - step, curvature + step].map(|k| corner_square(&locked, k).0);
            let found = (ends[1] - ends[0]) / (2.0 * step);
            assert!(
                (found - slope).abs() < 1e-5 * square / curvature.abs(),
                "{curvature}: {found} {slope}"
            );
        }
    }
}
