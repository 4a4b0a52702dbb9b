//! The speed that the driver aims for: a forward and a backward pass under a friction ellipse (the book, chapter Model,
//! section 5, in first-order form; a driver needs no better).

use super::relief::{RELIEF_WIDTH, row_of};
use crate::scalar::bisected;
use crate::track::Circuit;
use crate::vehicle::aero::aero_forces;
use crate::vehicle::{Car, Chassis, Tyres};

/// Speeds to aim for along the centreline, at even steps from the start line, linear between them and periodic.
#[derive(Clone, Debug)]
pub struct SpeedPlan {
    /// Distance between grid points, m.
    pub spacing_m: f64,
    /// Speed at each grid point, m/s.
    pub speed_mps: Vec<f64>,
}

/// Friction of a tyre whose model has no limit.
const LINEAR_TYRE_FRICTION: f64 = 1.0;
/// Grid spacing along the centreline, m.
const SPACING: f64 = 2.0;

/// What the tyres carry at a speed (m/s), over the car's mass (m/s^2).
pub(super) fn load_mps2(c: &Chassis<f64>, speed: f64) -> f64 {
    let aero = aero_forces(c, speed, 0.0);
    c.gravity + (aero.downforce_front + aero.downforce_rear) / c.mass
}

/// A row of the road, see [`row_of`].
type Row = [f64; RELIEF_WIDTH];

/// Estimates of what the car can do at a speed: lateral and longitudinal grip, drive and drag, all in m/s^2.
struct TyreEnvelope<'a> {
    car: &'a Car,
    friction: f64,
}

impl TyreEnvelope<'_> {
    /// On a row of the road, see [`row_of`].
    fn grip(&self, speed: f64, [_, _, press, dip, friction, ..]: Row) -> f64 {
        let c = &self.car.chassis;
        let aero = aero_forces(c, speed, 0.0);
        let load = press + speed * speed * dip + (aero.downforce_front + aero.downforce_rear) / c.mass;
        friction * self.friction * load.max(0.0)
    }

    fn drag(&self, speed: f64, flap: f64) -> f64 {
        let c = &self.car.chassis;
        aero_forces(c, speed, flap).drag / c.mass
    }

    fn drive(&self, speed: f64) -> f64 {
        let c = &self.car.chassis;
        match &self.car.powertrain {
            Some(powertrain) => powertrain.wheel_force(speed, c.radius_rear) / c.mass,
            None => 0.4 * self.grip(speed, self.level()),
        }
    }

    /// The row of a level and dry road.
    fn level(&self) -> Row {
        [0.0, 0.0, self.car.chassis.gravity, 0.0, 1.0, 0.0, 0.0, 0.0]
    }

    /// What the ellipse leaves for the longitudinal direction at a curvature.
    fn remaining(&self, speed: f64, curvature: f64, row: Row) -> f64 {
        let grip = self.grip(speed, row);
        if grip <= 0.0 {
            return 0.0;
        }
        let used = ((curvature * speed * speed + row[1]).abs() / grip).min(1.0);
        grip * (1.0 - used * used).sqrt()
    }

    /// The greatest speed (m/s) up to `top` at a curvature.
    fn corner(&self, curvature: f64, top: f64, row: Row) -> f64 {
        if row[1] == 0.0 && row[3] == 0.0 {
            // Grip grows with speed, so the corner speed is a fixed point; a few rounds settle it.
            let mut v = top;
            for _ in 0..60 {
                v = (self.grip(v, row) / curvature.abs().max(1e-9)).sqrt().min(top);
            }
            return v;
        }
        let holds = |v: f64| (curvature * v * v + row[1]).abs() <= self.grip(v, row);
        if holds(top) {
            return top;
        }
        bisected([0.0, top], 1e-12 * top, holds)[0]
    }
}

impl SpeedPlan {
    /// Plans a lap at `pace`, the share of the car's friction that the driver uses (0 to 1).
    ///
    /// `top_speed` (m/s) caps the straights.
    pub fn new(car: &Car, circuit: &Circuit, pace: f64, top_speed: f64) -> Self {
        let friction = pace
            * match &car.tyres {
                Tyres::MagicFormula { front, rear } => {
                    let mu =
                        |t: &crate::vehicle::TyreCoefficients<f64>| (t.pdx1 * t.lmux).min(t.pdy1 * t.lmuy);
                    mu(&front.coefficients).min(mu(&rear.coefficients))
                }
                Tyres::Linear { .. } => LINEAR_TYRE_FRICTION,
            };
        let envelope = TyreEnvelope { car, friction };
        let count = (circuit.length_m / SPACING).round().max(8.0) as usize;
        let spacing_m = circuit.length_m / count as f64;
        let curvature: Vec<f64> = (0..count)
            .map(|i| circuit.curvature_at(i as f64 * spacing_m))
            .collect();
        let samples = circuit.station_m.len();
        let row = |i: usize| {
            let sample = (i as f64 * spacing_m / circuit.spacing_m()).round() as usize % samples;
            match circuit.relief {
                Some(_) => row_of(circuit, sample),
                None => envelope.level(),
            }
        };
        let rows: Vec<Row> = (0..count).map(row).collect();
        let places = curvature.iter().zip(&rows);
        let mut speed_mps: Vec<f64> = places
            .map(|(k, row)| envelope.corner(*k, top_speed, *row))
            .collect();
        // Two rounds, because the start of a closed lap needs the speed at its end.
        for step in 0..2 * count {
            let (i, next) = (step % count, (step + 1) % count);
            let v = speed_mps[i];
            let flap = f64::from(u8::from(circuit.drs_at(i as f64 * spacing_m)));
            let tyres = 0.6 * envelope.remaining(v, curvature[i], rows[i]);
            let a = envelope.drive(v).min(tyres) - envelope.drag(v, flap) - rows[i][0];
            speed_mps[next] = speed_mps[next].min((v * v + 2.0 * a * spacing_m).max(1.0).sqrt());
        }
        for step in (0..2 * count).rev() {
            let (i, next) = (step % count, (step + 1) % count);
            let v = speed_mps[next];
            let tyres = 0.85 * envelope.remaining(v, curvature[next], rows[next]);
            let a = tyres + envelope.drag(v, 0.0) + rows[next][0];
            speed_mps[i] = speed_mps[i].min((v * v + 2.0 * a * spacing_m).max(1.0).sqrt());
        }
        Self { spacing_m, speed_mps }
    }

    /// A plan of given speeds (m/s) at rising stations (m) of a closed lap of this length (m), the first at zero.
    pub fn of_speeds(station_m: &[f64], speed_mps: &[f64], length_m: f64) -> Self {
        let count = (length_m / SPACING).round().max(8.0) as usize;
        let spacing_m = length_m / count as f64;
        let n = station_m.len();
        let mut before = 0;
        let speeds = (0..count).map(|i| {
            let at = i as f64 * spacing_m;
            while before + 1 < n && station_m[before + 1] <= at {
                before += 1;
            }
            let (next, end) = if before + 1 < n {
                (before + 1, station_m[before + 1])
            } else {
                (0, length_m)
            };
            let share = ((at - station_m[before]) / (end - station_m[before])).clamp(0.0, 1.0);
            speed_mps[before] + share * (speed_mps[next] - speed_mps[before])
        });
        Self {
            spacing_m,
            speed_mps: speeds.collect(),
        }
    }
}
