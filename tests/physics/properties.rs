//! Properties that hold whatever the figures: files come back as they were written, no bytes upset the readers, errors
//! name line and key, forces are finite, derivatives are derivatives.

use crate::support::{chassis_from, forces_at, set_b};
use lapswarm::scalar::Dual;
use lapswarm::vehicle::parameters::ParameterInfo;
use lapswarm::vehicle::tyre::{Tyre, TyreFile, TyreInput};
use lapswarm::vehicle::{
    Car, CarInput, CarModel, CarState, Chassis, LinearTyre, MagicFormula, TyreCoefficients, Tyres,
};
use lapswarm::{Error, Result};
use proptest::prelude::*;
use std::path::Path;

/// Figures within the bounds of a table, some of them at the bounds and some at awkward places.
fn flat(table: &'static [ParameterInfo]) -> impl Strategy<Value = Vec<f64>> {
    table
        .iter()
        .map(|p| {
            let (low, high) = (p.minimum, p.maximum);
            prop_oneof![
                8 => low..=high,
                1 => Just(low),
                1 => Just(high),
                1 => Just(if low <= 0.0 && high >= 0.0 { -0.0 } else { low }),
                1 => Just(if low <= 1e-300 && high >= 1e-300 { 1e-300 } else { high }),
            ]
        })
        .collect::<Vec<_>>()
}

/// The same in every bit, which `==` does not say of zeros.
fn bits(figures: &[f64]) -> Vec<u64> {
    figures.iter().map(|x| x.to_bits()).collect()
}

fn parse_tir(text: &str) -> Result<TyreFile> {
    TyreFile::parse(Path::new("some.tir"), text)
}

fn parse_car(text: &str) -> Result<Car> {
    Car::parse(Path::new("some.toml"), text, |_| Ok(TyreFile::new(set_b())))
}

/// A chassis that `Car::parse` takes: an open DRS may not shed more than the rear axle has.
fn chassis() -> impl Strategy<Value = Chassis<f64>> {
    flat(Chassis::<f64>::PARAMETERS).prop_map(|flat| {
        let mut chassis = Chassis::from_flat(&flat);
        chassis.drs_lift = chassis
            .drs_lift
            .min(100.0 * (1.0 - chassis.pressure_centre))
            .max(0.0);
        if chassis.drs_lift / 100.0 > 1.0 - chassis.pressure_centre {
            chassis.drs_lift = 0.0;
        }
        chassis
    })
}

const TYRE: &[ParameterInfo] = TyreCoefficients::<f64>::PARAMETERS;

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn a_tyre_file_comes_back_bit_for_bit(flat in flat(TYRE)) {
        let file = TyreFile::new(TyreCoefficients::from_flat(&flat));
        let text = file.to_text();
        let back = parse_tir(&text).unwrap();
        prop_assert_eq!(bits(&back.coefficients.to_flat()), bits(&flat));
        // From then on the text is its own image.
        prop_assert_eq!(back.to_text(), text);
    }

    /// The bundled file with other figures in it: comments, sections and the rest stay.
    #[test]
    fn a_changed_tyre_file_keeps_its_text(flat in flat(TYRE)) {
        let mut file = parse_tir(include_str!("../../data/cars/gt_slick.tir")).unwrap();
        file.coefficients = TyreCoefficients::from_flat(&flat);
        let back = parse_tir(&file.to_text()).unwrap();
        prop_assert_eq!(bits(&back.coefficients.to_flat()), bits(&flat));
        prop_assert!(file.to_text().contains("! A racing slick"));
    }

    #[test]
    fn a_car_comes_back_bit_for_bit(
        chassis in chassis(),
        front in flat(TYRE),
        rear in flat(TYRE),
        same in any::<bool>(),
        name in "\\PC{0,20}",
        ratio in 0.1..100.0,
        engine in any::<bool>(),
    ) {
        let file = |flat: &[f64]| Box::new(parse_tir(&TyreFile::new(TyreCoefficients::from_flat(flat)).to_text()).unwrap());
        let mut car = Car::bundled().unwrap();
        car.name = name;
        car.chassis = chassis;
        car.steering_ratio = ratio;
        car.tyres = Tyres::MagicFormula { front: file(&front), rear: file(if same { &front } else { &rear }) };
        if !engine {
            car.powertrain = None;
        }
        written_and_read(&car)?;
    }

    #[test]
    fn a_car_on_linear_tyres_comes_back_bit_for_bit(
        chassis in chassis(),
        front in flat(LinearTyre::<f64>::PARAMETERS),
        rear in flat(LinearTyre::<f64>::PARAMETERS),
    ) {
        let mut car = Car::bundled().unwrap();
        car.chassis = chassis;
        car.tyres = Tyres::Linear {
            front: LinearTyre::from_flat(&front),
            rear: LinearTyre::from_flat(&rear),
        };
        written_and_read(&car)?;
    }

    #[test]
    fn no_bytes_upset_the_readers(bytes in prop::collection::vec(any::<u8>(), 0..400)) {
        let text = String::from_utf8_lossy(&bytes);
        let _ = parse_tir(&text);
        let _ = parse_car(&text);
    }

    /// Bytes thrown into good files get further into the readers than bytes alone.
    #[test]
    fn no_bytes_in_good_files_upset_the_readers(
        splice in prop::collection::vec(prop_oneof![any::<char>(), prop::sample::select("[]=\"'$!{}.\n-e0_\t".chars().collect::<Vec<_>>())], 0..12),
        at in any::<prop::sample::Index>(),
        cut in 0usize..40,
    ) {
        for good in [include_str!("../../data/cars/gt_slick.tir"), include_str!("../../data/cars/gt.toml")] {
            let mut text: Vec<char> = good.chars().collect();
            let start = at.index(text.len());
            let end = (start + cut).min(text.len());
            text.splice(start..end, splice.iter().copied());
            let text: String = text.into_iter().collect();
            // What still parses still writes what reads back.
            if let Ok(file) = parse_tir(&text) {
                let back = parse_tir(&file.to_text()).unwrap();
                prop_assert_eq!(bits(&back.coefficients.to_flat()), bits(&file.coefficients.to_flat()));
            }
            let _ = parse_car(&text);
        }
    }

    /// Any coefficient out of its bounds is named with its line.
    #[test]
    fn a_wrong_coefficient_is_named(
        index in 0..TYRE.len(),
        wrong in prop::sample::select(vec!["", "x", "1e999", "nan", "inf", "1,5", "0x10", "1e9", "-1e9", "1 2"]),
    ) {
        let good = TyreFile::new(set_b()).to_text();
        let key = match TYRE[index].name {
            "R0" => "UNLOADED_RADIUS".to_owned(),
            "lFz0" => "LFZO".to_owned(),
            name => name.to_uppercase(),
        };
        let mut lines: Vec<String> = good.lines().map(str::to_owned).collect();
        let line = lines.iter().position(|l| l.split('=').next().unwrap().trim() == key).unwrap_or(lines.len());
        lines.truncate(lines.len().max(line));
        let entry = format!("{key} = {wrong}");
        if line < lines.len() { lines[line] = entry } else { lines.push(entry) }
        let error = parse_tir(&lines.join("\n")).unwrap_err();
        prop_assert_eq!(place(&error), format!("line {}, key {key}", line + 1));
        prop_assert!(error.to_string().contains("some.tir"));
    }

    #[test]
    fn a_wrong_field_is_named(
        index in 0..Chassis::<f64>::PARAMETERS.len(),
        wrong in prop::sample::select(vec!["\"x\"", "nan", "inf", "true", "1e9", "-1e9", "[1.0]", "1e400"]),
    ) {
        let key = Chassis::<f64>::PARAMETERS[index].name;
        let good = include_str!("../../data/cars/gt.toml");
        let mut lines: Vec<String> = good.lines().map(str::to_owned).collect();
        let line = match lines.iter().position(|l| l.split('=').next().unwrap().trim() == key) {
            Some(line) => line,
            None => {
                let section = lines.iter().position(|l| l == "[chassis]").unwrap();
                lines.insert(section + 1, String::new());
                section + 1
            }
        };
        lines[line] = format!("{key} = {wrong}");
        let error = parse_car(&lines.join("\n")).unwrap_err();
        prop_assert_eq!(place(&error), format!("line {}, field chassis.{key}", line + 1));
    }

    /// Whatever passes as a tyre answers with finite forces at every load and slip that a car can get into; its
    /// dual and single-precision forms with it.
    #[test]
    fn a_well_formed_tyre_has_finite_forces(
        figures in flat(TYRE),
        wild in prop::collection::vec(0..TYRE.len(), 1..25),
        share in prop_oneof![0.0..4.0, Just(0.0), Just(1e-9), -1.0..0.0],
        ratio in prop_oneof![-1.0..1.0, -50.0..50.0f64, Just(0.0)],
        tangent in prop_oneof![-0.3..0.3, -50.0..50.0f64, Just(0.0)],
        camber in -0.26..0.26,
    ) {
        // All coefficients wild at once hardly ever make a tyre; some of a good tyre's do.
        let mut flat = set_b().to_flat();
        for &index in &wild {
            flat[index] = figures[index];
        }
        let tyre: TyreCoefficients<f64> = TyreCoefficients::from_flat(&flat);
        if tyre.well_formed().is_err() { return Ok(()); }
        let load = share * tyre.fnomin * tyre.lfz0;
        let forces = forces_at(&tyre, load, ratio, tangent, camber);
        prop_assert!(forces.x.is_finite() && forces.y.is_finite() && forces.aligning_moment.is_finite(), "{forces:?}");
        let single: TyreCoefficients<f32> = TyreCoefficients::from_flat(&flat.iter().map(|x| *x as f32).collect::<Vec<_>>());
        let forces = single.prepare(camber as f32).forces(TyreInput {
            load: load as f32,
            slip_ratio: ratio as f32,
            slip_tangent: tangent as f32,
            side: 1.0,
        });
        prop_assert!(forces.x.is_finite() && forces.y.is_finite() && forces.aligning_moment.is_finite(), "single: {forces:?} {load} {ratio} {tangent} {camber}  {:?}", wild.iter().map(|i| (TYRE[*i].name, flat[*i])).collect::<Vec<_>>());
    }

    /// A curve's `E` is taken as one where it is greater, whatever its parts make of it.
    #[test]
    fn curvature_is_never_above_one(
        excess in 1.0..1000.0,
        load in 1000.0..8000.0,
        ratio in -0.3..0.3,
        tangent in -0.3..0.3,
    ) {
        let with = |e: f64| {
            let mut tyre = set_b();
            (tyre.pex2, tyre.pex3, tyre.pex4, tyre.pey2, tyre.pey3, tyre.pey4) = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
            (tyre.rex2, tyre.rey2, tyre.qez2, tyre.qez4, tyre.qez5) = (0.0, 0.0, 0.0, 0.0, 0.0);
            (tyre.pex1, tyre.pey1, tyre.rex1, tyre.rey1, tyre.qez1) = (e, e, e, e, e);
            forces_at(&tyre, load, ratio, tangent, 0.05)
        };
        prop_assert_eq!(with(excess), with(1.0));
    }

    /// Exact derivatives of the whole car's rates to its state, inputs and parameters, against central differences.
    #[test]
    fn derivatives_of_the_car_are_derivatives(
        vx in 8.0..60.0, drift in -0.06..0.06, yaw_rate in -0.5..0.5, roll in -0.05..0.05, roll_rate in -0.2..0.2,
        pitch in -8.0..8.0, steer in -0.1..0.1,
        slips in prop::array::uniform4(-0.08..0.08),
        freed in 0..Chassis::<f64>::PARAMETERS.len() + 2 * TYRE.len(),
    ) {
        // The car of set B has cambers, shifts and wind, so that no term is zero by luck.
        let chassis = chassis_from(
            "front_camber_deg=-2 rear_camber_deg=-1 headwind_mps=3 drs_drag_percent=8 drs_downforce_percent=5
             steer_offset_rad=0.002 front_left_load_share=0.51 rear_left_load_share=0.48",
        );
        let parameters: Vec<f64> = [chassis.to_flat(), set_b().to_flat(), set_b().to_flat()].concat();
        let state = [vx, drift * vx, yaw_rate, roll, roll_rate, pitch];
        let speeds: [f64; 4] = std::array::from_fn(|i| (1.0 + slips[i]) * vx / chassis.radius_front);
        let variables: Vec<f64> = [&state[..], &speeds, &[steer, parameters[freed]]].concat();
        let dual: [Dual<12>; 12] = std::array::from_fn(|i| Dual::variable(variables[i], i));
        let exact = rates(&dual, &parameters.iter().map(|x| Dual::constant(*x)).collect::<Vec<_>>(), freed);
        // A step that leaves truncation (h^2) and cancellation (1e-16/h) both near 1e-10 of the figure; per variable
        // in the size of that variable.
        for variable in 0..12 {
            let size = variables[variable].abs().max(if variable == 11 { 1e-2 } else { 0.1 });
            let difference = |h: f64| -> Vec<f64> {
                let at = |shift: f64| {
                    let mut moved: [f64; 12] = std::array::from_fn(|i| variables[i]);
                    moved[variable] += shift;
                    rates(&moved, &parameters, freed)
                };
                at(h).iter().zip(at(-h)).map(|(a, b)| (a - b) / (2.0 * h)).collect()
            };
            let (fine, coarse) = (difference(1e-6 * size), difference(2e-6 * size));
            for output in 0..8 {
                let got = exact[output].gradient[variable];
                // Two steps that disagree straddle a kink (a sign, a clamp, a lifting wheel), where there is none.
                let scale = exact[output].value.abs().max(1.0) / size;
                let kink = (fine[output] - coarse[output]).abs() > 1e-6 * (scale + got.abs());
                prop_assert!(kink || (got - fine[output]).abs() <= 1e-6 * (scale + got.abs()),
                    "output {output}, variable {variable}: {got} where differences say {}", fine[output]);
            }
        }
    }
}

/// The rates of state, ax and ay of a car in the state, under the wheel speeds and steering, and with the `freed`
/// parameter that `variables` hold in this order.
fn rates<R: lapswarm::scalar::Real>(variables: &[R; 12], parameters: &[R], freed: usize) -> Vec<R> {
    let mut parameters = parameters.to_vec();
    parameters[freed] = variables[11];
    let model: CarModel<R, MagicFormula<R>> = CarModel::from_parameters(&parameters);
    let state = CarState::from_array(std::array::from_fn(|i| variables[i]));
    let input = CarInput {
        wheel_speed: std::array::from_fn(|i| variables[6 + i]),
        steer: variables[10],
        flap: R::lit(0.4),
        friction: None,
    };
    let rate = model.rate(&state, &input);
    [&rate.state.to_array()[..], &[rate.ax, rate.ay]].concat()
}

/// Writes a car into a folder and reads it back: every figure in every bit.
fn written_and_read(car: &Car) -> std::result::Result<(), TestCaseError> {
    let folder = tempfile::tempdir().unwrap();
    car.write(folder.path(), "car").unwrap();
    let back = Car::load(folder.path().join("car.toml").to_str().unwrap()).unwrap();
    prop_assert_eq!(&back, car);
    prop_assert_eq!(bits(&back.to_flat()), bits(&car.to_flat()));
    Ok(())
}

fn place(error: &Error) -> String {
    match error {
        Error::Input { place, .. } => place.to_string(),
        other => panic!("not an input error: {other}"),
    }
}

/// What is missing, unknown or twice there is named too.
#[test]
fn missing_unknown_and_repeated_entries_are_named() {
    let tir = TyreFile::new(set_b()).to_text();
    let without = |key: &str| {
        let kept: Vec<&str> = tir.lines().filter(|l| !l.starts_with(key)).collect();
        place(&parse_tir(&kept.join("\n")).unwrap_err())
    };
    assert_eq!(without("PKY1"), "key PKY1");
    assert_eq!(without("FNOMIN"), "key FNOMIN");
    assert_eq!(without("FITTYP"), "key FITTYP");
    let lines = tir.lines().count();
    assert_eq!(
        place(&parse_tir(&format!("{tir}PCY1 = 1.3\n")).unwrap_err()),
        format!("line {}, key PCY1", lines + 1)
    );
    assert_eq!(
        place(&parse_tir(&tir.replace("FITTYP = 6", "FITTYP = 61")).unwrap_err()),
        "line 13, key FITTYP"
    );
    assert_eq!(
        place(&parse_tir(&tir.replace("'meter'", "'mm'")).unwrap_err()),
        "line 6, key LENGTH"
    );
    assert_eq!(place(&parse_tir("[MODEL\nFITTYP = 6").unwrap_err()), "line 1");

    let car = include_str!("../../data/cars/gt.toml");
    let wrong = |from: &str, to: &str| place(&parse_car(&car.replace(from, to)).unwrap_err());
    assert_eq!(wrong("mass_kg = 1245.0", ""), "line 4, field chassis.mass_kg");
    assert_eq!(
        wrong("mass_kg = ", "mass = 1\nmass_kg = "),
        "line 5, field chassis.mass"
    );
    assert_eq!(
        wrong("mass_kg = 1245.0", "mass_kg = 12"),
        "line 5, field chassis.mass_kg"
    );
    assert_eq!(wrong("mass_kg = 1245.0", "mass_kg = = 12"), "line 5");
    assert_eq!(wrong("[tyres]", "[tires]"), "field tyres");
}
