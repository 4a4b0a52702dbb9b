//! What the compiler of a real graphics processor makes of every kernel: registers, spills, waves and cycles, by Mesa's driver for
//! AMD, which needs no processor for that.
//!
//! `cargo bench --bench kernels` compiles all kernels, `cargo bench --bench kernels -- "replay: magic" line` those whose names have
//! one of these.

#[path = "../tests/common/mod.rs"]
mod common;

use common::kernels::kernels;
use common::radv;

/// The columns: what the driver calls them, and what the table does.
const COLUMNS: [(&str, &str); 9] = [
    ("VGPRs", "VGPRs"),
    ("SGPRs", "SGPRs"),
    ("Spilled VGPRs", "spilled VGPRs"),
    ("Spilled SGPRs", "spilled SGPRs"),
    ("Subgroups per SIMD", "waves per SIMD"),
    ("Instructions", "instructions"),
    ("Code size", "code, bytes"),
    ("Latency", "latency, cycles"),
    ("Inverse Throughput", "inverse throughput, cycles"),
];

fn main() {
    if radv::answer_parent(kernels) {
        return;
    }
    if let Err(reason) = radv::driver() {
        eprintln!("IGNORED: {reason}");
        return;
    }
    let arguments: Vec<String> = std::env::args()
        .skip(1)
        .filter(|a| !a.starts_with("--"))
        .collect();
    let wanted: Vec<&str> = arguments.iter().map(String::as_str).collect();
    for family in radv::FAMILIES {
        match radv::ask(family, &wanted) {
            Ok(answer) => print_table(family, &answer),
            Err(reason) => eprintln!("IGNORED: {reason}"),
        }
    }
}

fn print_table(family: &str, answer: &radv::Answer) {
    println!("## {family}, Mesa {}.{}\n", answer.mesa.0, answer.mesa.1);
    let heads: Vec<&str> = COLUMNS.iter().map(|(_, head)| *head).collect();
    println!("| kernel | {} |", heads.join(" | "));
    println!("|{}", "---|".repeat(1 + COLUMNS.len()));
    for kernel in &answer.kernels {
        let figures: Vec<String> = COLUMNS
            .iter()
            .map(|(name, _)| kernel.figure(name).to_string())
            .collect();
        println!("| {} | {} |", kernel.name(), figures.join(" | "));
    }
    println!();
}
