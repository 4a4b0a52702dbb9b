//! The command line as scripts see it: files to start from, checks, exit codes.

use std::path::Path;
use std::process::{Command, Output};

fn lapswarm(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_lapswarm"))
        .args(arguments)
        .current_dir(folder)
        .output()
        .expect("the program starts")
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

#[test]
fn files_to_start_from_are_sound_and_never_overwrite() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    for (what, said) in [
        ("identify", "a study of identify"),
        ("raceline", "a study of raceline"),
        ("run", "a study of run"),
        ("car", "a car"),
    ] {
        let made = lapswarm(folder.path(), &["init", what]);
        assert!(made.status.success(), "{what}: {}", text(&made.stderr));
        let file = format!("{what}.toml");
        let checked = lapswarm(folder.path(), &["check", &file]);
        assert!(checked.status.success(), "{what}: {}", text(&checked.stderr));
        assert!(text(&checked.stdout).contains(said), "{}", text(&checked.stdout));
        let before = std::fs::read(folder.path().join(&file)).expect("the file");
        let again = lapswarm(folder.path(), &["init", what]);
        assert_eq!(again.status.code(), Some(2), "{what} again");
        assert_eq!(
            std::fs::read(folder.path().join(&file)).expect("the file"),
            before
        );
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

#[test]
fn what_is_wrong_is_named_with_its_place_and_code_two() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    for (file, contents, place) in [
        ("study.toml", "sections = 3\n", "sections"),
        ("study.toml", "no_such_key = 3\n", "no_such_key"),
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

#[test]
fn completions_name_every_command() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let printed = lapswarm(folder.path(), &["completions", "bash"]);
    let script = text(&printed.stdout);
    for command in [
        "identify",
        "raceline",
        "run",
        "sensitivity",
        "surface",
        "parity",
        "bench",
        "transient",
        "check",
    ] {
        assert!(script.contains(command), "{command}");
    }
}
