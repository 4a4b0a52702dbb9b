//! An own optimiser: children scattered about the best so far, ever closer.
//!
//! Whatever implements `Optimiser` runs on every problem and every backend. This one is run on a sphere of ten variables. Ends
//! with an error if it does not converge.
//!
//! `cargo run --release --example own_optimiser`

use lapswarm::evaluate::{Evaluation, Problem, Worth};
use lapswarm::random::Random;
use lapswarm::swarm::problems::TestProblem;
use lapswarm::swarm::{Counters, Front, Optimiser, run};
use std::ops::ControlFlow;

const CHILDREN: usize = 20;

struct Scatter<'a> {
    problem: &'a Problem,
    best: Vec<f64>,
    worth: Worth,
    asked: Vec<f64>,
    counters: Counters,
}

impl Optimiser for Scatter<'_> {
    fn ask(&mut self) -> Vec<f64> {
        let spread = 0.3 * 0.95f64.powi(self.iteration() as i32);
        let width = self.best.len();
        let drawn = (0..CHILDREN * width).map(|i| {
            let (child, k) = (i / width, i % width);
            let v = &self.problem.variables[k];
            // A draw is a function of purpose, time, child and variable, so the same seed gives the same run.
            let normal = Random::new(1).normal(1, self.iteration() as u32, child as u32, k as u32);
            (self.best[k] + spread * (v.upper - v.lower) * normal).clamp(v.lower, v.upper)
        });
        self.asked = drawn.collect();
        self.asked.clone()
    }

    fn tell(&mut self, evaluation: &Evaluation) -> lapswarm::Result<()> {
        evaluation.check(CHILDREN, 1)?;
        for (child, worth) in self.asked.chunks_exact(self.best.len()).zip(evaluation.worths(1)) {
            if worth < self.worth {
                (self.best, self.worth) = (child.to_vec(), worth);
            }
        }
        self.counters.iteration += 1;
        self.counters.evaluations += CHILDREN as u64;
        Ok(())
    }

    fn counters(&self) -> Counters {
        self.counters
    }

    fn planned_iterations(&self) -> usize {
        300
    }

    fn best(&self) -> Vec<f64> {
        vec![self.worth.cost]
    }

    fn front(&self) -> Front {
        Front {
            candidates: vec![self.best.clone()],
            objectives: vec![self.best()],
            violation: self.worth.violation,
        }
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let sphere = TestProblem::single("sphere", 10).ok_or("no such problem")?;
    let problem = sphere.problem();
    let best = problem.variables.iter().map(|v| v.upper).collect();
    let mut scatter = Scatter {
        problem,
        best,
        worth: Worth::FAILED,
        asked: Vec::new(),
        counters: Counters::default(),
    };
    run(&mut scatter, &mut sphere.evaluator(), |_| {
        ControlFlow::Continue(())
    })?;
    println!(
        "{:.1e} from the optimum after {} evaluations",
        scatter.worth.cost,
        scatter.evaluations()
    );
    if scatter.worth.cost > 1e-6 {
        return Err("the optimiser did not converge".into());
    }
    Ok(())
}
