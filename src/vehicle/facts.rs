//! A whole car from the few figures that an engineer knows of it.
//!
//! What is not asked for is taken in proportion: the tyre from the bundled slick, scaled to the wheels' load and to the grip that is
//! asked for; the inertias from the places of the wheels; the engine from a torque curve of usual shape; the gears in a geometric
//! row. The figures are a start to be fitted to a log, not measurements.

use super::car::USUAL_STEER_RATE_RADPS;
use super::chassis::Chassis;
use super::limits::STEER_TO_GRIP;
use super::parameters::ParameterInfo;
use super::powertrain::{GRAVITY_MPS2 as G, Powertrain};
use super::steady::{Turn, steady_car};
use super::{Car, Tyres};
use crate::config::kinds::{count, number, optional, text};
use crate::config::settings::{Settings, settings};
use crate::config::{Document, read_text};
use crate::error::{Error, Result};
use crate::scalar::bisected;
use std::f64::consts::TAU;
use std::path::Path;

settings! {
    /// What an engineer knows of a car. [`CarFacts::car`] makes a whole car of it.
    pub struct CarFacts {
        name: String ["-"] = "my car".to_owned(), text(),
            "What the car is called";
        mass_kg: f64 ["kg"] = 1245.0, number(50.0, 50_000.0),
            "Mass with driver and fuel";
        front_weight_percent: f64 ["%"] = 45.0, number(10.0, 90.0),
            "Share of the weight on the front wheels";
        wheelbase_m: f64 ["m"] = 2.6, number(0.5, 12.0),
            "Distance between the axles";
        front_track_m: f64 ["m"] = 1.64, number(0.4, 4.0),
            "Distance between the front wheels";
        rear_track_m: f64 ["m"] = 1.64, number(0.4, 4.0),
            "Distance between the rear wheels";
        cg_height_m: f64 ["m"] = 0.42, number(0.05, 2.5),
            "Height of the centre of gravity";
        tyre_radius_m: f64 ["m"] = 0.325, number(0.08, 1.2),
            "Rolling radius of the tyres";
        corner_g: Option<f64> ["g"] = None, optional(number(0.2, 6.0)).example("1.5"),
            "Greatest lateral acceleration at corner_kmh; the tyres are scaled to it";
        corner_kmh: f64 ["km/h"] = 70.0, number(15.0, 350.0),
            "Speed at which corner_g is reached";
        tyre_friction: Option<f64> ["-"] = None, optional(number(0.2, MOST_FRICTION)).example("1.2"),
            "Peak lateral friction of a tyre under the load at rest, in place of corner_g";
        roll_deg_per_g: f64 ["deg/g"] = 3.0, number(0.05, 15.0),
            "Roll angle over lateral acceleration";
        power_kw: f64 ["kW"] = 310.0, number(1.0, 2000.0),
            "Greatest power at the crank";
        redline_rpm: f64 ["rpm"] = 8000.0, number(500.0, 25_000.0),
            "Greatest engine speed";
        gears: usize ["-"] = 6, count(1, 18),
            "Forward gears";
        top_speed_kmh: f64 ["km/h"] = 270.0, number(20.0, 450.0),
            "Top speed on the level";
        drag_area_m2: Option<f64> ["m2"] = None, optional(number(0.0, 10.0)).example("0.95"),
            "Drag coefficient times frontal area; unset, what power and top speed make it";
        downforce_area_m2: f64 ["m2"] = 0.0, number(-5.0, 15.0),
            "Downforce coefficient times frontal area, negative for lift";
        steering_ratio: f64 ["-"] = 14.0, number(0.5, 40.0),
            "Angle of the steering wheel over that of the road wheels";
    }

    fn consistent(&self) -> Result<()> {
        match (self.corner_g, self.tyre_friction) {
            (Some(_), Some(friction)) => Err(Error::input(
                "the car",
                "tyre_friction",
                friction.to_string(),
                "corner_g or tyre_friction, not both: either says how the tyres grip",
            )),
            _ => Ok(()),
        }
    }
}

/// Density of the air (kg/m^3).
const AIR: f64 = 1.2;
/// Share of the engine's torque that reaches the wheels.
const EFFICIENCY: f64 = 0.95;
/// Share of the redline at which the engine runs at top speed, and at which it has its greatest power.
const AT_TOP_SPEED: f64 = 0.95;
/// Full-throttle torque over that at greatest power, by engine speed over the redline: a naturally aspirated engine.
const TORQUE: [(f64, f64); 8] = [
    (0.25, 0.85),
    (0.40, 0.95),
    (0.55, 1.06),
    (0.70, 1.10),
    (0.80, 1.09),
    (0.90, 1.04),
    (AT_TOP_SPEED, 1.0),
    (1.00, 0.93),
];
/// How much more load than the front tyres the rear tyres are made for, over the loads at rest.
const REAR_RESERVE: f64 = 1.15;
/// The front axle's share of the roll moment. Like [`REAR_RESERVE`] it keeps the car from turning round by itself.
const ROLL_SHARE_FRONT: f64 = 0.55;
/// First gear over top gear, for each gear more.
const GEAR_SPAN: f64 = 0.36;
/// Largest drag area that is taken from power and top speed, over the track squared: that of a box as high as wide.
const MOST_DRAG: f64 = 1.2;
/// Peak friction that no tyre has.
const MOST_FRICTION: f64 = 3.0;

impl CarFacts {
    /// What the table `[asked]` of a car's file says that the car was made of, if it has one.
    ///
    /// # Errors
    /// [`Error::Io`] if the file cannot be read, [`Error::Input`] naming line and field if it says something wrong.
    pub fn asked(path: &Path) -> Result<Option<Self>> {
        let text = read_text(path)?;
        let document = Document::parse(path, &text)?;
        let table = document.root().table("asked")?;
        table
            .map(|table| Self::read_table(table, Path::new("")))
            .transpose()
    }

    /// The car, with a tyre that reaches `corner_g` at `corner_kmh` in steady-state cornering to 0.1 %.
    ///
    /// Inertias: roll about a radius of 0.3 tracks, yaw 0.8 `m a b`, pitch 0.9 of yaw, as cars measure (G. J. Heydinger et al.,
    /// *Measured Vehicle Inertial Parameters*, SAE 1999-01-1336). Roll is critically damped.
    ///
    /// # Errors
    /// [`Error::Input`] for facts out of their ranges and a car that would turn over, [`Error::Study`] if no friction brings the car to `corner_g`.
    pub fn car(&self) -> Result<Car> {
        self.validate()?;
        let mut car = self.with_base_tyre()?;
        match (self.corner_g, self.tyre_friction) {
            (Some(corner_g), _) => {
                let scale = self.scale_for(corner_g, &car)?;
                scale_grip(&mut car, scale);
            }
            (None, Some(wanted)) => {
                let scale = wanted / friction_at_rest(&car);
                scale_grip(&mut car, scale);
            }
            (None, None) => {}
        }
        Ok(car)
    }

    /// The car on the bundled tyre, whose size and nominal load are scaled to it.
    fn with_base_tyre(&self) -> Result<Car> {
        let base = Car::bundled()?;
        let front_share = self.front_weight_percent / 100.0;
        let (a, b) = (
            (1.0 - front_share) * self.wheelbase_m,
            front_share * self.wheelbase_m,
        );
        let m = self.mass_kg;
        let track = 0.5 * (self.front_track_m + self.rear_track_m);
        let inertia_roll = m * (0.3 * track).powi(2);
        let inertia_yaw = 0.8 * m * a * b;
        // The weight leans on the springs, too.
        let rolling = m * G * self.cg_height_m;
        let roll_stiffness = rolling * (1.0 + 1.0 / self.roll_deg_per_g.to_radians());
        let top_mps = self.top_speed_kmh / 3.6;
        // Where more power than any drag takes is left, gears end the speed.
        let drag_area = self
            .drag_area_m2
            .unwrap_or_else(|| (self.drive_w() / air_w(top_mps)).min(MOST_DRAG * track.powi(2)));
        let chassis = Chassis {
            mass: m,
            cg_to_front: a,
            cg_to_rear: b,
            half_track_front: 0.5 * self.front_track_m,
            half_track_rear: 0.5 * self.rear_track_m,
            cg_height: self.cg_height_m,
            inertia_roll,
            inertia_pitch: 0.9 * inertia_yaw,
            inertia_yaw,
            roll_stiffness,
            roll_damping: 2.0
                * ((roll_stiffness - rolling) * (inertia_roll + m * self.cg_height_m.powi(2))).sqrt(),
            roll_share_front: ROLL_SHARE_FRONT,
            camber_front: 0.0,
            camber_rear: 0.0,
            radius_front: self.tyre_radius_m,
            radius_rear: self.tyre_radius_m,
            air_density: AIR,
            drag_area,
            lift_area: self.downforce_area_m2,
            // Behind the centre of gravity, so that downforce makes no car nervous.
            pressure_centre: (front_share - 0.03).max(0.0),
            drag_height: self.cg_height_m,
            ..base.chassis
        };
        within_ranges(&chassis)?;
        let mut car = Car {
            name: self.name.clone(),
            tyres: base.tyres,
            steering_ratio: self.steering_ratio,
            max_steer_rad: 0.5,
            // The driver's hands turn no faster with another ratio.
            max_steer_rate_radps: USUAL_STEER_RATE_RADPS * base.steering_ratio / self.steering_ratio,
            powertrain: Some(self.powertrain(top_mps, drag_area)),
            hybrid: None,
            reached: None,
            chassis,
        };
        // As much nominal load over the load at rest as the base car has, and at the rear a little more: it grips longer.
        let size = self.tyre_radius_m / base.chassis.radius_front;
        let load = m / base.chassis.mass;
        if let Tyres::MagicFormula { front, rear } = &mut car.tyres {
            for (tyre, share) in [(front, front_share), (rear, REAR_RESERVE * (1.0 - front_share))] {
                tyre.coefficients.r0 *= size;
                tyre.coefficients.fnomin *= 2.0 * share * load;
            }
        }
        Ok(car)
    }

    /// Greatest power at the wheels (W).
    fn drive_w(&self) -> f64 {
        1e3 * EFFICIENCY * self.power_kw
    }

    fn powertrain(&self, top_mps: f64, drag_area: f64) -> Powertrain {
        let at_redline = TORQUE[TORQUE.len() - 1].1 / AT_TOP_SPEED;
        let geared = drag_area * air_w(top_mps) < at_redline * self.drive_w();
        let top_rpm = if geared { 1.0 } else { AT_TOP_SPEED } * self.redline_rpm;
        let greatest = 1e3 * self.power_kw / (AT_TOP_SPEED * self.redline_rpm * TAU / 60.0);
        let wheel_rpm = top_mps / self.tyre_radius_m * 60.0 / TAU;
        let first = 1.0 + GEAR_SPAN * (self.gears - 1) as f64;
        let step = |gear: usize| (self.gears - 1 - gear) as f64 / (self.gears.max(2) - 1) as f64;
        Powertrain {
            engine_speed_rpm: TORQUE.map(|(speed, _)| speed * self.redline_rpm).into(),
            torque_nm: TORQUE.map(|(_, torque)| torque * greatest).into(),
            gear_ratios: (0..self.gears).map(|gear| first.powf(step(gear))).collect(),
            final_drive: top_rpm / wheel_rpm,
            efficiency: EFFICIENCY,
            engine: None,
            rolling_resistance: 0.0,
            rotating_mass_factor: 1.0,
        }
    }

    /// The factor on the base tyre's friction with which the car corners at `corner_g`. It is enclosed and then halved, since cornering
    /// may go with more than the square of the friction where a wheel lifts.
    fn scale_for(&self, corner_g: f64, car: &Car) -> Result<f64> {
        let lift = air_w(self.corner_kmh / 3.6) / (self.corner_kmh / 3.6) * self.downforce_area_m2;
        let half_track = 0.25 * (self.front_track_m + self.rear_track_m);
        let turns_over = half_track / self.cg_height_m * (1.0 + lift / (self.mass_kg * G));
        if corner_g > turns_over {
            let found = format!("{corner_g} g at {} km/h", self.corner_kmh);
            let expected = format!(
                "less than {turns_over:.2} g, at which this track and centre of gravity turn the car over"
            );
            return Err(Error::input("the car", "corner_g", found, expected));
        }
        let reached = |scale: f64| {
            let mut car = car.clone();
            scale_grip(&mut car, scale);
            corner_g_of(&car, self.corner_kmh)
        };
        let at_rest = friction_at_rest(car);
        let (mut scale, mut less, mut more) = (1.0f64, None::<f64>, None::<f64>);
        for _ in 0..60 {
            let found = reached(scale);
            if (found / corner_g - 1.0).abs() < 1e-3 {
                return Ok(scale);
            }
            *(if found < corner_g { &mut less } else { &mut more }) = Some(scale);
            scale = match (less, more) {
                (Some(less), Some(more)) => (less * more).sqrt(),
                (Some(_), None) => scale * (corner_g / found).clamp(1.05, 2.0),
                (None, _) => scale * (corner_g / found).clamp(0.5, 0.95),
            };
            if found <= 0.0 || scale * at_rest > MOST_FRICTION {
                break;
            }
        }
        if more.is_some() {
            return Err(Error::Study(format!(
                "no friction brings {} to {corner_g} g at {} km/h: a wheel lifts there, and it corners less or more",
                self.name, self.corner_kmh
            )));
        }
        Err(Error::Study(format!(
            "no tyre with a friction of up to {MOST_FRICTION} brings {} to {corner_g} g at {} km/h: ask for less, for a lower centre of \
             gravity or for more downforce",
            self.name, self.corner_kmh
        )))
    }
}

/// Power that the air takes from a drag area of 1 m^2 at a speed (m/s), W.
fn air_w(speed_mps: f64) -> f64 {
    0.5 * AIR * speed_mps.powi(3)
}

/// Greatest lateral acceleration in steady-state cornering at a speed (km/h), in g; 0 where there is no steady state.
pub fn corner_g_of(car: &Car, speed_kmh: f64) -> f64 {
    let trims = steady_car(car).cornering(speed_kmh / 3.6, STEER_TO_GRIP, Turn::Left);
    trims.iter().map(|t| t.ay_mps2).fold(0.0, f64::max) / G
}

/// Peak lateral friction of the tyres under the load at rest, the mean of both axles; 0 for linear tyres, which have none.
pub fn friction_at_rest(car: &Car) -> f64 {
    let Tyres::MagicFormula { front, rear } = &car.tyres else {
        return 0.0;
    };
    let (c, weight) = (&car.chassis, car.chassis.mass * G);
    let wheelbase = c.cg_to_front + c.cg_to_rear;
    let axles = [(front, c.cg_to_rear), (rear, c.cg_to_front)];
    let friction = axles.map(|(tyre, arm)| {
        let t = &tyre.coefficients;
        let nominal = t.fnomin * t.lfz0;
        let over = (0.5 * weight * arm / wheelbase - nominal) / nominal;
        (t.pdy1 + t.pdy2 * over).abs() * t.lmuy
    });
    0.5 * (friction[0] + friction[1])
}

/// Speed at which the drive just overcomes the drag, or at which the engine ends in top gear (km/h).
pub fn top_speed_kmh(car: &Car) -> Option<f64> {
    let powertrain = car.powertrain.as_ref()?;
    let steady = steady_car(car);
    let drives = |v: f64| {
        let force = powertrain.wheel_force(v, car.chassis.radius_rear);
        force > 0.0 && force >= car.chassis.mass * steady.drag(v)
    };
    // From above: at very low speed an engine gives no force in any gear.
    Some(3.6 * bisected([1.0, 200.0], 1e-3, drives)[0])
}

/// Scales friction along and across.
fn scale_grip(car: &mut Car, scale: f64) {
    if let Tyres::MagicFormula { front, rear } = &mut car.tyres {
        for tyre in [front, rear] {
            tyre.coefficients.lmux *= scale;
            tyre.coefficients.lmuy *= scale;
        }
    }
}

/// Facts that are each in their range may make a figure that is not.
fn within_ranges(chassis: &Chassis<f64>) -> Result<()> {
    let wrong = |(p, x): &(&ParameterInfo, f64)| !(p.minimum..=p.maximum).contains(x);
    match Chassis::<f64>::PARAMETERS
        .iter()
        .zip(chassis.to_flat())
        .find(wrong)
    {
        Some((p, x)) => Err(Error::input(
            "the car",
            p.name,
            format!("{x:.4} {}", p.unit),
            format!(
                "{} to {} {}; it follows from the facts given",
                p.minimum, p.maximum, p.unit
            ),
        )),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A kart, a truck, an open-wheeler with much downforce and a road car.
    fn cars() -> [CarFacts; 5] {
        let facts = CarFacts::default;
        [
            // A wheel lifts, from where on cornering goes with the square of the friction and more.
            CarFacts {
                mass_kg: 160.0,
                wheelbase_m: 1.04,
                corner_g: Some(1.6),
                power_kw: 22.0,
                top_speed_kmh: 115.0,
                ..facts()
            },
            CarFacts {
                mass_kg: 160.0,
                front_weight_percent: 43.0,
                wheelbase_m: 1.04,
                front_track_m: 1.1,
                rear_track_m: 1.15,
                cg_height_m: 0.22,
                tyre_radius_m: 0.135,
                corner_g: Some(1.8),
                corner_kmh: 60.0,
                roll_deg_per_g: 0.5,
                power_kw: 22.0,
                redline_rpm: 14_000.0,
                gears: 1,
                top_speed_kmh: 115.0,
                ..facts()
            },
            CarFacts {
                mass_kg: 5500.0,
                front_weight_percent: 52.0,
                wheelbase_m: 3.6,
                front_track_m: 2.1,
                rear_track_m: 1.9,
                cg_height_m: 0.85,
                tyre_radius_m: 0.5,
                corner_g: Some(0.8),
                roll_deg_per_g: 4.0,
                power_kw: 780.0,
                redline_rpm: 2600.0,
                gears: 12,
                top_speed_kmh: 160.0,
                ..facts()
            },
            CarFacts {
                mass_kg: 730.0,
                front_weight_percent: 46.0,
                wheelbase_m: 3.0,
                cg_height_m: 0.28,
                tyre_radius_m: 0.33,
                corner_g: Some(3.2),
                corner_kmh: 200.0,
                roll_deg_per_g: 0.3,
                power_kw: 480.0,
                redline_rpm: 11_000.0,
                top_speed_kmh: 300.0,
                downforce_area_m2: 4.0,
                ..facts()
            },
            CarFacts {
                mass_kg: 1450.0,
                front_weight_percent: 60.0,
                cg_height_m: 0.55,
                tyre_friction: Some(0.95),
                roll_deg_per_g: 5.0,
                power_kw: 110.0,
                redline_rpm: 6500.0,
                top_speed_kmh: 205.0,
                ..facts()
            },
        ]
    }

    #[test]
    fn cars_do_what_was_asked_of_them() {
        for facts in cars() {
            let car = facts.car().unwrap();
            let top = top_speed_kmh(&car).unwrap();
            assert!((top / facts.top_speed_kmh - 1.0).abs() < 2e-3, "{facts:?}: {top}");
            match facts.corner_g {
                Some(g) => {
                    let found = corner_g_of(&car, facts.corner_kmh);
                    assert!((found / g - 1.0).abs() < 1e-3, "{facts:?}: {found}");
                }
                None => assert!((friction_at_rest(&car) / 0.95 - 1.0).abs() < 1e-12),
            }
            let folder = tempfile::tempdir().unwrap();
            car.write(folder.path(), "car").unwrap();
            let path = folder.path().join("car.toml");
            assert_eq!(Car::load(path.to_str().unwrap()).unwrap(), car);
        }
    }

    #[test]
    fn hands_turn_as_fast_with_any_ratio() {
        let direct = CarFacts {
            steering_ratio: 4.0,
            ..CarFacts::default()
        };
        let rates_radps =
            [CarFacts::default(), direct].map(|facts| facts.car().unwrap().max_steer_rate_radps);
        assert_eq!(
            rates_radps,
            [USUAL_STEER_RATE_RADPS, 14.0 / 4.0 * USUAL_STEER_RATE_RADPS]
        );
    }

    #[test]
    fn what_cannot_be_is_refused_by_name() {
        let both = CarFacts {
            corner_g: Some(1.0),
            tyre_friction: Some(1.0),
            ..CarFacts::default()
        };
        assert!(both.car().unwrap_err().to_string().contains("tyre_friction"));
        let tower = CarFacts {
            corner_g: Some(5.0),
            cg_height_m: 1.5,
            ..CarFacts::default()
        };
        assert!(tower.car().unwrap_err().to_string().contains("5 g at 70 km/h"));
    }
}
