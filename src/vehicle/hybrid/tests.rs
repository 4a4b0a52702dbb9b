use super::*;
use crate::vehicle::Car;
use std::path::Path;

fn hybrid() -> Hybrid {
    Car::load("gt_hybrid").unwrap().hybrid.unwrap()
}

#[test]
fn the_class_of_8_mj_is_5_3_mj_at_silverstone() {
    // 8 MJ x 5.84 km x 1.55 / 13.626 km by hand, and Formula One's as they stand.
    let class = EnergyRules::le_mans(8.0e6);
    assert!((class.deployed_on(5840.0).unwrap() - 5.3146e6).abs() < 1e2);
    assert!((class.deployed_on(13_626.0).unwrap() - 12.4e6).abs() < 1.0);
    assert_eq!(EnergyRules::FORMULA_ONE.deployed_on(5840.0), Some(4.0e6));
    assert_eq!(hybrid().rules, class);
}

#[test]
fn the_motor_is_held_by_torque_then_by_power() {
    let k = hybrid().mgu_k;
    // 60 Nm at 4 x 4000 rpm: 60 x 1675.5 rad/s = 100.5 kW; at 4 x 5000 rpm 125.7 kW, held to 120.
    assert!((k.power_at(4000.0) - 100_531.0).abs() < 1.0);
    assert_eq!(k.power_at(5000.0), 120e3);
    // 35 Nm at 34000 rpm is 124.6 kW; beyond there is none.
    assert_eq!(k.power_at(8500.0), 120e3);
    assert_eq!(k.power_at(8501.0), 0.0);
    assert_eq!(k.power_at(0.0), 0.0);
}

#[test]
fn brakes_are_blended() {
    let k = hybrid().mgu_k;
    let soft = k.blend(50e3, 7000.0, 0.95);
    assert!((soft.generator_w - 47.5e3).abs() < 1e-6 && soft.hydraulic_w.abs() < 1e-6);
    let hard = k.blend(500e3, 7000.0, 0.95);
    assert_eq!(hard.generator_w, 120e3);
    assert!((hard.hydraulic_w - (500e3 - 120e3 / 0.95)).abs() < 1e-6);
}

#[test]
fn the_turbocharger_generates_by_its_flow() {
    let h = hybrid().mgu_h.unwrap();
    assert_eq!((h.generated_w(1.0), h.generated_w(0.5)), (40e3, 20e3));
}

#[test]
fn files_are_written_and_read_back() {
    let folder = tempfile::tempdir().unwrap();
    let mut car = Car::load("gt_hybrid").unwrap();
    let written = |car: &Car| {
        car.write(folder.path(), "own").unwrap();
        Car::load(folder.path().join("own.toml").to_str().unwrap()).unwrap()
    };
    assert_eq!(written(&car), car);
    let h = car.hybrid.as_mut().unwrap().mgu_h.as_mut().unwrap();
    (h.motor_w, h.motor_gain_w) = (60e3, 20e3);
    assert_eq!(written(&car), car);
}

#[test]
fn mistakes_are_named() {
    let text = include_str!("../../../data/cars/gt_hybrid.toml");
    let tyre = include_str!("../../../data/cars/gt_slick.tir");
    for (from, to, wanted) in [
        (
            "motor_efficiency = 1.0",
            "motor_efficiency = 1.1",
            "hybrid.mgu_k.motor_efficiency",
        ),
        (
            "gearbox_efficiency = 0.95",
            "gearbox_efficiency = 1.2",
            "powertrain.gearbox_efficiency",
        ),
        ("[0, 20000, 34000]", "[0, 34000, 20000]", "hybrid.mgu_k.speed_rpm"),
        ("[60, 60, 35]", "[60, -60, 35]", "hybrid.mgu_k.torque_nm"),
        ("power_kw = 120.0", "power_kw = -1.0", "hybrid.mgu_k.power_kw"),
        (
            "generator_kw = 40.0",
            "generator_kw = 40.0\nmotor_gain_kw = 80.0",
            "hybrid.mgu_h.motor_kw",
        ),
        (
            "generator_kw = 40.0",
            "generator_kw = 40.0\nmotor_kw = 60.0",
            "hybrid.mgu_h.motor_gain_kw",
        ),
        (
            "from_speed_mps = 65.0",
            "motor_kw = 60.0\nmotor_gain_kw = 20.0",
            "hybrid.mgu_h.from_speed_mps",
        ),
        (
            "capacity_mj = 5.3",
            "capacity_mj = 0.0",
            "hybrid.store.capacity_mj",
        ),
        ("start_soc = 1.0", "start_soc = 1.5", "hybrid.store.start_soc"),
        ("\"le_mans_8mj\"", "\"dtm\"", "hybrid.rules.class"),
        (
            "\"le_mans_8mj\"",
            "\"le_mans_8mj\"\ndeployed_mj_per_lap = 3",
            "hybrid.rules.deployed_mj_per_lap",
        ),
        (
            "class = \"le_mans_8mj\"",
            "deployed_mj_per_lap = -3",
            "hybrid.rules.deployed_mj_per_lap",
        ),
        ("[0, 10, 20, 30,", "[0, 20, 10, 30,", "powertrain.throttle_deg"),
        ("[4000, 4500,", "[4500, 4000,", "powertrain.engine_speed_rpm"),
        ("    [9, 8.2, 8.2,", "    [9, 8.2,", "powertrain.fuel_flow_kgph"),
        ("    [227, 242,", "    [-227, 242,", "powertrain.torque_map_nm"),
        ("    [227, 242,", "    [2270, 242,", "efficiency"),
        (
            "fuel_density_kgpl = 0.748",
            "fuel_flow_most_kgph = 5",
            "powertrain.fuel_flow_most_kgph",
        ),
    ] {
        assert!(text.contains(from), "{from}");
        let changed = text.replacen(from, to, 1);
        let error = Car::parse(Path::new("own.toml"), &changed, |name| {
            crate::vehicle::tyre::TyreFile::parse(Path::new(name), tyre)
        })
        .unwrap_err()
        .to_string();
        assert!(
            error.contains(wanted) && error.contains("own.toml"),
            "{error} should say {wanted}"
        );
    }
}
