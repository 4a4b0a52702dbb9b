//! Every reader given bytes from anywhere: what it takes is sound, what it refuses it refuses by file and place, and it never
//! panics. The fuzz targets of `fuzz/` and the tests of what they found share this file.

use lapswarm::line::{read_line, read_line_apart};
use lapswarm::report::compare::{self, Run};
use lapswarm::study::registry::STUDIES;
use lapswarm::study::sweep::{self, SWEEP_FILE, SweepSettings};
use lapswarm::swarm::checkpoint::{self, Checkpoint};
use lapswarm::swarm::device::DeviceState;
use lapswarm::swarm::{
    CooperativeSwarm, CovarianceSwarm, DifferenceSwarm, HybridSwarm, Islands, Moead, Mopso, Nsga2, Nsga3,
    Pso, WindowSwarm,
};
use lapswarm::telemetry::{ChannelMap, Log, LogOptions, Recording};
use lapswarm::track::{Circuit, Smoothing, Survey, SurveyOptions, Track};
use lapswarm::vehicle::tyre::TyreFile;
use lapswarm::vehicle::{Car, Envelope};
use lapswarm::{Error, Result};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

/// A reader by the name of its fuzz target.
pub type Reader = (&'static str, fn(&[u8]));

/// All of them.
pub const READERS: &[Reader] = &[
    ("car", car),
    ("maps", maps),
    ("tyre", tyre),
    ("study", study),
    ("sweep", sweep),
    ("curvature", curvature),
    ("track_csv", track_csv),
    ("boundaries", boundaries),
    ("latlon", latlon),
    ("gpx_kml", gpx_kml),
    ("log_csv", log_csv),
    ("motec_csv", motec_csv),
    ("motec_ld", motec_ld),
    ("envelope", envelope),
    ("checkpoint", checkpoint),
    ("state", state),
    ("run_folder", run_folder),
    ("line", line),
    ("survey", survey_file),
    ("sweep_rows", sweep_rows),
];

/// What was read, if anything was; a refusal must name the file and a place in it.
fn taken<T>(result: Result<T>) -> Option<T> {
    match result {
        Ok(value) => Some(value),
        Err(Error::Input {
            file, place, found, ..
        }) => {
            assert!(!file.is_empty() && !place.is_empty());
            assert!(found.len() < 4096, "{place}: a message of {} bytes", found.len());
            None
        }
        Err(Error::Memory { file, .. }) => {
            assert!(!file.is_empty());
            None
        }
        Err(error) => panic!("refused without a place: {error}"),
    }
}

/// As [`taken`], for readers that open what a file names or that ask for text: these may also say that they cannot read it.
fn taken_from_disk<T>(result: Result<T>) -> Option<T> {
    match result {
        Err(Error::Io { .. }) => None,
        other => taken(other),
    }
}

thread_local! {
    /// In memory where the system offers that.
    static FOLDER: tempfile::TempDir = {
        let memory = Path::new("/dev/shm");
        let made = if memory.is_dir() { tempfile::tempdir_in(memory) } else { tempfile::tempdir() };
        made.expect("a temporary folder")
    };
}

/// A file that holds these bytes, for readers that go by a path.
fn on_disk(name: &str, bytes: &[u8]) -> PathBuf {
    let path = FOLDER.with(|folder| folder.path().join(name));
    std::fs::write(&path, bytes).expect("a temporary file");
    path
}

/// What stands before and after the first zero.
fn split(data: &[u8]) -> (&[u8], &[u8]) {
    let mut parts = data.splitn(2, |&byte| byte == 0);
    (parts.next().unwrap_or_default(), parts.next().unwrap_or_default())
}

fn bundled_tyre(_: &str) -> Result<TyreFile> {
    TyreFile::parse(Path::new("f.tir"), Car::BUNDLED_TYRE)
}

/// A car's figures wherever it may be asked for them.
fn finite_car(car: &Car) {
    assert!(car.to_flat().iter().all(|x| x.is_finite()));
    let radius = car.chassis.radius_rear;
    if let Some(powertrain) = &car.powertrain {
        for rpm in [0.0, 1.0, 999.5, 6000.0, 1e6] {
            assert!(powertrain.torque_at(rpm).is_finite());
        }
        for v in [0.0, 1e-3, 20.0, 70.0, 300.0] {
            assert!(powertrain.wheel_force(v, radius).is_finite());
        }
        assert!(
            powertrain
                .shift_points_mps(radius)
                .iter()
                .flatten()
                .all(|v| v.is_finite())
        );
        if let Some(map) = &powertrain.engine {
            let (speeds, torques) = map.full_throttle_curve();
            assert!(speeds.iter().chain(&torques).all(|x| x.is_finite()));
            for (rpm, throttle) in [(0.0, 0.0), (3000.0, 45.0), (1e5, 90.0)] {
                assert!(map.fuel_flow_at(rpm, throttle).is_finite());
                assert!(map.throttle_for(rpm, 100.0).is_finite());
            }
        }
    }
    if let Some(hybrid) = &car.hybrid {
        for rpm in [0.0, 3000.0, 1e6] {
            assert!(hybrid.mgu_k.power_at(rpm).is_finite());
            assert!(hybrid.mgu_k.blend(1e5, rpm, 0.9).hydraulic_w.is_finite());
        }
        if let Some(h) = &hybrid.mgu_h {
            assert!(h.generated_w(0.5).is_finite());
        }
    }
}

/// A car's file.
pub fn car(data: &[u8]) {
    let text = String::from_utf8_lossy(data);
    if let Some(car) = taken(Car::parse(Path::new("f.toml"), &text, bundled_tyre)) {
        finite_car(&car);
    }
}

/// The tables of a car's engine, motors and store behind a sound chassis.
pub fn maps(data: &[u8]) {
    let whole = include_str!("../../data/cars/gt_hybrid.toml");
    let head = whole.split("[powertrain]").next().unwrap_or_default();
    let text = format!("{head}{}", String::from_utf8_lossy(data));
    if let Some(car) = taken(Car::parse(Path::new("f.toml"), &text, bundled_tyre)) {
        finite_car(&car);
    }
}

/// A tyre's property file, and the bundled car on it.
pub fn tyre(data: &[u8]) {
    let text = String::from_utf8_lossy(data);
    let read = |_: &str| TyreFile::parse(Path::new("f.tir"), &text);
    taken(read(""));
    if let Some(car) = taken(Car::parse(Path::new("f.toml"), Car::BUNDLED_TOML, read)) {
        finite_car(&car);
    }
}

/// A study's settings, read as those of every study, and a channel map.
pub fn study(data: &[u8]) {
    let path = on_disk("study.toml", data);
    for study in STUDIES {
        taken_from_disk(study.read_settings(&path));
    }
    taken(ChannelMap::parse(&String::from_utf8_lossy(data), "f.toml"));
}

/// A sweep and the points of its grid.
pub fn sweep(data: &[u8]) {
    let text = String::from_utf8_lossy(data);
    if let Some(sweep) = taken(SweepSettings::parse(Path::new("f.toml"), &text)) {
        taken(sweep.points());
    }
}

/// A circuit's file and, behind a zero, its table of curvature.
pub fn curvature(data: &[u8]) {
    let (toml, table) = split(data);
    let path = on_disk("circuit.toml", toml);
    on_disk("circuit.csv", table);
    if let Some(circuit) = taken_from_disk(Circuit::load(path))
        && let Some(cross_sections) = taken(circuit.cross_sections(50))
    {
        assert!(
            cross_sections
                .right_m
                .iter()
                .chain(&cross_sections.left_m)
                .all(|p| p.is_finite())
        );
    }
}

/// What is taken for a road is a road: its spline and cross-sections are finite, or refused.
fn survey(data: &[u8], name: &str) {
    for width_m in [None, Some(8.0)] {
        let options = SurveyOptions {
            width_m,
            ..SurveyOptions::default()
        };
        if let Some(survey) = taken(Survey::parse(data, name, &options))
            && let Some(line) = taken(survey.smoothed(&Smoothing::default()))
            && let Some(cross_sections) = taken(line.cross_sections(50))
        {
            assert!(
                cross_sections
                    .right_m
                    .iter()
                    .chain(&cross_sections.left_m)
                    .all(|p| p.is_finite())
            );
        }
    }
}

/// A reference line with its widths.
pub fn track_csv(data: &[u8]) {
    survey(data, "f.csv");
}

/// Both edges of a road.
pub fn boundaries(data: &[u8]) {
    survey(data, "f.csv");
}

/// Latitudes and longitudes.
pub fn latlon(data: &[u8]) {
    survey(data, "f.csv");
}

/// A track of GPX, or a line of KML.
pub fn gpx_kml(data: &[u8]) {
    survey(data, "f.gpx");
}

fn log(recording: Result<Recording>) {
    if let Some(recording) = taken_from_disk(recording) {
        let log = Log::from_recording(&recording, &ChannelMap::default(), &LogOptions::default());
        if let Some(log) = taken(log) {
            assert!(log.vx_mps.iter().chain(&log.steer_rad).all(|x| x.is_finite()));
        }
    }
}

/// A log as the program writes it.
pub fn log_csv(data: &[u8]) {
    log(Recording::parse(data, "f.csv"));
}

/// A log as i2 exports it.
pub fn motec_csv(data: &[u8]) {
    log(Recording::parse(data, "f.csv"));
}

/// A log as the logger writes it, and the same bytes as the beacons beside a sound one.
pub fn motec_ld(data: &[u8]) {
    log(Recording::parse(data, "f.ld"));
    let path = on_disk("f.ld", include_bytes!("../data/small.ld"));
    on_disk("f.ldx", data);
    log(Recording::read(path));
}

/// A g-g-v envelope, and a line that another study wrote.
pub fn envelope(data: &[u8]) {
    if let Some(envelope) = taken(Envelope::from_csv("f.csv", &String::from_utf8_lossy(data))) {
        let v = envelope.top_speed_mps();
        for row in [0.0, 0.5 * v, v, 2.0 * v].map(|v| envelope.at(v)) {
            let figures = [row.ay_mps2, row.ax_grip_mps2, row.ax_drive_mps2, row.drag_mps2];
            assert!(figures.iter().all(|x| x.is_finite()));
            let in_bends = [0.0, 0.7, 1.0].map(|share| envelope.traction_at(row.v_mps, share));
            assert!(in_bends.iter().flatten().all(|x| (0.0..=200.0).contains(x)));
        }
    }
    if let Some(points) = taken(read_line(&on_disk("line.csv", data))) {
        assert!(points.iter().all(|p| p.is_finite()));
    }
}

/// A checkpoint with a head and a sum that are right, so that what is inside is looked at.
fn forged_file(kind: &str, payload: &[u8]) -> Vec<u8> {
    let mut bytes = b"LAPSWARM".to_vec();
    bytes.extend(checkpoint::VERSION.to_le_bytes());
    bytes.extend((kind.len() as u32).to_le_bytes());
    bytes.extend(kind.as_bytes());
    bytes.extend((payload.len() as u64).to_le_bytes());
    bytes.extend(payload);
    bytes.extend(crc32fast::hash(&bytes).to_le_bytes());
    bytes
}

/// What is taken of such a checkpoint can be kept again.
fn forged<T: Checkpoint>(payload: &[u8]) {
    let bytes = forged_file(T::KIND, payload);
    if let Some(state) = taken(checkpoint::from_bytes::<T>(&bytes, Path::new("f"))) {
        taken(checkpoint::to_bytes(&state));
    }
}

/// A swarm's checkpoint: as it is and, by its first byte, as the state of one of the swarms.
pub fn checkpoint(data: &[u8]) {
    taken(checkpoint::from_bytes::<Pso>(data, Path::new("f")));
    let Some((&kind, payload)) = data.split_first() else {
        return;
    };
    match kind % 14 {
        0 => forged::<Pso>(payload),
        1 => forged::<Mopso>(payload),
        2 => forged::<CooperativeSwarm>(payload),
        3 => forged::<CovarianceSwarm>(payload),
        4 => forged::<DeviceState>(payload),
        5 => forged::<DifferenceSwarm>(payload),
        6 => forged::<HybridSwarm>(payload),
        7 => forged::<Nsga2>(payload),
        8 => forged::<WindowSwarm>(payload),
        9 => forged::<Islands<Mopso>>(payload),
        10 => forged::<Islands<Pso>>(payload),
        11 => forged::<Islands<DifferenceSwarm>>(payload),
        12 => forged::<Nsga3>(payload),
        _ => forged::<Moead>(payload),
    }
}

/// The kinds of states that studies save.
pub fn state_kinds() -> Vec<&'static str> {
    let mut kinds: Vec<&str> = STUDIES
        .iter()
        .flat_map(|study| study.state_kinds())
        .copied()
        .collect();
    kinds.sort_unstable();
    kinds.dedup();
    kinds
}

/// A study's state, of the kind that its first byte says.
pub fn state(data: &[u8]) {
    let Some((&number, payload)) = data.split_first() else {
        return;
    };
    let kinds = state_kinds();
    let kind = kinds[usize::from(number) % kinds.len()];
    let path = on_disk("state.lapswarm", &forged_file(kind, payload));
    let study = STUDIES.iter().find(|study| study.state_kinds().contains(&kind));
    taken(study.expect("one has it").read_state(&path));
}

/// The manifest of a run and, behind zeros, its figures and a lap.
pub fn run_folder(data: &[u8]) {
    let (manifest, rest) = split(data);
    let (summary, lap) = split(rest);
    let path = on_disk("manifest.json", manifest);
    on_disk("summary.json", summary);
    on_disk("line_fastest.csv", lap);
    let Some(folder) = path.parent() else {
        return;
    };
    if let Some(run) = taken(Run::read(folder)) {
        taken(compare::compare(&[run]));
    }
}

/// A line that a hybrid is driven on.
pub fn line(data: &[u8]) {
    if let Some(points) = taken(read_line_apart(&on_disk("driven.csv", data), 4.0)) {
        assert!(points.iter().all(|p| p.is_finite()));
    }
}

/// A file that names a survey and, behind a zero, the survey.
pub fn survey_file(data: &[u8]) {
    let (toml, table) = split(data);
    let path = on_disk("surveyed.toml", toml);
    on_disk("survey.csv", table);
    if let Some(track) = taken_from_disk(Track::read(path))
        && let Some(cross_sections) = taken(track.cross_sections(50, false))
    {
        assert!(
            cross_sections
                .right_m
                .iter()
                .chain(&cross_sections.left_m)
                .all(|p| p.is_finite())
        );
    }
}

/// The sweep whose rows [`sweep_rows`] reads.
pub const SWEPT: &str =
    "study = \"raceline\"\n[base]\ntrack = \"circle:590:600\"\n[grid]\nsections = [40, 60]\nseed = [1, 2]\n";

/// The rows that a sweep goes on from, and what it makes of them.
pub fn sweep_rows(data: &[u8]) {
    let folder = FOLDER.with(|folder| folder.path().join("sweep"));
    std::fs::create_dir_all(&folder).expect("a temporary folder");
    std::fs::write(folder.join(SWEEP_FILE), SWEPT).expect("a temporary file");
    let _ = std::fs::remove_dir_all(folder.join("rows"));
    std::fs::create_dir_all(folder.join("rows")).expect("a temporary folder");
    std::fs::create_dir_all(folder.join("studies")).expect("a temporary folder");
    let rows = String::from_utf8_lossy(data);
    for (run, row) in rows.lines().take(4).enumerate() {
        std::fs::write(folder.join(format!("rows/{run:05}.json")), row).expect("a temporary file");
    }
    let settings = SweepSettings::parse(Path::new("s.toml"), SWEPT).expect("a sweep");
    match sweep::sweep(&settings, &folder, true, |_| ControlFlow::Break(())) {
        // Rows are left to do.
        Err(Error::Interrupted(_)) => {}
        other => drop(taken_from_disk(other)),
    }
}
