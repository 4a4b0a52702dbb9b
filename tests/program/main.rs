//! The program as its users meet it: commands, flags, files, exit codes.

mod bench_optimisers;
mod bench_studies;
mod bench_swarm;
mod bench_whole;
mod cli;
mod examples;
mod messages;
mod paths;
mod pictures;
mod tutorials;

/// A bench of a kind, run to its end.
fn bench(kind: &str, arguments: &[&str]) -> std::process::Output {
    std::process::Command::new(env!("CARGO_BIN_EXE_lapswarm"))
        .args(["bench", kind])
        .args(arguments)
        .output()
        .unwrap()
}
