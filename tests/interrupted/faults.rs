//! Studies whose devices fail, no device at all, broken drivers, and studies that are too large.

use crate::common::kinds::alone;
use crate::common::runs::{finish, same_results, start, summary};
use lapswarm::evaluate::BackendChoice;
use lapswarm::evaluate::gpu::faults::{self, Fault};
use lapswarm::evaluate::line::LineObjective;
use lapswarm::files::run_folder::STATE;
use lapswarm::study::framework::state_file::StateFile;
use lapswarm::study::framework::{Progress, Study, Work};
use lapswarm::study::raceline::{
    self, LineAlgorithm, LinesState, Outcome, Raceline, RacelineSettings, Setup,
};
use lapswarm::study::sweep::{SweepSettings, sweep};
use lapswarm::swarm::checkpoint;
use std::ops::ControlFlow;
use std::path::Path;
use std::process::{Command, Output};
use std::sync::Arc;

tests! {
    faults_survive_a_resume_and_the_summary_names_what_ended_the_run: device,
    a_study_ends_without_the_adapter_that_it_began_with: device,
    without_a_driver_that_works_auto_works_and_gpu_says_why_not: everywhere,
    processes_that_share_a_device_all_finish_with_the_same_results: device full,
    a_sweep_tells_of_faults_and_dispatches_run_by_run: device,
    what_would_take_all_memory_is_refused_with_what_would_not: everywhere,
}

/// Looks for lines, from a state if one is given.
fn find_lines(
    settings: &RacelineSettings,
    setup: &Setup,
    (state, state_file): (Option<LinesState>, &mut StateFile),
    mut observe: impl FnMut(&Progress) -> ControlFlow<()>,
) -> lapswarm::Result<Outcome> {
    let work = Work::<Raceline> {
        settings,
        prepared: setup,
        state,
        state_file,
        observe: &mut observe,
        stop: Arc::default(),
    };
    Raceline::solve(work).map(|found| found.expect("lines"))
}

/// What went wrong with devices before a run was broken off is told at its end, and what ended it is what it names.
fn faults_survive_a_resume_and_the_summary_names_what_ended_the_run() {
    let _turn = alone();
    for algorithm in [LineAlgorithm::Windows, LineAlgorithm::Thesis] {
        let settings = RacelineSettings {
            track: "stadium:300:80:12".to_owned(),
            sections: Some(60),
            population: 16,
            iterations: 12,
            objectives: vec![LineObjective::Length],
            warm_start: Some(false),
            local_search: Some(false),
            backend: BackendChoice::Gpu,
            algorithm,
            ..RacelineSettings::default()
        };
        let setup = raceline::set_up(&settings).unwrap();
        let folder = tempfile::tempdir().unwrap();
        let mut seen = 0;
        // One submission fails, and the device is opened anew.
        let found = find_lines(
            &settings,
            &setup,
            (None, &mut StateFile::new(folder.path())),
            |p| {
                // Steps only: questions while a solver works go by the clock.
                if p.done == 0 {
                    return ControlFlow::Continue(());
                }
                seen += 1;
                if seen == 2 {
                    faults::inject(Fault::Lost, 0, 1);
                }
                if seen == 4 {
                    ControlFlow::Break(())
                } else {
                    ControlFlow::Continue(())
                }
            },
        )
        .unwrap();
        faults::end();
        assert!(found.record.interrupted);
        assert_eq!(
            found.record.device_faults.len(),
            1,
            "{:?}",
            found.record.device_faults
        );
        let state: LinesState = checkpoint::load(&folder.path().join(STATE)).unwrap();
        let mut state_file = StateFile::new(folder.path());
        let mut seen = 0;
        // The same again, and then it stays away.
        let ended = find_lines(&settings, &setup, (Some(state), &mut state_file), |p| {
            seen += usize::from(p.done > 0);
            if seen == 2 {
                faults::inject(Fault::Lost, 0, u64::MAX);
            }
            ControlFlow::Continue(())
        })
        .unwrap();
        faults::end();
        assert!(!ended.record.interrupted);
        assert_eq!(ended.record.device_faults[0], found.record.device_faults[0]);
        let last = ended.record.device_faults.last().unwrap();
        assert!(
            last.contains("simd takes over"),
            "{:?}",
            ended.record.device_faults
        );
        assert_eq!(ended.record.backend, "simd", "{algorithm:?}");
    }
}

/// An adapter that goes in the middle of a study stays away for all that the study opens after it: several levels of two
/// searches, and the front between them.
fn a_study_ends_without_the_adapter_that_it_began_with() {
    let _turn = alone();
    let settings = RacelineSettings {
        track: "stadium:300:80:12".to_owned(),
        sections: Some(60),
        population: 16,
        iterations: 12,
        objectives: vec![LineObjective::Length, LineObjective::Gamma],
        warm_start: Some(false),
        local_search: Some(false),
        backend: BackendChoice::Gpu,
        ..RacelineSettings::default()
    };
    let setup = raceline::set_up(&settings).unwrap();
    let mut gone = false;
    let ended = find_lines(&settings, &setup, (None, &mut StateFile::idle()), |p| {
        if p.done > 0 && !std::mem::replace(&mut gone, true) {
            faults::inject(Fault::Gone, 0, u64::MAX);
        }
        ControlFlow::Continue(())
    });
    faults::end();
    let ended = ended.expect("lanes take over, and for those that come after too");
    assert!(ended.front.is_some());
    assert_eq!(ended.record.backend, "simd");
    assert!(
        ended
            .record
            .device_faults
            .iter()
            .any(|f| f.contains("the adapter is gone")),
        "{:?}",
        ended.record.device_faults
    );
}

fn lapswarm(folder: &Path, driver: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_lapswarm"))
        .args(arguments)
        .current_dir(folder)
        .env("VK_DRIVER_FILES", driver)
        .env("VK_ICD_FILENAMES", driver)
        .output()
        .expect("the program starts")
}

/// The description of a driver that there is none of.
const NO_DRIVER: &str = "/nowhere/none.json";

const STUDY: &str =
    "section = \"Abbey\"\npolish = false\n[swarm]\nalgorithm = \"pso\"\npopulation = 8\niterations = 2\n";

/// No driver, one that is no library, one that is another library, one that is not there, and descriptions that are none.
fn without_a_driver_that_works_auto_works_and_gpu_says_why_not() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    std::fs::write(folder.join("study.toml"), STUDY).unwrap();
    std::fs::write(folder.join("text.so"), "not a library\n").unwrap();
    let own = folder.join("text.so");
    let described = |library: &str| {
        format!(
            "{{\"file_format_version\":\"1.0.0\",\"ICD\":{{\"library_path\":{library:?},\"api_version\":\"1.3.0\"}}}}"
        )
    };
    for (name, text) in [
        ("no_library", described(own.to_str().unwrap())),
        // Of which every machine has one; no driver's functions are in it.
        ("another_library", described("libm.so.6")),
        ("missing", described("/nowhere/libnone.so")),
        ("half", described("libm.so.6")[..40].to_owned()),
        ("no_json", "a driver\n".to_owned()),
        ("empty", String::new()),
    ] {
        std::fs::write(folder.join(format!("{name}.json")), text).unwrap();
    }
    let drivers = [
        "no_library",
        "another_library",
        "missing",
        "half",
        "no_json",
        "empty",
    ]
    .map(|name| folder.join(format!("{name}.json")));
    for driver in drivers.iter().map(|d| d.as_path()).chain([Path::new(NO_DRIVER)]) {
        let name = driver.file_stem().unwrap().to_str().unwrap();
        let run = |backend: &str| {
            let out = format!("{name}-{backend}");
            let study = ["identify", "study.toml", "--json", "--quiet"];
            let on = ["--backend", backend, "--out", &out];
            lapswarm(folder, driver, &[&study[..], &on].concat())
        };
        let auto = run("auto");
        let said = String::from_utf8_lossy(&auto.stderr).into_owned();
        assert!(
            auto.status.success() && !said.contains("panicked"),
            "{name}: {said}"
        );
        let summary: serde_json::Value = serde_json::from_slice(&auto.stdout).unwrap();
        assert_eq!(summary["backend"], "simd", "{name}");
        assert!(summary["failures"].is_object() && summary["device_faults"].is_array());
        let gpu = run("gpu");
        let said = String::from_utf8_lossy(&gpu.stderr).into_owned();
        assert_eq!(gpu.status.code(), Some(3), "{name}: {said}");
        assert!(
            said.contains("adapter was found") && said.contains("simd") && !said.contains("panicked"),
            "{name}: {said}"
        );
        assert!(!folder.join(format!("{name}-gpu")).exists(), "{name}");
        let listed = lapswarm(folder, driver, &["devices"]);
        assert!(matches!(listed.status.code(), Some(0 | 3)), "{name}: {listed:?}");
    }
}

/// Several processes at work on the device at once have the results of one that has it to itself.
fn processes_that_share_a_device_all_finish_with_the_same_results() {
    let _turn = alone();
    let root = tempfile::tempdir().unwrap();
    let root = root.path();
    let study = STUDY.replace("iterations = 2", "iterations = 30");
    std::fs::write(root.join("study.toml"), study).unwrap();
    let identify = ["identify", "study.toml", "--backend", "gpu"];
    let track = ["--track", "stadium:300:80:12", "--sections", "60"];
    let swarm = ["--population", "12", "--iterations", "12", "--backend", "gpu"];
    let raceline = [&["raceline"], &track[..], &swarm].concat();
    let begin = |study: &[&str], out: &str| start(root, &[study, &["--out", out]].concat());
    let wanted = [&identify[..], &raceline].map(|study| {
        let out = format!("{}-alone", study[0]);
        (study, summary(&finish(begin(study, &out))), out)
    });
    let together: Vec<_> = (0..4)
        .map(|k| {
            let (study, ..) = &wanted[k % 2];
            (k, begin(study, &format!("together-{k}")))
        })
        .collect();
    for (k, child) in together {
        let (study, wanted, out) = &wanted[k % 2];
        let found = summary(&finish(child));
        assert_eq!(found, *wanted, "{}", study[0]);
        assert_eq!(found["backend"], "gpu");
        assert_eq!(found["device_faults"], serde_json::json!([]));
        same_results(study[0], &root.join(format!("together-{k}")), &root.join(out));
    }
}

/// Identifications that go together in a sweep share their device, and what goes wrong with it; each says so, and how long its
/// dispatches took.
fn a_sweep_tells_of_faults_and_dispatches_run_by_run() {
    let _turn = alone();
    let text = "study = \"identify\"\n[base]\nsection = \"Abbey\"\npolish = false\nbackend = \"gpu\"\n[base.swarm]\n\
                algorithm = \"thesis\"\npopulation = 6\niterations = 3\n[grid]\nseed = [1, 2, 3]\n";
    let settings = SweepSettings::parse(Path::new("s.toml"), text).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let mut begun = 0;
    let summary = sweep(&settings, folder.path(), false, |_| {
        begun += 1;
        // Not before the device is open: told first before the runs, then before each call.
        if begun == 2 {
            faults::inject(Fault::Lost, 0, 1);
        }
        ControlFlow::Continue(())
    });
    faults::end();
    let summary = summary.unwrap();
    assert_eq!(summary.device_faults.len(), 1, "{:?}", summary.device_faults);
    let told = &summary.device_faults[0];
    assert!(
        told.starts_with("runs 00000, 00001, 00002: ") && told.contains("opened anew"),
        "{told}"
    );
    for (run, row) in summary.rows.iter().enumerate() {
        let path = folder.path().join(format!("studies/{run:05}.json"));
        let manifest: serde_json::Value = serde_json::from_slice(&std::fs::read(path).unwrap()).unwrap();
        assert_eq!(manifest["backend"], "gpu");
        assert_eq!(manifest["seed"], run + 1);
        assert_eq!(manifest["device_faults"], serde_json::json!(row.device_faults));
        assert!(
            manifest["longest_dispatch_ms"]
                .as_f64()
                .is_some_and(|ms| ms > 0.0),
            "{manifest}"
        );
    }
}

fn what_would_take_all_memory_is_refused_with_what_would_not() {
    let folder = tempfile::tempdir().unwrap();
    let huge = std::fs::File::create(folder.path().join("huge.csv")).unwrap();
    let sweep = "study = \"identify\"\n[grid]\nseed = [1, 2]\n\"swarm.population\" = [10, 100000]\n";
    std::fs::write(folder.path().join("sweep.toml"), sweep).unwrap();
    // Ten gigabytes that take no space: a file with a hole.
    huge.set_len(10 << 30).unwrap();
    for arguments in [
        &["identify", "--population", "1000000000"][..],
        &["identify", "--iterations", "100000000000"],
        &["raceline", "--population", "9999999"],
        &["raceline", "--sections", "1000000"],
        &["raceline", "--sections", "1000000000"],
        &["identify", "--population", "100000", "--memory-limit-mib", "16"],
        &["hybrid", "--population", "9999999"],
        &["hybrid", "--iterations", "1000000", "--population", "100000"],
        &["sensitivity", "--samples", "65536", "--memory-limit-mib", "64"],
        &["surface", "--grid", "2000", "--memory-limit-mib", "64"],
        &["sweep", "sweep.toml", "--memory-limit-mib", "16"],
        &["identify", "--log", "huge.csv"],
        &["raceline", "--track", "huge.csv"],
        &["raceline", "--envelope", "huge.csv"],
        &["check", "huge.csv"],
    ] {
        let refused = lapswarm(folder.path(), Path::new(NO_DRIVER), arguments);
        let said = String::from_utf8_lossy(&refused.stderr).into_owned();
        assert_eq!(refused.status.code(), Some(2), "{arguments:?}: {said}");
        assert!(said.contains("expected"), "{arguments:?}: {said}");
    }
    assert!(
        !folder.path().join("runs").exists(),
        "a refused study leaves no folder"
    );
}
