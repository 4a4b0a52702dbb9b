use super::*;
use crate::vehicle::Car;

fn powertrain() -> (Powertrain, f64) {
    let car = Car::load("gt_hybrid").unwrap();
    (car.powertrain.unwrap(), car.chassis.radius_rear)
}

/// Third gear turns 2.15 x 3.2 = 6.88 times: 6000 rpm are 100 Hz, so that the wheel turns 14.5349 times a second, 2.04204 m each. The
/// 417 N m of that engine speed push with 417 x 6.88 x 0.95 / 0.325 N.
#[test]
fn a_gears_speed_and_force_by_hand() {
    let car = Car::bundled().unwrap();
    let (powertrain, radius) = (car.powertrain.unwrap(), car.chassis.radius_rear);
    let speed = powertrain.road_speed_in(2, 6000.0, radius);
    assert!((speed / 29.6808 - 1.0).abs() < 1e-5, "{speed}");
    assert!((powertrain.engine_speed_in(2, speed, radius) - 6000.0).abs() < 1e-9);
    let force = powertrain.force_in(2, speed, radius);
    assert!((force / 8386.2 - 1.0).abs() < 1e-5, "{force}");
    assert_eq!(powertrain.force_in(2, 1.5 * speed, radius), 0.0);
}

#[test]
fn formula_ones_fuel_flow() {
    // 0.009 x 8000 + 5.5 by hand, and 100 from 10500 rpm on, where both agree.
    assert!((FlowLimit::FORMULA_ONE.at(8000.0) - 77.5).abs() < 1e-12);
    assert!((FlowLimit::FORMULA_ONE.at(10_499.99) - 100.0).abs() < 1e-3);
    assert_eq!(FlowLimit::FORMULA_ONE.at(10_500.0), 100.0);
    assert_eq!(FlowLimit::FORMULA_ONE.at(15_000.0), 100.0);
}

#[test]
fn maps_are_bilinear_and_held_at_their_edges() {
    let engine = powertrain().0.engine.unwrap();
    assert_eq!(engine.fuel_flow_at(6000.0, 90.0), 70.7);
    // The mean of 54.6, 57.7, 64.1 and 69.8.
    assert!((engine.fuel_flow_at(6250.0, 15.0) - 61.55).abs() < 1e-9);
    assert_eq!(engine.torque_at(9000.0, 95.0), 382.0);
    assert_eq!(engine.torque_at(3000.0, 90.0), 227.0);
    // 408 Nm at 8000 rpm is 341.8 kW, which 92.4 kg/h give at 270.3 g/kWh.
    assert!((engine.bsfc_gpkwh(8000.0, 90.0).unwrap() - 270.3).abs() < 0.1);
    assert_eq!(engine.bsfc_gpkwh(8000.0, 0.0), None);
}

#[test]
fn a_limit_of_the_flow_closes_the_throttle() {
    let mut engine = powertrain().0.engine.unwrap();
    assert_eq!(engine.greatest_torque(8000.0), (408.0, 90.0));
    engine.flow_limit = Some(FlowLimit::FORMULA_ONE);
    let (torque, throttle) = engine.greatest_torque(8000.0);
    // 77.5 kg/h lie a quarter of the way from 76.4 (20 degrees) to 80.8 (30 degrees).
    assert!((throttle - 22.5).abs() < 1e-6, "{throttle}");
    assert!(engine.fuel_flow_at(8000.0, throttle) <= 77.5);
    let share = (77.5 - 9.2) / (92.4 - 9.2);
    assert!((torque - 408.0 * share).abs() < 0.1, "{torque}");
}

/// A smaller engine under a limit as much smaller is written and read as it is: the line below 10500 rpm too.
#[test]
fn a_scaled_limit_of_the_flow_is_written_back_whole() {
    let mut car = Car::load("gt_hybrid").unwrap();
    let mut powertrain = car.powertrain.take().unwrap();
    powertrain.engine.as_mut().unwrap().flow_limit = Some(FlowLimit::FORMULA_ONE);
    car.powertrain = Some(powertrain.scaled(0.7));
    let folder = tempfile::tempdir().unwrap();
    car.write(folder.path(), "car").unwrap();
    let back = Car::load(&folder.path().join("car.toml").display().to_string()).unwrap();
    let limit = |car: &Car| {
        car.powertrain
            .as_ref()
            .unwrap()
            .engine
            .as_ref()
            .unwrap()
            .flow_limit
    };
    assert_eq!(limit(&back), limit(&car));
    assert!((limit(&back).unwrap().at(8000.0) - 0.7 * 77.5).abs() < 1e-9);
}

#[test]
fn gears_give_most_force_and_shift_where_the_next_does() {
    let (powertrain, radius) = powertrain();
    let shifts = powertrain.shift_points_mps(radius);
    assert_eq!(shifts.len(), 5);
    for (i, shift) in shifts.iter().enumerate() {
        let v = shift.unwrap();
        assert_eq!(powertrain.gear(v - 0.1, radius).unwrap().index, i, "{v}");
        assert_eq!(powertrain.gear(v + 0.1, radius).unwrap().index, i + 1, "{v}");
    }
    // Sixth ends at 8500 rpm: 70 m/s.
    assert!(powertrain.gear(69.9, radius).unwrap().engine_speed_rpm < 8500.0);
    assert!(powertrain.gear(70.1, radius).is_none());
}

#[test]
fn an_operating_point_is_the_maps_inverse() {
    let (powertrain, radius) = powertrain();
    let engine = powertrain.engine.as_ref().unwrap();
    for (speed, wheel_power) in [(30.0, 50e3), (45.0, 150e3), (60.0, 280e3), (65.0, 10e3)] {
        let point = powertrain.operating_point(speed, wheel_power, radius).unwrap();
        let rpm = point.gear.engine_speed_rpm;
        assert!((point.power_w * powertrain.efficiency - wheel_power).abs() < 1e-6);
        assert!((engine.torque_at(rpm, point.throttle_deg) - point.torque_nm).abs() < 1e-9);
        assert!((0.0..=1.0).contains(&point.load) && point.missing_w.abs() < 1e-6);
    }
    let beyond = powertrain.operating_point(60.0, 1e6, radius).unwrap();
    assert_eq!(beyond.load, 1.0);
    assert!(beyond.missing_w > 6e5);
}

/// 5000 N on 1245 kg against 1425 N of drag and a rolling resistance of 0.013, with rotating masses of a tenth of the car's:
/// (5000 - 1425 - 158.7) / (1.1 x 1245) = 2.495 m/s^2.
#[test]
fn what_turns_is_accelerated_too() {
    let (mut powertrain, _) = powertrain();
    powertrain.rotating_mass_factor = 1.1;
    let resistance = 1425.0 / 1245.0 + GRAVITY_MPS2 * 0.013;
    let found = powertrain.acceleration_mps2(5000.0, 1245.0, resistance);
    assert!((found - 2.4946).abs() < 1e-3, "{found}");
}

/// The rear axle drives, both wheels alike: a file that says otherwise is not half obeyed.
#[test]
fn a_differential_is_refused() {
    let text = include_str!("../../../data/cars/gt.toml");
    let tyre = include_str!("../../../data/cars/gt_slick.tir");
    let read = |text: &str| {
        Car::parse(std::path::Path::new("own.toml"), text, |name| {
            crate::vehicle::tyre::TyreFile::parse(std::path::Path::new(name), tyre)
        })
    };
    assert!(read(text).is_ok());
    for key in ["front_share", "outer_share_per_rad", "outer_share_per_radps"] {
        let error = read(&format!("{text}\n[powertrain.differential]\n{key} = 0.5\n")).unwrap_err();
        assert!(error.to_string().contains("differential"), "{error}");
    }
}
