//! Names in files are names, wherever they seem to lead: a study writes into its run folder and nowhere else.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

fn lapswarm(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_lapswarm"))
        .args(arguments)
        .current_dir(folder)
        .output()
        .expect("the program starts")
}

fn all(folder: &Path, found: &mut BTreeSet<PathBuf>) {
    for entry in folder.read_dir().expect("a folder").flatten() {
        let path = entry.path();
        if path.is_dir() {
            all(&path, found);
        }
        found.insert(path);
    }
}

/// What is in a folder and those in it, but for what is in `out`.
fn beside(folder: &Path, out: &Path) -> BTreeSet<PathBuf> {
    let mut found = BTreeSet::new();
    all(folder, &mut found);
    found.into_iter().filter(|path| !path.starts_with(out)).collect()
}

/// A circuit whose name and sections lead elsewhere.
fn circuit(folder: &Path, elsewhere: &str) {
    let text = format!(
        "name = \"{elsewhere}\"\ncurvature_table = \"round.csv\"\nlength_m = 628.3185307179587\nwidth_m = 12\n\
         [[sections]]\nname = \"../../evil\"\nstart_m = 50\nend_m = 120\n\
         [[sections]]\nname = \"{elsewhere}\"\nstart_m = 200\nend_m = 300\n"
    );
    std::fs::write(folder.join("round.toml"), text).expect("a circuit");
    let table = "station_m,curvature_1pm\n0,0.01\n200,0.01\n400,0.01\n";
    std::fs::write(folder.join("round.csv"), table).expect("a table");
}

/// The bundled lap with a channel more, whose name leads elsewhere.
fn log(folder: &Path, elsewhere: &str) {
    let bundled = concat!(env!("CARGO_MANIFEST_DIR"), "/data/laps/gt_silverstone.csv");
    let text = std::fs::read_to_string(bundled).expect("a lap");
    let lines = text.lines().filter(|line| !line.starts_with('#'));
    let text: String = lines
        .enumerate()
        .map(|(i, line)| match i {
            0 => format!("{line},../../evil,{elsewhere}\n"),
            _ => format!("{line},1,2\n"),
        })
        .collect();
    std::fs::write(folder.join("lap.csv"), text).expect("a log");
}

/// A bundled car by another name.
fn car(folder: &Path, bundled: &str, name: &str) {
    let cars = concat!(env!("CARGO_MANIFEST_DIR"), "/data/cars");
    let text = std::fs::read_to_string(Path::new(cars).join(bundled)).expect("a car");
    let text: String = text
        .lines()
        .map(|line| match line.starts_with("name = ") {
            true => format!("name = \"{name}\"\n"),
            false => format!("{line}\n"),
        })
        .collect();
    assert!(text.contains(name));
    std::fs::write(folder.join(bundled), text).expect("a car");
    for tyre in Path::new(cars).read_dir().expect("a folder").flatten() {
        if tyre.path().extension().is_some_and(|e| e == "tir") {
            std::fs::copy(tyre.path(), folder.join(tyre.file_name())).expect("a tyre");
        }
    }
}

#[test]
fn names_that_lead_elsewhere_stay_in_the_run_folder() {
    let root = tempfile::tempdir().expect("a temporary folder");
    let folder = root.path().join("a/b/c");
    std::fs::create_dir_all(&folder).expect("folders");
    let elsewhere = root.path().join("evil");
    let elsewhere = elsewhere.to_string_lossy().replace('\\', "/");
    circuit(&folder, &elsewhere);
    log(&folder, &elsewhere);
    car(&folder, "gt.toml", "../../evil");
    car(&folder, "gt_hybrid.toml", &elsewhere);
    let write = |name: &str, text: String| std::fs::write(folder.join(name), text).expect("a study");
    write(
        "identify.toml",
        "car = \"gt.toml\"\nlog = \"lap.csv\"\nbackend = \"simd\"\npolish = false\nwindow_s = 3\n[free]\nK = [3e4, 3e5]\n\
         [swarm]\npopulation = 8\niterations = 3\n"
            .to_owned(),
    );
    write(
        "raceline.toml",
        "car = \"gt.toml\"\ntrack = \"round.toml\"\nsections = 80\nbackend = \"simd\"\nobjectives = [\"length\", \"gamma\"]\n"
            .to_owned(),
    );
    write(
        "hybrid.toml",
        format!(
            "car = \"gt_hybrid.toml\"\ntrack = \"round.toml\"\nsections = 80\nbackend = \"simd\"\noptimise = false\n\
             [scenarios.\"../../evil\"]\nsteer_rad = 0.2\n[scenarios.\"{elsewhere}\"]\nsteer_rad = 0.3\n"
        ),
    );
    for (study, names) in [
        ("identify", &["car.toml"][..]),
        ("raceline", &["section_______evil.svg"]),
        ("hybrid", &["lap_______evil.csv", "energy_______evil.svg"]),
    ] {
        let out = folder.join(study);
        let before = beside(root.path(), &out);
        let ended = lapswarm(
            &folder,
            &[study, &format!("{study}.toml"), "--out", study, "--quiet"],
        );
        let said = String::from_utf8_lossy(&ended.stderr);
        assert!(ended.status.success(), "{study}: {said}");
        assert_eq!(beside(root.path(), &out), before, "{study}");
        for name in names {
            assert!(out.join(name).is_file(), "{study}: {name}");
        }
    }
}

#[test]
fn names_too_long_for_files_are_refused_before_anything_is_done() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let long = "n".repeat(300);
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).expect("a file");
    write("scenario.toml", &format!("[scenarios.{long}]\nsoc = 0.5\n"));
    write("track.toml", "track = \"round.toml\"\n");
    circuit(folder.path(), &long);
    write("car.toml", "car = \"gt.toml\"\n");
    car(folder.path(), "gt.toml", &long);
    for arguments in [
        ["hybrid", "scenario.toml"],
        ["raceline", "track.toml"],
        ["raceline", "car.toml"],
        ["identify", "car.toml"],
    ] {
        let refused = lapswarm(folder.path(), &arguments);
        let said = String::from_utf8_lossy(&refused.stderr);
        assert_eq!(refused.status.code(), Some(2), "{arguments:?}: {said}");
        // The message is wrapped to the terminal.
        let said: String = said.split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(
            said.contains("name") && said.contains("120"),
            "{arguments:?}: {said}"
        );
    }
    assert!(!folder.path().join("runs").exists());
}

/// Studies that name the car beside them find it from wherever they are begun, and named with a folder or without.
#[test]
fn files_are_relative_to_the_file_that_names_them() {
    let root = tempfile::tempdir().expect("a temporary folder");
    let folder = root.path().join("own");
    std::fs::create_dir(&folder).expect("a folder");
    for bundled in ["gt.toml", "gt_hybrid.toml"] {
        car(&folder, bundled, "one of its own");
    }
    let write = |name: &str, text: &str| std::fs::write(folder.join(name), text).expect("a study");
    write("ring.csv", &crate::cli::ring());
    let studies = [
        "identify",
        "envelope",
        "raceline",
        "transient",
        "sensitivity",
        "surface",
        "hybrid",
        "run",
    ];
    for study in studies {
        let text = match study {
            "run" => "[identify]\ncar = \"gt.toml\"\n",
            "transient" => "car = \"gt.toml\"\nline = [\"ring.csv\"]\ntrack = \"circle:95:105\"\n",
            "hybrid" => "car = \"gt_hybrid.toml\"\n",
            _ => "car = \"gt.toml\"\n",
        };
        write(&format!("{study}.toml"), text);
    }
    let swept = "track = \"stadium:200:60:12\"\nsections = 40\nalgorithm = \"thesis\"\nwarm_start = false\n\
                 local_search = false\nbackend = \"simd\"\nobjectives = [\"gamma\"]\npopulation = 8\niterations = 2\n";
    write(
        "s.toml",
        &format!("study = \"raceline\"\n[base]\n{swept}[grid]\ncar = [\"gt.toml\", \"gt_hybrid.toml\"]\n"),
    );
    write(
        "nested.toml",
        "study = \"run\"\n[base]\nrounds = 1\n[base.identify]\ncar = \"gt.toml\"\n[grid]\nmargin_m = [0.5]\n",
    );
    let goes = |within: &Path, arguments: &[&str]| {
        let ended = lapswarm(within, arguments);
        let said = String::from_utf8_lossy(&ended.stderr);
        assert!(
            ended.status.success(),
            "{arguments:?} in {}: {said}",
            within.display()
        );
    };
    for (within, at) in [(&*folder, ""), (root.path(), "own/")] {
        for study in studies {
            let file = format!("{at}{study}.toml");
            goes(within, &[study, &file, "--dry-run", "--quiet"]);
        }
        goes(
            within,
            &["sweep", &format!("{at}nested.toml"), "--dry-run", "--quiet"],
        );
        let out = root.path().join(format!("out{}", at.len()));
        let out = out.to_string_lossy();
        goes(
            within,
            &["sweep", &format!("{at}s.toml"), "--out", &out, "--quiet"],
        );
        // What a sweep has written runs by itself.
        let study = format!("{out}/studies/00001.toml");
        goes(root.path(), &["raceline", &study, "--dry-run", "--quiet"]);
    }
}
