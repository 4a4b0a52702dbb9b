//! The program as its users meet it: commands, flags, files, exit codes.

mod bench_optimisers;
mod bench_studies;
mod bench_swarm;
mod cli;
mod examples;
mod paths;
