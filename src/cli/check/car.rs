//! A car's figures beside those that it was made from, and its picture.

use lapswarm::report::{Figure, Table};
use lapswarm::study::envelope::envelope_figure;
use lapswarm::vehicle::facts::{corner_g_of, friction_at_rest, top_speed_kmh};
use lapswarm::vehicle::limits::{EnvelopeAtSpeed, SpeedRange, car_envelope};
use lapswarm::vehicle::powertrain::GRAVITY_MPS2;
use lapswarm::vehicle::{Car, CarFacts};
use lapswarm::{Error, Result};
use std::f64::consts::TAU;
use std::path::Path;

/// What the car does beside what was asked of it.
pub fn compared(car: &Car, facts: &CarFacts) -> String {
    let chassis = &car.chassis;
    let wheelbase = chassis.cg_to_front + chassis.cg_to_rear;
    let weight = chassis.mass * chassis.gravity * chassis.cg_height;
    let per_g = weight / (chassis.roll_stiffness - weight);
    let mut rows = vec![
        ("mass", "kg", Some(facts.mass_kg), chassis.mass),
        (
            "front weight",
            "%",
            Some(facts.front_weight_percent),
            100.0 * chassis.cg_to_rear / wheelbase,
        ),
        ("wheelbase", "m", Some(facts.wheelbase_m), wheelbase),
        ("roll", "deg/g", Some(facts.roll_deg_per_g), per_g.to_degrees()),
        (
            "tyre friction at rest",
            "-",
            facts.tyre_friction,
            friction_at_rest(car),
        ),
    ];
    let corner = format!("cornering at {} km/h", facts.corner_kmh);
    rows.push((&corner, "g", facts.corner_g, corner_g_of(car, facts.corner_kmh)));
    if let (Some(powertrain), Some(top)) = (&car.powertrain, top_speed_kmh(car)) {
        let points = powertrain.engine_speed_rpm.iter().zip(&powertrain.torque_nm);
        let power = points
            .map(|(rpm, torque)| rpm * TAU / 60.0 * torque / 1e3)
            .fold(0.0, f64::max);
        rows.push(("power", "kW", Some(facts.power_kw), power));
        rows.push(("top speed", "km/h", Some(facts.top_speed_kmh), top));
    }
    let said = |asked: &Option<f64>| asked.map_or("not asked".to_owned(), |x| format!("{x}"));
    Table::rows(&rows)
        .text("figure", |(name, ..)| *name)
        .text("unit", |(_, unit, ..)| *unit)
        .text("asked", |(.., asked, _)| said(asked))
        .text("the car", |(.., is)| format!("{is:.3}"))
        .table()
        .to_text()
}

/// Draws what a car can do into `folder`, and says it in words.
pub fn draw(path: &Path, folder: &Path) -> Result<String> {
    /// Speeds of the picture.
    const SPEEDS: f64 = 12.0;
    let car = Car::load(&path.display().to_string())?;
    let top = top_speed_kmh(&car).unwrap_or(250.0) / 3.6;
    let from_mps = (0.25 * top).max(3.0);
    let range = SpeedRange {
        from_mps,
        to_mps: top.max(from_mps + 1.0),
        step_mps: (top - from_mps).max(1.0) / SPEEDS,
    };
    let limits = car_envelope(&car, &range)?;
    std::fs::create_dir_all(folder).map_err(|e| Error::io(folder, "create", e))?;
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let picture = folder.join(format!("{stem}.svg"));
    envelope_figure(&limits, &car.name).write_svg(&picture)?;
    let at = |speed: &EnvelopeAtSpeed| {
        let in_g = |a: f64| a / GRAVITY_MPS2;
        format!(
            "{:.0} km/h: corners at up to {:.2} g, brakes at up to {:.2} g",
            3.6 * speed.row.v_mps,
            in_g(speed.row.ay_mps2),
            in_g(speed.row.ax_grip_mps2 + speed.row.drag_mps2)
        )
    };
    let ends = limits.speeds.first().into_iter().chain(limits.speeds.last());
    let ends: Vec<String> = ends.map(at).collect();
    Ok(format!(
        "{}\nundersteer gradient {:.2} deg/g\npicture: {}",
        ends.join("\n"),
        limits.handling.understeer_gradient_deg_per_g,
        picture.display()
    ))
}
