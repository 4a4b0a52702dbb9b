//! Tests that need what not every machine has: a survey, others' recordings, a browser. They show as ignored where it is missing.
//! Tests of the same things that need nothing stand beside them.
//!
//! `LAPSWARM_OUTSIDE` names a folder with the data of others; each ignored test says which file it misses and whose it is.

#[macro_use]
#[path = "../common/mod.rs"]
mod common;
mod calder;
mod multibody;
mod optimum;
mod raceline;
mod report;
#[path = "../physics/support.rs"]
mod support;
mod survey;
mod tyre_table;

fn main() -> std::process::ExitCode {
    common::harness::main([
        calder::tests(),
        multibody::tests(),
        optimum::tests(),
        raceline::tests(),
        report::tests(),
        survey::tests(),
        tyre_table::tests(),
    ])
}
