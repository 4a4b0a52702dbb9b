//! One small problem of every kind that is evaluated, how it is evaluated, and how far its backends may be apart.

use super::harness::adapter;
use super::line::{gt_car, line_problem, ring};
use super::{bundled_car, linear_car, problem};
use lapswarm::Error;
use lapswarm::evaluate::drive::{
    CpuDriveEvaluator, DriveProblem, GpuDriveEvaluator, SimdDriveEvaluator, open_drive_evaluator,
};
use lapswarm::evaluate::energy::{
    Free, GpuHybridEvaluator, HybridLine, HybridObjective, HybridProblem, SimdHybridEvaluator, Strategy,
    open_hybrid_evaluator,
};
use lapswarm::evaluate::gpu::{Batching, GpuContext};
use lapswarm::evaluate::line::{GpuLineEvaluator, LineProblem, SimdLineEvaluator, open_line_evaluator};
use lapswarm::evaluate::replay::{GpuEvaluator, ReplayProblem, SimdEvaluator, open_evaluator};
use lapswarm::evaluate::simd::InstructionSet;
use lapswarm::evaluate::steady::{
    CpuSteadyEvaluator, GpuSteadyEvaluator, SimdSteadyEvaluator, SteadyProblem, open_steady_evaluator,
};
use lapswarm::evaluate::{
    BackendChoice, Evaluation, Evaluator, FAILED_COST, Failure, FallbackEvaluator, Problem,
};
use lapswarm::line::energy::{EnergyCar, EnergyPlan, Gates, Mode};
use lapswarm::line::{Parametrisation, geometry};
use lapswarm::parity::synthetic_lap::Lap;
use lapswarm::parity::{Draws, drive, energy, laps, line_tolerances, steady};
use lapswarm::vehicle::Car;
use lapswarm::vehicle::limits::{SpeedRange, car_envelope};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Devices and their faults are of the whole process: one test at a time.
pub fn alone() -> MutexGuard<'static, ()> {
    static TURN: Mutex<()> = Mutex::new(());
    TURN.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The backends that there are.
pub fn choices() -> &'static [BackendChoice] {
    let choices = &[BackendChoice::Cpu, BackendChoice::Simd, BackendChoice::Gpu];
    &choices[..if adapter().is_ok() { 3 } else { 2 }]
}

/// All of an evaluation, in a form that compares to the bit.
pub fn bits(evaluation: &Evaluation) -> (Vec<u64>, Vec<Option<Failure>>) {
    let objectives = evaluation.objectives.iter().map(|x| x.to_bits()).collect();
    (objectives, evaluation.failures.clone())
}

pub type Boxed<'a> = Box<dyn Evaluator + 'a>;
/// Of each objective of a candidate, given with what it costs.
type Tolerances<'a> = dyn Fn(&[f64], &[f64]) -> Option<Vec<f64>> + 'a;

/// The problems.
pub struct Problems {
    pub replay: ReplayProblem,
    pub line: LineProblem,
    pub hybrid: HybridProblem,
    pub drive: DriveProblem,
    pub steady: SteadyProblem,
}

/// A way to evaluate one of them.
pub struct Kind<'a> {
    pub name: &'static str,
    pub problem: &'a Problem,
    /// As studies open it.
    pub open: Box<dyn Fn(BackendChoice) -> Boxed<'a> + 'a>,
    /// On a device, its work cut so that a small population takes several dispatches, always as many.
    pub cut: Box<dyn Fn(Arc<GpuContext>) -> Result<Boxed<'a>, Error> + 'a>,
    lanes: Box<dyn Fn() -> Boxed<'a> + 'a>,
    /// How far single precision may be off on a candidate with these objectives in `f64`; nothing where it may be anywhere.
    allowed: Box<Tolerances<'a>>,
}

fn hybrid() -> HybridProblem {
    let car = Car::load("gt_hybrid").expect("bundled");
    let coarse = SpeedRange {
        step_mps: 8.0,
        ..SpeedRange::USUAL
    };
    let limits = car_envelope(&car, &coarse).expect("limits");
    let traction = limits.traction();
    let car = EnergyCar::new(car, limits.envelope, traction, 2.0).expect("a hybrid");
    let cross_sections = ring(90.0, 104.0, 60);
    let length = geometry(&cross_sections.points(&[0.5; 60]), true).segment_m;
    let plan = EnergyPlan::zoned(&length, &[5, 25, 45], true, 30, Mode::Additional);
    let gates = [
        Free::Steer,
        Free::Speed,
        Free::Acceleration,
        Free::Soc,
        Free::Energy,
        Free::Motor,
    ];
    let strategy = Strategy {
        free: gates.into_iter().chain((0..3).map(Free::Zone)).collect(),
        ..Strategy::fixed(Gates::OPEN, 3)
    };
    let line = HybridLine::Free {
        cross_sections: Box::new(cross_sections),
        parametrisation: Parametrisation::control_points(8),
    };
    HybridProblem::new(line, car, plan, strategy, &HybridObjective::ALL, 30.0).expect("a sound problem")
}

impl Problems {
    pub fn new() -> Self {
        let lap = Lap {
            samples: 200,
            windows: 2,
            ..Lap::default()
        };
        Self {
            replay: problem(bundled_car(), &["rBx1", "rCy1", "K", "C"], lap),
            line: line_problem(ring(90.0, 104.0, 24), Parametrisation::sections(), gt_car()),
            hybrid: hybrid(),
            // Some twenty seconds of driving.
            drive: drive::problem_of(
                linear_car(),
                &["stadium:60:40:14"],
                &[0.4, 0.5],
                6e-3,
                &["mass_kg", "aero_balance_front"],
            )
            .expect("a sound problem"),
            steady: steady::problem(linear_car()).expect("a sound problem"),
        }
    }

    pub fn kinds(&self) -> [Kind<'_>; 5] {
        // As long as steps are not cut by time they are always cut alike.
        let steps = |steps| Batching {
            lanes: 64,
            bytes: u64::MAX,
            dispatch_ms: 1e9,
            steps: Some(steps),
        };
        let lines = Batching {
            bytes: 1 << 16,
            steps: None,
            ..steps(1)
        };
        [
            Kind {
                name: "replay",
                problem: &self.replay.problem,
                open: Box::new(|choice| open_evaluator(&self.replay, choice, None).expect("it opens")),
                cut: Box::new(|context| {
                    let batching = Batching {
                        lanes: 128,
                        bytes: 1 << 20,
                        dispatch_ms: 1e9,
                        steps: Some(1),
                    };
                    Ok(Box::new(
                        GpuEvaluator::new(&self.replay, context)?.with_batching(batching),
                    ))
                }),
                lanes: Box::new(|| Box::new(SimdEvaluator::new(&self.replay, InstructionSet::best()))),
                allowed: Box::new(|_, row| {
                    let each = row.iter().enumerate();
                    Some(each.map(|(k, exact)| laps::allowed(k, *exact)).collect())
                }),
            },
            Kind {
                name: "line",
                problem: &self.line.problem,
                open: Box::new(|choice| open_line_evaluator(&self.line, choice, None).expect("it opens")),
                cut: Box::new(move |context| {
                    Ok(Box::new(
                        GpuLineEvaluator::new(&self.line, context)?.with_batching(lines),
                    ))
                }),
                lanes: Box::new(|| Box::new(SimdLineEvaluator::new(&self.line, InstructionSet::best()))),
                allowed: Box::new(|_, row| Some(line_tolerances(&self.line, row).to_vec())),
            },
            Kind {
                name: "hybrid",
                problem: &self.hybrid.problem,
                open: Box::new(|choice| open_hybrid_evaluator(&self.hybrid, choice, None).expect("it opens")),
                cut: Box::new(move |context| {
                    Ok(Box::new(
                        GpuHybridEvaluator::new(&self.hybrid, context)?.with_batching(lines),
                    ))
                }),
                lanes: Box::new(|| Box::new(SimdHybridEvaluator::new(&self.hybrid, InstructionSet::best()))),
                allowed: Box::new(|candidate, _| {
                    let car = self.hybrid.car();
                    let off = energy::allowed(&self.hybrid, &self.hybrid.lap(candidate).0);
                    let swing = 2.0 * off.energy / car.hybrid.store.capacity_j;
                    Some(vec![
                        off.time,
                        off.fuel / car.fuel_density_kgpl,
                        off.energy / 1e6,
                        swing,
                    ])
                }),
            },
            Kind {
                name: "drive",
                problem: &self.drive.problem,
                open: Box::new(|choice| open_drive_evaluator(&self.drive, choice, None).expect("it opens")),
                cut: Box::new(move |context| {
                    let all = steps(usize::MAX);
                    Ok(Box::new(
                        GpuDriveEvaluator::new(&self.drive, context)?.with_batching(all),
                    ))
                }),
                lanes: Box::new(|| Box::new(SimdDriveEvaluator::new(&self.drive, InstructionSet::best()))),
                allowed: Box::new(|candidate, _| {
                    let lap = CpuDriveEvaluator::new(&self.drive).outcomes(&[candidate])[0].ok()?;
                    Some(drive::allowed(&self.drive, &lap).to_vec())
                }),
            },
            Kind {
                name: "steady",
                problem: &self.steady.problem,
                open: Box::new(|choice| open_steady_evaluator(&self.steady, choice, None).expect("it opens")),
                cut: Box::new(move |context| {
                    let third = self.steady.plan().steps as usize / 3 + 1;
                    Ok(Box::new(
                        GpuSteadyEvaluator::new(&self.steady, context)?.with_batching(steps(third)),
                    ))
                }),
                lanes: Box::new(|| Box::new(SimdSteadyEvaluator::new(&self.steady, InstructionSet::best()))),
                allowed: Box::new(|candidate, row| {
                    let state = CpuSteadyEvaluator::new(&self.steady).outcomes(&[candidate])[0].ok()?;
                    let [across, sideslip, roll, slip] = steady::allowed(&self.steady, candidate, &state)?;
                    let [speed, _] = self.steady.aim_figures(candidate);
                    // The order of the objectives, of which the first is speed times the third.
                    let off = vec![across, sideslip, across / speed, roll, slip];
                    // Next to no trim: as the parity of steady states has it.
                    (across < 0.02 && row.len() == off.len()).then_some(off)
                }),
            },
        ]
    }
}

impl<'a> Kind<'a> {
    /// Number of variables and objectives.
    pub fn widths(&self) -> (usize, usize) {
        (self.problem.variables.len(), self.problem.objectives.len())
    }

    /// Random candidates from the middle half of the bounds.
    pub fn population(&self, count: usize, seed: u64) -> Vec<f64> {
        let mut draws = Draws::new(seed);
        let variables = &self.problem.variables;
        let mut population = Vec::with_capacity(count * variables.len());
        for _ in 0..count {
            // Lines that are smooth, as their parity wants them: nearly parallel to the edges.
            let along = draws.within(0.3, 0.7);
            population.extend(variables.iter().map(|v| {
                let share = match self.name {
                    "line" => along,
                    _ => draws.within(0.25, 0.75),
                };
                v.lower + share * (v.upper - v.lower)
            }));
        }
        population
    }

    /// On a device as `cut` has it, opened anew when it fails and taken over by lanes when it fails again.
    pub fn with_fallback(&self) -> FallbackEvaluator<'_> {
        FallbackEvaluator::new(
            self.problem,
            (BackendChoice::Gpu, None),
            || (self.cut)(GpuContext::shared(None)?),
            || (self.lanes)(),
        )
        .expect("a device or lanes")
    }

    /// How far backends may be apart on each candidate of a population: nothing where the reference itself is moved by more
    /// than that when every variable is moved by a millionth of itself, sixteen roundings of single precision; a candidate
    /// like that is at the edge of something, and neither answer is wrong.
    pub fn parity(&self, population: &[f64]) -> Vec<Option<Vec<f64>>> {
        let (dimensions, width) = self.widths();
        let mut reference = (self.open)(BackendChoice::Cpu);
        let exact = reference.evaluate(population).expect("it runs");
        let mut near = Vec::new();
        for off in [-1e-6, 1e-6] {
            let moved: Vec<f64> = population.iter().map(|x| x * (1.0 + off)).collect();
            near.push(reference.evaluate(&moved).expect("it runs"));
        }
        let rows = exact.objectives.chunks_exact(width).enumerate();
        rows.map(|(i, row)| {
            let candidate = &population[i * dimensions..(i + 1) * dimensions];
            let alike = near.iter().all(|n| n.failures[i] == exact.failures[i]);
            let allowed = match exact.failures[i] {
                Some(_) => Some(vec![0.0; width]),
                None => (self.allowed)(candidate, row),
            }?;
            let still = near.iter().all(|n| {
                let other = &n.objectives[i * width..(i + 1) * width];
                let both = other.iter().zip(row).zip(&allowed);
                both.into_iter().all(|((a, b), off)| apart(*a, *b) <= *off)
            });
            (alike && still).then_some(allowed)
        })
        .collect()
    }

    /// Holds what a backend in single precision says against the reference, or against another such backend with `times` 2;
    /// hands back how many candidates there was something to say of.
    pub fn compare(
        &self,
        what: &str,
        (found, exact): (&Evaluation, &Evaluation),
        parity: &[Option<Vec<f64>>],
        times: f64,
    ) -> usize {
        let (_, width) = self.widths();
        let mut compared = 0;
        let mut wrong = Vec::new();
        for (i, allowed) in parity.iter().enumerate() {
            let Some(allowed) = allowed else { continue };
            compared += 1;
            let at = i * width..(i + 1) * width;
            let (a, b) = (&found.objectives[at.clone()], &exact.objectives[at]);
            let near = a
                .iter()
                .zip(b)
                .zip(allowed)
                .all(|((a, b), off)| apart(*a, *b) <= times * off);
            if found.failures[i] != exact.failures[i] || !near {
                let (found, exact) = (found.failures[i], exact.failures[i]);
                wrong.push(format!(
                    "candidate {i}: {a:?} {found:?} for {b:?} {exact:?}, {allowed:?} allowed"
                ));
            }
        }
        assert!(wrong.is_empty(), "{}, {what}:\n{}", self.name, wrong.join("\n"));
        compared
    }

    /// No figure of an evaluation is none, and what costs as much as a failure is one that says so.
    pub fn is_sound(&self, what: &str, evaluation: &Evaluation, population: &[f64]) {
        let (dimensions, width) = self.widths();
        let rows = evaluation.objectives.chunks_exact(width);
        assert_eq!(rows.len() * dimensions, population.len());
        for ((row, failure), candidate) in rows
            .zip(&evaluation.failures)
            .zip(population.chunks_exact(dimensions))
        {
            let failed = row.iter().all(|x| *x == FAILED_COST);
            assert!(
                failed || row.iter().all(|x| x.is_finite() && *x < FAILED_COST),
                "{}, {what}: {row:?} of {candidate:?}",
                self.name
            );
            assert_eq!(
                failure.is_some(),
                failed,
                "{}, {what}: {row:?} {failure:?} of {candidate:?}",
                self.name
            );
        }
    }
}

/// How far two costs lie apart; the costs of two failures, which are infinite, do not.
fn apart(a: f64, b: f64) -> f64 {
    if a == b { 0.0 } else { (a - b).abs() }
}
