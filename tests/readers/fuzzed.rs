//! What fuzzing found, and the seeds that it starts from: see `fuzz/README.md`.

#[path = "../common/ld.rs"]
#[allow(dead_code)] // Others look into the file that it makes.
mod ld;
#[path = "../common/readers.rs"]
mod readers;

use crate::small_studies::small;
use lapswarm::evaluate::{Objective, Problem, Variable};
use lapswarm::files::run_folder::STATE;
use lapswarm::study::framework::memory::USUAL_MIB;
use lapswarm::study::framework::{Request, Searched};
use lapswarm::study::registry::STUDIES;
use lapswarm::study::sweep::{KeptRow, Row, SweepSettings};
use lapswarm::swarm::checkpoint::{self, Checkpoint};
use lapswarm::swarm::{
    CooperativeSettings, CooperativeSwarm, CovarianceSettings, CovarianceSwarm, DifferenceSettings,
    DifferenceSwarm, HybridSettings, HybridSwarm, Islands, Moead, MoeadSettings, Mopso, MopsoSettings, Nsga2,
    Nsga2Settings, Nsga3, Nsga3Settings, Pso, PsoSettings, Reached, WindowSettings, WindowSwarm,
};
use lapswarm::vehicle::Car;
use readers::READERS;
use std::f64::consts::TAU;
use std::fmt::Write as _;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

#[test]
fn what_was_found_is_mended() {
    let found = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/found");
    let mut inputs = 0;
    for folder in found.read_dir().unwrap().flatten() {
        let name = folder.file_name().into_string().unwrap();
        let reader = READERS.iter().find(|(reader, _)| *reader == name);
        let (_, reader) = reader.unwrap_or_else(|| panic!("no reader {name}"));
        for input in folder.path().read_dir().unwrap().flatten() {
            reader(&std::fs::read(input.path()).unwrap());
            inputs += 1;
        }
    }
    assert!(inputs > 0);
}

/// Seeds are read by their readers. Where `LAPSWARM_SEEDS` names a folder they are left there, for the fuzzer.
#[test]
fn seeds_are_read() {
    let folder = std::env::var_os("LAPSWARM_SEEDS").map(PathBuf::from);
    let mut without: Vec<&str> = READERS.iter().map(|(name, _)| *name).collect();
    for (number, (name, bytes)) in seeds().into_iter().enumerate() {
        let (_, reader) = READERS.iter().find(|(reader, _)| *reader == name).unwrap();
        reader(&bytes);
        without.retain(|other| *other != name);
        if let Some(folder) = &folder {
            let folder = folder.join(name);
            std::fs::create_dir_all(&folder).unwrap();
            std::fs::write(folder.join(format!("seed-{number:02}")), &bytes).unwrap();
        }
    }
    assert!(without.is_empty(), "no seed for {without:?}");
}

fn seeds() -> Vec<(&'static str, Vec<u8>)> {
    let hybrid = include_str!("../../data/cars/gt_hybrid.toml");
    let tables = &hybrid[hybrid.find("[powertrain]").unwrap()..];
    let circuit = concat!(
        include_str!("../../data/circuits/silverstone_gp.toml"),
        "\0",
        include_str!("../../data/circuits/silverstone_gp.csv")
    );
    // As the reader of the target lays them down.
    let circuit = circuit.replace("silverstone_gp.csv", "circuit.csv");
    let mut seeds: Vec<(&'static str, Vec<u8>)> = [
        ("car", Car::BUNDLED_TOML),
        ("car", hybrid),
        ("car", include_str!("../../data/cars/touring.toml")),
        ("maps", tables),
        ("tyre", Car::BUNDLED_TYRE),
        ("study", include_str!("../../data/studies/real_log.toml")),
        ("study", "car = \"gt_hybrid\"\nfree = \"both\"\nobjectives = [\"lap_time_s\", \"fuel_l\"]\nbudgets_mj = [1, 2.1]\n"),
        ("study", "parameters = [\"rBy1\", \"rCy1\"]\nshare = 0.2\ngrid = 11\nsamples = 64\n"),
        ("study", "steering_ratio = 12.5\n[vx]\nchannel = \"Ground Speed\"\nunit = \"km/h\"\nsign = 1\ndelay_s = 0.02\n"),
        ("sweep", include_str!("../../data/sweeps/front.toml")),
        ("sweep", include_str!("../../data/sweeps/norms.toml")),
        ("sweep", include_str!("../../data/sweeps/sections.toml")),
        ("sweep", include_str!("../../data/sweeps/thesis_inertia.toml")),
        ("curvature", &circuit),
        ("line", "# a line\nstation (m),x (m),y (m)\n0,0,0\n5,5,0\n10,9,3\n15,9,8\n"),
        ("line", "x_m,y_m\n0,0\n4,0\n8,1e1\n"),
        ("envelope", "v_mps,ay_mps2,ax_grip_mps2,ax_drive_mps2,drag_mps2\n10,12,12,8,0.1\n30,14,13,6,0.8\n60,18,16,2,3\n"),
        ("envelope", "v_mps,ay_mps2,ax_grip_mps2,ax_drive_mps2,drag_mps2,ax_traction_mps2_at_0,ax_traction_mps2_at_0.8,\
            ax_traction_mps2_at_1\n10,12,12,8,0.1,9,7,0\n60,18,16,2,3,12,10,1\n"),
        ("run_folder", "{\"program\":\"lapswarm\",\"version\":\"0.1.0\",\"study\":\"raceline\",\"seed\":1,\"track\":\"a\"}\0\
            {\"study\":\"raceline\",\"elapsed_s\":1.5,\"best\":{\"lap_time\":{\"lap_time_fine_s\":114.2}},\
            \"rows\":[{\"name\":\"a\",\"x\":1}]}\0station (m),x (m),y (m),speed (m/s),time (s)\n0,0,0,30,0\n1,1,0,31,0.1\n2,2,0,32,0.2\n"),
    ]
    .map(|(name, text)| (name, text.as_bytes().to_vec()))
    .into();
    seeds.extend(
        STUDIES
            .iter()
            .map(|study| ("study", study.template().into_bytes())),
    );
    seeds.push(("sweep_rows", sweep_rows()));
    seeds.extend(tracks().into_iter().map(|(name, text)| (name, text.into_bytes())));
    let lap: String = include_str!("../../data/laps/gt_silverstone.csv")
        .lines()
        .take(24)
        .map(|line| format!("{line}\n"))
        .collect();
    seeds.push(("log_csv", lap.into_bytes()));
    seeds.push(("motec_csv", motec_csv().into_bytes()));
    seeds.push(("motec_ld", motec_ld()));
    seeds.push((
        "motec_ld",
        b"<Marker Version=\"100\" ClassName=\"BCN\" Name=\"1\" Time=\"2.5e+06\"/>\n".to_vec(),
    ));
    seeds.extend(swarms().into_iter().map(|bytes| ("checkpoint", bytes)));
    seeds.extend(states().into_iter().map(|bytes| ("state", bytes)));
    seeds
}

/// An oval in every format of a survey.
fn tracks() -> Vec<(&'static str, String)> {
    let around = |count: u32, a: f64, b: f64| {
        (0..count).map(move |i| {
            let t = TAU * f64::from(i) / f64::from(count);
            (a * t.cos(), b * t.sin())
        })
    };
    let place = |(x, y): (f64, f64)| (52.07 + y / 111268.7, -1.016 + x / 68570.8);
    let mut line = "# x_m,y_m,w_tr_right_m,w_tr_left_m\n".to_owned();
    let mut width = "x_m,y_m,width_m\n".to_owned();
    let mut edges = "left_x_m,left_y_m,right_x_m,right_y_m\n".to_owned();
    let mut latitudes = "latitude_deg,longitude_deg,width_m\n".to_owned();
    let mut gpx = "<?xml version=\"1.0\"?>\n<gpx version=\"1.1\" creator=\"t\" xmlns=\"http://www.topografix.com/GPX/1/1\">\n\
                   <trk><name>Oval &amp; more</name><trkseg>\n"
        .to_owned();
    let mut kml = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<kml xmlns=\"http://www.opengis.net/kml/2.2\">\n<Document>\
                   <Placemark><name>Oval</name><LineString><coordinates>\n"
        .to_owned();
    for (x, y) in around(40, 200.0, 120.0) {
        let (lat, lon) = place((x, y));
        let _ = writeln!(line, "{x:.3},{y:.3},5.5,6.25");
        let _ = writeln!(width, "{x:.3},{y:.3},12");
        let _ = writeln!(latitudes, "{lat:.7},{lon:.7},9");
        let _ = writeln!(
            gpx,
            "<trkpt lat=\"{lat:.7}\" lon=\"{lon:.7}\"><ele>150</ele></trkpt>"
        );
        let _ = writeln!(kml, "{lon:.7},{lat:.7},0");
    }
    for (left, right) in around(30, 194.0, 114.0).zip(around(30, 206.0, 126.0)) {
        let _ = writeln!(edges, "{:.3},{:.3},{:.3},{:.3}", left.0, left.1, right.0, right.1);
    }
    let named = format!(
        "survey = \"survey.csv\"\nname = \"Oval\"\nclosed = true\nsmoothing_line_m = 0.2\n\
         [[sections]]\nname = \"A\"\nstart_m = 10\nend_m = 90\n[[corners]]\nname = \"B\"\nstation_m = 50\n\0{line}"
    );
    let mut driven = "time_s,lap,lap_complete,gps_lat,gps_long\n".to_owned();
    for (i, at) in around(120, 200.0, 120.0).enumerate() {
        let (lat, lon) = place(at);
        let _ = writeln!(driven, "{:.1},1,1,{lat:.7},{lon:.7}", i as f64 * 0.3);
    }
    vec![
        ("survey", named),
        ("track_csv", line),
        ("track_csv", width),
        ("boundaries", edges),
        ("latlon", latitudes),
        ("latlon", driven),
        ("gpx_kml", gpx + "</trkseg></trk>\n</gpx>\n"),
        (
            "gpx_kml",
            kml + "</coordinates></LineString></Placemark></Document></kml>\n",
        ),
    ]
}

/// The rows of a sweep that is done but for its figures' files, and of one that is not.
fn sweep_rows() -> Vec<u8> {
    let settings = SweepSettings::parse(Path::new("s.toml"), readers::SWEPT).unwrap();
    let rows = settings
        .points()
        .unwrap()
        .into_iter()
        .enumerate()
        .map(|(run, point)| KeptRow {
            processor_elapsed_s: 2.0,
            searched: Searched {
                objectives: vec!["length (m)".to_owned(), "lap time (s)".to_owned()],
                reached: vec![Reached {
                    evaluations: 8,
                    elapsed_s: 0.5,
                    best: None,
                    front: vec![vec![2.0, 3.0]],
                }],
                front: Vec::new(),
            },
            row: Row {
                run,
                settings: point.settings,
                figures: [("hypervolume".to_owned(), Some(0.5)), ("none".to_owned(), None)].into(),
                device_faults: Vec::new(),
                front: vec![vec![1.0, 3.0 + run as f64], vec![2.0, 1.5]],
            },
            exit_code: 0,
            machine: "a".to_owned(),
            elapsed_s: 1.0,
            log: Vec::new(),
        });
    rows.flat_map(|row| (serde_json::to_string(&row).unwrap() + "\n").into_bytes())
        .collect()
}

fn motec_csv() -> String {
    let mut text = "\"Format\",\"MoTeC CSV File\"\r\n\"Beacon Markers\",\"0.5 1.0\"\r\n\r\n\"Time\",\"Ground Speed\",\
        \"Wheel Speed FL\",\"Wheel Speed FR\",\"Wheel Speed RL\",\"Wheel Speed RR\",\"Steered Angle\",\"G Force Lat\",\
        \"G Force Long\",\"Gyro Yaw Velocity\"\r\n\"s\",\"km/h\",\"rpm\",\"rpm\",\"rpm\",\"rpm\",\"deg\",\"G\",\"G\",\
        \"deg/s\"\r\n\r\n"
        .to_owned();
    for i in 0..40 {
        let t = f64::from(i) * 0.05;
        let _ = write!(
            text,
            "{t:.2},{:.2},{r:.1},{r:.1},{r:.1},{r:.1},{:.3},0.3,0.1,{:.3}\r\n",
            (40.0 + t) * 3.6,
            2.0 * t.sin(),
            5.0 * t.sin(),
            r = (40.0 + t) * 30.0
        );
    }
    text
}

/// A log of the channels that the program looks for.
fn motec_ld() -> Vec<u8> {
    use motec_i2::{Datatype, Sample};
    let channels = [
        ("Ground Speed", "km/h", 150.0),
        ("Wheel Speed FL", "rpm", 1200.0),
        ("Wheel Speed FR", "rpm", 1200.0),
        ("Wheel Speed RL", "rpm", 1210.0),
        ("Wheel Speed RR", "rpm", 1210.0),
        ("Steered Angle", "deg", 3.0),
        ("G Force Lat", "G", 0.3),
        ("G Force Long", "G", 0.1),
        ("Gyro Yaw Velocity", "deg/s", 4.0),
    ];
    let channels = channels.map(|(name, unit, value)| {
        let samples = (0..40).map(|i| Sample::F32(value + 0.01 * i as f32)).collect();
        (ld::channel(name, unit, Datatype::F32, 20), samples)
    });
    ld::file(channels.into())
}

/// What is inside a checkpoint, behind the number by which the target knows its kind.
fn inside(number: usize, kind: &str, file: &[u8]) -> Vec<u8> {
    let head = 8 + 4 + 4 + kind.len() + 8;
    let mut seed = vec![number as u8];
    seed.extend(&file[head..file.len() - 4]);
    seed
}

fn swarm<T: Checkpoint>(number: usize, state: &T) -> Vec<u8> {
    inside(number, T::KIND, &checkpoint::to_bytes(state).unwrap())
}

fn swarms() -> Vec<Vec<u8>> {
    let problem = |objectives: usize| Problem {
        variables: (0..4)
            .map(|k| Variable::new(format!("x{k}"), "-", 0.0, 1.0))
            .collect(),
        objectives: (0..objectives)
            .map(|k| Objective::new(format!("f{k}"), "-"))
            .collect(),
    };
    let (one, two) = (problem(1), problem(2));
    let motion = PsoSettings {
        population: 6,
        ..PsoSettings::default()
    };
    let many = MopsoSettings {
        motion: PsoSettings {
            population: 6,
            ..MopsoSettings::default().motion
        },
        archive: 4,
        ..MopsoSettings::default()
    };
    let pso = || Pso::new(&one, motion.clone()).unwrap();
    let mopso = || Mopso::new(&two, many.clone()).unwrap();
    let cooperative = CooperativeSettings {
        motion: motion.clone(),
        groups: 2,
    };
    let small = Nsga2Settings {
        population: 8,
        ..Nsga2Settings::default()
    };
    let directed = Nsga3Settings {
        population: 8,
        ..Nsga3Settings::default()
    };
    let decomposed = MoeadSettings {
        population: 8,
        ..MoeadSettings::default()
    };
    let difference = || DifferenceSwarm::new(&one, DifferenceSettings::default()).unwrap();
    vec![
        checkpoint::to_bytes(&pso()).unwrap(),
        swarm(0, &pso()),
        swarm(1, &mopso()),
        swarm(2, &CooperativeSwarm::new(&one, cooperative).unwrap()),
        swarm(
            3,
            &CovarianceSwarm::new(&one, &[0.5; 4], CovarianceSettings::default()).unwrap(),
        ),
        swarm(5, &difference()),
        swarm(6, &HybridSwarm::new(&one, HybridSettings::default()).unwrap()),
        swarm(7, &Nsga2::new(&two, small).unwrap()),
        swarm(
            8,
            &WindowSwarm::new(&one, &[0.5; 4], WindowSettings::default()).unwrap(),
        ),
        swarm(9, &Islands::new(&two, vec![mopso(), mopso()], None).unwrap()),
        swarm(10, &Islands::new(&one, vec![pso(), pso()], None).unwrap()),
        swarm(
            11,
            &Islands::new(&one, vec![difference(), difference()], None).unwrap(),
        ),
        swarm(12, &Nsga3::new(&two, directed).unwrap()),
        swarm(13, &Moead::new(&two, decomposed).unwrap()),
    ]
}

/// The state of every kind that a small study leaves when it is interrupted at its first step.
fn states() -> Vec<Vec<u8>> {
    let kinds = readers::state_kinds();
    let mut seeds = vec![Vec::new(); kinds.len()];
    let folder = tempfile::tempdir().unwrap();
    for study in STUDIES.iter().filter(|study| study.name() != "run") {
        let given = small(study.name(), folder.path());
        let mut ways = vec![given.clone()];
        // A line that is driven alone keeps another state than set-ups do.
        if given.iter().any(|(key, _)| key == "setups") {
            let alone = given
                .into_iter()
                .filter(|(key, _)| key != "setups" && key != "backend");
            ways.push(alone.collect());
        }
        for flags in ways {
            let out = folder.path().join("out");
            let stopped = study.run(Request {
                file: None,
                text: None,
                flags: &flags,
                out: Some(&out),
                resume: false,
                save_every: Duration::ZERO,
                time_limit: None,
                memory_limit_mib: USUAL_MIB,
                dry_run: false,
                stop: Arc::default(),
                observe: &mut |_| ControlFlow::Break(()),
            });
            drop(stopped);
            let file = std::fs::read(out.join(STATE));
            let file = file.unwrap_or_else(|error| panic!("{}: {error}", study.name()));
            std::fs::remove_dir_all(&out).unwrap();
            // The length of the kind stands behind the mark and the version.
            let is_its = |kind: &&str| file[16..].starts_with(kind.as_bytes());
            let number = kinds.iter().position(is_its).expect("a kind of a study");
            seeds[number] = inside(number, kinds[number], &file);
        }
    }
    assert!(
        seeds.iter().all(|seed| !seed.is_empty()),
        "no state of some of {kinds:?}"
    );
    seeds
}
