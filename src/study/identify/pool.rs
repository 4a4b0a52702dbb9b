//! What is usually not known of a car that has been measured: the parameters that a log chooses among where a study names none.

use super::settings::FreeParameter;
use crate::vehicle::Car;

/// Where a parameter is looked for, about the car's own value.
enum About {
    /// From so many times the value to so many times. A value of zero tells no range.
    Times(f64, f64),
    /// So much below the value and above it, in its unit.
    By(f64, f64),
}

/// The parameters. Mass, wheelbase, tracks and weight distribution are measured, and the log's calibration tells the rolling radii.
const UNSURE: [(&str, About); 21] = [
    ("front.lMUy", About::Times(0.6, 1.6)),
    ("rear.lMUy", About::Times(0.6, 1.6)),
    ("front.lKy", About::Times(0.15, 3.0)),
    ("rear.lKy", About::Times(0.15, 3.0)),
    ("lMUx", About::Times(0.6, 1.6)),
    ("lKx", About::Times(0.15, 3.0)),
    // How friction and stiffness change with load: base sets differ most there, and downforce brings loads far from those at rest.
    ("pDx2", About::By(0.3, 0.3)),
    ("pDy2", About::By(0.3, 0.3)),
    ("pKx3", About::By(0.5, 0.5)),
    ("pKy2", About::Times(0.5, 4.0)),
    ("rBx1", About::Times(0.5, 2.0)),
    ("rBy1", About::Times(0.5, 2.0)),
    ("cg_height_m", About::Times(0.6, 1.6)),
    ("yaw_inertia_kgm2", About::Times(0.5, 2.0)),
    ("roll_stiffness_nm_per_rad", About::Times(0.3, 3.0)),
    ("roll_damping_nms_per_rad", About::Times(0.3, 2.0)),
    ("front_roll_moment_share", About::By(0.25, 0.25)),
    ("drag_area_m2", About::Times(0.3, 3.0)),
    ("downforce_area_m2", About::By(0.5, 0.5)),
    ("steer_scale", About::Times(0.7, 1.4)),
    ("steer_offset_rad", About::By(0.03, 0.03)),
];
/// Downforce that a car has is looked for from this share below it to this share above, besides.
const DOWNFORCE: f64 = 0.5;

/// How many of them there are at the most: a tyre's may differ by axle.
pub(super) const MOST: usize = UNSURE.len() + 8;

/// The parameters of this car that are usually not known, with bounds about its own values.
pub(super) fn unsure_of(car: &Car) -> Vec<FreeParameter> {
    let flat = car.to_flat();
    let mut free = Vec::new();
    for (name, about) in &UNSURE {
        let Some(parameter) = car.parameter(name) else {
            // Another tyre model has no such coefficient.
            continue;
        };
        let values: Vec<f64> = parameter.slots.iter().map(|&slot| flat[slot]).collect();
        // What differs by axle stays different.
        let names = if values.iter().all(|value| *value == values[0]) {
            vec![(*name).to_owned()]
        } else {
            vec![format!("front.{name}"), format!("rear.{name}")]
        };
        for (name, value) in names.into_iter().zip(values) {
            let (low, high) = match about {
                About::Times(low, high) => (value * low, value * high),
                About::By(below, above) => (value - below, value + above),
            };
            let more = if parameter.info.name == "downforce_area_m2" {
                DOWNFORCE * value.abs()
            } else {
                0.0
            };
            let lower = (low.min(high) - more).max(parameter.info.minimum);
            let upper = (high.max(low) + more).min(parameter.info.maximum);
            if lower < upper {
                free.push(FreeParameter { name, lower, upper });
            }
        }
    }
    free
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vehicle::TyreModel;

    #[test]
    fn bounds_are_about_the_values_of_the_car() {
        let mut car = Car::bundled().unwrap();
        car.chassis.roll_stiffness *= 20.0;
        let free = unsure_of(&car);
        assert_eq!(free.len(), UNSURE.len());
        let flat = car.to_flat();
        for f in &free {
            let parameter = car.parameter(&f.name).unwrap();
            let value = flat[parameter.slots[0]];
            assert!(f.lower < f.upper && (f.lower..=f.upper).contains(&value), "{f:?}");
            assert!(
                parameter.info.admits(f.lower) && parameter.info.admits(f.upper),
                "{f:?}"
            );
        }
        // A coefficient that differs by axle is found for each of them.
        let mut flat = car.to_flat();
        flat[car.parameter("rear.lKx").unwrap().slots[0]] *= 1.5;
        let free = unsure_of(&car.with_flat(&flat));
        let named = |name: &str| free.iter().any(|f| f.name == name);
        assert!(named("front.lKx") && named("rear.lKx") && !named("lKx"));
        // Tyres that differ in everything.
        let mut flat = car.to_flat();
        for parameter in TyreModel::MagicFormula.parameters() {
            let rear = car.parameter(&format!("rear.{}", parameter.name)).unwrap();
            flat[rear.slots[0]] = 1.1 * flat[rear.slots[0]] + 0.01;
        }
        assert_eq!(unsure_of(&car.with_flat(&flat)).len(), MOST);
    }
}
