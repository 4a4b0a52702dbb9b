//! Swarms with constraints that live on the device, against those in lanes.

use crate::device::{devices, the_device};
use crate::swarm::rounds_like_the_processor;
use lapswarm::Result;
use lapswarm::evaluate::gpu::{Binding, GpuContext, Kernel};
use lapswarm::evaluate::{Evaluation, FAILED_COST, Failure, Objective, Problem, Variable};
use lapswarm::swarm::checkpoint::{from_bytes, to_bytes};
use lapswarm::swarm::device::{BLOCK, DeviceMopso, DeviceObjectives};
use lapswarm::swarm::{MANY, Mopso, MopsoSettings, Optimiser, PsoSettings};
use std::path::Path;
use std::sync::Arc;

tests! {
    swarms_with_constraints_in_lanes_and_on_the_device_in_lockstep: device,
    swarms_with_constraints_shaped_for_a_card_are_those_in_lanes: device,
    a_swarm_with_constraints_resumes_as_it_was: device,
    one_objective_with_constraints_on_the_device: device,
    a_swarm_and_its_objectives_agree_on_constraints: device,
}

const VARIABLES: usize = 6;

/// To be near to where all variables but the first are 0.875, along a line of the first, within a ball about where they are 0.375 whose
/// radius squared is `room`. Variables stand on grids so coarse that nothing is rounded. Candidates whose second variable is above 0.95
/// fail.
struct Ball {
    problem: Problem,
    room: f32,
    context: Arc<GpuContext>,
    kernel: Arc<Kernel>,
}

impl Ball {
    fn new(objectives: usize, room: f32, context: &Arc<GpuContext>) -> Self {
        let source = format!(
            "
            @group(0) @binding(0) var<storage, read> position: array<f32>;
            @group(0) @binding(1) var<storage, read_write> objectives: array<f32>;
            fn place(who: u32, width: u32, k: u32) -> u32 {{ return (who / 64u * width + k) * 64u + who % 64u; }}
            @compute @workgroup_size(64) fn ball(
                @builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>,
            ) {{
                let who = id.y * groups.x * 64u + id.x;
                if who >= arrayLength(&position) / {VARIABLES}u {{ return; }}
                let first = floor(position[place(who, {VARIABLES}u, 0u)] * 1048576.0) / 1048576.0;
                var out = 0.0;
                var away = 0.0;
                for (var k = 1u; k < {VARIABLES}u; k++) {{
                    let x = floor(position[place(who, {VARIABLES}u, k)] * 1024.0) / 1024.0;
                    out += (x - 0.375) * (x - 0.375);
                    away += (x - 0.875) * (x - 0.875);
                }}
                var row = array<f32, 3>(first, (1.0 - first) + away, max(out - {room:?}, 0.0));
                if {objectives}u == 1u {{ row = array<f32, 3>((1.0 - first) + away, row[2], 0.0); }}
                for (var k = 0u; k <= {objectives}u; k++) {{
                    let failed = position[place(who, {VARIABLES}u, 1u)] > 0.95;
                    objectives[place(who, {objectives}u + 1u, k)] = select(row[k], bitcast<f32>(0x7f7fff02u), failed);
                }}
            }}"
        );
        let variables = (0..VARIABLES).map(|k| Variable::new(format!("x{k}"), "-", 0.0, 1.0));
        let objective = |k: usize| Objective::new(format!("f{k}"), "-");
        Self {
            problem: Problem {
                variables: variables.collect(),
                objectives: (0..objectives).map(objective).collect(),
            },
            room,
            kernel: context
                .kernel(&source, "ball", &[Binding::Read, Binding::Write])
                .expect("it compiles"),
            context: Arc::clone(context),
        }
    }

    /// The same on the host, with the same operations.
    fn told(&self, candidates: &[f64]) -> Evaluation {
        let mut told = Evaluation::default();
        let width = self.problem.objectives.len();
        for candidate in candidates.chunks_exact(VARIABLES) {
            let x: Vec<f32> = candidate.iter().map(|x| *x as f32).collect();
            let on_grid = |x: f32, steps: f32| (x * steps).floor() / steps;
            let from = |centre: f32| {
                let away = x[1..].iter().map(|x| on_grid(*x, 1024.0) - centre);
                away.fold(0.0f32, |sum, away| sum + away * away)
            };
            let first = on_grid(x[0], 1_048_576.0);
            let row = [first, (1.0 - first) + from(0.875)];
            let failure = (x[1] > 0.95).then_some(Failure::Spun);
            let costs = row[2 - width..].iter().map(|cost| match failure {
                Some(_) => FAILED_COST,
                None => f64::from(*cost),
            });
            told.objectives.extend(costs);
            told.failures.push(failure);
            told.violations
                .push(f64::from((from(0.375) - self.room).max(0.0)));
        }
        told
    }

    fn swarm(&self, population: usize, iterations: usize) -> DeviceMopso {
        let settings = settings(population, iterations);
        DeviceMopso::with_constraints(&self.problem, settings, Arc::clone(&self.context)).unwrap()
    }

    /// The least of the last objective where the first does not count: from the ball's nearest point.
    fn least(&self) -> f64 {
        let ways = (VARIABLES - 1) as f64;
        (0.5 * ways.sqrt() - f64::from(self.room).sqrt()).powi(2)
    }
}

fn settings(population: usize, iterations: usize) -> MopsoSettings {
    MopsoSettings::default().with_size(population, iterations)
}

impl DeviceObjectives for Ball {
    fn problem(&self) -> &Problem {
        &self.problem
    }

    fn is_constrained(&self) -> bool {
        true
    }

    fn evaluate(
        &mut self,
        particles: usize,
        position: &wgpu::Buffer,
        objectives: &wgpu::Buffer,
    ) -> Result<()> {
        let group = self.context.bind(&self.kernel, &[position, objectives])?;
        let groups = [particles.div_ceil(BLOCK) as u32, 1];
        self.context.dispatch(&self.kernel, &group, groups, None)?;
        Ok(())
    }
}

/// The ball holds a fraction of 2e-7 of the space: own bests lead until a particle is inside, then they stand in for the members
/// that the archive lacks. Bit for bit where the device rounds as the processor does, and near the true front anywhere.
fn swarms_with_constraints_in_lanes_and_on_the_device_in_lockstep() {
    let context = the_device();
    let mut ball = Ball::new(2, 1.0 / 1024.0, &context);
    let exact = rounds_like_the_processor(&context);
    // A block that is not full, and more than one part.
    let (population, generations) = (MANY + 4, 60);
    let mut lanes = Mopso::new(&ball.problem, settings(population, generations)).unwrap();
    let mut there = ball.swarm(population, generations);
    let mut violations = Vec::new();
    for generation in 0..generations {
        let candidates = lanes.ask();
        if exact {
            assert!(candidates == there.candidates().unwrap(), "{generation}");
        }
        let told = ball.told(&candidates);
        lanes.tell(&told).unwrap();
        let progress = there.step(&mut ball).unwrap();
        if exact {
            assert_eq!(progress.failures, told.failure_counts(), "{generation}");
            assert_eq!(progress.violation, lanes.violation(), "{generation}");
            assert_eq!(there.front(), lanes.front(), "{generation}");
        }
        violations.push(progress.violation);
    }
    assert!(
        violations[2] > 0.0 && violations.is_sorted_by(|a, b| a >= b),
        "{violations:?}"
    );
    let front = there.front();
    assert!(front.is_feasible() && front.objectives.len() > 90, "{front:?}");
    for row in &front.objectives {
        let above = row[0] + row[1] - 1.0 - ball.least();
        assert!((-1e-6..0.01).contains(&above), "{row:?}: {above}");
    }
}

/// Slices of coordinates, and so many particles that those that may enter the archive are told apart before they are read.
fn swarms_with_constraints_shaped_for_a_card_are_those_in_lanes() {
    let devices = devices();
    let (population, generations) = (150_000, 4);
    let found: Vec<_> = devices
        .iter()
        .map(|context| {
            let mut ball = Ball::new(2, 0.375, context);
            let mut swarm = ball.swarm(population, generations);
            for _ in 0..generations {
                swarm.step(&mut ball).unwrap();
            }
            (swarm.candidates().unwrap(), swarm.front())
        })
        .collect();
    assert!(found[0] == found[1]);
    assert!(found[0].1.is_feasible());
    if rounds_like_the_processor(&devices[0]) {
        let ball = Ball::new(2, 0.375, &devices[0]);
        let mut lanes = Mopso::new(&ball.problem, settings(population, generations)).unwrap();
        for _ in 0..generations {
            let candidates = lanes.ask();
            lanes.tell(&ball.told(&candidates)).unwrap();
        }
        assert!(found[0] == (lanes.ask(), lanes.front()));
    }
}

/// Stopped where nothing feasible is known, and where the archive is full.
fn a_swarm_with_constraints_resumes_as_it_was() {
    let context = the_device();
    let mut ball = Ball::new(2, 1.0 / 1024.0, &context);
    let mut swarm = ball.swarm(1000, 60);
    let mut states = Vec::new();
    for generation in 0..60 {
        if generation == 2 || generation == 55 {
            states.push(to_bytes(&swarm.state().unwrap()).unwrap());
        }
        swarm.step(&mut ball).unwrap();
    }
    for (bytes, infeasible) in states.into_iter().zip([true, false]) {
        let state = from_bytes(&bytes, Path::new("state")).unwrap();
        let mut again = DeviceMopso::from_state(state, Arc::clone(&context)).unwrap();
        assert_eq!(!again.front().is_feasible(), infeasible);
        while again.iteration() < 60 {
            again.step(&mut ball).unwrap();
        }
        assert_eq!(again.front(), swarm.front());
        assert_eq!(again.candidates().unwrap(), swarm.candidates().unwrap());
    }
}

/// A plain particle swarm. One that does not know of constraints ends at one less, as the least without them is nothing.
fn one_objective_with_constraints_on_the_device() {
    let context = the_device();
    let mut ball = Ball::new(1, 0.125, &context);
    let settings = MopsoSettings {
        motion: PsoSettings {
            population: MANY,
            ..PsoSettings::thesis()
        },
        ..MopsoSettings::thesis()
    };
    let mut swarm = DeviceMopso::with_constraints(&ball.problem, settings, Arc::clone(&context)).unwrap();
    swarm
        .run(&mut ball, |_| std::ops::ControlFlow::Continue(()))
        .unwrap();
    assert!(swarm.front().is_feasible());
    let above = swarm.best()[0] - ball.least();
    assert!((-1e-6..5e-3).contains(&above), "{above}");
}

/// Neither takes the rows of the other.
fn a_swarm_and_its_objectives_agree_on_constraints() {
    let context = the_device();
    let mut ball = Ball::new(2, 0.125, &context);
    let mut swarm = DeviceMopso::new(&ball.problem, settings(100, 2), context).unwrap();
    let error = swarm.step(&mut ball).unwrap_err();
    assert_eq!(error.exit_code(), 2);
    assert!(error.to_string().contains("constraints"), "{error}");
}
