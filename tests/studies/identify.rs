//! Identification end to end on the bundled lap and on laps simulated here.

use lapswarm::config::settings::Settings;
use lapswarm::evaluate::Failure;
use lapswarm::evaluate::replay::{BackendChoice, CHANNEL_NAMES, open_evaluator};
use lapswarm::simulate::{SensorSettings, SimulateSettings, simulate_lap};
use lapswarm::study::framework::{solve_unobserved, write_results};
use lapswarm::study::identify::{
    Algorithm, FreeParameter, Identify, IdentifySettings, Setup, Summary, Unknowns, Verdict, judge,
    judge_candidate, lap_format, polish, set_up, total_parameter_error,
};
use lapswarm::telemetry::{ChannelMap, FindingKind, Log, LogOptions, Recording, Role, write_native};
use lapswarm::track::Circuit;
use lapswarm::vehicle::Car;
use std::path::{Path, PathBuf};

fn simd() -> IdentifySettings {
    IdentifySettings {
        backend: BackendChoice::Simd,
        ..IdentifySettings::default()
    }
}

fn all(_: usize) -> bool {
    true
}

/// A candidate every parameter of which is off by a share of its range, alternately up and down.
fn perturbed(setup: &Setup, share: f64) -> (Vec<f64>, Vec<f64>) {
    let truth = setup.truth.clone().unwrap();
    let shifted = setup
        .replay
        .problem
        .variables
        .iter()
        .zip(&truth)
        .enumerate()
        .map(|(k, (v, t))| {
            let sign = if k % 2 == 0 { 1.0 } else { -1.0 };
            (t + sign * share * (v.upper - v.lower)).clamp(v.lower, v.upper)
        });
    (shifted.collect(), truth)
}

#[test]
fn truth_fits_the_bundled_lap_exactly() {
    let setup = set_up(&simd()).unwrap();
    assert_eq!(
        setup.replay.plan.fractions.len(),
        1,
        "the fit takes the log's own step"
    );
    let residuals = setup.replay.residuals(setup.truth.as_ref().unwrap()).unwrap();
    // The log's outputs are rounded to 1e-11 when written, so each is at most half of that off; ten times that
    // leaves room for the rounding of 7000 steps on other processors' libraries.
    assert!(residuals.errors.iter().all(|e| e.abs() < 5e-11));
}

/// Drives without derivatives are those with them: the polish compares the costs of both.
#[test]
fn errors_are_the_same_with_and_without_derivatives() {
    let setup = set_up(&in_windows(None, Some(1.0))).unwrap();
    let (candidate, _) = perturbed(&setup, 0.001);
    let (errors, residuals) = (
        setup.replay.errors(&candidate).unwrap(),
        setup.replay.residuals(&candidate).unwrap(),
    );
    assert_eq!(errors.len(), residuals.errors.len());
    let pairs = || errors.iter().zip(&residuals.errors);
    let apart = pairs().map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    println!("{apart:e}");
    // Measured are 9e-14, the rounding of some hundred steps; the errors themselves are above 1e-3.
    assert!(
        apart < 1e-11 && errors.iter().any(|e| e.abs() > 1e-3),
        "{apart:e}"
    );
}

#[test]
#[ignore = "full tier: a whole polish"]
fn polish_recovers_the_truth_from_a_distance() {
    let setup = set_up(&simd()).unwrap();
    let (start, truth) = perturbed(&setup, 0.001);
    assert!(
        total_parameter_error(&start, &truth, all) > 0.02,
        "a start that is wrong"
    );
    let polished = polish(&setup.replay, &start, setup.scales.map(|s| 1.0 / s)).unwrap();
    let error = total_parameter_error(&polished.candidate, &truth, all);
    println!("{error:e}");
    // Claimed, and measured here, are 2e-10. The rounding of 7000 steps on other processors' libraries is of the size of that of
    // the log's outputs, which make it: fifty times as much has room for both.
    assert!(error < 1e-8, "{error:e}");
}

/// The polish follows a bent valley from afar: one corner tells all 22 parameters after a small swarm.
#[test]
#[ignore = "full tier: whole identifications"]
fn one_corner_is_enough_for_a_small_swarm() {
    for seed in [1, 2] {
        let settings = IdentifySettings {
            section: Some("Abbey".to_owned()),
            population: Some(64),
            iterations: Some(200),
            seed,
            ..simd()
        };
        let setup = set_up(&settings).unwrap();
        let outcome = solve_unobserved::<Identify>(&settings, &setup).unwrap();
        let truth = setup.truth.unwrap();
        let [swarm, polished] = [&outcome.swarm_candidate, &outcome.candidate]
            .map(|candidate| total_parameter_error(candidate, &truth, all));
        println!("{swarm} {polished:e}");
        assert!(swarm > 1.0, "a start from afar");
        // Measured are 5e-8; a corner of 400 samples tells less than the lap, by the rounding of its figures.
        assert!(polished < 1e-6, "{polished:e}");
    }
}

#[test]
#[ignore = "full tier: a whole identification"]
fn a_cold_swarm_and_polish_find_the_car() {
    let settings = IdentifySettings {
        population: Some(64),
        iterations: Some(150),
        ..simd()
    };
    let setup = set_up(&settings).unwrap();
    let outcome = solve_unobserved::<Identify>(&settings, &setup).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let summary = write_results::<Identify>(folder.path(), &settings, &setup, &outcome).unwrap();
    println!("{:?}", summary.total_parameter_error);
    assert!(summary.unidentifiable.is_empty(), "{:?}", summary.unidentifiable);
    assert!(
        summary.total_parameter_error.unwrap() < 1e-8,
        "{:?}",
        summary.total_parameter_error
    );

    for name in [
        "manifest.json",
        "summary.json",
        "study.toml",
        "car.toml",
        "car.tir",
        "convergence.csv",
        "traces.csv",
        "tyres.csv",
    ] {
        assert!(folder.path().join(name).metadata().unwrap().len() > 0, "{name}");
    }
    for name in ["traces.svg", "convergence.svg", "parameters.svg", "map.svg"] {
        assert!(
            std::fs::read_to_string(folder.path().join(name))
                .unwrap()
                .starts_with("<svg"),
            "{name}"
        );
    }
    // Loads of the four tyres are the car's weight and its downforce.
    let rows = |name: &str| -> Vec<Vec<String>> {
        let text = std::fs::read_to_string(folder.path().join(name)).unwrap();
        text.lines()
            .map(|line| line.split(',').map(str::to_owned).collect())
            .collect()
    };
    let (tyres, traces) = (rows("tyres.csv"), rows("traces.csv"));
    let column = |rows: &[Vec<String>], name: &str| {
        let found = rows[0]
            .iter()
            .position(|head| head.split(' ').next() == Some(name));
        found.unwrap_or_else(|| panic!("{name} in {:?}", rows[0]))
    };
    let chassis = Car::bundled().unwrap().chassis;
    let number = |row: &[String], at: usize| row[at].parse::<f64>().ok();
    let mut compared = 0;
    for row in &tyres[1..] {
        let loads =
            ["load_fl", "load_fr", "load_rl", "load_rr"].map(|name| number(row, column(&tyres, name)));
        let time = &row[column(&tyres, "time")];
        let trace = traces
            .iter()
            .find(|trace| trace[column(&traces, "time")] == *time)
            .unwrap();
        let speed = number(trace, column(&traces, "vx_fitted"));
        let (Some(speed), [Some(a), Some(b), Some(c), Some(d)]) = (speed, loads) else {
            continue;
        };
        let downforce = 0.5 * chassis.air_density * chassis.lift_area * speed * speed;
        let expected = chassis.mass * chassis.gravity + downforce;
        let off = (a + b + c + d) / expected - 1.0;
        assert!(off.abs() < 1e-6, "{off:e} at {time} s");
        compared += 1;
    }
    assert!(compared > 1000, "{compared}");
    // What was written is a car that reads back as the truth, to the parameter error above.
    let car = Car::load(&folder.path().join("car.toml").display().to_string()).unwrap();
    let (found, truth) = (car.to_flat(), Car::bundled().unwrap().to_flat());
    assert!(
        found
            .iter()
            .zip(&truth)
            .all(|(a, b)| (a - b).abs() <= 1e-3 * b.abs())
    );
    // And the resolved study reads back as the one that was run.
    let again = IdentifySettings::read(&folder.path().join("study.toml")).unwrap();
    assert_eq!(again.free, settings.free);
    assert_eq!(
        (again.population, again.iterations, again.seed),
        (Some(64), Some(150), settings.seed)
    );
}

#[test]
fn the_same_seed_gives_the_same_bytes() {
    let settings = IdentifySettings {
        algorithm: Algorithm::Pso,
        population: Some(40),
        iterations: Some(4),
        polish: false,
        ..simd()
    };
    let setup = set_up(&settings).unwrap();
    let go = || {
        solve_unobserved::<Identify>(&settings, &setup)
            .unwrap()
            .swarm_candidate
    };
    assert_eq!(go(), go());
}

#[test]
fn a_car_without_camber_cannot_reveal_rvy3() {
    let folder = tempfile::tempdir().unwrap();
    let mut car = Car::bundled().unwrap();
    car.chassis.camber_front = 0.0;
    car.chassis.camber_rear = 0.0;
    car.write(folder.path(), "flat").unwrap();
    let log = simulate_lap(
        &car,
        &Circuit::silverstone_gp().unwrap(),
        &SimulateSettings::default(),
    )
    .unwrap()
    .log;
    let path = folder.path().join("lap.csv");
    write_native(&log, &path, &lap_format()).unwrap();
    let name = folder.path().join("flat.toml").display().to_string();
    let settings = IdentifySettings {
        car: name.clone(),
        truth: Some(name),
        log: Some(path),
        free: IdentifySettings::default().free.to_vec().into(),
        ..simd()
    };
    let setup = set_up(&settings).unwrap();
    let truth = setup.truth.as_ref().unwrap();
    let residuals = setup.replay.residuals(truth).unwrap();
    let verdict = judge(&residuals, &setup.replay.problem.variables, truth, &setup.scales);
    let blind: Vec<&str> = settings
        .free
        .iter()
        .zip(&verdict.identifiable)
        .filter(|(_, told)| !**told)
        .map(|(f, _)| f.name.as_str())
        .collect();
    assert_eq!(blind, ["rVy3"]);
    assert_eq!(*verdict.singular_values.last().unwrap(), 0.0);
}

/// The bounds of the thesis's unknowns are those of one car. On a log of another, the log chooses among figures about that car's own.
#[test]
#[ignore = "full tier: a whole choice of unknowns"]
fn a_log_of_ones_own_chooses_what_is_found() {
    let folder = tempfile::tempdir().unwrap();
    let mut car = Car::bundled().unwrap();
    let settings = SimulateSettings {
        rate_hz: 25.0,
        ..SimulateSettings::default()
    };
    let log = simulate_lap(&car, &Circuit::silverstone_gp().unwrap(), &settings)
        .unwrap()
        .log;
    let path = folder.path().join("lap.csv");
    write_native(&log, &path, &lap_format()).unwrap();
    // Below the least stiffness that the thesis's bounds know.
    car.chassis.roll_stiffness = 2.5e4;
    car.write(folder.path(), "soft").unwrap();
    let setup = |log: Option<PathBuf>, free: Unknowns| {
        set_up(&IdentifySettings {
            car: folder.path().join("soft.toml").display().to_string(),
            log,
            free,
            ..simd()
        })
        .unwrap()
    };
    let unsaid = IdentifySettings::default().free;
    let chosen = setup(Some(path.clone()), unsaid.clone());
    assert!(chosen.choice.is_some());
    let replay = &chosen.replay;
    let own = replay.free.values_in(replay.free.base());
    assert!(!own.is_empty() && own.len() < 22);
    for (variable, own) in replay.problem.variables.iter().zip(own) {
        assert!(
            (variable.lower..=variable.upper).contains(&own),
            "{variable:?}: {own}"
        );
    }
    // What is said is done, and the bundled lap is the thesis's.
    let said = setup(Some(path), unsaid.to_vec().into());
    assert!(said.choice.is_none() && said.replay.problem.variables.len() == 22);
    let bundled = setup(None, unsaid);
    assert!(bundled.choice.is_none() && bundled.replay.problem.variables.len() == 22);
}

/// At full power against its drag a kart's rear wheels have about the same slip at every speed. That is no smaller radius.
#[test]
fn slip_at_full_power_is_no_smaller_radius() {
    let mut text = "time_s,wheel_speed_fl_radps,wheel_speed_fr_radps,wheel_speed_rl_radps,wheel_speed_rr_radps,steer_rad,\
                    vx_mps,ax_mps2,ay_mps2,yaw_rate_radps\n"
        .to_owned();
    let (mut v, mut powered, dt) = (18.0f64, true, 0.1);
    for i in 0..1200 {
        // 4.1 m/s^2 at the wheels, of which the drag takes 0.0039 v^2; then the brakes.
        let accel = if powered { 4.1 - 0.0039 * v * v } else { -8.0 };
        powered = if powered { v < 29.0 } else { v < 18.0 };
        let slip = if powered { 0.0175 } else { -0.03 };
        let (front, rear) = (v / 0.13, v * (1.0 + slip) / 0.13);
        // Speeds that are off by 0.05 m/s at the most, in no order.
        let noise = 0.1 * (f64::from(i) * 0.618_034).fract() - 0.05;
        text += &format!(
            "{:.1},{front},{front},{rear},{rear},0,{},{accel},0,0\n",
            f64::from(i) * dt,
            v + noise
        );
        v += accel * dt;
    }
    let recording = Recording::parse(text.as_bytes(), "kart.csv").unwrap();
    let options = LogOptions {
        rolling_radius_m: Some([0.13; 2]),
        ..LogOptions::default()
    };
    let log = Log::from_recording(&recording, &ChannelMap::default(), &options).unwrap();
    for role in [Role::WheelSpeedRl, Role::WheelSpeedRr] {
        let found = log
            .calibration
            .findings
            .iter()
            .find(|f| f.role == role && f.kind == FindingKind::RollingRadius)
            .unwrap();
        println!("{found:?}");
        assert!(!found.applied, "{found:?}");
    }
}

#[test]
fn a_log_of_any_rate_is_of_the_lap_that_was_driven() {
    let (car, circuit) = (Car::bundled().unwrap(), Circuit::silverstone_gp().unwrap());
    let logged = |rate_hz: f64, substeps: Option<usize>| {
        let mut settings = SimulateSettings {
            rate_hz,
            substeps,
            ..SimulateSettings::default()
        };
        settings.driver.pace = 0.6;
        simulate_lap(&car, &circuit, &settings)
    };
    let greatest = |log: &Log| log.ay_mps2.iter().fold(0.0f64, |most, ay| most.max(ay.abs()));
    let fine = greatest(&logged(100.0, None).unwrap().log);
    // Samples 0.04 s and 0.1 s apart miss a peak that lasts half a second by a few percent.
    for rate_hz in [25.0, 10.0] {
        let coarse = greatest(&logged(rate_hz, None).unwrap().log);
        assert!(
            (coarse / fine - 1.0).abs() < 0.05,
            "{rate_hz} Hz: {coarse} of {fine}"
        );
    }
    // One step per sample is too long for the car's modes at 25 Hz.
    let lost = logged(25.0, Some(1)).unwrap_err().to_string();
    assert!(
        lost.contains("substeps: found 1 at 25 Hz, expected 2 or more"),
        "{lost}"
    );
}

#[test]
#[ignore = "full tier: whole identifications"]
fn noise_stays_within_three_standard_errors() {
    let folder = tempfile::tempdir().unwrap();
    let settings = SimulateSettings {
        sensors: SensorSettings {
            noise: [0.05, 0.3, 0.3, 0.005],
            delay_s: [0.0; 4],
        },
        seed: 11,
        ..SimulateSettings::default()
    };
    let car = Car::bundled().unwrap();
    let log = simulate_lap(&car, &Circuit::silverstone_gp().unwrap(), &settings)
        .unwrap()
        .log;
    let path = folder.path().join("noisy.csv");
    write_native(&log, &path, &lap_format()).unwrap();
    let study = IdentifySettings {
        log: Some(path),
        truth: Some("gt".to_owned()),
        free: IdentifySettings::default().free.to_vec().into(),
        ..simd()
    };
    let setup = set_up(&study).unwrap();
    let (start, truth) = perturbed(&setup, 0.001);
    let noise = settings.sensors.noise;
    let polished = polish(&setup.replay, &start, noise.map(|n| 1.0 / n)).unwrap();
    let residuals = setup.replay.residuals(&polished.candidate).unwrap();
    let variables = &setup.replay.problem.variables;
    let verdict = judge(&residuals, variables, &polished.candidate, &setup.scales);
    // At a minimum, with white noise left over.
    assert!(verdict.step_in_errors < 0.1 && verdict.looks_like_noise);
    // Beside it, a step of least squares leads back by as much, to within the curvature of the lap over one standard error.
    let mut beside = polished.candidate.clone();
    let last = beside.len() - 1;
    beside[last] += verdict.standard_errors[last];
    let errors = setup.replay.residuals(&beside).unwrap();
    let step = judge(&errors, variables, &beside, &setup.scales).step_in_errors;
    assert!((0.8..1.2).contains(&step), "{step}");
    for (told, true_noise) in verdict.noise.iter().zip(noise) {
        // 7000 samples tell a standard deviation to 1/sqrt(14000), 0.8%; five of those.
        assert!((told / true_noise - 1.0).abs() < 0.042, "{told} for {true_noise}");
    }
    for (k, v) in setup.replay.problem.variables.iter().enumerate() {
        let off = (polished.candidate[k] - truth[k]).abs() / verdict.standard_errors[k];
        assert!(off < 3.0, "{}: {off:.2} standard errors off", v.name);
    }
}

fn free(unknowns: &[(&str, f64, f64)]) -> Unknowns {
    let free = |(name, lower, upper): &(&str, f64, f64)| FreeParameter {
        name: (*name).to_owned(),
        lower: *lower,
        upper: *upper,
    };
    unknowns.iter().map(free).collect()
}

/// The lap of a car on the bundled circuit, in a file, with what steps it was worked out.
fn lap_of(car: &Car, noise: [f64; 4], folder: &Path) -> (PathBuf, usize) {
    let settings = SimulateSettings {
        sensors: SensorSettings {
            noise,
            delay_s: [0.0; 4],
        },
        seed: 3,
        ..SimulateSettings::default()
    };
    let simulated = simulate_lap(car, &Circuit::silverstone_gp().unwrap(), &settings).unwrap();
    let path = folder.join("lap.csv");
    write_native(&simulated.log, &path, &lap_format()).unwrap();
    (path, simulated.substeps)
}

/// Windows of three seconds, and what can be told of handling in so short a time.
fn in_windows(log: Option<PathBuf>, settle_s: Option<f64>) -> IdentifySettings {
    IdentifySettings {
        log,
        truth: Some("gt".to_owned()),
        window_s: Some(3.0),
        settle_s,
        free: free(&[
            ("yaw_inertia_kgm2", 1000.0, 2500.0),
            ("K", 5e4, 2e5),
            ("C", 1e4, 4e4),
            ("front.lKy", 0.7, 1.4),
            ("rear.lKy", 0.7, 1.4),
        ]),
        ..simd()
    }
}

/// Of a car that differs from the starting one in two figures, the log chooses these and leaves what it cannot tell.
#[test]
fn the_log_chooses_what_it_can_tell() {
    let folder = tempfile::tempdir().unwrap();
    let mut car = Car::bundled().unwrap();
    car.chassis.lift_area *= 0.7;
    car.chassis.inertia_yaw *= 1.3;
    let (log, _) = lap_of(&car, [0.05, 0.1, 0.1, 0.005], folder.path());
    let pool = [
        ("roll_damping_nms_per_rad", 3e3, 5e4),
        ("drs_drag_percent", 0.0, 50.0),
        ("downforce_area_m2", 0.5, 4.0),
        ("rEx2", -1.0, 1.0),
        ("yaw_inertia_kgm2", 800.0, 3000.0),
        ("rVy6", 2.0, 30.0),
    ];
    let settings = IdentifySettings {
        log: Some(log),
        free: Unknowns {
            auto: true,
            unsaid: false,
            ..free(&pool)
        },
        ..simd()
    };
    let setup = set_up(&settings).unwrap();
    let choice = setup.choice.expect("a choice");
    println!("{}", choice.to_text());
    assert!(choice.not_chosen.is_none() && choice.among == pool.len());
    let mut first = [&choice.names[0][..], &choice.names[1][..]];
    first.sort_unstable();
    assert_eq!(first, ["downforce_area_m2", "yaw_inertia_kgm2"]);
    assert!(choice.names.len() < pool.len() && !choice.names.iter().any(|n| n == "drs_drag_percent"));
    assert_eq!(setup.replay.dimensions(), choice.names.len());
    let chosen = choice.tried.iter().find(|t| t.parameters == choice.names.len());
    assert!(chosen.unwrap().held_out_error < 0.5 * choice.starting_error.unwrap());

    // The settings read back as they were.
    let read = IdentifySettings::parse(Path::new("study.toml"), &settings.to_toml(), folder.path()).unwrap();
    assert!(read.free.auto && read.free.len() == pool.len());

    // The car that drove the bundled lap leaves nothing to choose by.
    let exact = set_up(&IdentifySettings {
        free: Unknowns {
            auto: true,
            unsaid: false,
            ..IdentifySettings::default().free
        },
        ..simd()
    });
    let choice = exact.unwrap().choice.unwrap();
    assert!(choice.not_chosen.is_some() && choice.names.len() == 22);
}

#[test]
fn a_car_drives_the_windows_of_its_own_lap_exactly() {
    for settle_s in [Some(0.5), None] {
        let setup = set_up(&in_windows(None, settle_s)).unwrap();
        let judged = judge_candidate(&setup.replay, setup.truth.as_ref().unwrap());
        println!("{} s: {:?}", setup.settle_s, judged.rms_error);
        // With no sideslip and no roll at their start it was 0.8 m/s^2 of 8.
        assert!(judged.rms_error[2] < 1e-4 * judged.rms_signal[2]);
    }
}

/// The same car with other unknowns, in a file: what is known of a car before it is fitted.
fn another_car(folder: &Path) -> String {
    let mut car = Car::bundled().unwrap();
    car.chassis.inertia_yaw *= 1.25;
    car.chassis.roll_stiffness *= 1.3;
    car.chassis.roll_damping *= 0.8;
    let mut flat = car.to_flat();
    for (name, factor) in [("front.lKy", 0.9), ("rear.lKy", 1.15)] {
        for slot in car.parameter(name).unwrap().slots {
            flat[slot] *= factor;
        }
    }
    car = car.with_flat(&flat);
    car.write(folder, "another").unwrap();
    folder.join("another.toml").display().to_string()
}

#[test]
#[ignore = "full tier: whole polishes"]
fn windows_of_a_perfect_lap_give_its_car() {
    let folder = tempfile::tempdir().unwrap();
    let settings = IdentifySettings {
        car: another_car(folder.path()),
        population: Some(64),
        iterations: Some(60),
        ..in_windows(None, None)
    };
    let (_, summary) = identified(&settings, folder.path());
    println!("{}", summary.to_text(&settings));
    for p in &summary.parameters {
        let off = p.car_value / p.truth.unwrap() - 1.0;
        assert!(off.abs() < 1e-3, "{}: {off:e}", p.name);
    }
}

#[test]
#[ignore = "full tier: whole polishes"]
fn windows_of_a_noisy_lap_give_its_car_within_three_standard_errors() {
    let folder = tempfile::tempdir().unwrap();
    let (log, _) = lap_of(&Car::bundled().unwrap(), [0.05, 0.3, 0.3, 0.005], folder.path());
    let settings = IdentifySettings {
        car: another_car(folder.path()),
        population: Some(64),
        iterations: Some(60),
        ..in_windows(Some(log), None)
    };
    let (_, summary) = identified(&settings, folder.path());
    println!("{}", summary.to_text(&settings));
    for p in &summary.parameters {
        let error = p.standard_error.unwrap();
        let off = (p.car_value - p.truth.unwrap()).abs() / error;
        assert!(off < 3.0, "{}: {off}", p.name);
    }
    // Of 1500 kg m2: it was 1709 +- 8.6.
    assert!(summary.parameters[0].standard_error.unwrap() < 15.0);
}

/// A log that tells of no laps is fitted as it is: as a whole where the starting car drives it to its end, else in windows.
#[test]
fn a_log_without_laps_is_scored_in_windows_where_the_starting_car_does_not_drive_it() {
    let folder = tempfile::tempdir().unwrap();
    let bundled = include_str!("../../data/laps/gt_silverstone.csv");
    let log = bundled
        .lines()
        .skip(1)
        .map(|line| line.replace("time_s", "time (s)") + "\n")
        .collect::<String>();
    let path = folder.path().join("outing.csv");
    std::fs::write(&path, log).unwrap();
    let of = |car: &str| IdentifySettings {
        car: car.to_owned(),
        log: Some(path.clone()),
        // Said, so that the log need not choose them.
        free: IdentifySettings::default().free.to_vec().into(),
        ..simd()
    };
    let whole = set_up(&of("gt")).unwrap();
    assert!(!whole.log.laps[0].complete);
    assert_eq!(whole.windows_instead_s, None);
    assert_eq!(whole.replay.plan.windows.len(), 1);
    let mut car = Car::bundled().unwrap();
    // Tyres that hold half as much.
    car.chassis.gravity *= 0.5;
    car.write(folder.path(), "slippery").unwrap();
    let windows = set_up(&of(&folder.path().join("slippery.toml").display().to_string())).unwrap();
    assert!(matches!(windows.windows_instead_s, Some(2.0 | 5.0)));
    assert!(windows.replay.plan.windows.len() > 20);
}

/// Where the model lacks something, the errors are no noise, and the fit ends at a minimum of the cost that was asked for.
#[test]
#[ignore = "full tier: whole polishes"]
fn a_car_that_the_model_cannot_be_is_fitted_to_the_cost() {
    let folder = tempfile::tempdir().unwrap();
    let mut car = Car::bundled().unwrap();
    car.chassis.mass *= 1.2;
    car.chassis.drag_area *= 1.5;
    car.write(folder.path(), "heavy").unwrap();
    let settings = IdentifySettings {
        car: folder.path().join("heavy.toml").display().to_string(),
        ..in_windows(None, None)
    };
    let (setup, summary) = identified(&settings, folder.path());
    assert!(!summary.errors_look_like_noise);
    assert!(summary.step_in_standard_errors.unwrap() < 1.0);
    let found: Vec<f64> = summary.parameters.iter().map(|p| p.car_value).collect();
    let mut replay = setup.replay.clone();
    replay.start_as_driven_by(&replay.flat(&found));
    let weights = setup.scales.map(|s| 1.0 / s);
    let errors = replay.residuals(&found).unwrap().errors;
    let weighted = errors
        .iter()
        .zip(weights.iter().cycle())
        .map(|(e, w)| (e * w).powi(2));
    let cost = 0.5 * weighted.sum::<f64>();
    let further = polish(&replay, &found, weights).unwrap().cost;
    assert!(further > 0.999 * cost, "{further} of {cost}");
}

#[test]
fn a_lap_begins_to_count_where_the_one_before_has_let_the_car_settle() {
    let folder = tempfile::tempdir().unwrap();
    let (path, _) = lap_of(&Car::bundled().unwrap(), [0.0; 4], folder.path());
    // The same lap twice, in one file.
    let text = std::fs::read_to_string(&path).unwrap();
    let rows: Vec<&str> = text.lines().filter(|line| !line.starts_with('#')).collect();
    let (header, rows) = (rows[0], &rows[1..]);
    let mut twice = format!("lap,{header}\n");
    for lap in 0..2 {
        for (i, row) in rows.iter().enumerate() {
            let values = row.split_once(',').unwrap().1;
            let time_s = 0.02 * (lap * rows.len() + i) as f64;
            twice.push_str(&format!("{},{time_s:.4},{values}\n", lap + 1));
        }
    }
    std::fs::write(&path, twice).unwrap();
    let setup = |laps: Vec<u32>| {
        let settings = IdentifySettings {
            laps,
            ..in_windows(Some(path.clone()), None)
        };
        let whole = IdentifySettings {
            window_s: None,
            ..settings
        };
        set_up(&whole).unwrap()
    };
    let (first, second) = (setup(vec![1]), setup(vec![2]));
    let settle = (first.settle_s / first.log.dt_s).round() as usize;
    let scored = |setup: &Setup| {
        let window = &setup.replay.plan.windows[0];
        window.start + window.scored_from..window.end
    };
    assert_eq!((first.without_run_up, second.without_run_up), (1, 0));
    assert_eq!(scored(&first), settle..rows.len());
    assert_eq!(scored(&second), rows.len()..2 * rows.len());
}

/// Runs a short identification, and writes it.
fn identified(settings: &IdentifySettings, folder: &Path) -> (Setup, Summary) {
    let settings = IdentifySettings {
        algorithm: Algorithm::Pso,
        population: settings.population.or(Some(24)),
        iterations: settings.iterations.or(Some(12)),
        hops: 0,
        ..settings.clone()
    };
    let setup = set_up(&settings).unwrap();
    let outcome = solve_unobserved::<Identify>(&settings, &setup).unwrap();
    let summary = write_results::<Identify>(folder, &settings, &setup, &outcome).unwrap();
    (setup, summary)
}

#[test]
#[ignore = "full tier: a whole identification"]
fn the_car_that_is_handed_on_is_the_car_that_was_judged() {
    let folder = tempfile::tempdir().unwrap();
    // A car with other wings than the one that the search starts from.
    let mut car = Car::bundled().unwrap();
    car.chassis.lift_area *= 0.7;
    car.chassis.drag_area *= 1.4;
    let (log, _) = lap_of(&car, [0.0; 4], folder.path());
    // The air's density only stands in products with the others: none of the three is told, and all are needed.
    let settings = IdentifySettings {
        log: Some(log),
        settle_s: Some(2.0),
        free: free(&[
            ("air_density_kgpm3", 0.8, 1.8),
            ("drag_area_m2", 0.3, 2.5),
            ("downforce_area_m2", 0.5, 3.0),
            ("K", 3e4, 3e5),
        ]),
        ..simd()
    };
    let run = folder.path().join("run");
    std::fs::create_dir(&run).unwrap();
    let (_, summary) = identified(&settings, &run);
    println!("{}", summary.to_text(&settings));
    let products = ["air_density_kgpm3", "drag_area_m2", "downforce_area_m2"];
    assert_eq!(summary.unidentifiable, products);
    assert_eq!(summary.untold_groups.len(), 1);
    assert_eq!(summary.untold_groups[0].parameters, products);
    assert_eq!(summary.untold_groups[0].combinations_told, 2);
    assert_eq!(summary.verdict, Verdict::NotAllTold);
    assert!(summary.rms_error["ay"] < 1e-3 * summary.rms_signal["ay"]);

    // The car that was written, replayed by itself.
    let written = run.join("car.toml").display().to_string();
    let replayed = set_up(&IdentifySettings {
        car: written.clone(),
        ..settings
    })
    .unwrap();
    let free = &replayed.replay.free;
    let again = judge_candidate(&replayed.replay, &free.values_in(free.base()));
    for (channel, cost) in CHANNEL_NAMES.into_iter().zip(again.costs) {
        assert_eq!(cost, summary.costs[channel], "{channel}");
    }
    let comment = std::fs::read_to_string(written).unwrap();
    assert!(
        comment.contains("# drag_area_m2: not told by the log"),
        "{comment}"
    );
}

#[test]
fn a_parameter_without_effect_keeps_its_value_and_one_at_its_bound_is_no_verdict_of_all() {
    let folder = tempfile::tempdir().unwrap();
    let mut car = Car::bundled().unwrap();
    car.chassis.camber_front = 0.0;
    car.chassis.camber_rear = 0.0;
    car.write(folder.path(), "flat").unwrap();
    let (log, _) = lap_of(&car, [0.0; 4], folder.path());
    let settings = IdentifySettings {
        car: folder.path().join("flat.toml").display().to_string(),
        log: Some(log),
        free: free(&[("rVy3", -2.0, 2.0), ("K", 3e4, 8e4)]),
        ..simd()
    };
    let (setup, summary) = identified(&settings, folder.path());
    let own = setup.replay.free.values_in(setup.replay.free.base());
    let [blind, at_bound] = &summary.parameters[..] else {
        panic!("two parameters")
    };
    assert_eq!((blind.value, blind.car_value), (None, own[0]));
    // The truth, 1e5, lies beyond the bounds.
    assert!(at_bound.at_bound);
    assert!(summary.verdict < Verdict::NotAllTold, "{:?}", summary.verdict);
    let text = summary.to_text(&settings);
    assert!(
        text.contains("At their bounds: roll_stiffness_nm_per_rad"),
        "{text}"
    );
    assert!(!text.contains("tells all"), "{text}");
}

#[test]
fn cars_that_are_too_stiff_for_the_steps_are_told_from_cars_that_spin() {
    for backend in [BackendChoice::Cpu, BackendChoice::Simd] {
        let failures = |substeps: Option<usize>| {
            let settings = IdentifySettings {
                substeps,
                backend,
                ..simd()
            };
            let setup = set_up(&settings).unwrap();
            let mut stiff = setup.truth.clone().unwrap();
            stiff[21] = 5e4;
            let mut evaluator = open_evaluator(&setup.replay, backend, None).unwrap();
            evaluator.evaluate(&stiff).unwrap().failures
        };
        assert_eq!(failures(None), [Some(Failure::StepTooLong)]);
        assert_eq!(failures(Some(2)), [None]);
    }
}

#[test]
#[ignore = "full tier: whole identifications"]
fn a_car_that_needs_finer_steps_than_were_taken_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let mut car = Car::bundled().unwrap();
    car.chassis.roll_damping = 3.3e4;
    let (log, substeps) = lap_of(&car, [0.0; 4], folder.path());
    assert_eq!(substeps, 2);
    let settings = IdentifySettings {
        log: Some(log),
        free: free(&[("C", 3.25e4, 5e4)]),
        ..simd()
    };
    let run = |name: &str, substeps: Option<usize>| {
        let settings = IdentifySettings {
            substeps,
            ..settings.clone()
        };
        let folder = folder.path().join(name);
        std::fs::create_dir(&folder).unwrap();
        identified(&settings, &folder).1
    };
    let coarse = run("coarse", None);
    println!("{} {:?}", coarse.to_text(&settings), coarse.parameters);
    assert_eq!((coarse.substeps, coarse.substeps_needed), (1, 2));
    assert!(
        coarse
            .notes
            .iter()
            .any(|note| note.contains("fit again with substeps = 2")),
        "{:?}",
        coarse.notes
    );
    let fine = run("fine", Some(2));
    assert!(
        !fine.notes.iter().any(|note| note.contains("substeps")),
        "{:?}",
        fine.notes
    );
    assert!((fine.parameters[0].car_value / 3.3e4 - 1.0).abs() < 1e-6);
}

#[test]
fn bad_studies_are_refused_by_line_and_field() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("study.toml");
    let refusal = |text: &str| {
        std::fs::write(&path, text).unwrap();
        let error = IdentifySettings::read(&path).unwrap_err();
        assert_eq!(error.exit_code(), 2);
        error.to_string()
    };
    let message = refusal("seed = 1\nnorm = \"3\"\n");
    assert!(
        message.contains("line 2, field norm") && message.contains("\"infinity\""),
        "{message}"
    );
    let message = refusal("[free]\nrBx1 = [3.0, 1.0]\n");
    assert!(message.contains("line 2, field free.rBx1"), "{message}");
    let message = refusal("colour = \"red\"\n");
    assert!(
        message.contains("line 1, field colour") && message.contains("unknown key"),
        "{message}"
    );

    let unknown = IdentifySettings {
        free: Unknowns::from(vec![FreeParameter {
            name: "rZz9".to_owned(),
            lower: 0.0,
            upper: 1.0,
        }]),
        ..simd()
    };
    assert!(set_up(&unknown).err().unwrap().to_string().contains("rZz9"));
    let missing = IdentifySettings {
        log: Some(Path::new("no/such/log.csv").to_owned()),
        ..simd()
    };
    assert_eq!(set_up(&missing).err().unwrap().exit_code(), 2);
}
