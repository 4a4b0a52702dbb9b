//! A car's figures beside those that it was made from, and its pictures.

use super::draw::{Chart, Line, Look};
use super::tyres;
use lapswarm::Result;
use lapswarm::files::write_whole;
use lapswarm::report::{HtmlReport, Table};
use lapswarm::study::envelope::envelope_figure;
use lapswarm::vehicle::brakes::{BrakedAxles, brake_balance};
use lapswarm::vehicle::facts::{corner_g_of, friction_at_rest, top_speed_kmh};
use lapswarm::vehicle::limits::{CarEnvelope, EnvelopeAtSpeed, SpeedRange, car_envelope};
use lapswarm::vehicle::powertrain::GRAVITY_MPS2;
use lapswarm::vehicle::{Car, CarFacts, Powertrain, steady_car};
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

/// The g-g-v envelope of a car with an engine.
pub struct Limits {
    limits: CarEnvelope,
    name: String,
}

impl Limits {
    fn of(car: &Car) -> Result<Self> {
        /// Speeds of the picture.
        const SPEEDS: f64 = 12.0;
        let top = top_mps(car);
        let from_mps = (0.25 * top).max(3.0);
        let range = SpeedRange {
            from_mps,
            to_mps: top.max(from_mps + 1.0),
            step_mps: (top - from_mps).max(1.0) / SPEEDS,
        };
        Ok(Self {
            limits: car_envelope(car, &range)?,
            name: car.name.clone(),
        })
    }

    /// Writes its files into a folder, and places it on a page.
    pub fn write(&self, page: &mut HtmlReport, folder: &Path) -> Result<()> {
        page.section(
            "g-g-v envelope",
            "Steady states of the 4DOF model, the limits of tyres and engine, and what they leave. `envelope.csv` is read by --envelope.",
        );
        page.figure(
            folder.join("envelope.svg"),
            &envelope_figure(&self.limits, &self.name),
        )?;
        let rows = self.limits.envelope.to_csv();
        write_whole(folder.join("envelope.csv"), rows.as_bytes())
    }

    /// Its ends in words.
    pub fn told(&self) -> String {
        let at = |speed: &EnvelopeAtSpeed| {
            let in_g = |a: f64| a / GRAVITY_MPS2;
            format!(
                "{:.0} km/h: corners at up to {:.2} g, brakes at up to {:.2} g",
                3.6 * speed.row.v_mps,
                in_g(speed.row.ay_mps2),
                in_g(speed.row.ax_grip_mps2 + speed.row.drag_mps2)
            )
        };
        let speeds = &self.limits.speeds;
        let ends: Vec<String> = speeds.first().into_iter().chain(speeds.last()).map(at).collect();
        format!(
            "{}\nundersteer gradient {:.2} deg/g",
            ends.join("\n"),
            self.limits.handling.understeer_gradient_deg_per_g
        )
    }
}

/// The greatest speed of a car (m/s); of one without an engine what its pictures go to.
fn top_mps(car: &Car) -> f64 {
    top_speed_kmh(car).unwrap_or(250.0) / 3.6
}

/// The page and the charts of the car of a file, and its envelope if it has an engine.
pub fn drawn(path: &Path) -> Result<(HtmlReport, Vec<Chart>, Option<Limits>)> {
    let car = Car::load(&path.display().to_string())?;
    let limits = car.powertrain.as_ref().map(|_| Limits::of(&car)).transpose()?;
    let mut page = HtmlReport::new("check", &car.name);
    let mut charts = Vec::new();
    match &car.powertrain {
        Some(powertrain) => {
            page.tile("Top speed", format!("{:.1}", top_mps(&car)), "m/s");
            charts.push(gears(powertrain, car.chassis.radius_rear));
            charts.push(tractive_force(&car, powertrain));
            charts.push(standing_start(&car, powertrain));
        }
        None => {
            page.sentence("The car has no powertrain: there are no gears, no tractive force and no envelope.")
        }
    }
    charts.push(brakes(&car, &mut page));
    let [front, rear] = car.axle_tyres();
    let named = |name: &str, tyre| (name.to_owned(), tyre);
    let axles = if front == rear {
        vec![named("both axles", front)]
    } else {
        vec![named("front tyre", front), named("rear tyre", rear)]
    };
    page.sentence("Tyres are the left ones, with the camber of their axle; the second of the four loads is about theirs at rest.");
    // Half of a wheel's load at rest.
    charts.extend(tyres::charts(
        &axles,
        0.125 * car.chassis.mass * car.chassis.gravity,
    ));
    Ok((page, charts, limits))
}

/// The place of a gear among all, from 0 to 1.
fn place(gear: usize, powertrain: &Powertrain) -> f64 {
    gear as f64 / (powertrain.gear_ratios.len() - 1).max(1) as f64
}

/// The ends of the torque curve (rpm).
fn engine_range(powertrain: &Powertrain) -> [f64; 2] {
    let speeds = &powertrain.engine_speed_rpm;
    [speeds[0], speeds[speeds.len() - 1]]
}

/// Engine speed over road speed in each gear, and the way through the gears at full throttle.
fn gears(powertrain: &Powertrain, radius: f64) -> Chart {
    let [slowest, fastest] = engine_range(powertrain);
    let road = |gear, rpm| powertrain.road_speed_in(gear, rpm, radius);
    let gear_line = |gear: usize| {
        let ends = [slowest, fastest].map(|rpm| (road(gear, rpm), rpm));
        Line::new(
            format!("gear {}", gear + 1),
            Look::Family(place(gear, powertrain)),
            ends,
        )
    };
    let mut lines: Vec<Line> = (0..powertrain.gear_ratios.len()).map(gear_line).collect();
    let mut shifts: Vec<(f64, f64)> = Vec::new();
    for (gear, shift) in powertrain.shift_points_mps(radius).into_iter().enumerate() {
        // A gear that is never better ends the way.
        let Some(speed) = shift else { break };
        let speed = speed.min(road(gear, fastest));
        let rpm = |gear| powertrain.engine_speed_in(gear, speed, radius);
        shifts.extend([(speed, rpm(gear)), (speed, rpm(gear + 1))]);
    }
    let last = shifts.len() / 2;
    let start = (road(0, slowest), slowest);
    let end = (road(last, fastest), fastest);
    let way = std::iter::once(start).chain(shifts.iter().copied()).chain([end]);
    let told: Vec<String> = shifts
        .chunks_exact(2)
        .enumerate()
        .map(|(gear, pair)| {
            let [(speed, before), (_, after)] = [pair[0], pair[1]];
            format!(
                "{}-{} at {:.0} km/h ({before:.0} to {after:.0} rpm)",
                gear + 1,
                gear + 2,
                3.6 * speed
            )
        })
        .collect();
    let about = if powertrain.gear_ratios.len() == 1 {
        "The car has one gear.".to_owned()
    } else if told.is_empty() {
        "No gear gives more force than the one before it.".to_owned()
    } else {
        format!(
            "The line at full throttle shifts where the next gear gives more force: {}.",
            told.join(", ")
        )
    };
    lines.push(Line::new("at full throttle", Look::Own, way));
    if !shifts.is_empty() {
        let points = shifts.into_iter().step_by(2);
        lines.push(Line::new("shift points", Look::Dots, points));
    }
    Chart {
        file: "gears",
        title: "Gears",
        about,
        axes: [("speed", "m/s"), ("engine speed", "rpm")],
        of: ["chart", "line"],
        panels: vec![("Engine speed in each gear".to_owned(), lines)],
    }
}

/// Force at the wheels at full throttle in each gear, what resists it, and what the driven tyres can give.
fn tractive_force(car: &Car, powertrain: &Powertrain) -> Chart {
    const STEPS: u8 = 60;
    let radius = car.chassis.radius_rear;
    let [slowest, fastest] = engine_range(powertrain);
    let share = |k: u8| f64::from(k) / f64::from(STEPS);
    let gear_line = |gear: usize| {
        let point = |k: u8| {
            // The end itself, and not what lies beyond it by rounding.
            let rpm = (slowest + (fastest - slowest) * share(k)).min(fastest * (1.0 - 1e-12));
            let speed = powertrain.road_speed_in(gear, rpm, radius);
            (speed, powertrain.force_in(gear, speed, radius))
        };
        let look = Look::Family(place(gear, powertrain));
        Line::new(format!("gear {}", gear + 1), look, (0..=STEPS).map(point))
    };
    let mut lines: Vec<Line> = (0..powertrain.gear_ratios.len()).map(gear_line).collect();
    let steady = steady_car(car);
    let (mass, top) = (car.chassis.mass, top_mps(car));
    let speeds =
        move |steps: u8| (0..=steps).map(move |k| 1.0 + (top - 1.0) * f64::from(k) / f64::from(steps));
    let resistance = speeds(STEPS).map(|v| (v, mass * (steady.drag(v) + car.rolling_mps2())));
    let grip = speeds(20).map(|v| (v, mass * steady.greatest_traction(v)));
    lines.push(Line::new("drag and rolling", Look::Own, resistance));
    lines.push(Line::new("driven tyres at most", Look::Own, grip));
    Chart {
        file: "tractive_force",
        title: "Tractive force",
        about: format!(
            "At full throttle. What lies above drag and rolling resistance accelerates the car; above the line of the driven tyres wheels              spin. The top speed is {:.0} km/h.",
            3.6 * top
        ),
        axes: [("speed", "m/s"), ("force at the wheels", "N")],
        of: ["chart", "line"],
        panels: vec![("Force at the wheels in each gear".to_owned(), lines)],
    }
}

/// From standstill to the top speed at full throttle and back on the brakes: by the engine, and with the motor of a hybrid beside it.
fn standing_start(car: &Car, powertrain: &Powertrain) -> Chart {
    /// Speeds at which tyres are asked, and steps between two of these.
    const KNOTS: usize = 40;
    const WITHIN: usize = 10;
    /// Motors have a torque at rest, and gears a speed: both are taken at this speed or above (m/s).
    const SLOWEST_MPS: f64 = 1.0;
    let (mass, radius) = (car.chassis.mass, car.chassis.radius_rear);
    let steady = steady_car(car);
    // Just below the top speed, which is reached where nothing is left to accelerate.
    let top = 0.995 * top_mps(car);
    let knot = |k: usize| (top * k as f64 / KNOTS as f64).max(SLOWEST_MPS);
    let knots = |of: &dyn Fn(f64) -> f64| (0..=KNOTS).map(|k| of(knot(k))).collect::<Vec<f64>>();
    let traction = knots(&|v| steady.greatest_traction(v));
    let braking = knots(&|v| steady.greatest_braking(v));
    let steps = KNOTS * WITHIN;
    let at = |table: &[f64], step: f64| {
        let place = step / WITHIN as f64;
        let k = (place as usize).min(KNOTS - 1);
        table[k] + (place - k as f64) * (table[k + 1] - table[k])
    };
    let rotating = powertrain.rotating_mass_factor;
    let gains = |step: f64, motor: bool| {
        let v = (top * step / steps as f64).max(SLOWEST_MPS);
        let motor_n = car.motor_n(v).filter(|_| motor).unwrap_or(0.0);
        let pull = (powertrain.wheel_force(v, radius) + motor_n) / mass;
        let drag = steady.drag(v);
        let driven = (pull - car.rolling_mps2() + (rotating - 1.0) * drag) / rotating;
        at(&traction, step).min(driven) - drag
    };
    let sheds = |step: f64| {
        let v = (top * step / steps as f64).max(SLOWEST_MPS);
        at(&braking, step) + steady.drag(v) + car.rolling_mps2()
    };
    let rise = top / steps as f64;
    let run = |motor: bool| {
        let (mut time, mut points) = (0.0, vec![(0.0, 0.0)]);
        for step in 0..steps {
            time += rise / gains(step as f64 + 0.5, motor);
            points.push((time, rise * (step + 1) as f64));
        }
        let reached_s = time;
        for step in (0..steps).rev() {
            time += rise / sheds(step as f64 + 0.5);
            points.push((time, rise * step as f64));
        }
        (points, reached_s, time - reached_s)
    };
    let (points, reached_s, stopped_s) = run(false);
    let shifts = powertrain.shift_points_mps(radius).into_iter().flatten();
    let passed = |speed: f64| points.iter().take(steps + 1).find(|(_, v)| *v >= speed).copied();
    let shifts: Vec<(f64, f64)> = shifts.filter_map(passed).collect();
    let mut about = format!("From rest to {top:.1} m/s in {reached_s:.2} s, and back in {stopped_s:.2} s");
    let mut lines = vec![Line::new("engine", Look::Own, points.clone())];
    if car.hybrid.is_some() {
        let (with_motor, sooner_s, _) = run(true);
        about += &format!("; with the motor beside the engine it takes {sooner_s:.2} s to that speed");
        lines.push(Line::new("engine and motor", Look::Own, with_motor));
    }
    if !shifts.is_empty() {
        lines.push(Line::new("shift points", Look::Dots, shifts));
    }
    Chart {
        file: "standing_start",
        title: "From standstill and back",
        about: about + ".",
        axes: [("time", "s"), ("speed", "m/s")],
        of: ["chart", "line"],
        panels: vec![("Speed, straight on".to_owned(), lines)],
    }
}

/// The front's share of the braking force over deceleration, without air and at the top speed.
fn brakes(car: &Car, page: &mut HtmlReport) -> Chart {
    const STEPS: usize = 40;
    let percent = |share: f64| 100.0 * share;
    let mut panels = Vec::new();
    for speed in [0.0, top_mps(car)] {
        let axles = brake_balance(car, speed, STEPS);
        let of = |f: &dyn Fn(&BrakedAxles) -> Option<f64>| -> Vec<(f64, f64)> {
            let point = |at: &BrakedAxles| Some((at.deceleration_mps2, percent(f(at)?)));
            axles.iter().filter_map(point).collect()
        };
        let by_load = Line::new("load", Look::Own, of(&|at| Some(at.equal_use())));
        let by_peaks = of(&BrakedAxles::equal_peaks);
        let mut lines = vec![by_load];
        if !by_peaks.is_empty() {
            lines.push(Line::new("tyres' peaks", Look::Own, by_peaks));
        }
        panels.push((format!("{:.0} km/h", 3.6 * speed), lines));
        let last = axles[STEPS];
        if let Some(peaks) = last.equal_peaks() {
            page.sentence(format!(
                "The car brakes at up to {:.2} g at {:.0} km/h, with {:.1} % of the force at the front.",
                last.deceleration_mps2 / GRAVITY_MPS2,
                3.6 * speed,
                percent(peaks)
            ));
        }
    }
    Chart {
        file: "brake_balance",
        title: "Brake balance",
        about: "The front's share of the braking force, braking straight on: with which both axles use the same share of their load, and \
                with which the tyres of both come to their peak at once. A greater share locks the front wheels first, a smaller one the \
                rear wheels. Lines go from rolling freely to the greatest deceleration."
            .to_owned(),
        axes: [("deceleration", "m/s^2"), ("front share of the braking force", "%")],
        of: ["speed", "share by"],
        panels,
    }
}
