//! Every example in `examples/` runs.

use std::path::Path;
use std::process::Command;

#[test]
#[ignore = "full tier: builds and runs every example"]
fn every_example_runs() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let folder = root.join("examples").read_dir().expect("examples");
    let names = folder.flatten().filter_map(|entry| {
        let path = entry.path();
        let is_example = path.extension().is_some_and(|e| e == "rs") || path.join("main.rs").is_file();
        let name = path.file_stem()?.to_str()?.to_owned();
        is_example.then_some(name)
    });
    let names: Vec<String> = names.collect();
    assert!(!names.is_empty());
    for name in names {
        // What it writes goes with the folder.
        let place = tempfile::tempdir().expect("a temporary folder");
        let mut cargo = Command::new(env!("CARGO"));
        cargo.args([
            "run",
            "--quiet",
            "--locked",
            "--example",
            &name,
            "--manifest-path",
        ]);
        cargo.arg(root.join("Cargo.toml")).current_dir(place.path());
        if !cfg!(debug_assertions) {
            cargo.arg("--release");
        }
        let run = cargo.output().expect("cargo runs");
        let said = String::from_utf8_lossy(&run.stderr);
        assert!(run.status.success(), "{name}: {said}");
    }
}
