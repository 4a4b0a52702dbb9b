//! The command line as scripts see it: files to start from, checks, exit codes.

use lapswarm::config::settings::Settings;
use lapswarm::study::envelope::EnvelopeSettings;
use lapswarm::study::hybrid::HybridStudySettings;
use lapswarm::study::identify::IdentifySettings;
use lapswarm::study::raceline::RacelineSettings;
use lapswarm::study::registry;
use lapswarm::study::run::RunSettings;
use lapswarm::study::sensitivity::SensitivitySettings;
use lapswarm::study::surface::SurfaceSettings;
use lapswarm::study::transient::TransientSettings;
use std::io::Write;
use std::path::Path;
use std::process::{Command, Output, Stdio};

pub fn lapswarm(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_lapswarm"))
        .args(arguments)
        .current_dir(folder)
        .output()
        .expect("the program starts")
}

/// As [`lapswarm`], with answers on stdin.
fn answered(folder: &Path, arguments: &[&str], answers: &str) -> Output {
    let mut child = Command::new(env!("CARGO_BIN_EXE_lapswarm"))
        .args(arguments)
        .current_dir(folder)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the program starts");
    let mut stdin = child.stdin.take().expect("its stdin");
    stdin.write_all(answers.as_bytes()).expect("it reads");
    drop(stdin);
    child.wait_with_output().expect("it ends")
}

pub fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// A ring of 100 m about the origin, for what is driven along a line.
pub fn ring() -> String {
    let points = (0..200).map(|i| f64::from(i) * std::f64::consts::TAU / 200.0);
    let rows: String = points
        .map(|a| format!("{},{}\n", 100.0 * a.cos(), 100.0 * a.sin()))
        .collect();
    format!("x_m,y_m\n{rows}")
}

/// The circuit on which [`ring`] lies.
pub const AROUND_RING: [&str; 2] = ["--track", "circle:95:105"];

#[test]
fn files_to_start_from_are_sound_and_never_overwrite() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    std::fs::write(folder.path().join("ring.csv"), ring()).expect("a line");
    let studies = registry::names()
        .into_iter()
        .map(|name| (name, format!("a study of {name}")));
    let others = [
        ("sweep", "a sweep"),
        ("car", "a car"),
        ("channels", "a channel map"),
    ];
    let others = others.map(|(what, said)| (what, said.to_owned()));
    for (what, said) in studies.chain(others) {
        let made = lapswarm(folder.path(), &["init", what]);
        assert!(made.status.success(), "{what}: {}", text(&made.stderr));
        let file = format!("{what}.toml");
        let checked = lapswarm(folder.path(), &["check", &file]);
        assert!(checked.status.success(), "{what}: {}", text(&checked.stderr));
        let told = text(&checked.stdout);
        assert!(told.starts_with(&format!("{file}: {said}")), "{told}");
        let before = std::fs::read(folder.path().join(&file)).expect("the file");
        let again = lapswarm(folder.path(), &["init", what]);
        assert_eq!(again.status.code(), Some(2), "{what} again");
        assert_eq!(
            std::fs::read(folder.path().join(&file)).expect("the file"),
            before
        );
        if !["car", "channels"].contains(&what) {
            let mut arguments = vec![what, &file, "--dry-run"];
            // There is no line to start from.
            if what == "transient" {
                arguments.extend(["--line", "ring.csv"].into_iter().chain(AROUND_RING));
            }
            let planned = lapswarm(folder.path(), &arguments);
            assert!(planned.status.success(), "{what}: {}", text(&planned.stderr));
        }
    }
    std::fs::write(
        folder.path().join("survey.csv"),
        "x_m,y_m,width_m\n0,0,10\n100,0,10\n200,50,10\n200,150,10\n100,200,10\n0,200,10\n-80,150,10\n-80,50,10\n",
    )
    .expect("a survey");
    let made = lapswarm(folder.path(), &["init", "track"]);
    assert!(made.status.success(), "{}", text(&made.stderr));
    let checked = lapswarm(folder.path(), &["check", "track.toml", "survey.csv"]);
    assert!(checked.status.success(), "{}", text(&checked.stderr));
    assert_eq!(
        text(&checked.stdout).matches("a closed track").count(),
        2,
        "{}",
        text(&checked.stdout)
    );
}

/// The car of a kart, from figures that its driver knows.
const KART: &str = "mass_kg=160,front_weight_percent=43,wheelbase_m=1.04,front_track_m=1.1,rear_track_m=1.15,cg_height_m=0.22,\
                    tyre_radius_m=0.135,corner_g=1.8,corner_kmh=60,roll_deg_per_g=0.5,power_kw=22,redline_rpm=14000,gears=1,\
                    top_speed_kmh=115";

#[test]
fn a_car_is_made_of_what_is_known_and_compared_with_it() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let made = lapswarm(folder.path(), &["init", "car", "kart.toml", "--set", KART]);
    assert!(made.status.success(), "{}", text(&made.stderr));
    assert_eq!(text(&made.stdout), "kart_front.tir\nkart_rear.tir\nkart.toml\n");
    let checked = lapswarm(folder.path(), &["check", "kart.toml", "--draw", "drawn"]);
    assert!(checked.status.success(), "{}", text(&checked.stderr));
    let told = text(&checked.stdout);
    // What the car does is within a part in a hundred of what was asked.
    let figures = [
        ("mass", 160.0),
        ("wheelbase", 1.04),
        ("cornering at 60 km/h", 1.8),
        ("power", 22.0),
        ("top speed", 115.0),
    ];
    for (figure, asked) in figures {
        let line = told.lines().find(|line| line.trim_start().starts_with(figure));
        let last = line.and_then(|line| line.split_whitespace().last()?.parse::<f64>().ok());
        assert!(
            last.is_some_and(|x| (x / asked - 1.0).abs() < 0.01),
            "{figure}: {told}"
        );
    }
    assert!(told.contains("understeer gradient"), "{told}");
    let picture = std::fs::read_to_string(folder.path().join("drawn/envelope.svg")).expect("a picture");
    assert!(picture.contains("<svg") && picture.contains("polyline"));
    let run = [
        "envelope",
        "--car",
        "kart.toml",
        "--from-mps",
        "8",
        "--to-mps",
        "30",
        "--quiet",
    ];
    let found = lapswarm(folder.path(), &run);
    assert!(found.status.success(), "{}", text(&found.stderr));

    let driven = lapswarm(
        folder.path(),
        &[
            "simulate",
            "--car",
            "kart.toml",
            "--track",
            "stadium:100:25:8",
            "--quiet",
        ],
    );
    assert!(driven.status.success(), "{}", text(&driven.stderr));

    // Asked for on stdin: an empty line takes what is shown, one that cannot be is asked for again.
    let answers = "asked car\nheavy\n-5\n900\n\n";
    let asked = answered(folder.path(), &["init", "car", "asked.toml", "--ask"], answers);
    assert!(asked.status.success(), "{}", text(&asked.stderr));
    let told = text(&asked.stderr);
    assert_eq!(
        told.matches("Mass with driver and fuel (50 to 50000 kg) [1245.0]: ")
            .count(),
        3,
        "{told}"
    );
    let car = std::fs::read_to_string(folder.path().join("asked.toml")).expect("a car");
    assert!(
        car.contains("name = \"asked car\"") && car.contains("mass_kg = 900.0"),
        "{car}"
    );

    for (arguments, expected) in [
        (["init", "car", "a.toml", "--set", "mass=900"], "mass_kg"),
        (
            ["init", "car", "a.toml", "--set", "mass_kg=heavy"],
            "expected a number",
        ),
        (["init", "car", "a.toml", "--set", "mass_kg=1"], "50 to 50000"),
        (
            ["init", "car", "a.toml", "--set", "corner_g=1,tyre_friction=1"],
            "not both",
        ),
        (["init", "run", "a.toml", "--set", "mass_kg=900"], "init car"),
    ] {
        let refused = lapswarm(folder.path(), &arguments);
        assert_eq!(refused.status.code(), Some(2), "{arguments:?}");
        let told = text(&refused.stderr);
        assert!(told.contains(expected), "{arguments:?}: {told}");
        assert!(!folder.path().join("a.toml").exists());
    }
}

#[test]
fn laps_are_exported_as_loggers_write_them() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let root = folder.path();
    let simulated = lapswarm(
        root,
        &[
            "simulate",
            "--track",
            "stadium:300:80:12",
            "--out",
            "lap",
            "--quiet",
        ],
    );
    assert!(simulated.status.success(), "{}", text(&simulated.stderr));
    let exported = lapswarm(root, &["export", "lap", "lap/lap.csv", "--rate", "20", "--json"]);
    assert!(exported.status.success(), "{}", text(&exported.stderr));
    let said: serde_json::Value = serde_json::from_slice(&exported.stdout).expect("JSON");
    let names: Vec<&str> = said["files"]
        .as_array()
        .expect("files")
        .iter()
        .filter_map(|f| f.as_str())
        .collect();
    let wanted = [
        "lap_lap.csv",
        "lap_lap.ld",
        "lap_lap.ldx",
        "lap.csv",
        "lap.ld",
        "lap.ldx",
    ];
    assert_eq!(names, wanted.map(|name| format!("export/{name}")));
    for name in ["export/lap.ld", "export/lap.csv"] {
        let checked = lapswarm(root, &["check", "--kind", "log", name]);
        let told = text(&checked.stdout);
        assert!(
            checked.status.success() && told.contains("at 20 Hz"),
            "{told} {}",
            text(&checked.stderr)
        );
    }
    let again = lapswarm(root, &["export", "lap/lap.csv"]);
    assert_eq!(again.status.code(), Some(2));
    assert!(text(&again.stderr).contains("nothing is overwritten"));
    let line = lapswarm(root, &["export", "lap/manifest.json", "--out", "other"]);
    assert_eq!(line.status.code(), Some(2), "{}", text(&line.stderr));
}

#[test]
fn the_study_file_of_every_run_folder_is_taken_for_what_it_is() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    std::fs::write(folder.path().join("ring.csv"), ring()).expect("a line");
    // As a run folder has it.
    let files = [
        ("run", RunSettings::default().to_toml()),
        ("identify", IdentifySettings::default().to_toml()),
        ("envelope", EnvelopeSettings::default().to_toml()),
        ("raceline", RacelineSettings::default().to_toml()),
        ("hybrid", HybridStudySettings::default().to_toml()),
        (
            "transient",
            TransientSettings {
                line: vec![folder.path().join("ring.csv")],
                track: Some(AROUND_RING[1].to_owned()),
                ..TransientSettings::default()
            }
            .to_toml(),
        ),
        ("sensitivity", SensitivitySettings::default().to_toml()),
        ("surface", SurfaceSettings::default().to_toml()),
    ];
    assert_eq!(
        files.each_ref().map(|(name, _)| *name).to_vec(),
        registry::names()
    );
    for (name, contents) in files {
        std::fs::write(folder.path().join("study.toml"), &contents).expect("a file");
        let checked = lapswarm(folder.path(), &["check", "study.toml"]);
        assert!(checked.status.success(), "{name}: {}", text(&checked.stderr));
        let told = text(&checked.stdout);
        assert!(
            told.starts_with(&format!("study.toml: a study of {name}:")),
            "{told}\n{contents}"
        );
        let planned = lapswarm(folder.path(), &[name, "study.toml", "--dry-run"]);
        assert!(planned.status.success(), "{name}: {}", text(&planned.stderr));
    }
}

#[test]
fn what_is_wrong_is_named_with_its_place_and_code_two() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    for (file, contents, place) in [
        ("study.toml", "sections = 3\n", "sections"),
        ("study.toml", "no_such_key = 3\n", "no_such_key"),
        ("study.toml", "[free]\n", "study.toml: table [free]"),
        (
            "study.toml",
            "objectives = [\"gamma\", \"gamma\"]\nsections = 60\n",
            "study.toml: objectives: found gamma twice",
        ),
        ("car.toml", "name = \"x\"\n[chassis]\nmass_kg = -1\n", "mass_kg"),
        (
            "limits.csv",
            "v_mps,ay_mps2,ax_grip_mps2,ax_drive_mps2,drag_mps2\n10,x,1,1,1\n",
            "line 2",
        ),
        ("tyre.tir", "[MDI_HEADER]\n", "tyre.tir"),
        ("log.csv", "time_s,vx_mps\n0,1\n", "log.csv"),
    ] {
        std::fs::write(folder.path().join(file), contents).expect("a file");
        let checked = lapswarm(folder.path(), &["check", file]);
        assert_eq!(
            checked.status.code(),
            Some(2),
            "{file}: {}",
            text(&checked.stdout)
        );
        // Reports wrap lines: what they say is compared without the frame.
        let said: String = text(&checked.stderr).replace(['\n', '│', ' '], "");
        assert!(said.contains(&place.replace(' ', "")), "{file}: {said}");
    }
    let missing = lapswarm(folder.path(), &["check", "nowhere.csv"]);
    assert_eq!(missing.status.code(), Some(2));
    let unknown = lapswarm(
        folder.path(),
        &["sensitivity", "--parameters", "no_such_parameter"],
    );
    assert_eq!(unknown.status.code(), Some(2), "{}", text(&unknown.stderr));
}

/// The optimiser of the racetrack database writes two comments and the header as a third.
#[test]
fn a_line_of_another_program_is_known_by_its_header() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let rows = (0..12).map(|i| {
        let (y, x) = (f64::from(i) * std::f64::consts::TAU / 12.0).sin_cos();
        format!("{i}; {x}; {y}; 0.0; 0.01; 30.0; 0.0\n")
    });
    let header = "# 6a3f9c\n# 0b1e\n# s_m; x_m; y_m; psi_rad; kappa_radpm; vx_mps; ax_mps2\n";
    let text_of_line = header.to_owned() + &rows.collect::<String>();
    std::fs::write(folder.path().join("line.csv"), text_of_line).expect("a file");
    let checked = lapswarm(folder.path(), &["check", "line.csv"]);
    assert_eq!(checked.status.code(), Some(0), "{}", text(&checked.stderr));
    assert_eq!(text(&checked.stdout).trim(), "line.csv: a line of 12 points");
}

/// What is refused, wherever it is found, leaves no folder that stands in the way of the same run with better input, nor takes
/// one away that was there.
#[test]
fn refused_input_leaves_nothing_in_the_way() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let write = |name: &str, contents: &str| {
        std::fs::write(folder.path().join(name), contents).expect("a file");
    };
    write(
        "line.csv",
        "x_m,y_m\n0,0\n500,0\n900,90\n900,300\n500,400\n0,400\n-90,300\n-90,90\n",
    );
    write("short.csv", "x_m,y_m\n0,0\n1,0\n");
    write(
        "sweep.toml",
        "study = \"identify\"\n[grid]\nlog = [\"nowhere.csv\"]\n",
    );
    write(
        "few.toml",
        "study = \"identify\"\n[base]\npolish = false\n[grid]\n\"swarm.population\" = [1]\n",
    );
    write("raceline.toml", "sections = 60\ntrack = \"stadium:300:80:12\"\n");
    write("own.toml", "raceline = \"no_track.toml\"\n");
    write("no_track.toml", "track = \"nowhere.csv\"\n");
    let stadium = ["--track", "stadium:300:80:12", "--sections", "60"];
    let raceline = |more: &[&'static str]| [&["raceline"], &stadium[..], more].concat();
    let hybrid = |more: &[&'static str]| [&["hybrid"], &stadium[..], more].concat();
    let refused: Vec<Vec<&str>> = vec![
        vec!["identify", "--population", "1"],
        vec!["identify", "--population", "0"],
        vec!["identify", "--iterations", "0"],
        vec!["identify", "--algorithm", "thesis", "--population", "1"],
        vec!["identify", "--objectives", "vx,yaw_rate", "--population", "1"],
        vec!["identify", "--section", "Nowhere"],
        vec!["identify", "--laps", "77"],
        vec!["identify", "--backend", "gpu", "--adapter", "no such adapter"],
        raceline(&["--population", "1"]),
        raceline(&["--iterations", "0"]),
        raceline(&["--algorithm", "thesis", "--population", "1"]),
        raceline(&["--algorithm", "cooperative", "--groups", "0"]),
        raceline(&["--entry-mps", "-1"]),
        raceline(&["--ellipse-exponent", "0"]),
        raceline(&["--car-width-m", "50"]),
        raceline(&["--backend", "gpu", "--adapter", "no such adapter"]),
        hybrid(&["--population", "1"]),
        hybrid(&["--match-lap-time-s", "1000"]),
        hybrid(&["--stint-laps", "9", "--stint-fuel-kg", "1"]),
        hybrid(&["--line", "short.csv"]),
        hybrid(&["--car", "gt"]),
        hybrid(&["--energy-mj", "-1"]),
        vec!["transient", "--line", "line.csv"],
        vec!["transient", "--line", "short.csv"],
        vec!["transient", "--line", "line.csv", "--setups", "3"],
        vec![
            "transient",
            "--line",
            "line.csv",
            "--setups",
            "3",
            "--parameters",
            "no_such",
        ],
        vec!["transient", "--line", "line.csv", "--setups", "3", "--share", "2"],
        vec!["sensitivity", "--section", "Abbey", "--samples", "0"],
        vec!["sensitivity", "--section", "Abbey", "--share", "7"],
        vec!["sensitivity", "--section", "Abbey", "--parameters", "no_such"],
        vec!["surface", "--section", "Abbey", "--grid", "1"],
        vec!["surface", "--section", "Abbey", "--parameters", "K,K"],
        vec!["sweep", "sweep.toml"],
        vec!["sweep", "few.toml"],
        vec!["reproduce", "--chapter", "1"],
        vec![
            "reproduce",
            "--adapter",
            "no such adapter",
            "--backend",
            "gpu",
            "--chapter",
            "2",
        ],
        vec!["envelope", "--step-mps", "0"],
        vec!["envelope", "--from-mps", "90", "--to-mps", "20"],
        vec!["simulate", "--rate", "0"],
        vec!["simulate", "--pace", "9"],
        vec!["run", "--log", "nowhere.csv", "--no-cache"],
        vec!["run", "--track", "nowhere.csv", "--no-cache"],
        vec!["run", "own.toml", "--no-cache"],
    ];
    let mut wrong = Vec::new();
    for arguments in &refused {
        for there in [false, true] {
            let out = folder.path().join("out");
            if there {
                std::fs::create_dir(&out).expect("a folder");
            }
            let ended = lapswarm(
                folder.path(),
                &[&arguments[..], &["--quiet", "--out", "out"]].concat(),
            );
            let said = text(&ended.stderr);
            if !matches!(ended.status.code(), Some(2 | 3)) {
                wrong.push(format!(
                    "{arguments:?} ends with {:?}: {said}",
                    ended.status.code()
                ));
            }
            let left: Vec<_> = out.read_dir().into_iter().flatten().flatten().collect();
            if out.is_dir() != there || !left.is_empty() {
                wrong.push(format!("{arguments:?} leaves {left:?}: {said}"));
            }
            if out.is_dir() {
                std::fs::remove_dir_all(&out).expect("the folder goes");
            }
            // Once is enough for what takes its time.
            if ["hybrid", "run"].contains(&arguments[0]) {
                break;
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    let works = lapswarm(
        folder.path(),
        &[
            "raceline",
            "raceline.toml",
            "--objectives",
            "length",
            "--out",
            "out",
        ],
    );
    assert!(works.status.success(), "{}", text(&works.stderr));
}

/// A log with names of its own: its channels are listed, a map is written, and the map, edited, makes it a log.
#[test]
fn check_lists_the_channels_of_a_log_and_writes_a_map_of_them() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let rows = (0..200).map(|i| {
        let t = f64::from(i) * 0.05;
        let wheel = 60.0 + t.sin();
        format!(
            "{t},{wheel},{wheel},{wheel},{wheel},{},{},{}\n",
            2.0 * t.sin(),
            70.0 + t.sin(),
            8.0 * t.sin()
        )
    });
    let head = "time (s),wheel speed fl (rad/s),wheel speed fr (rad/s),wheel speed rl (rad/s),wheel speed rr (rad/s),\
                steer (deg),speed (km/h),gyro (deg/s)\n";
    let log = format!("{head}{}", rows.collect::<String>());
    std::fs::write(folder.path().join("own.csv"), log).expect("a log");
    let listed = lapswarm(folder.path(), &["check", "own.csv", "--write-map", "map.toml"]);
    let told = text(&listed.stdout);
    assert_eq!(listed.status.code(), Some(2), "{told}");
    for part in [
        "speed",
        "km/h",
        "vx, by its name",
        "no yaw_rate: needed",
        "could be, by the unit: gyro",
    ] {
        assert!(told.contains(part), "{part}: {told}");
    }
    let map = folder.path().join("map.toml");
    let written = std::fs::read_to_string(&map).expect("a map");
    let again = lapswarm(folder.path(), &["check", "own.csv", "--write-map", "map.toml"]);
    assert_eq!(again.status.code(), Some(2));
    assert_eq!(std::fs::read_to_string(&map).expect("a map"), written);
    let edited = written.replace("# [channels.yaw_rate]\n# name", "[channels.yaw_rate]\nname");
    assert_ne!(edited, written);
    std::fs::write(&map, edited).expect("a map");
    let mapped = lapswarm(folder.path(), &["check", "own.csv", "--channel-map", "map.toml"]);
    let told = text(&mapped.stdout);
    assert!(mapped.status.success(), "{told} {}", text(&mapped.stderr));
    assert!(
        told.contains("yaw_rate, by the channel map") && told.contains("no ay: speed times yaw rate"),
        "{told}"
    );
}

/// A log of the steering wheel's angle of a car with a ratio of its own, whose wheels are logged as speeds.
#[test]
fn check_reads_a_log_for_the_car_that_is_named() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let facts = "steering_ratio=18,tyre_radius_m=0.4";
    let made = lapswarm(folder.path(), &["init", "car", "car.toml", "--set", facts]);
    assert!(made.status.success(), "{}", text(&made.stderr));
    let rows = (0..1200).map(|i| {
        let t = f64::from(i) * 0.05;
        let (v, yaw) = (20.0 + 2.0 * (0.3 * t).sin(), 0.2 * (0.7 * t).sin());
        let steer = (18.0 * 2.7 * yaw / v).to_degrees();
        let wheel = |side: f64| 3.6 * (v + side * 0.8 * yaw);
        let (l, r) = (wheel(-1.0), wheel(1.0));
        format!(
            "{t},{l},{r},{l},{r},{steer},{},{},{}\n",
            3.6 * v,
            v * yaw,
            yaw.to_degrees()
        )
    });
    let head = "time (s),wheel speed fl (km/h),wheel speed fr (km/h),wheel speed rl (km/h),wheel speed rr (km/h),\
                steering wheel angle (deg),vehicle speed (km/h),lateral acceleration (m/s^2),yaw rate (deg/s)\n";
    let log = format!("{head}{}", rows.collect::<String>());
    std::fs::write(folder.path().join("own.csv"), log).expect("a log");
    let checked = lapswarm(folder.path(), &["check", "own.csv", "--car", "car.toml"]);
    let told = text(&checked.stdout);
    assert!(checked.status.success(), "{told} {}", text(&checked.stderr));
    for part in [
        "steering ratio 18, rolling radii 0.4 m in front and 0.4 m at the rear",
        "divided by the car's ratio of 18",
    ] {
        assert!(told.contains(part), "{part}: {told}");
    }
    let bundled = lapswarm(folder.path(), &["check", "own.csv"]);
    assert!(
        text(&bundled.stdout).contains("--car names the car"),
        "{}",
        text(&bundled.stdout)
    );
    let nowhere = lapswarm(folder.path(), &["check", "own.csv", "--car", "nowhere.toml"]);
    assert_eq!(nowhere.status.code(), Some(2));
}

/// Names of channels that begin like places: a log is no track for them.
#[test]
fn a_log_of_lateral_and_longitudinal_g_is_a_log() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut log = "t,G_Lat,G_Long\ns,g,g\n".to_owned();
    for i in 0..100 {
        log.push_str(&format!(
            "{},{},0.1\n",
            f64::from(i) * 0.05,
            (f64::from(i) * 0.1).sin()
        ));
    }
    std::fs::write(folder.path().join("own.csv"), log).expect("a log");
    let checked = lapswarm(folder.path(), &["check", "own.csv"]);
    let told = text(&checked.stdout);
    assert!(told.contains("ay, by its name"), "{told}");
}

#[test]
fn a_log_that_a_study_takes_is_one_that_check_takes() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let bundled = concat!(env!("CARGO_MANIFEST_DIR"), "/data/laps/gt_silverstone.csv");
    let mut log = std::fs::read_to_string(bundled).expect("a lap");
    log = log.lines().skip(1).map(|line| format!("{line}\n")).collect();
    // More than any other text may have, in lines that count for nothing.
    let comment = format!("#{}\n", " ".repeat(1 << 20));
    for _ in 0..66 {
        log.push_str(&comment);
    }
    std::fs::write(folder.path().join("large.csv"), log).expect("a file");
    let checked = lapswarm(folder.path(), &["check", "large.csv"]);
    assert!(checked.status.success(), "{}", text(&checked.stderr));
    assert!(
        text(&checked.stdout).contains("a log of 1 laps"),
        "{}",
        text(&checked.stdout)
    );
    let planned = lapswarm(folder.path(), &["identify", "--log", "large.csv", "--dry-run"]);
    assert!(planned.status.success(), "{}", text(&planned.stderr));
    // Its size is told of where it does not fit.
    let limited = [
        "identify",
        "--log",
        "large.csv",
        "--dry-run",
        "--memory-limit-mib",
        "64",
    ];
    let refused = lapswarm(folder.path(), &limited);
    assert_eq!(refused.status.code(), Some(2));
    let said = text(&refused.stderr);
    let said = said.split_whitespace().collect::<Vec<_>>().join(" ");
    for part in ["large.csv", "MiB are needed", "64 MiB", "--memory-limit-mib"] {
        assert!(said.contains(part), "{said}");
    }
}

/// What is measured goes to stdout, with `--json` to stderr beside the object, and with `--quiet` nowhere.
#[test]
fn a_benchs_table_goes_where_it_is_asked_to() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let bench = [
        "bench",
        "swarm",
        "--populations",
        "100",
        "--problems",
        "zdt1",
        "--generations",
        "2",
        "--repeats",
        "1",
        "--backend",
        "cpu",
    ];
    for (flags, on_stdout, on_stderr) in [
        (&[][..], true, false),
        (&["--json"], false, true),
        (&["--quiet"], false, false),
        (&["--quiet", "--json"], false, false),
    ] {
        let run = lapswarm(folder.path(), &[&bench[..], flags].concat());
        assert!(run.status.success(), "{flags:?}: {}", said(&run));
        let has_table = |output: &[u8]| text(output).contains("backend problem");
        assert_eq!(has_table(&run.stdout), on_stdout, "{flags:?}");
        assert_eq!(has_table(&run.stderr), on_stderr, "{flags:?}");
        assert_eq!(
            text(&run.stdout).starts_with('{'),
            flags.contains(&"--json"),
            "{flags:?}"
        );
        assert_eq!(run.stdout.is_empty(), flags == ["--quiet"], "{flags:?}");
    }
}

#[test]
fn completions_name_every_command() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let printed = lapswarm(folder.path(), &["completions", "bash"]);
    let script = text(&printed.stdout);
    let others = [
        "parity",
        "bench",
        "check",
        "init",
        "sweep",
        "reproduce",
        "simulate",
        "report",
        "export",
        "devices",
    ];
    for command in registry::names().into_iter().chain(others) {
        assert!(script.contains(command), "{command}");
    }
}

/// Every file and folder below `folder`.
fn files_in(folder: &Path) -> Vec<std::path::PathBuf> {
    let mut found = Vec::new();
    for entry in folder.read_dir().expect("a folder").flatten() {
        if entry.path().is_dir() {
            found.extend(files_in(&entry.path()));
        }
        found.push(entry.path());
    }
    found.sort();
    found
}

#[test]
fn a_dry_run_of_any_study_says_what_it_would_do_and_writes_nothing() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    std::fs::write(folder.path().join("ring.csv"), ring()).expect("a line");
    std::fs::create_dir(folder.path().join("empty")).expect("a folder");
    std::fs::create_dir(folder.path().join("full")).expect("a folder");
    std::fs::write(folder.path().join("full/a"), "something").expect("a file");
    let before = files_in(folder.path());
    let line = [&["--line", "ring.csv"], AROUND_RING.as_slice()].concat();
    let setups = [line.as_slice(), &["--setups", "3", "--backend", "simd"]].concat();
    // Each with an evaluation's number where one is known beforehand: of the adaptive swarms 128 * 50 + 64 * 150; of three
    // parameters a base car, four levels of each and eight samples of five; 5 * 5; four set-ups with 21 shares of the grip;
    // 71 of these alone, each by four drivers; four runs of inertia and two each of the pulls with three seeds, 50 * 100 cars each;
    // speeds of 18, 38 and 58 m/s by 128 steering angles.
    let studies: &[(&str, &[&str], Option<u64>)] = &[
        ("run", &[], None),
        ("identify", &[], Some(128 * 50 + 64 * 150)),
        ("raceline", &AROUND_RING, None),
        ("hybrid", &["--scenarios-only", "--sections", "60"], None),
        ("envelope", &["--step-mps", "20"], Some(3 * 128)),
        (
            "sensitivity",
            &["--parameters", "K,C,rBy1", "--samples", "8"],
            Some(1 + 3 * 4 + 8 * 5),
        ),
        ("surface", &["--grid", "5"], Some(25)),
        ("transient", &line, Some(4 * 71)),
        ("transient", &setups, Some(4 * 21)),
        ("simulate", &["--noise", "0.1,0,0,0"], Some(1)),
        ("sweep", &["thesis_inertia"], Some(48 * 5000)),
        ("sweep", &["sections"], None),
        ("reproduce", &["--quick"], None),
    ];
    for &(study, flags, evaluations) in studies {
        let said = |more: &[&str]| {
            let all = [&[study], flags, &["--dry-run"], more].concat();
            let output = lapswarm(folder.path(), &all);
            assert_eq!(files_in(folder.path()), before, "{all:?} has written");
            output
        };
        let plain = said(&["--out", "empty"]);
        assert!(plain.status.success(), "{study}: {}", text(&plain.stderr));
        let words = text(&plain.stdout);
        assert!(words.contains("nothing is written"), "{study}: {words}");
        assert!(words.contains("is there, and empty"), "{study}: {words}");

        let json = said(&["--json", "--quiet", "--out", "new"]);
        let told: serde_json::Value = serde_json::from_slice(&json.stdout).expect("one JSON object");
        assert_eq!(told["study"], study);
        assert_eq!(told["dry_run"], true);
        assert_eq!(told["evaluations"].as_u64(), evaluations, "{study}");
        // What follows the swarm: two polishes of 100 steps, four rounds of 25, and hops of 1024 starts and 60 steps. Each has a first
        // drive, and three for a step. The sweep is without.
        let hops = told["settings"]["hops"].as_u64().unwrap_or(0);
        let polish = (study == "identify").then_some(2 * 301 + 4 * 76 + hops * (1024 + 181));
        assert_eq!(told["polish_drives"].as_u64(), polish, "{study}");
        assert_eq!(told["folder"], "new");
        assert_eq!(told["folder_exists"], false);
        assert!(told["settings"].is_object(), "{study}: {told}");
        assert!(told["backend"].is_string(), "{study}: {told}");

        for wrong in [&["--out", "full"][..], &["--out", "full/a"]] {
            assert_eq!(said(wrong).status.code(), Some(2), "{study} {wrong:?}");
        }
    }
    for wrong in [
        &["identify", "--log", "nowhere.csv"][..],
        &["identify", "--laps", "9"],
        &["identify", "--section", "Nowhere"],
        &["raceline", "--car", "nowhere.toml"],
        &["raceline", "--sections", "3"],
        &["hybrid", "--car", "gt"],
        &["hybrid", "--line", "nowhere.csv"],
        &["envelope", "--step-mps", "0"],
        &["sensitivity", "--parameters", "nothing"],
        &["surface", "--parameters", "K,nothing"],
        &["transient", "--line", "nowhere.csv"],
        // The ring is not on the bundled circuit.
        &["transient", "--line", "ring.csv"],
        &[
            "transient",
            "--line",
            "ring.csv",
            "--track",
            "circle:95:105",
            "--setups",
            "2",
            "--parameters",
            "nothing",
        ],
        &["simulate", "--rate", "1"],
        &["simulate", "--track", "nowhere.csv"],
        &["sweep", "nothing"],
        &["run", "--log", "nowhere.csv"],
    ] {
        let output = lapswarm(folder.path(), &[wrong, &["--dry-run"]].concat());
        assert_eq!(
            output.status.code(),
            Some(2),
            "{wrong:?}: {}",
            text(&output.stdout)
        );
        assert_eq!(files_in(folder.path()), before, "{wrong:?} has written");
    }
}

/// What the program says, on both channels, without the frames and line breaks of its reports.
pub fn said(output: &Output) -> String {
    let all = text(&output.stdout) + &text(&output.stderr);
    all.replace(['\n', '│', ' '], "")
}

#[test]
fn mistakes_come_with_what_was_meant() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    std::fs::write(folder.path().join("alone.toml"), "[grid]\nseed = [1]\n").expect("a file");
    for (arguments, meant) in [
        (&["hybrid", "--car", "gt"][..], "gt_hybrid"),
        (&["sensitivity", "--parameters", "mass"], "mass_kg"),
        (&["sensitivity", "--parameters", "front.rBy"], "front.rBy1"),
        (&["surface", "--parameters", "k,C"], "perhapsK"),
        (
            &["surface", "--parameters", "roll_stifness,C"],
            "roll_stiffness_nm_per_rad",
        ),
        (&["simulate", "--delay", "5,0,0,0"], "0to1"),
        (&["simulate", "--noise=-1,0,0,0"], "0to100"),
        // What it was taken for is said before what is wrong with it.
        (&["check", "alone.toml"], "readasasweep"),
    ] {
        let output = lapswarm(folder.path(), arguments);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {}", said(&output));
        assert!(said(&output).contains(meant), "{arguments:?}: {}", said(&output));
    }
    // Nothing like it: what there is is said instead.
    let output = lapswarm(folder.path(), &["surface", "--parameters", "zzz,C"]);
    assert!(said(&output).contains("achassiskey") && !said(&output).contains("perhaps"));
}

#[test]
fn what_to_doubt_is_said() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let few = ["sensitivity", "--parameters", "rBy1,rCy1,K", "--samples"];
    let unsure = lapswarm(folder.path(), &[&few[..], &["8"]].concat());
    assert!(unsure.status.success(), "{}", said(&unsure));
    assert!(said(&unsure).contains("8samplesaretoofew"), "{}", said(&unsure));
    let sure = lapswarm(folder.path(), &[&few[..], &["512"]].concat());
    assert!(
        sure.status.success() && !said(&sure).contains("toofew"),
        "{}",
        said(&sure)
    );
    // Sixty cross-sections of a circuit of 5.9 km leave a hundred metres between them, in which no line keeps to the road.
    let small = [
        "raceline",
        "--sections",
        "60",
        "--objectives",
        "length",
        "--quiet",
        "--json",
    ];
    let off = lapswarm(folder.path(), &small);
    assert_eq!(off.status.code(), Some(1), "{}", said(&off));
    assert!(said(&off).contains("leavestheroad"), "{}", said(&off));
}

/// The help of a study begins with what the study does, and has its flags with ranges and defaults. An error is an object where
/// JSON is asked for.
#[test]
fn helps_and_errors_are_whole() {
    let folder = tempfile::tempdir().expect("a folder");
    for study in registry::STUDIES {
        let help = lapswarm(folder.path(), &[study.name(), "--help"]);
        let help = text(&help.stdout);
        let words = |text: &str| text.split_whitespace().collect::<Vec<_>>().join(" ");
        let about = study.about().trim_end_matches('.');
        assert!(words(&help).starts_with(&words(about)), "{help}");
    }
    let whole = lapswarm(folder.path(), &["--help"]);
    let whole = text(&whole.stdout);
    assert!(
        whole.starts_with("Evaluate whole swarms of race cars at once\n"),
        "{whole}"
    );
    let help = lapswarm(folder.path(), &["raceline", "--help"]);
    let help = text(&help.stdout)
        .split_whitespace()
        .collect::<Vec<_>>()
        .join(" ");
    assert!(
        help.contains("one for every 4 m, and 960 at least (8 to 1000000)"),
        "{help}"
    );
    assert!(help.contains("[default: gamma,length,lap_time]"), "{help}");

    std::fs::write(folder.path().join("s.toml"), "grid = 5\nshare = \"wide\"\n").expect("a file");
    let refused = lapswarm(folder.path(), &["surface", "s.toml", "--json"]);
    assert_eq!(refused.status.code(), Some(2));
    let told: serde_json::Value = serde_json::from_slice(&refused.stdout).expect("one object");
    let error = &told["error"];
    assert_eq!((&error["file"], &error["line"]), (&"s.toml".into(), &2.into()));
    assert_eq!(error["field"], "share");
    let message = error["message"].as_str().expect("words");
    assert!(text(&refused.stderr).contains(message), "{message}");
}
