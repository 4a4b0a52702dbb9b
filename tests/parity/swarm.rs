//! Random numbers, test problems and swarms: processor and device against each other.

use crate::common::Random;
use crate::device::{device, devices, the_device};
use lapswarm::Result;
use lapswarm::evaluate::gpu::shader::{WheelOrder, elementary, random};
use lapswarm::evaluate::gpu::{Binding, GpuContext, Kernel};
use lapswarm::evaluate::simd::InstructionSet;
use lapswarm::evaluate::{Evaluator, Failure, Objective, Problem, Variable};
use lapswarm::parity::Subject;
use lapswarm::random::philox;
use lapswarm::scalar::elementary::{ln, power};
use lapswarm::swarm::device::{BLOCK, DeviceMopso, most_particles};
use lapswarm::swarm::metrics::{hypervolume, non_dominated};
use lapswarm::swarm::problems::{GpuTestEvaluator, NAMES, SimdTestEvaluator, TestProblem};
use lapswarm::swarm::{Mopso, MopsoSettings, Mutation, Optimiser, PsoSettings};
use std::sync::Arc;

tests! {
    the_device_draws_the_same_random_numbers: device,
    the_device_takes_the_same_powers: device,
    test_problems_are_the_same_everywhere: also_device,
    swarms_in_lanes_and_on_the_device_in_lockstep: device,
    swarms_shaped_for_a_card_are_those_in_lanes: device,
    a_swarm_on_the_device_takes_costs_of_any_size: device,
    a_swarm_on_the_device_counts_what_is_beyond_single_precision: device,
    swarms_on_the_device_keep_the_knee_of_a_front_with_long_tails: device,
    a_swarm_that_the_device_has_no_room_for_is_refused_with_the_size_that_fits: device,
}

/// A buffer of the device holds a whole number of blocks of particles; one particle more is refused before anything is made.
fn a_swarm_that_the_device_has_no_room_for_is_refused_with_the_size_that_fits() {
    let context = the_device();
    let test = TestProblem::by_name(NAMES[0]).unwrap();
    let variables = test.problem().variables.len();
    let room = most_particles(&context, variables);
    let largest = context.limits().max_storage_buffer_binding_size as usize;
    assert!(room * variables * 4 <= largest && (room + 2 * BLOCK) * variables * 4 > largest);
    let settings = MopsoSettings::default().with_size(room + 1, 1);
    let refused = DeviceMopso::new(test.problem(), settings, context)
        .err()
        .expect("no room");
    assert_eq!(refused.exit_code(), 2);
    let text = refused.to_string();
    assert!(
        text.contains("population") && text.contains(&format!("at most {room} ")),
        "{text}"
    );
}

/// Whether the device is known to round every operation as the processor does.
pub fn rounds_like_the_processor(context: &Arc<GpuContext>) -> bool {
    Subject::Device(Arc::clone(context)).rounds_like_the_processor()
}

/// `expression` of eight words `c`, four of which it is to yield.
fn map_words(context: &GpuContext, fragments: &str, expression: &str, inputs: &[u32]) -> Vec<u32> {
    let lanes = inputs.len() / 8;
    let source = format!(
        "{fragments}
        @group(0) @binding(0) var<storage, read> from_host: array<vec4<u32>>;
        @group(0) @binding(1) var<storage, read_write> to_host: array<vec4<u32>>;
        @compute @workgroup_size(64) fn apply(@builtin(global_invocation_id) id: vec3<u32>) {{
            if id.x < {lanes}u {{
                let a = from_host[2u * id.x];
                let b = from_host[2u * id.x + 1u];
                to_host[id.x] = {expression};
            }}
        }}"
    );
    // Bits travel as floats, unread.
    let floats: &[f32] = bytemuck::cast_slice(inputs);
    let found = context
        .run_array(&source, "apply", floats, lanes * 4, lanes)
        .expect("the kernel runs");
    bytemuck::cast_slice(&found).to_vec()
}

fn the_device_draws_the_same_random_numbers() {
    let context = the_device();
    let mut source = Random(3);
    let mut inputs: Vec<u32> = (0..8 * 100_000).map(|_| source.bits() as u32).collect();
    // All ones carry furthest.
    inputs[..8].fill(u32::MAX);
    let found = map_words(&context, random(), "philox(a, b.xy)", &inputs);
    for (given, words) in inputs.chunks_exact(8).zip(found.chunks_exact(4)) {
        let expected = philox([given[0], given[1], given[2], given[3]], [given[4], given[5]]);
        assert_eq!(words, expected, "{given:?}");
    }
}

/// Integer work and one division: exact where divisions are, else as far as the logarithm carries their 2.5 ULP.
fn the_device_takes_the_same_powers() {
    let context = the_device();
    let mut source = Random(4);
    let inputs: Vec<f32> = (0..100_000)
        .flat_map(|_| {
            let x = source.within(0.0, 1.0) as f32;
            [x, x * 1e-6, x * 1e6, 1.0 / 21.0, 0.0, 0.0, 0.0, 0.0]
        })
        .collect();
    let expression = "bitcast<vec4<u32>>(vec4<f32>(own_ln(bitcast<f32>(a.y) + 1e-9), own_ln(bitcast<f32>(a.z) + 1e-9), \
                      own_power(bitcast<f32>(a.x), 21.0), own_power(bitcast<f32>(a.x), bitcast<f32>(a.w))))";
    let source = elementary(WheelOrder::SideBySide);
    let found = map_words(&context, &source, expression, bytemuck::cast_slice(&inputs));
    for (given, words) in inputs.chunks_exact(8).zip(found.chunks_exact(4)) {
        let expected = [
            ln(given[1] + 1e-9),
            ln(given[2] + 1e-9),
            power(given[0], 21.0),
            power(given[0], given[3]),
        ];
        for (word, expected) in words.iter().zip(expected) {
            let found = f32::from_bits(*word);
            if rounds_like_the_processor(&context) {
                assert_eq!(
                    found.to_bits(),
                    expected.to_bits(),
                    "{given:?}: {found} is not {expected}"
                );
            } else {
                let share = (found - expected).abs() / expected.abs().max(1e-3);
                assert!(share < 1e-5, "{given:?}: {found} is not {expected}");
            }
        }
    }
}

fn candidates(test: &TestProblem, count: usize) -> Vec<f64> {
    let mut source = Random(5);
    let variables = &test.problem().variables;
    (0..count)
        // As floats, so that all backends are asked for the same candidates.
        .flat_map(|_| {
            variables
                .iter()
                .map(|v| f64::from(source.within(v.lower, v.upper) as f32))
                .collect::<Vec<_>>()
        })
        .map(|x| x.clamp(-1e6, 1e6))
        .collect()
}

/// Lanes on every instruction set, the device, and `f64`.
///
/// Against `f64`: a float's spacing of 6e-8 of the largest term, times the number of operations of a sum (30 variables,
/// some four each), times what the steepest function makes of an argument's rounding: cosines of 20 half turns
/// times 100 in DTLZ1.
fn test_problems_are_the_same_everywhere() {
    let context = device();
    for name in NAMES {
        let test = TestProblem::by_name(name).unwrap();
        let population = candidates(&test, 1003);
        let exact = test.evaluator().evaluate(&population).unwrap();
        let lanes = SimdTestEvaluator::new(&test, InstructionSet::best())
            .evaluate(&population)
            .unwrap();
        for set in InstructionSet::available() {
            assert_eq!(
                SimdTestEvaluator::new(&test, set).evaluate(&population).unwrap(),
                lanes,
                "{name} {set:?}"
            );
        }
        let largest = exact.objectives.iter().fold(0.0f64, |m, x| m.max(x.abs()));
        let close = |found: &[f64], what: &str, share: f64| {
            for (i, (found, expected)) in found.iter().zip(&exact.objectives).enumerate() {
                let off = (found - expected).abs() / largest;
                assert!(off <= share, "{name} {what} {i}: {found} is not {expected}");
            }
        };
        close(&lanes.objectives, "lanes", 2e-5);
        let Some(context) = &context else { continue };
        let on_device = GpuTestEvaluator::new(&test, Arc::clone(context))
            .unwrap()
            .evaluate(&population)
            .unwrap();
        assert_eq!(on_device.failures, lanes.failures);
        if rounds_like_the_processor(context) {
            // Llvmpipe regroups Ackley's sum of three terms of up to 23, whose two roundings are each half a spacing of
            // 32: 2e-6.
            let most = if name == "ackley" { 4e-6 } else { 0.0 };
            let off = |i: &usize| (on_device.objectives[*i] - lanes.objectives[*i]).abs() > most;
            let part = (0..lanes.objectives.len()).find(off);
            if let Some(i) = part {
                panic!(
                    "{name}, figure {i}: {} is not {}",
                    on_device.objectives[i], lanes.objectives[i]
                );
            }
        } else {
            close(&on_device.objectives, "device", 4e-5);
        }
    }
}

/// Generations that the two swarms go in lockstep.
const GENERATIONS: usize = 100;

/// One hundred generations on smooth fronts: bit for bit where the device rounds as the processor does. Elsewhere the
/// first rounding that turns a comparison makes another swarm, so that there the first generation is held to the
/// rounding of its few operations (ten spacings of one), and the end to how good the front is.
fn swarms_in_lanes_and_on_the_device_in_lockstep() {
    let context = the_device();
    let default = MopsoSettings::default();
    let mut thesis = MopsoSettings::thesis();
    thesis.motion.mutation = Mutation::None;
    // A block that is not full, and more than one part.
    for (name, settings, population) in [
        ("zdt1", default.clone(), 4100),
        ("dtlz2", default, 5000),
        ("zdt2", thesis, 4096),
    ] {
        let test = TestProblem::sized(name, 12).unwrap();
        let settings = MopsoSettings {
            motion: PsoSettings {
                population,
                iterations: GENERATIONS,
                seed: 9,
                ..settings.motion
            },
            ..settings
        };
        let mut lanes = Mopso::new(test.problem(), settings.clone()).unwrap();
        let mut judge = SimdTestEvaluator::new(&test, InstructionSet::best());
        let mut there = DeviceMopso::new(test.problem(), settings, Arc::clone(&context)).unwrap();
        let mut judge_there = GpuTestEvaluator::new(&test, Arc::clone(&context)).unwrap();
        let exact = rounds_like_the_processor(&context);
        for generation in 0..GENERATIONS {
            let candidates = lanes.ask();
            if exact || generation < 2 {
                let others = there.candidates().unwrap();
                let furthest = candidates
                    .iter()
                    .zip(&others)
                    .map(|(a, b)| (a - b).abs())
                    .fold(0.0, f64::max);
                let most = if exact {
                    0.0
                } else {
                    10.0 * f64::from(f32::EPSILON)
                };
                assert!(
                    furthest <= most,
                    "{name}, generation {generation}: {furthest} apart"
                );
            }
            lanes.tell(&judge.evaluate(&candidates).unwrap()).unwrap();
            there.step(&mut judge_there).unwrap();
        }
        if exact {
            assert_eq!(lanes.front(), there.front(), "{name}");
        }
        assert_eq!(lanes.evaluations(), there.evaluations());
        let reference = vec![1.1; test.problem().objectives.len()];
        let volume = |rows: &[Vec<f64>]| lapswarm::swarm::metrics::hypervolume(rows, &reference).unwrap();
        let (here, there) = (
            volume(&lanes.front().objectives),
            volume(&there.front().objectives),
        );
        assert!((here - there).abs() < 2e-3, "{name}: {here} and {there}");
    }
}

/// Slices of coordinates, and so many particles that those that may enter the archive are told apart before they are read: with another
/// shape a swarm has the same bits.
fn swarms_shaped_for_a_card_are_those_in_lanes() {
    let devices = devices();
    for (name, variables) in [("zdt1", 37), ("dtlz2", 40)] {
        let test = TestProblem::sized(name, variables).unwrap();
        let settings = MopsoSettings::default().with_size(150_000, 4);
        let mut lanes = Mopso::new(test.problem(), settings.clone()).unwrap();
        let mut judge = SimdTestEvaluator::new(&test, InstructionSet::best());
        let first = judge.evaluate(&lanes.ask()).unwrap().objectives;
        let rows = first.chunks(test.problem().objectives.len());
        let rows: Vec<Vec<f64>> = rows.map(<[f64]>::to_vec).collect();
        let newcomers: usize = rows.chunks(BLOCK).map(|block| non_dominated(block).len()).sum();
        assert!(newcomers > 8192, "{name}: {newcomers} are read as they are");
        let swarm = |context: &Arc<GpuContext>| {
            let mut swarm = DeviceMopso::new(test.problem(), settings.clone(), Arc::clone(context)).unwrap();
            let mut judge = GpuTestEvaluator::new(&test, Arc::clone(context)).unwrap();
            swarm
                .run(&mut judge, |_| std::ops::ControlFlow::Continue(()))
                .unwrap();
            (swarm.candidates().unwrap(), swarm.front())
        };
        let found = swarm(&devices[0]);
        assert!(found == swarm(&devices[1]), "{name}");
        if rounds_like_the_processor(&devices[0]) {
            for _ in 0..4 {
                let candidates = lanes.ask();
                lanes.tell(&judge.evaluate(&candidates).unwrap()).unwrap();
            }
            assert!(found == (lanes.ask(), lanes.front()), "{name}");
        }
    }
}

fn on_the_device(test: &TestProblem, context: &Arc<GpuContext>, generations: usize) -> DeviceMopso {
    let settings = MopsoSettings::default().with_size(1000, generations);
    DeviceMopso::new(test.problem(), settings, Arc::clone(context)).unwrap()
}

/// A power of two changes no digit: every figure of the front is that many times as large, to the last bit.
fn a_swarm_on_the_device_takes_costs_of_any_size() {
    let context = the_device();
    let front = |factor: f32| {
        let test = TestProblem::sized("zdt1", 8).unwrap().times(factor);
        let mut swarm = on_the_device(&test, &context, 15);
        let mut judge = GpuTestEvaluator::new(&test, Arc::clone(&context)).unwrap();
        let mut failed = 0;
        swarm
            .run(&mut judge, |progress| {
                failed += progress.failed;
                std::ops::ControlFlow::Continue(())
            })
            .unwrap();
        assert_eq!(failed, 0);
        assert!(swarm.front().is_feasible() && swarm.front().objectives.len() > 20);
        swarm.front()
    };
    let usual = front(1.0);
    for factor in [2f32.powi(-30), 2f32.powi(31), 2f32.powi(50), 2f32.powi(120)] {
        let found = front(factor);
        let times = |row: &Vec<f64>| row.iter().map(|f| f * f64::from(factor)).collect();
        let expected: Vec<Vec<f64>> = usual.objectives.iter().map(times).collect();
        assert_eq!(found.objectives, expected, "times {factor}");
        assert_eq!(found.candidates, usual.candidates, "times {factor}");
    }
}

/// Half of what ZDT1 can cost is beyond the greatest float here.
fn a_swarm_on_the_device_counts_what_is_beyond_single_precision() {
    let context = the_device();
    let test = TestProblem::sized("zdt1", 8).unwrap().times(2f32.powi(126));
    let mut swarm = on_the_device(&test, &context, 15);
    assert_eq!(swarm.best(), [f64::INFINITY; 2]);
    let mut judge = GpuTestEvaluator::new(&test, Arc::clone(&context)).unwrap();
    let candidates = swarm.candidates().unwrap();
    let there = judge.evaluate(&candidates).unwrap();
    let expected = there.failures.iter().flatten().count();
    let progress = swarm.step(&mut judge).unwrap();
    assert!((50..950).contains(&expected), "{expected}");
    // Candidates are rounded on their way here and back, which may turn the last digit of one on the edge.
    assert!(
        progress.failed.abs_diff(expected) <= 1,
        "{} and {expected}",
        progress.failed
    );
    assert_eq!(
        progress.failures["objective_beyond_single_precision"],
        progress.failed as u64
    );
    assert!(there.failures.contains(&Some(Failure::BeyondSinglePrecision)));
    let best = progress.best;
    assert!(best.iter().all(|x| x.is_finite()), "{best:?}");
    let start = [vec![0.5; 3]];
    let said = swarm.start_from(&start).unwrap_err().to_string();
    assert!(
        said.contains("candidate 1") && said.contains("3 values"),
        "{said}"
    );
}

/// 10^u and 10^-u, u from -4 to 4.
struct Tails {
    problem: Problem,
    context: Arc<GpuContext>,
    kernel: Arc<Kernel>,
}

impl Tails {
    fn new(context: Arc<GpuContext>) -> Self {
        let source = "
            @group(0) @binding(0) var<storage, read> position: array<f32>;
            @group(0) @binding(1) var<storage, read_write> objectives: array<f32>;
            @compute @workgroup_size(64) fn tails(@builtin(global_invocation_id) id: vec3<u32>) {
                let u = 8.0 * position[id.x] - 4.0;
                let first = id.x / 64u * 128u + id.x % 64u;
                objectives[first] = exp2(3.321928 * u);
                objectives[first + 64u] = exp2(-3.321928 * u);
            }";
        Self {
            problem: Problem {
                variables: vec![Variable::new("u", "-", -4.0, 4.0)],
                objectives: ["right", "left"].map(|name| Objective::new(name, "-")).to_vec(),
            },
            kernel: context
                .kernel(source, "tails", &[Binding::Read, Binding::Write])
                .expect("it compiles"),
            context,
        }
    }
}

impl lapswarm::swarm::device::DeviceObjectives for Tails {
    fn problem(&self) -> &Problem {
        &self.problem
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

fn swarms_on_the_device_keep_the_knee_of_a_front_with_long_tails() {
    let mut tails = Tails::new(the_device());
    // What a thousand points spread evenly over u dominate up to 25, in the knee.
    let even: Vec<Vec<f64>> = (0..1000)
        .map(|i| 10f64.powf(-4.0 + 8.0 * f64::from(i) / 999.0))
        .map(|x| vec![x, 1.0 / x])
        .collect();
    let most = hypervolume(&even, &[25.0; 2]).unwrap();
    for (population, reference, least) in [
        (4096, None, 30),
        (16_384, None, 30),
        (4096, Some(vec![25.0; 2]), 99),
    ] {
        let settings = MopsoSettings {
            motion: PsoSettings {
                population,
                iterations: 30,
                ..MopsoSettings::default().motion
            },
            reference,
            ..MopsoSettings::default()
        };
        let mut swarm = DeviceMopso::new(&tails.problem, settings, Arc::clone(&tails.context)).unwrap();
        swarm
            .run(&mut tails, |_| std::ops::ControlFlow::Continue(()))
            .unwrap();
        let found = swarm.front().objectives;
        let members = found.iter().filter(|row| row.iter().all(|x| *x < 25.0)).count();
        let volume = hypervolume(&found, &[25.0; 2]).unwrap();
        assert!(members >= least, "{population} particles: {members}");
        assert!(
            volume > 0.998 * most,
            "{population} particles: {volume} of {most}"
        );
    }
}
