//! Damaged and random files, for every reader that takes text or bytes: nothing panics, and every refusal names the file
//! and a place in it. Surveys and `.ld` files have tests of their own beside their readers.

use lapswarm::config::settings::Settings;
use lapswarm::evaluate::{Objective, Problem, Variable};
use lapswarm::study::identify::IdentifySettings;
use lapswarm::study::raceline::RacelineSettings;
use lapswarm::study::registry;
use lapswarm::swarm::checkpoint;
use lapswarm::swarm::{Pso, PsoSettings};
use lapswarm::telemetry::{ChannelMap, Log, LogOptions, Recording};
use lapswarm::vehicle::tyre::TyreFile;
use lapswarm::vehicle::{Car, Envelope};
use lapswarm::{Error, Result};
use proptest::prelude::*;
use std::path::Path;

/// What is done to a file: where, with which byte, and how.
type Change = (prop::sample::Index, u8, u8);

fn changes() -> impl Strategy<Value = Vec<Change>> {
    prop::collection::vec((any::<prop::sample::Index>(), any::<u8>(), 0u8..6), 1..6)
}

fn damaged(good: &[u8], changes: &[Change], digits: bool) -> Vec<u8> {
    let mut bytes = good.to_vec();
    for (at, byte, how) in changes {
        if bytes.is_empty() {
            break;
        }
        let at = at.index(bytes.len());
        // Digits keep a file readable and make its figures wild.
        let byte = if digits { b'0' + byte % 10 } else { *byte };
        match how {
            0 => bytes[at] = byte,
            1 => bytes.insert(at, byte),
            2 => drop(bytes.remove(at)),
            3 => bytes.truncate(at),
            4 => drop(bytes.splice(at..at, *b"e308")),
            _ => {
                let end = (at + 40).min(bytes.len());
                let piece: Vec<u8> = bytes[at..end].to_vec();
                bytes.splice(at..at, piece);
            }
        }
    }
    bytes
}

fn names_its_place<T>(result: Result<T>) -> std::result::Result<Option<T>, TestCaseError> {
    match result {
        Ok(value) => Ok(Some(value)),
        Err(Error::Input { file, place, .. }) if !file.is_empty() && !place.is_empty() => Ok(None),
        Err(error) => Err(TestCaseError::fail(error.to_string())),
    }
}

/// The first lines of the bundled lap.
fn lap() -> String {
    include_str!("../../data/laps/gt_silverstone.csv")
        .lines()
        .take(60)
        .map(|line| format!("{line}\n"))
        .collect()
}

fn motec() -> String {
    let mut text = "\"Format\",\"MoTeC CSV File\"\r\n\"Beacon Markers\",\"1.0 2.0\"\r\n\r\n\"Time\",\"Ground Speed\",\
        \"Wheel Speed FL\",\"Wheel Speed FR\",\"Wheel Speed RL\",\"Wheel Speed RR\",\"Steered Angle\",\"G Force Lat\",\
        \"G Force Long\",\"Gyro Yaw Velocity\"\r\n\"s\",\"km/h\",\"rpm\",\"rpm\",\"rpm\",\"rpm\",\"deg\",\"G\",\"G\",\
        \"deg/s\"\r\n\r\n"
        .to_owned();
    for i in 0..60 {
        let t = f64::from(i) * 0.05;
        let v = 40.0 + t;
        text += &format!(
            "{t},{},{r},{r},{r},{r},{},0.3,0.1,{}\r\n",
            v * 3.6,
            2.0 * t.sin(),
            5.0 * t.sin(),
            r = v * 30.0
        );
    }
    text
}

const LIMITS: &str =
    "v_mps,ay_mps2,ax_grip_mps2,ax_drive_mps2,drag_mps2\n10,12,12,8,0.1\n30,14,13,6,0.8\n60,18,16,2,3\n";
const MAP: &str = "[vx]\nchannel = \"Ground Speed\"\nunit = \"km/h\"\n";

fn state() -> Vec<u8> {
    let problem = Problem {
        variables: (0..4)
            .map(|k| Variable::new(format!("x{k}"), "-", 0.0, 1.0))
            .collect(),
        objectives: vec![Objective::new("f", "-")],
    };
    let settings = PsoSettings {
        population: 8,
        ..PsoSettings::default()
    };
    checkpoint::to_bytes(&Pso::new(&problem, settings).unwrap()).unwrap()
}

proptest! {
    #[test]
    fn cars_and_tyres(edits in changes(), digits in any::<bool>()) {
        let tyre = |_: &str| TyreFile::parse(Path::new("f.tir"), Car::BUNDLED_TYRE);
        let text = String::from_utf8_lossy(&damaged(Car::BUNDLED_TOML.as_bytes(), &edits, digits)).into_owned();
        if let Some(car) = names_its_place(Car::parse(Path::new("f.toml"), &text, tyre))? {
            prop_assert!(car.to_flat().iter().all(|x| x.is_finite()));
        }
        let text = String::from_utf8_lossy(&damaged(Car::BUNDLED_TYRE.as_bytes(), &edits, digits)).into_owned();
        let tyre = |_: &str| TyreFile::parse(Path::new("f.tir"), &text);
        if let Some(car) = names_its_place(Car::parse(Path::new("f.toml"), Car::BUNDLED_TOML, tyre))? {
            prop_assert!(car.to_flat().iter().all(|x| x.is_finite()));
        }
    }

    #[test]
    fn logs(edits in changes(), digits in any::<bool>(), of_motec in any::<bool>()) {
        let good = if of_motec { motec() } else { lap() };
        let bytes = damaged(good.as_bytes(), &edits, digits);
        if let Some(recording) = names_its_place(Recording::parse(&bytes, "f.csv"))? {
            let log = Log::from_recording(&recording, &ChannelMap::default(), &LogOptions::default());
            if let Some(log) = names_its_place(log)? {
                prop_assert!(log.vx_mps.iter().chain(&log.steer_rad).all(|x| x.is_finite()));
            }
        }
    }

    #[test]
    fn envelopes_maps_and_states(edits in changes(), digits in any::<bool>(), noise in prop::collection::vec(any::<u8>(), 0..300)) {
        let text = |good: &str| String::from_utf8_lossy(&damaged(good.as_bytes(), &edits, digits)).into_owned();
        if let Some(limits) = names_its_place(Envelope::from_csv("f.csv", &text(LIMITS)))? {
            prop_assert!(limits.rows().iter().all(|r| r.v_mps.is_finite() && r.ay_mps2.is_finite()));
        }
        names_its_place(ChannelMap::parse(&text(MAP), "f.toml"))?;
        names_its_place(checkpoint::from_bytes::<Pso>(&damaged(&state(), &edits, digits), Path::new("f")))?;
        // With a sum that is right, so that what is inside is looked at.
        let mut forged = damaged(&state()[..state().len() - 4], &edits, digits);
        forged.extend(crc32fast::hash(&forged).to_le_bytes());
        names_its_place(checkpoint::from_bytes::<Pso>(&forged, Path::new("f")))?;
        for bytes in [&noise, &[&state()[..20], &noise].concat()] {
            names_its_place(checkpoint::from_bytes::<Pso>(bytes, Path::new("f")))?;
            names_its_place(Recording::parse(bytes, "f.ld"))?;
            names_its_place(Recording::parse(bytes, "f.csv"))?;
            let text = String::from_utf8_lossy(bytes);
            names_its_place(Envelope::from_csv("f.csv", &text))?;
            names_its_place(TyreFile::parse(Path::new("f.tir"), &text))?;
        }
    }

    #[test]
    fn studies(edits in changes(), digits in any::<bool>()) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("study.toml");
        let damage = |study: &str| {
            let good = registry::named(study).unwrap().template();
            let text = String::from_utf8_lossy(&damaged(good.as_bytes(), &edits, digits)).into_owned();
            std::fs::write(&path, text).unwrap();
        };
        damage("identify");
        names_its_place(IdentifySettings::read(&path))?;
        damage("raceline");
        names_its_place(RacelineSettings::read(&path))?;
    }
}
