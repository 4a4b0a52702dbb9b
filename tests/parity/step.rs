//! Layer two: one derivative and one Runge-Kutta step of random cars in random states, against `f64`.

use crate::common::bundled_car;
use crate::device::subjects;
use lapswarm::parity::step::{Case, TOLERANCE, cases, compare, evaluated, scales};
use lapswarm::vehicle::{CarModel, Chassis, MagicFormula, TyreModel};
use proptest::prelude::*;

tests! {
    a_derivative_and_a_step_agree_on_every_backend: also_device,
    any_car_in_any_state_agrees_with_the_reference: everywhere,
    a_linear_car_in_the_mirror_does_the_mirrored: everywhere,
    the_table_starts_with_the_chassis: everywhere,
}

fn a_derivative_and_a_step_agree_on_every_backend() {
    for subject in subjects() {
        for found in compare(&subject).expect("the kernel runs") {
            println!(
                "{}: {:.1e} off, bits as the scalar's: {:?}",
                found.key(),
                found.max_relative,
                found.bits_as_scalar
            );
            assert!(found.pass, "{}: {}", found.key(), found.worst);
        }
    }
}

const MODELS: [TyreModel; 2] = [TyreModel::MagicFormula, TyreModel::Linear];

/// The car seen in a mirror: left and right exchanged. Only with wheels set upright is the bundled car its own
/// mirror image, its tyres' own left-right differences apart.
fn mirrored(case: &Case) -> Case {
    let [vx, vy, r, phi, p, pitch] = case.state;
    let [fl, fr, rl, rr, steer, flap, friction] = case.input;
    Case {
        table: case.table.clone(),
        state: [vx, -vy, -r, -phi, -p, pitch],
        input: [fr, fl, rr, rl, -steer, flap, friction],
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 256, failure_persistence: None, ..ProptestConfig::default() })]

    fn any_car_in_any_state_agrees_with_the_reference(seed: u64, linear: bool) {
        let model = MODELS[usize::from(linear)];
        let case = cases(model, 1, seed).expect("the bundled car").remove(0);
        let (single, exact) = (evaluated::<f32>(model, &case), evaluated::<f64>(model, &case));
        for (i, scale) in scales(&case).into_iter().enumerate() {
            let error = (f64::from(single[i]) - exact[i]).abs() / scale;
            prop_assert!(error <= TOLERANCE, "output {i}: {} for {}", single[i], exact[i]);
        }
    }

    fn a_linear_car_in_the_mirror_does_the_mirrored(seed: u64) {
        let mut case = cases(TyreModel::Linear, 1, seed).expect("the bundled car").remove(0);
        // Shares of load and the steering's offset are what tells left from right.
        let place = |name: &str| Chassis::<f32>::FIELDS.iter().position(|f| *f == name);
        for (name, value) in [("left_share_front", 0.5), ("left_share_rear", 0.5), ("steer_offset", 0.0)] {
            case.table[place(name).expect(name)] = value;
        }
        let here = evaluated::<f32>(TyreModel::Linear, &case);
        let there = evaluated::<f32>(TyreModel::Linear, &mirrored(&case));
        let scales = scales(&case);
        // Forward speed and acceleration stay, sideways, yaw and roll change sign.
        let signs = [1.0, -1.0, -1.0, -1.0, -1.0, 1.0, 1.0, -1.0, 1.0, -1.0, -1.0, -1.0, -1.0, 1.0];
        for i in 0..here.len() {
            let error = f64::from((here[i] - signs[i] as f32 * there[i]).abs()) / scales[i];
            prop_assert!(error <= TOLERANCE, "output {i}: {} and {}", here[i], there[i]);
        }
    }
}

/// Keeps the cars that cases are made from honest: the fields that the scales read are where they think.
fn the_table_starts_with_the_chassis() {
    let car = bundled_car();
    let table = CarModel::<f64, MagicFormula<f64>>::from_parameters(&car.to_flat()).to_table();
    assert_eq!(table[..Chassis::<f64>::FIELDS.len()], car.chassis.to_flat());
}
