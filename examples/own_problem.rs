//! An own problem with a constraint: the fuel cell of least sheet metal that holds 60 litres.
//!
//! A closure scores one candidate at a time, and an optimiser is asked and told until its budget is spent. The answer is
//! known: the best cylinder is as high as it is wide. Ends with an error if the swarm does not find it.
//!
//! `cargo run --release --example own_problem`

use lapswarm::evaluate::point::{CallCost, Constraint, PointEvaluator};
use lapswarm::evaluate::{Evaluator, Objective, Problem, Variable};
use lapswarm::swarm::{HybridSettings, HybridSwarm, Optimiser};
use std::f64::consts::PI;

/// What the cell must hold (m^3).
const VOLUME_M3: f64 = 0.060;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let problem = Problem {
        variables: vec![
            Variable::new("radius", "m", 0.05, 0.50),
            Variable::new("height", "m", 0.10, 1.00),
        ],
        objectives: vec![Objective::new("sheet metal", "m^2")],
    };
    // One constraint `G <= 0`, written behind the objective: the volume that is missing, as a share of what is wanted.
    let constraints = vec![Constraint::at_most_zero()];
    let mut evaluator = PointEvaluator::constrained(problem.clone(), constraints, CallCost::Cheap, |x, f| {
        let (radius, height) = (x[0], x[1]);
        f[0] = 2.0 * PI * radius * (radius + height);
        f[1] = 1.0 - PI * radius * radius * height / VOLUME_M3;
    });
    let settings = HybridSettings {
        population: 20,
        iterations: 300,
        ..HybridSettings::default()
    };
    let mut swarm = HybridSwarm::new(&problem, settings)?;
    while !swarm.done() {
        let candidates = swarm.ask();
        let evaluation = evaluator.evaluate(&candidates)?;
        swarm.tell(&evaluation)?;
    }

    let (best, worth) = swarm.best_candidate();
    let expected_m = (VOLUME_M3 / (2.0 * PI)).cbrt();
    println!(
        "radius {:.4} m, height {:.4} m: {:.4} m^2 of sheet",
        best[0], best[1], worth.cost
    );
    println!(
        "known optimum: radius {expected_m:.4} m, height {:.4} m",
        2.0 * expected_m
    );
    if (best[0] / expected_m - 1.0).abs() > 1e-3 || (best[1] / best[0] - 2.0).abs() > 1e-2 {
        return Err("the swarm missed the optimum".into());
    }
    Ok(())
}
