//! What `bench tune` may choose, and what becomes of it.

use crate::common::kinds::{Problems, alone, bits};
use lapswarm::evaluate::gpu::{GpuContext, Tuning};
use std::path::{Path, PathBuf};
use std::process::Command;

tests! {
    no_tuning_changes_a_bit: device,
    what_is_tuned_is_remembered_for_the_adapter_and_damaged_files_are_as_good_as_none: device,
}

/// Workgroups and lanes of a dispatch, whatever `bench tune` may choose.
fn no_tuning_changes_a_bit() {
    let _turn = alone();
    let usual = GpuContext::shared(None).expect("it opens");
    let problems = Problems::new();
    let kind = usual.summary().kind;
    // Each workgroup, with the usual lanes or more by turns.
    let tried: Vec<Tuning> = Tuning::all(kind).into_iter().step_by(2).collect();
    assert!(tried.iter().any(|t| t.workgroup == 256));
    for problem in problems.kinds() {
        let population = problem.population(300, 1);
        let on = |context| {
            let mut evaluator = (problem.cut)(context).expect("it opens");
            bits(&evaluator.evaluate(&population).expect("it runs"))
        };
        let expected = on(usual.clone());
        for &tuning in &tried {
            let tuned = GpuContext::with_tuning(None, tuning).expect("it opens");
            assert_eq!(tuned.tuning(), tuning);
            assert!(on(tuned) == expected, "{}, {tuning:?}", problem.name);
        }
    }
}

/// What is kept of the adapter.
fn kept(cache: &Path, what: &str) -> Option<PathBuf> {
    let files = std::fs::read_dir(cache.join("lapswarm")).ok()?;
    let mut paths = files.map(|file| file.unwrap().path());
    paths.find(|path| path.file_name().unwrap().to_str().unwrap().starts_with(what))
}

fn what_is_tuned_is_remembered_for_the_adapter_and_damaged_files_are_as_good_as_none() {
    let _turn = alone();
    let folder = tempfile::tempdir().unwrap();
    let run = |arguments: &[&str]| -> serde_json::Value {
        let output = Command::new(env!("CARGO_BIN_EXE_lapswarm"))
            .args(arguments)
            .arg("--json")
            .current_dir(folder.path())
            // Where caches are on each system.
            .envs(["XDG_CACHE_HOME", "HOME", "LOCALAPPDATA"].map(|name| (name, folder.path())))
            .output()
            .unwrap();
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.success(), "{said}");
        serde_json::from_slice(&output.stdout).unwrap()
    };
    let table = run(&["bench", "tune", "--problems", "line", "--population", "64"]);
    let rows = table["rows"].as_array().unwrap();
    assert_eq!(rows.len(), 8);
    assert!(rows.iter().all(|row| row["same_bits"] == true), "{table}");
    let file = PathBuf::from(table["best"]["file"].as_str().unwrap());
    let text = std::fs::read_to_string(&file).unwrap();
    assert!(
        text.contains(&format!("workgroup = {}", table["best"]["workgroup"])),
        "{text}"
    );

    let bench = [
        "bench",
        "--problems",
        "line",
        "--backend",
        "gpu",
        "--populations",
        "64",
    ];
    run(&bench);
    // Lavapipe has pipeline caches; where there are none there is nothing to damage.
    let files = ["tuning", "kernels"].map(|what| kept(file.parent().unwrap().parent().unwrap(), what));
    for path in files.into_iter().flatten() {
        let whole = std::fs::read(&path).unwrap();
        for damaged in [&whole[..whole.len() / 2], b"?", &[]] {
            std::fs::write(&path, damaged).unwrap();
            run(&bench);
        }
    }
}
