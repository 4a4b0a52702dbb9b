//! Several devices, and a second driver. Each is the program's own matter: the Vulkan loader reads its drivers once in a process.

use crate::common::{harness::swiftshader, radv};
use serde_json::Value;
use std::path::Path;
use std::process::{Command, Output};

tests! {
    all_adapters_together_give_the_bytes_of_one: two_software_devices,
    a_second_software_driver_keeps_parity: swiftshader full,
}

/// The program on these drivers.
fn with_drivers(drivers: &[&Path], arguments: &[&str]) -> Output {
    let drivers = std::env::join_paths(drivers).expect("paths without colons");
    let output = Command::new(env!("CARGO_BIN_EXE_lapswarm"))
        .args(arguments)
        .env("VK_DRIVER_FILES", &drivers)
        .env("VK_ICD_FILENAMES", &drivers)
        .output()
        .expect("the program starts");
    let told = String::from_utf8_lossy(&output.stderr).into_owned();
    // A small search need not come to a line that the car can drive.
    assert!(matches!(output.status.code(), Some(0 | 1)), "{told}");
    output
}

fn all_adapters_together_give_the_bytes_of_one() {
    let folder = tempfile::tempdir().expect("a folder");
    let driver = radv::software_driver().expect("it was there");
    let second = folder.path().join("second.json");
    std::fs::copy(&driver, &second).expect("a copy");
    let lines = |adapter: &str| {
        let out = folder.path().join(adapter.trim_start_matches('#'));
        let out = out.to_str().expect("a path");
        // Shares that are not alike: 25 candidates on two devices.
        let line = "raceline --track stadium:400:120:14 --sections 60 --objectives length,lap_time --population 25 --iterations 6 \
                    --json --quiet --backend gpu --adapter";
        let arguments: Vec<&str> = line.split_whitespace().chain([adapter, "--out", out]).collect();
        let output = with_drivers(&[&driver, &second], &arguments);
        let summary: Value = serde_json::from_slice(&output.stdout).expect("a summary");
        let read = |name: &str| std::fs::read(Path::new(out).join(name)).expect(name);
        (
            summary["adapter"].clone(),
            read("front.csv"),
            read("line_fastest.csv"),
        )
    };
    let (alone, front, fastest) = lines("#2");
    let (together, front_together, fastest_together) = lines("all");
    let name = alone.as_str().expect("a name");
    assert_eq!(together, format!("2 x {name}"));
    assert!(front == front_together && fastest == fastest_together);
    // A swarm that lives on a device has one.
    let refused = Command::new(env!("CARGO_BIN_EXE_lapswarm"))
        .args(
            "raceline --track stadium:400:120:14 --swarm device --backend gpu --adapter all --dry-run"
                .split(' '),
        )
        .output()
        .expect("the program starts");
    let told = String::from_utf8_lossy(&refused.stderr);
    assert_eq!(refused.status.code(), Some(2), "{told}");
    assert!(told.contains("one adapter"), "{told}");
}

fn a_second_software_driver_keeps_parity() {
    let driver = swiftshader().expect("it was there");
    let output = with_drivers(&[&driver], &["parity", "--backend", "gpu", "--json", "--quiet"]);
    let found: Value = serde_json::from_slice(&output.stdout).expect("findings");
    let adapter = found["adapter"].as_str().unwrap_or_default();
    assert!(adapter.contains("SwiftShader"), "{adapter}");
    assert_eq!(output.status.code(), Some(0), "{found}");
}
