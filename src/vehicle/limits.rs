//! What a car can do at each speed, from its 4DOF model: the limits that make its g-g-v envelope.
//!
//! At every speed the steady states of the car ([`super::steady`]) give lateral acceleration over steering and its ridge,
//! straight-line running the greatest braking and traction, and the powertrain what the engine can give through the gears. At
//! shares of the ridge the driven wheels are pushed on until they give no more: the traction that is left in bends. The
//! rows make an [`Envelope`]; the small-angle end of the curves gives the handling figures.

use super::envelope::{BendTraction, root_left};
use super::powertrain::GRAVITY_MPS2;
use super::{BendDrive, Car, Envelope, EnvelopeRow, SteadyCar, Traction, Trim, Turn, steady_car};
use crate::error::{Error, Result};
use crate::scalar::bisected;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// The slowest speed that a car's own range begins at (m/s), and the share of the steering lock that it may need there.
const LEAST_MPS: f64 = 4.0;
const LOCK_SHARE: f64 = 0.95;

/// Speeds that limits are looked for at, in even steps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpeedRange {
    /// The slowest (m/s).
    pub from_mps: f64,
    /// The greatest (m/s), if the engine goes that far.
    pub to_mps: f64,
    /// The step between them (m/s).
    pub step_mps: f64,
}

impl SpeedRange {
    /// The usual range of a racing car.
    pub const USUAL: Self = Self {
        from_mps: 18.0,
        to_mps: 77.0,
        step_mps: 2.0,
    };

    /// The usual range for `car`, begun at slower speeds as far as its steering lock leaves the limit to the tyres there. Below the
    /// range, limits are those of its slowest speed, which has more downforce.
    pub fn of(car: &Car) -> Self {
        let Self {
            from_mps, step_mps, ..
        } = Self::USUAL;
        let wheelbase_m = car.chassis.cg_to_front + car.chassis.cg_to_rear;
        let cornering = steady_car(car).cornering(from_mps, STEER_TO_GRIP, Turn::Left);
        let limit = cornering.iter().max_by(|a, b| a.ay_mps2.total_cmp(&b.ay_mps2));
        let free_mps = limit.map_or(f64::INFINITY, |limit| {
            // What the tyres' slip takes of the steering angle hardly depends on the speed; the bend takes the rest.
            let slip_rad = limit.steer_rad - wheelbase_m * limit.ay_mps2 / from_mps.powi(2);
            let left_rad = LOCK_SHARE * car.max_steer_rad - slip_rad;
            (wheelbase_m * limit.ay_mps2 / left_rad.max(0.0)).sqrt()
        });
        let steps = ((from_mps - free_mps.max(LEAST_MPS)) / step_mps).floor();
        Self {
            from_mps: from_mps - step_mps * steps.max(0.0),
            ..Self::USUAL
        }
    }

    /// How many speeds there are, whatever the engine does.
    pub fn most(&self) -> usize {
        ((self.to_mps - self.from_mps) / self.step_mps + 1e-9).floor() as usize + 1
    }

    /// The speeds that the limits of `car` are looked for at (m/s), the last of them where its engine ends. The driven wheels turn
    /// faster than the road passes, by the slip that holds the speed: the engine ends that much earlier.
    ///
    /// # Errors
    /// [`Error::Input`] for a range that is none and for a car without a powertrain.
    pub fn speeds_of(&self, car: &Car) -> Result<Vec<f64>> {
        if !(self.step_mps > 0.0 && self.to_mps > self.from_mps) {
            let found = format!("{} to {} m/s by {}", self.from_mps, self.to_mps, self.step_mps);
            let expected = "a step above 0, and to_mps above from_mps";
            return Err(Error::input(&car.name, "speeds", found, expected));
        }
        let force = engine_of(car)?;
        let steady = steady_car(car);
        let drives = |speed: f64| force(speed * (1.0 + steady.slip_against_drag(speed))) > 0.0;
        let count = self.most();
        let grid = (0..count).map(|i| self.from_mps + self.step_mps * i as f64);
        let mut speeds: Vec<f64> = grid.take_while(|&speed| drives(speed)).collect();
        if let Some(&last) = speeds.last()
            && speeds.len() < count
        {
            // The engine ends between two speeds: that is the car's greatest.
            let [top, _] = bisected([last, last + self.step_mps], 1e-6, drives);
            if top - last > 1e-3 {
                speeds.push(top);
            }
        }
        Ok(speeds)
    }
}

/// What the car does at one speed.
#[derive(Clone, Debug, PartialEq)]
pub struct EnvelopeAtSpeed {
    /// The row of the envelope.
    pub row: EnvelopeRow,
    /// Greatest lateral acceleration to the left within the steering lock (m/s^2),
    pub left_mps2: f64,
    /// and to the right. The row has the lesser of both sides.
    pub right_mps2: f64,
    /// Steady cornering to the left, in order along the curve of steady states.
    pub cornering: Vec<Trim>,
    /// Greatest acceleration by the driven tyres (m/s^2) running straight,
    pub traction_mps2: f64,
    /// and at each of [`LATERAL_SHARES`] of the row's lateral acceleration.
    pub traction_in_bends_mps2: Vec<f64>,
    /// What slip and the drag of the tyres take there of the row's drive (m/s^2).
    pub lost_in_bends_mps2: Vec<f64>,
    /// Greatest acceleration by the engine in its best gear, before drag (m/s^2).
    pub engine_mps2: f64,
    /// The same with a hybrid's motor beside the engine.
    pub with_motor_mps2: Option<f64>,
}

/// How the car steers at small lateral acceleration (R. Gillespie, *Fundamentals of Vehicle Dynamics*, 1992, ch. 6).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Handling {
    /// Steering at the wheels beyond what geometry asks for, over lateral acceleration (deg per g); positive
    /// understeers.
    pub understeer_gradient_deg_per_g: f64,
    /// `K` in `steer = L kappa (1 + K v^2)` (s^2/m^2).
    pub stability_factor_s2_per_m2: f64,
    /// Yaw moment that turns the car back for every radian of sideslip, running straight (N m/rad): `b C_r - a C_f` of the
    /// axles' cornering stiffnesses, which some call the stability factor; positive is stable.
    #[serde(default)]
    pub yaw_stiffness_nm_per_rad: f64,
    /// The same over both axles' side force for a radian and the wheelbase: how far the neutral steer point lies behind the
    /// centre of gravity, as a share of the wheelbase.
    #[serde(default)]
    pub static_margin: f64,
    /// Speed at which an understeering car answers most to the steering wheel (m/s).
    pub characteristic_speed_mps: Option<f64>,
    /// Speed at which an oversteering car becomes unstable (m/s).
    pub critical_speed_mps: Option<f64>,
}

/// A car's limits.
#[derive(Clone, Debug, PartialEq)]
pub struct CarEnvelope {
    /// Limits by rising speed.
    pub speeds: Vec<EnvelopeAtSpeed>,
    /// Handling in the middle of the range.
    pub handling: Handling,
    /// The envelope.
    pub envelope: Envelope,
    /// Limits at the same speeds with the DRS open, of a car that has one.
    pub open: Option<Vec<EnvelopeAtSpeed>>,
    /// Speeds at which the car has no steady state in a bend (m/s). The envelope goes on between its neighbours there.
    pub left_out_mps: Vec<f64>,
}

impl CarEnvelope {
    /// What the driven tyres can give.
    pub fn traction(&self) -> Traction {
        Traction {
            rows: self
                .speeds
                .iter()
                .map(|s| (s.row.v_mps, s.traction_mps2))
                .collect(),
        }
    }
}

/// Shares of the lateral limit at which the traction is swept. What is left of it falls with `sqrt(1 - share^2)`, over which they
/// are spread. Beyond 0.97 wheels lift and steady states are few; at the limit itself there is no traction.
pub const LATERAL_SHARES: [f64; 12] = [0.0, 0.2, 0.4, 0.5, 0.6, 0.7, 0.8, 0.85, 0.9, 0.94, 0.97, 1.0];

/// Share at which the losses of running straight are found: curves of steady states begin with no bend at all.
const STRAIGHT: f64 = 1e-3;

/// Steering up to which steady states are looked for (rad): a car whose lock is reached first still has the tyres' own limit.
pub const STEER_TO_GRIP: f64 = 0.6;

/// Sweeps the car over speed and steering, with its DRS shut and open.
///
/// # Errors
/// [`Error::Input`] for a range that is none and for a car without a powertrain, [`Error::Study`] for one that has a steady
/// state in bends at fewer than two of the speeds.
pub fn car_envelope(car: &Car, range: &SpeedRange) -> Result<CarEnvelope> {
    car_envelope_at(car, &range.speeds_of(car)?)
}

/// As [`car_envelope`], at these speeds (m/s).
fn car_envelope_at(car: &Car, speeds: &[f64]) -> Result<CarEnvelope> {
    let shut = limits_at(car, speeds)?;
    let open = match car.chassis.with_open_drs() {
        Some(chassis) => Some(limits_at(
            &Car {
                chassis,
                ..car.clone()
            },
            speeds,
        )?),
        None => None,
    };
    let corners = |l: &EnvelopeAtSpeed| l.row.ay_mps2 > 0.0 && l.row.ax_grip_mps2 > 0.0;
    let kept: Vec<bool> = (0..speeds.len())
        .map(|i| corners(&shut[i]) && open.as_ref().is_none_or(|open| corners(&open[i])))
        .collect();
    let left_out_mps: Vec<f64> = speeds
        .iter()
        .zip(&kept)
        .filter(|(_, kept)| !**kept)
        .map(|(v, _)| *v)
        .collect();
    let of_kept = |all: Vec<EnvelopeAtSpeed>| -> Vec<EnvelopeAtSpeed> {
        all.into_iter()
            .zip(&kept)
            .filter(|(_, kept)| **kept)
            .map(|(at, _)| at)
            .collect()
    };
    let (limits, open) = (of_kept(shut), open.map(of_kept));
    if limits.len() < 2 {
        return Err(Error::Study(format!(
            "{} has no steady state in bends at {} of {} speeds ({}): its tyres cannot hold it on the road there",
            car.name,
            left_out_mps.len(),
            left_out_mps.len() + limits.len(),
            in_words(&left_out_mps)
        )));
    }
    let envelope = envelope_of(&car.name, &limits)?;
    let envelope = match &open {
        Some(open) => envelope.with_open(envelope_of(&car.name, open)?)?,
        None => envelope,
    };
    let wheelbase = car.chassis.cg_to_front + car.chassis.cg_to_rear;
    Ok(CarEnvelope {
        handling: handling(&limits[limits.len() / 2], wheelbase, steady_car(car).as_ref()),
        speeds: limits,
        envelope,
        open,
        left_out_mps,
    })
}

/// Shares of the weight under which the limits are swept for roads in three dimensions, in even steps.
pub const LOADS: [f64; 4] = [0.6, 1.0, 1.4, 1.8];

/// As [`car_envelope`], with the envelopes of the car under [`LOADS`]: in a crest, in a dip, on a banked road. A load is a gravity of
/// that share.
///
/// # Errors
/// As [`car_envelope`].
pub fn car_envelope_under_loads(car: &Car, range: &SpeedRange) -> Result<CarEnvelope> {
    let speeds = range.speeds_of(car)?;
    let mut level = car_envelope_at(car, &speeds)?;
    let under = |share: f64| -> Result<(f64, Envelope)> {
        if share == 1.0 {
            return Ok((share, level.envelope.clone()));
        }
        let mut loaded = car.clone();
        loaded.chassis.gravity *= share;
        Ok((share, car_envelope_at(&loaded, &speeds)?.envelope))
    };
    let loads = LOADS.into_iter().map(under).collect::<Result<Vec<_>>>()?;
    level.envelope = level.envelope.with_loads(loads)?;
    Ok(level)
}

/// The envelope of these limits.
fn envelope_of(name: &str, limits: &[EnvelopeAtSpeed]) -> Result<Envelope> {
    let in_bends = BendTraction {
        shares: LATERAL_SHARES.to_vec(),
        rows: limits.iter().map(|l| l.traction_in_bends_mps2.clone()).collect(),
        lost: limits.iter().map(|l| l.lost_in_bends_mps2.clone()).collect(),
    };
    let rows = limits.iter().map(|l| l.row).collect();
    Envelope::new(name, rows)?.with_bend_traction(in_bends)
}

/// What the car does at these speeds (m/s).
fn limits_at(car: &Car, speeds: &[f64]) -> Result<Vec<EnvelopeAtSpeed>> {
    let force = engine_of(car)?;
    let steady = steady_car(car);
    let (mass, powertrain) = (car.chassis.mass, car.powertrain.as_ref());
    let rolling = car.rolling_mps2();
    let accelerated = |force_n: f64, drag_mps2: f64| {
        powertrain.map_or(0.0, |p| p.acceleration_mps2(force_n, mass, drag_mps2))
    };
    // The two sides of a car with even loads are each other's mirror image where they roll freely, and where they drive if its
    // tyres are.
    let even = car.chassis.left_share_front == 0.5 && car.chassis.left_share_rear == 0.5;
    let mirrored = even && car.tyres.are_mirrored();
    let at = |&speed: &f64| {
        let cornering = steady.cornering(speed, STEER_TO_GRIP, Turn::Left);
        let other = (!mirrored).then(|| steady.cornering(speed, STEER_TO_GRIP, Turn::Right));
        let peak = |trims: &[Trim]| greatest_within(car.max_steer_rad, trims);
        let left_mps2 = peak(&cornering);
        let other_mps2 = other.as_deref().map_or(left_mps2, peak);
        let right_mps2 = if even { left_mps2 } else { other_mps2 };
        let ay_mps2 = left_mps2.min(right_mps2);
        let traction_mps2 = steady.greatest_traction(speed);
        let drag_mps2 = steady.drag(speed) + rolling;
        let engine_mps2 = accelerated(force(speed), drag_mps2) + drag_mps2;
        let both = |motor_n: f64| accelerated(force(speed) + motor_n, drag_mps2) + drag_mps2;
        let ax_drive_mps2 = traction_mps2.min(engine_mps2);
        // What the wheels take to roll does not reach the road.
        let engine = engine_mps2 - rolling;
        // Each side at its own share.
        let driven = |share: f64| {
            let lock = car.max_steer_rad;
            let left = steady.greatest_drive(speed, share * left_mps2, lock, &cornering, engine)?;
            let right = other.as_deref().map_or(Some(left), |curve| {
                steady.greatest_drive(speed, -share * other_mps2, lock, curve, engine)
            })?;
            Some(BendDrive {
                traction_mps2: left.traction_mps2.min(right.traction_mps2),
                engine_mps2: left.engine_mps2.min(right.engine_mps2),
            })
        };
        let of_shares: Vec<_> = LATERAL_SHARES
            .iter()
            .map(|share| driven(share.max(STRAIGHT)))
            .collect();
        let traction_in_bends_mps2 = in_bends(traction_mps2, &of_shares);
        let lost_in_bends_mps2 = lost_in_bends(ax_drive_mps2 - rolling, &of_shares);
        EnvelopeAtSpeed {
            row: EnvelopeRow {
                v_mps: speed,
                ay_mps2,
                ax_grip_mps2: steady.greatest_braking(speed),
                ax_drive_mps2,
                drag_mps2,
            },
            left_mps2,
            right_mps2,
            cornering,
            traction_mps2,
            traction_in_bends_mps2,
            lost_in_bends_mps2,
            engine_mps2,
            with_motor_mps2: car.motor_n(speed).map(both),
        }
    };
    Ok(speeds.par_iter().map(at).collect())
}

/// What the tyres take of a drive (m/s^2) at each of [`LATERAL_SHARES`], from what was found there of the driven car. A share of which
/// nothing was found, the limit itself among them, takes what the one before it does.
fn lost_in_bends(drive_mps2: f64, driven: &[Option<BendDrive>]) -> Vec<f64> {
    let mut lost = 0.0;
    let at = |driven: &Option<BendDrive>| {
        if let Some(taken) = driven
            .map(|d| drive_mps2 - d.engine_mps2)
            .filter(|t| t.is_finite())
        {
            lost = taken.max(0.0);
        }
        lost
    };
    driven.iter().map(at).collect()
}

/// The traction (m/s^2) at each of [`LATERAL_SHARES`], from that of running straight and what was found of the driven car up to the
/// limit. What was not found follows from the shares next to it. A car that corners more never has more.
fn in_bends(straight_mps2: f64, driven: &[Option<BendDrive>]) -> Vec<f64> {
    let straight_mps2 = straight_mps2.max(0.0);
    let mut found = vec![(1.0, straight_mps2)];
    let bends = 1..LATERAL_SHARES.len() - 1;
    for (share, driven) in LATERAL_SHARES[bends.clone()].iter().zip(&driven[bends]) {
        if let Some(most) = driven.map(|d| d.traction_mps2).filter(|most| most.is_finite()) {
            let least = found[found.len() - 1].1;
            found.push((root_left(*share), most.clamp(0.0, least)));
        }
    }
    found.push((0.0, 0.0));
    let between = |share: &f64| {
        let root = root_left(*share);
        let after = found.partition_point(|f| f.0 >= root).clamp(1, found.len() - 1);
        let (more, less) = (found[after - 1], found[after]);
        let slope = (more.1 - less.1) / (more.0 - less.0);
        (less.1 + (root - less.0) * slope).clamp(less.1, more.1)
    };
    let others = LATERAL_SHARES[1..].iter().map(between);
    std::iter::once(straight_mps2).chain(others).collect()
}

/// The greatest lateral acceleration (m/s^2) along a curve of trims, as far as the road wheels turn by no more than `lock` (rad).
fn greatest_within(lock: f64, curve: &[Trim]) -> f64 {
    let mut most = 0.0f64;
    let mut before: Option<&Trim> = None;
    for trim in curve {
        let steer = trim.steer_rad.abs();
        if steer > lock {
            if let Some(last) = before {
                let share = (lock - last.steer_rad.abs()) / (steer - last.steer_rad.abs());
                let at_lock = last.ay_mps2.abs() + share * (trim.ay_mps2.abs() - last.ay_mps2.abs());
                most = most.max(at_lock);
            }
            break;
        }
        most = most.max(trim.ay_mps2.abs());
        before = Some(trim);
    }
    most
}

/// Speeds (m/s) in words.
pub(crate) fn in_words(speeds_mps: &[f64]) -> String {
    let words: Vec<String> = speeds_mps.iter().map(|v| format!("{v:.1}")).collect();
    format!("{} m/s", words.join(", "))
}

/// The engine's force at the wheels (N) by speed (m/s), in the best gear.
fn engine_of(car: &Car) -> Result<impl Fn(f64) -> f64 + Sync> {
    let Some(powertrain) = &car.powertrain else {
        return Err(Error::input(
            &car.name,
            "[powertrain]",
            "none",
            "an engine and gears, for what the car can accelerate by",
        ));
    };
    Ok(move |speed: f64| powertrain.wheel_force(speed, car.chassis.radius_rear))
}

/// The slope of steering over lateral acceleration, between the two steady states nearest to 0 and 2 m/s^2: small
/// against any tyre's limit, large against rounding.
fn handling(limits: &EnvelopeAtSpeed, wheelbase: f64, steady: &dyn SteadyCar) -> Handling {
    let first = limits.cornering.first();
    let second = limits
        .cornering
        .iter()
        .find(|t| t.ay_mps2 >= 2.0)
        .or(limits.cornering.last());
    let v = limits.row.v_mps;
    let slope = match (first, second) {
        (Some(a), Some(b)) if b.ay_mps2 > a.ay_mps2 => (b.steer_rad - a.steer_rad) / (b.ay_mps2 - a.ay_mps2),
        _ => f64::NAN,
    };
    let [side_stiffness, yaw_stiffness] = steady.sideslip_stiffness(v);
    let understeer_gradient = slope - wheelbase / v.powi(2);
    let stability_factor = understeer_gradient / wheelbase;
    Handling {
        understeer_gradient_deg_per_g: understeer_gradient.to_degrees() * GRAVITY_MPS2,
        stability_factor_s2_per_m2: stability_factor,
        yaw_stiffness_nm_per_rad: yaw_stiffness,
        static_margin: yaw_stiffness / (wheelbase * side_stiffness),
        characteristic_speed_mps: (stability_factor > 0.0).then(|| stability_factor.recip().sqrt()),
        critical_speed_mps: (stability_factor < 0.0).then(|| (-stability_factor).recip().sqrt()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_bundled_car_corners_as_it_was_made_to() {
        let car = Car::bundled().unwrap();
        let limits = car_envelope(&car, &SpeedRange::USUAL).unwrap();
        let envelope = &limits.envelope;
        // What the bundled car was made for: up to 15 m/s^2 at 25 m/s and 18 at 65, within a tenth.
        assert!((envelope.at(25.0).ay_mps2 / 15.0 - 1.0).abs() < 0.1);
        assert!((envelope.at(65.0).ay_mps2 / 18.0 - 1.0).abs() < 0.1);
        // Sixth gear ends at 8500 rpm: rims of 70 m/s. The wheels slip by what overcomes the drag there.
        let rims = 8500.0 * std::f64::consts::TAU / 60.0 / (1.2915 * 3.2) * 0.325;
        let top = envelope.top_speed_mps();
        let slip = steady_car(&car).slip_against_drag(top);
        assert!((top * (1.0 + slip) - rims).abs() < 1e-3);
        assert!((0.005..0.01).contains(&slip), "{slip}");
        // The engine limits where the tyres could do more, and the other way round.
        let fast = limits.speeds.last().unwrap();
        assert_eq!(fast.row.ax_drive_mps2, fast.engine_mps2);
        assert!(
            limits
                .speeds
                .iter()
                .all(|s| s.row.ax_drive_mps2 <= s.traction_mps2)
        );
        assert!(limits.handling.stability_factor_s2_per_m2.abs() < 0.01);
        assert!(limits.speeds.iter().all(|s| s.with_motor_mps2.is_none()));
    }

    /// 120 kW at its shaft, less what the gearbox takes.
    #[test]
    fn a_hybrids_motor_adds_its_power_to_the_engines() {
        let car = Car::bundled_hybrid().unwrap();
        let limits = car_envelope(&car, &SpeedRange::USUAL).unwrap();
        let efficiency = car.powertrain.as_ref().unwrap().efficiency;
        let powers = limits.speeds.iter().filter_map(|s| {
            let gained = s.with_motor_mps2? - s.engine_mps2;
            Some(gained * car.chassis.mass * s.row.v_mps / efficiency)
        });
        let powers: Vec<f64> = powers.collect();
        let greatest = powers.iter().copied().fold(0.0, f64::max);
        assert!((greatest / 120e3 - 1.0).abs() < 1e-9, "{greatest} W");
        assert!(powers.len() > 5 && powers.iter().all(|p| *p > 0.0), "{powers:?}");
    }

    /// The rear axle carries its share of the lateral force whatever it drives with. At 0.8 of the limit the ellipse of the whole car
    /// leaves 0.6 of its grip, and straight-line traction is more than that: the lesser of both is what a car had that is driven by
    /// all of its tyres.
    #[test]
    fn a_car_driven_at_the_rear_loses_drive_to_the_lateral_force_there() {
        let car = Car::bundled().unwrap();
        let limits = car_envelope(&car, &SpeedRange::USUAL).unwrap();
        let steady = steady_car(&car);
        for speed in &limits.speeds {
            let (v, table) = (speed.row.v_mps, &speed.traction_in_bends_mps2);
            let straight = steady.greatest_traction(v);
            assert_eq!(table[0], straight);
            assert!(table.windows(2).all(|pair| pair[1] <= pair[0]), "{v}: {table:?}");
            let share = 0.8;
            let whole = (0.6 * speed.row.ax_grip_mps2).min(straight);
            let found = limits.envelope.traction_at(v, share).unwrap();
            assert!(found < 0.9 * whole && found > 0.5 * whole, "{v}: {found} {whole}");
            assert!(table[10] < 0.5 * straight && table[11] == 0.0, "{v}: {table:?}");
        }
    }

    /// A share without a steady state has what lies between its neighbours; without any, the ellipse is left.
    #[test]
    fn what_is_not_found_follows_from_its_neighbours() {
        let found = |traction: &dyn Fn(f64) -> Option<f64>| {
            let at = |share: &f64| {
                traction(*share).map(|traction_mps2| BendDrive {
                    traction_mps2,
                    engine_mps2: 9.0,
                })
            };
            LATERAL_SHARES.iter().map(at).collect::<Vec<_>>()
        };
        let gap = in_bends(
            10.0,
            &found(&|share| (share != 0.6).then(|| 10.0 * root_left(share))),
        );
        for (found, share) in gap.iter().zip(LATERAL_SHARES) {
            assert!((found - 10.0 * root_left(share)).abs() < 1e-9, "{share}: {found}");
        }
        assert_eq!(in_bends(10.0, &found(&|_| None))[4], 10.0 * root_left(0.6));
        assert_eq!(in_bends(10.0, &found(&|_| Some(f64::NAN)))[0], 10.0);
        // No more in a bend than in a wider one, and none that is negative.
        assert_eq!(in_bends(10.0, &found(&|_| Some(11.0)))[..11], [10.0; 11]);
        assert_eq!(in_bends(10.0, &found(&|_| Some(-1.0)))[1], 0.0);
    }

    /// A lock of 0.03 rad is a circle of 87 m: at 18 m/s less than 324 / 87 = 3.7 m/s^2, where the tyres would hold 15.
    #[test]
    fn the_steering_lock_ends_the_envelope() {
        let mut car = Car::bundled().unwrap();
        let coarse = SpeedRange {
            step_mps: 20.0,
            ..SpeedRange::USUAL
        };
        let free = car_envelope(&car, &coarse).unwrap();
        car.max_steer_rad = 0.03;
        let locked = car_envelope(&car, &coarse).unwrap();
        let steady = steady_car(&car);
        for (speed, free) in locked.speeds.iter().zip(&free.speeds) {
            let v = speed.row.v_mps;
            let curve = &speed.cornering;
            let top = curve
                .iter()
                .max_by(|a, b| a.ay_mps2.total_cmp(&b.ay_mps2))
                .unwrap();
            let wanted = match top.steer_rad > 0.03 {
                true => steady.trim_at(v, 0.03, curve).unwrap().ay_mps2,
                false => free.row.ay_mps2,
            };
            assert!((speed.row.ay_mps2 / wanted - 1.0).abs() < 5e-3, "{v}: {wanted}");
        }
        let slow = locked.speeds[0].row.ay_mps2;
        assert!((slow / (324.0 * 0.03 / 2.6) - 1.0).abs() < 0.05, "{slow}");
    }

    /// The bundled car reaches a circle of 15 m on its lock: below 16 m/s that is the limit. With a lock of 0.5 rad the tyres are it
    /// down to 8 m/s, where there is less downforce than at 18.
    #[test]
    fn slow_bends_have_limits_of_their_own() {
        let mut car = Car::bundled().unwrap();
        assert_eq!(SpeedRange::of(&car), SpeedRange::USUAL);
        car.max_steer_rad = 0.5;
        let range = SpeedRange::of(&car);
        assert!((8.0..=10.0).contains(&range.from_mps), "{range:?}");
        let ay_mps2 = |range: &SpeedRange| car_envelope(&car, range).unwrap().envelope.at(8.0).ay_mps2;
        assert!(ay_mps2(&range) < 0.99 * ay_mps2(&SpeedRange::USUAL));
        // Beyond, rows are the same.
        let [slow, usual] =
            [range, SpeedRange::USUAL].map(|range| car_envelope(&car, &range).unwrap().envelope);
        let before = slow.rows().len() - usual.rows().len();
        assert_eq!(slow.rows()[before..], *usual.rows());
    }

    /// At 58 m/s the engine is the limit. With a rolling resistance of 0.013 and 1.1 of the mass to accelerate, force F and drag D
    /// leave (F/m - D/m - 0.013 g) / 1.1.
    #[test]
    fn rolling_and_rotating_masses_slow_every_car() {
        let mut car = Car::bundled().unwrap();
        let range = SpeedRange {
            from_mps: 58.0,
            to_mps: 60.0,
            step_mps: 2.0,
        };
        let plain = car_envelope(&car, &range).unwrap().envelope.rows()[0];
        let powertrain = car.powertrain.as_mut().unwrap();
        powertrain.rolling_resistance = 0.013;
        powertrain.rotating_mass_factor = 1.1;
        let slowed = car_envelope(&car, &range).unwrap().envelope.rows()[0];
        let wanted = (plain.ax_drive_mps2 - plain.drag_mps2 - 0.013 * GRAVITY_MPS2) / 1.1;
        assert!(
            (slowed.ax_drive_mps2 - slowed.drag_mps2 - wanted).abs() < 1e-12,
            "{slowed:?}"
        );
        assert!((slowed.drag_mps2 - plain.drag_mps2 - 0.013 * GRAVITY_MPS2).abs() < 1e-12);
        assert_eq!(slowed.ay_mps2, plain.ay_mps2);
    }

    #[test]
    fn a_car_without_an_engine_and_absurd_ranges_are_refused() {
        let mut car = Car::bundled().unwrap();
        let backwards = SpeedRange {
            to_mps: 10.0,
            ..SpeedRange::USUAL
        };
        assert!(
            car_envelope(&car, &backwards)
                .unwrap_err()
                .to_string()
                .contains("to_mps above")
        );
        car.powertrain = None;
        let error = car_envelope(&car, &SpeedRange::USUAL).unwrap_err();
        assert!(error.to_string().contains("[powertrain]"));
    }
}
