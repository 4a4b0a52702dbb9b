//! lapswarm evaluates whole swarms of race cars at once.
//!
//! A [`evaluate::Problem`] names bounded decision variables and objectives, an [`evaluate::Evaluator`] scores whole
//! populations of candidates of it, and a [`swarm::Optimiser`] is asked for candidates and told what they are worth.
//! Three backends evaluate the same problem and can replace one another: `f64` on the processor (the reference), `f32`
//! lanes on the processor, and WGSL kernels on any graphics processor.
//!
//! | | |
//! |---|---|
//! | [`vehicle`] | the car: tyres, body, loads, aero; written once over a [`scalar::Real`], with a WGSL twin in `shaders/` |
//! | [`track`], [`telemetry`] | circuits and logs, as read from files |
//! | [`simulate`] | a driver who takes a car round a circuit and logs it |
//! | [`mod@line`], [`optimum`] | racing lines, the quasi-steady-state lap on them, and their reference optima |
//! | [`evaluate`], [`swarm`] | problems and their evaluators; optimisers |
//! | [`study`], [`report`] | what users run, and the pictures and tables that it writes |
//!
//! Comments cite two sources by short names. *The thesis* is *Integrated Optimisation for Dynamic Modelling, Path Planning and
//! Energy Management in Hybrid Race Vehicles* (Lancaster University, 2020); figures in round brackets are the numbers of its
//! equations. *The book* is the documentation in `book/` of the repository.
//!
//! One call minimises a function of your own, see [`minimise`], [`minimise_several`] and [`minimise_batch`]:
//!
//! ```
//! let found = lapswarm::minimise(&[(-2.0, 3.0); 2], |x| (x[0] - 1.0).powi(2) + x[1] * x[1]).evaluations(8_000).run()?;
//! assert!(found.best().is_some_and(|(x, cost)| cost < 1e-12 && (x[0] - 1.0).abs() < 1e-6));
//! # Ok::<(), lapswarm::Error>(())
//! ```
//!
//! A problem of your own, asked and told by hand: the front between being near zero and being near one.
//!
//! ```
//! use lapswarm::evaluate::point::{CallCost, PointEvaluator};
//! use lapswarm::evaluate::{Evaluator, Objective, Problem, Variable};
//! use lapswarm::swarm::{Mopso, MopsoSettings, Optimiser};
//!
//! let problem = Problem {
//!     variables: vec![Variable::new("x", "m", -2.0, 3.0), Variable::new("y", "m", -2.0, 3.0)],
//!     objectives: vec![Objective::new("to zero", "m^2"), Objective::new("to one", "m^2")],
//! };
//! let mut evaluator = PointEvaluator::new(problem.clone(), CallCost::Cheap, |x, f| {
//!     f[0] = x.iter().map(|x| x * x).sum();
//!     f[1] = x.iter().map(|x| (x - 1.0) * (x - 1.0)).sum();
//! });
//! let settings = MopsoSettings { archive: 20, ..MopsoSettings::default() }.with_size(40, 500);
//! let mut swarm = Mopso::new(&problem, settings)?;
//! while !swarm.done() {
//!     let candidates = swarm.ask();
//!     swarm.tell(&evaluator.evaluate(&candidates)?)?;
//! }
//! // On the front, the roots of the two objectives add up to the distance between their optima.
//! for f in &swarm.front().objectives {
//!     assert!((f[0].sqrt() + f[1].sqrt() - 2f64.sqrt()).abs() < 0.01);
//! }
//! # Ok::<(), lapswarm::Error>(())
//! ```
//!
//! The same lines round a circle on the reference and in lanes:
//!
//! ```
//! use lapswarm::evaluate::Evaluator;
//! use lapswarm::evaluate::line::{CpuLineEvaluator, LineObjective, LineProblem, SimdLineEvaluator};
//! use lapswarm::evaluate::simd::InstructionSet;
//! use lapswarm::line::Parametrisation;
//! use lapswarm::track::Track;
//!
//! let cross_sections = Track::load("circle:590:600")?.cross_sections(361, true)?;
//! let problem = LineProblem::new(cross_sections, Parametrisation::sections(), &[LineObjective::Length], None, 0.0)?;
//! let lines = [vec![0.0; 361], vec![1.0; 361]].concat();
//! let reference = CpuLineEvaluator::new(&problem).evaluate(&lines)?;
//! let lanes = SimdLineEvaluator::new(&problem, InstructionSet::best()).evaluate(&lines)?;
//! for (lane, exact) in lanes.objectives.iter().zip(&reference.objectives) {
//!     assert!((lane / exact - 1.0).abs() < 1e-5);
//! }
//! # Ok::<(), lapswarm::Error>(())
//! ```
//!
//! An objective of your own on an evaluator that exists, here length plus a charge for what a line strays from the middle:
//!
//! ```
//! use lapswarm::evaluate::line::{CpuLineEvaluator, LineObjective, LineProblem};
//! use lapswarm::evaluate::{BackendInfo, Evaluation, Evaluator, Problem};
//! use lapswarm::line::Parametrisation;
//! use lapswarm::track::Track;
//!
//! struct Charged<E>(E);
//!
//! impl<E: Evaluator> Evaluator for Charged<E> {
//!     fn problem(&self) -> &Problem {
//!         self.0.problem()
//!     }
//!     fn backend(&self) -> BackendInfo {
//!         self.0.backend()
//!     }
//!     fn evaluate(&mut self, population: &[f64]) -> lapswarm::Result<Evaluation> {
//!         let mut found = self.0.evaluate(population)?;
//!         let width = self.problem().variables.len();
//!         for (cost, line) in found.objectives.iter_mut().zip(population.chunks_exact(width)) {
//!             *cost += line.iter().map(|alpha| (alpha - 0.5).abs()).sum::<f64>();
//!         }
//!         Ok(found)
//!     }
//! }
//!
//! let cross_sections = Track::load("circle:590:600")?.cross_sections(100, true)?;
//! let problem = LineProblem::new(cross_sections, Parametrisation::sections(), &[LineObjective::Length], None, 0.0)?;
//! let mut charged = Charged(CpuLineEvaluator::new(&problem));
//! let plain = CpuLineEvaluator::new(&problem).evaluate(&[1.0; 100])?;
//! let more = charged.evaluate(&[1.0; 100])?;
//! assert!((more.objectives[0] - plain.objectives[0] - 50.0).abs() < 1e-9);
//! # Ok::<(), lapswarm::Error>(())
//! ```
//!
//! Which car drove the bundled lap? A short search and no polish:
//!
//! ```no_run
//! use lapswarm::study::framework::{Study, solve_unobserved};
//! use lapswarm::study::identify::{Identify, IdentifySettings};
//!
//! let settings = IdentifySettings {
//!     population: Some(32),
//!     iterations: Some(3),
//!     polish: false,
//!     ..IdentifySettings::default()
//! };
//! let setup = Identify::prepare(&settings)?;
//! let outcome = solve_unobserved::<Identify>(&settings, &setup)?;
//! let unknowns = &setup.replay.problem.variables;
//! for (unknown, value) in unknowns.iter().zip(&outcome.swarm_candidate) {
//!     println!("{} = {value:.4} {}", unknown.name, unknown.unit);
//! }
//! # Ok::<(), lapswarm::Error>(())
//! ```

#![warn(missing_docs, clippy::missing_errors_doc, clippy::undocumented_unsafe_blocks)]
#![cfg_attr(docsrs, feature(doc_cfg))]
// What parts that are left out would use is not dead.
#![cfg_attr(not(feature = "cli"), allow(dead_code))]

#[cfg(feature = "cli")]
pub mod cli;
pub mod config;
#[cfg(feature = "vehicle")]
pub mod drive;
pub mod error;
pub mod evaluate;
pub mod files;
pub mod hold;
#[cfg(feature = "vehicle")]
pub mod line;
#[cfg(feature = "vehicle")]
pub mod optimum;
#[cfg(all(feature = "gpu", feature = "studies"))]
pub mod parity;
pub mod random;
#[cfg(feature = "report")]
pub mod report;
pub mod scalar;
#[cfg(feature = "vehicle")]
pub mod simulate;
#[cfg(feature = "studies")]
pub mod study;
pub mod swarm;
#[cfg(feature = "vehicle")]
pub mod telemetry;
#[cfg(feature = "vehicle")]
pub mod track;
#[cfg(feature = "vehicle")]
pub mod vehicle;

// The program calls the library by its name, as any other does.
#[cfg(feature = "cli")]
extern crate self as lapswarm;

pub use error::{Error, Place, Result};
pub use swarm::{minimise, minimise_batch, minimise_several};
