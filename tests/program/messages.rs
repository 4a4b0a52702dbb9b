//! What the program says, and where: in the user's words, and as JSON where that is asked for.

use crate::cli::{AROUND_RING, lapswarm, ring, said, text};
use lapswarm::config::settings::Settings;
use lapswarm::study::raceline::RacelineSettings;

/// What is wrong is told in the user's words and in those of the file, on the command line as in files.
#[test]
fn mistakes_are_told_in_words_that_know_nothing_of_the_program() {
    let folder = tempfile::tempdir().expect("a folder");
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).expect("a file");
    std::fs::create_dir(folder.path().join("somewhere")).expect("a folder");
    std::fs::create_dir(folder.path().join("track.toml")).expect("a folder");
    write("reversed.toml", "[free]\nK = [3e5, 3e4]\n");
    write("syntax.toml", "window_s = \n");
    write("unquoted.toml", "log = lap.csv\n");
    write("list.toml", "window_s = [3, 4]\n");
    write("map.toml", "[channels]\nay = \"G Force Lat\"\n");
    write("study.toml", "channel_map = \"map.toml\"\n");
    write("road.toml", "survey = \"road.csv\"\nlap = 1.5\n");
    for (arguments, parts) in [
        (
            &["identify", "reversed.toml"][..],
            ["line2", "[lower,upper],twonumbersinascendingorder"],
        ),
        (&["identify", "--free", "K=3e5:3e4"], ["K=3e5", "ascendingorder"]),
        (&["identify", "syntax.toml"], ["syntax.toml:line1", "expected"]),
        (&["identify", "unquoted.toml"], ["unquoted.toml:line1", "quoted"]),
        (
            &["identify", "list.toml"],
            ["line1", "found[3,4],expectedanumber"],
        ),
        (&["identify", "study.toml"], ["map.toml:line2", "expectedatable"]),
        (
            &["raceline", "--track", "somewhere"],
            ["somewhere", "foundafolder,expectedafile"],
        ),
        (
            &["raceline", "--track", "track.toml"],
            ["track.toml", "foundafolder,expectedafile"],
        ),
        (
            &["raceline", "--track", "road.toml"],
            ["road.toml:line2", "found1.5,expectedawholenumber"],
        ),
        (
            &["raceline", "--memory-limit-mib", "much"],
            ["'much'for'--memory-limit-mib", "expectedawholenumber"],
        ),
        (&["raceline", "--seed=-1"], ["--seed", "whole"]),
        (
            &["simulate", "--rate", "fast"],
            ["'fast'for'--rate", "expectedanumber"],
        ),
    ] {
        let output = lapswarm(folder.path(), arguments);
        let told = said(&output);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {told}");
        assert!(
            parts.iter().all(|part| told.contains(part)),
            "{arguments:?}: {told}"
        );
        for leak in [
            "struct",
            "f64",
            "u32",
            "invaliddigit",
            "invalidfloat",
            "aarray",
            "sequence",
        ] {
            assert!(!told.contains(leak), "{arguments:?}: {told}");
        }
    }
}

/// Where JSON is asked for it stands on stdout by itself, tables or not, whatever the command, and whatever goes wrong.
#[test]
fn json_stands_alone_on_standard_output() {
    let folder = tempfile::tempdir().expect("a folder");
    let small = [
        "--track",
        "stadium:300:80:12",
        "--sections",
        "60",
        "--objectives",
        "length",
    ];
    let raceline = [
        &[
            "raceline",
            "--out",
            "line",
            "--population",
            "8",
            "--iterations",
            "2",
        ],
        &small[..],
    ]
    .concat();
    for arguments in [
        &["surface", "--grid", "3", "--backend", "simd"][..],
        &raceline,
        &["raceline", "--dry-run"],
        &["report", "line"],
        &["devices"],
    ] {
        let output = lapswarm(folder.path(), &[arguments, &["--json"]].concat());
        assert!(output.status.success(), "{arguments:?}: {}", said(&output));
        let told: Result<serde_json::Value, _> = serde_json::from_slice(&output.stdout);
        assert!(
            told.is_ok_and(|told| told.is_object()),
            "{arguments:?}: {}",
            text(&output.stdout)
        );
    }
    for arguments in [
        &["surface", "--grid", "wide"][..],
        &["surface", "--nonsense"],
        &["raceline", "--memory-limit-mib", "much"],
        &["raceline", "--track", "nowhere.csv"],
        &["report", "nowhere"],
    ] {
        let output = lapswarm(folder.path(), &[arguments, &["--json"]].concat());
        assert_eq!(output.status.code(), Some(2), "{arguments:?}");
        let told: serde_json::Value = serde_json::from_slice(&output.stdout).expect("one object");
        assert!(told["error"]["message"].is_string(), "{arguments:?}: {told}");
    }
}

/// A line is driven on the circuit of the run that found it, by a car as wide as that run's, and on no other by itself.
#[test]
fn a_line_is_driven_on_its_own_circuit() {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::create_dir(folder.path().join("run")).expect("a folder");
    std::fs::write(folder.path().join("run/line_fastest.csv"), ring()).expect("a line");
    let planned = |more: &[&str]| {
        let asked = ["transient", "--line", "run/line_fastest.csv", "--dry-run"];
        lapswarm(folder.path(), &[&asked, more].concat())
    };
    let asked = planned(&[]);
    assert_eq!(asked.status.code(), Some(2), "{}", said(&asked));
    assert!(said(&asked).contains("--track"), "{}", said(&asked));
    let settings = RacelineSettings {
        track: AROUND_RING[1].to_owned(),
        ..RacelineSettings::default()
    };
    std::fs::write(folder.path().join("run/study.toml"), settings.to_toml()).expect("room");
    let found = planned(&[]);
    assert!(found.status.success(), "{}", said(&found));
    assert!(said(&found).contains(AROUND_RING[1]), "{}", said(&found));
    // A road of 2 m has a line for a car of 1.3 m. A line for a car that is declared 3 m wide has room for one of 2 m.
    for (track, car_width_m, [fits, wide]) in [
        ("circle:99:101", 1.3, ["1.4", "2"]),
        ("circle:98:101", 3.0, ["2.4", "3"]),
    ] {
        let of_run = RacelineSettings {
            track: track.to_owned(),
            car_width_m,
            ..settings.clone()
        };
        std::fs::write(folder.path().join("run/study.toml"), of_run.to_toml()).expect("room");
        for more in [&[][..], &["--car-width-m", fits]] {
            let driven = planned(more);
            assert!(driven.status.success(), "{car_width_m}: {}", said(&driven));
        }
        let refused = planned(&["--car-width-m", wide]);
        assert_eq!(refused.status.code(), Some(2), "{}", said(&refused));
        assert!(said(&refused).contains("thecar's"), "{}", said(&refused));
    }
    std::fs::write(folder.path().join("run/study.toml"), settings.to_toml()).expect("room");
    // Of two circuits neither is the one.
    std::fs::create_dir(folder.path().join("other")).expect("a folder");
    std::fs::write(folder.path().join("other/line.csv"), ring()).expect("a line");
    std::fs::write(
        folder.path().join("other/study.toml"),
        "track = \"circle:90:110\"\n",
    )
    .expect("room");
    let two = planned(&["--line", "other/line.csv"]);
    assert_eq!(two.status.code(), Some(2), "{}", said(&two));
    assert!(said(&two).contains("differentcircuits"), "{}", said(&two));
}

/// A swarm cannot live on a device that does not evaluate it, nor one whose moves the device does not make; a dry run says so too.
#[test]
fn a_swarm_on_no_device_is_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let asked = |more: &[&str]| {
        let flags = ["raceline", "--swarm", "device", "--dry-run"];
        lapswarm(folder.path(), &[&flags, more].concat())
    };
    for (more, reason) in [
        (
            &["--backend", "simd"][..],
            "the backend gpu, for a swarm on the device",
        ),
        (
            &["--backend", "gpu", "--objectives", "length"],
            "one objective and another algorithm than thesis",
        ),
    ] {
        let refused = asked(more);
        assert_eq!(refused.status.code(), Some(2), "{}", said(&refused));
        let words: String = reason.split_whitespace().collect();
        assert!(said(&refused).contains(&words), "{}", said(&refused));
    }
}
