//! Every example in `examples/` runs. `cargo test` has built them, unless it is asked for one target alone.

use std::path::Path;
use std::process::Command;

#[test]
#[ignore = "full tier: runs every example"]
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
    // Not by `cargo run`, which would build the library anew where the tests were built together with another package.
    let program = std::env::current_exe().expect("a program");
    let built = program
        .parent()
        .and_then(Path::parent)
        .expect("a folder")
        .join("examples");
    for name in names {
        // What it writes goes with the folder.
        let place = tempfile::tempdir().expect("a temporary folder");
        let example = built.join(&name).with_extension(std::env::consts::EXE_EXTENSION);
        let run = Command::new(&example).current_dir(place.path()).output();
        let run = run.unwrap_or_else(|error| {
            panic!(
                "{}: {error}; `cargo build --examples` builds it",
                example.display()
            );
        });
        let said = String::from_utf8_lossy(&run.stderr);
        assert!(run.status.success(), "{name}: {said}");
    }
}
