//! An own objective beside one that exists: how close a line comes to the edges of the road.
//!
//! A wrapper evaluates the length on any backend and adds its own column. A swarm then finds the front between short lines
//! and central ones. Ends with an error if the ends of the front are not where geometry puts them.
//!
//! `cargo run --release --example own_objective`

use lapswarm::evaluate::line::{LineObjective, LineProblem, open_line_evaluator};
use lapswarm::evaluate::{BackendChoice, BackendInfo, Evaluation, Evaluator, Objective, Problem};
use lapswarm::line::Parametrisation;
use lapswarm::swarm::{Mopso, MopsoSettings, Optimiser, run};
use lapswarm::track::Track;
use std::ops::ControlFlow;

/// A line's length, and the greatest share of half the road that it strays from the middle.
struct WithEdges<'a> {
    line: &'a LineProblem,
    length: Box<dyn Evaluator + 'a>,
    problem: Problem,
}

impl Evaluator for WithEdges<'_> {
    fn problem(&self) -> &Problem {
        &self.problem
    }

    fn backend(&self) -> BackendInfo {
        self.length.backend()
    }

    fn evaluate(&mut self, population: &[f64]) -> lapswarm::Result<Evaluation> {
        let mut evaluation = self.length.evaluate(population)?;
        let candidates = population.chunks_exact(self.problem.variables.len());
        let rows = evaluation.objectives.iter().zip(candidates);
        let with_edges = rows.flat_map(|(length_m, candidate)| {
            let alpha = self.line.alpha(candidate).into_iter();
            [
                *length_m,
                alpha.fold(0.0, |most, alpha| (2.0 * alpha - 1.0).abs().max(most)),
            ]
        });
        evaluation.objectives = with_edges.collect();
        Ok(evaluation)
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let sections = Track::load("ellipse:400:250:12")?.cross_sections(120, true)?;
    let way = Parametrisation::control_points(8);
    let line = LineProblem::new(sections, way, &[LineObjective::Length], None, 0.0)?;
    let length = open_line_evaluator(&line, BackendChoice::Auto, None)?;
    let mut problem = line.problem.clone();
    problem.objectives.push(Objective::new("strays", "-"));

    let mut swarm = Mopso::new(&problem, MopsoSettings::default())?;
    let line = &line;
    let mut evaluator = WithEdges {
        line,
        length,
        problem,
    };
    run(&mut swarm, &mut evaluator, |_| ControlFlow::Continue(()))?;

    let mut front = swarm.front().objectives;
    front.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let (shortest, central) = (&front[0], &front[front.len() - 1]);
    println!("{} lines on {}", front.len(), evaluator.backend().device);
    println!(
        "shortest {:.2} m, {:.0} % of the half road",
        shortest[0],
        100.0 * shortest[1]
    );
    println!(
        "central  {:.2} m, {:.0} % of the half road",
        central[0],
        100.0 * central[1]
    );
    // Six metres from the middle to the right edge, all the way round a right-hand circuit, are worth 2 pi times 6 m.
    let gain_m = central[0] - shortest[0];
    if !(37.0..38.4).contains(&gain_m) || shortest[1] < 0.98 || central[1] > 0.02 {
        return Err(format!("the ends are {gain_m:.2} m apart, not about 37.7 m").into());
    }
    Ok(())
}
