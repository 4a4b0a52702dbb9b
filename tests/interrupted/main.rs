//! Runs that are killed, told to stop, short of disk or memory, or whose devices fail: nothing is lost.
//!
//! Runs are held at points that the program passes (`lapswarm::hold`) before they are signalled: no test here depends on how
//! fast a machine is.

#[macro_use]
#[path = "../common/mod.rs"]
mod common;
mod devices;
mod drive;
mod faults;
#[cfg(unix)]
mod kills;
mod resident;
#[cfg(unix)]
mod stops;

fn main() -> std::process::ExitCode {
    let mut modules = vec![
        devices::tests(),
        drive::tests(),
        faults::tests(),
        resident::tests(),
    ];
    #[cfg(unix)]
    modules.extend([kills::tests(), stops::tests()]);
    common::harness::main(modules)
}
