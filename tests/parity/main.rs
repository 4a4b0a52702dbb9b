//! The single-precision backends against each other and against the `f64` reference, in four layers: elementary
//! functions, one derivative and one Runge-Kutta step, whole laps, and how the work is cut; and the kernels' sources.
//!
//! What needs an adapter shows as ignored on a machine without one; `LAPSWARM_REQUIRE_GPU=1` makes that a failure.

#[macro_use]
#[path = "../common/mod.rs"]
mod common;
mod cutting;
mod device;
mod drive;
mod drivers;
mod elementary;
mod energy;
mod lap;
mod line;
mod registers;
mod shaders;
mod steady;
mod step;
mod swarm;
mod swarm_constrained;
mod swarm_lines;
mod swarm_resident;
mod tuning;

fn main() -> std::process::ExitCode {
    if common::radv::answer_parent(common::kernels::kernels) {
        return std::process::ExitCode::SUCCESS;
    }
    common::harness::main([
        cutting::tests(),
        drive::tests(),
        drivers::tests(),
        elementary::tests(),
        energy::tests(),
        lap::tests(),
        line::tests(),
        registers::tests(),
        shaders::tests(),
        steady::tests(),
        step::tests(),
        swarm::tests(),
        swarm_constrained::tests(),
        swarm_lines::tests(),
        swarm_resident::tests(),
        tuning::tests(),
    ])
}
