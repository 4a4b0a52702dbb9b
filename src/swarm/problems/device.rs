//! The test problems on a device: for populations from the host, and for swarms that live there.

use super::TestProblem;
use super::lanes::failures;
use crate::error::{Error, Result};
use crate::evaluate::gpu::shader::test_problem;
use crate::evaluate::gpu::{Binding, GpuContext, Kernel};
use crate::evaluate::resident::{BLOCK, DeviceObjectives, groups};
use crate::evaluate::{BackendInfo, Evaluation, Evaluator, Problem};
use bytemuck::{Pod, Zeroable};
use std::sync::Arc;
use wgpu::BufferUsages as Usage;

/// Twin of `Task` in `shaders/test_problems.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Task {
    candidates: u32,
    rows: u32,
    variables: u32,
    objectives: u32,
}

/// Twin of `Variable` in `shaders/test_problems.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct DeviceVariable {
    lower: f32,
    range: f32,
    shift: f32,
    row: u32,
}

/// Scores candidates of a test problem on a device, in `f32`.
pub struct GpuTestEvaluator<'a> {
    test: &'a TestProblem,
    context: Arc<GpuContext>,
    kernel: Arc<Kernel>,
    task: wgpu::Buffer,
    /// Candidates as they come, and positions in the cube of the variables that are free.
    plain: wgpu::Buffer,
    scaled: wgpu::Buffer,
    free: usize,
}

/// The most candidates of a population from the host that are on the device at once.
const BATCH: usize = 1 << 18;

impl<'a> GpuTestEvaluator<'a> {
    /// An evaluator of `test` on `context`'s device.
    ///
    /// # Errors
    /// [`Error::Device`] if the kernel does not compile.
    pub fn new(test: &'a TestProblem, context: Arc<GpuContext>) -> Result<Self> {
        use Binding::{Read, Uniform, Write};
        let source = test_problem(test.function as u32, test.factor);
        let kernel = context.kernel(&source, "test_problem", &[Uniform, Read, Read, Write])?;
        let mut free = 0;
        let variables = test.problem.variables.iter().enumerate();
        let (plain, scaled): (Vec<_>, Vec<_>) = variables
            .map(|(k, v)| {
                let shift = test.shift.get(k).copied().unwrap_or(0.0) as f32;
                let plain = DeviceVariable {
                    lower: 0.0,
                    range: 1.0,
                    shift,
                    row: k as u32,
                };
                // A fixed variable has no row: with no range, any will do.
                let moves = v.upper > v.lower;
                let scaled = DeviceVariable {
                    lower: v.lower as f32,
                    range: (v.upper - v.lower) as f32,
                    shift,
                    row: if moves { free as u32 } else { 0 },
                };
                free += usize::from(moves);
                (plain, scaled)
            })
            .unzip();
        let table = |label: &str, rows: &[DeviceVariable]| {
            context.buffer_of(label, bytemuck::cast_slice(rows), Usage::STORAGE)
        };
        Ok(Self {
            plain: table("variables", &plain)?,
            scaled: table("variables of the cube", &scaled)?,
            task: context.buffer("task", size_of::<Task>() as u64, Usage::UNIFORM | Usage::COPY_DST)?,
            test,
            kernel,
            context,
            free,
        })
    }

    fn dispatch(
        &self,
        (candidates, rows): (usize, usize),
        variables: &wgpu::Buffer,
        position: &wgpu::Buffer,
        objectives: &wgpu::Buffer,
    ) -> Result<()> {
        let task = Task {
            candidates: candidates as u32,
            rows: rows as u32,
            variables: self.test.problem.variables.len() as u32,
            objectives: self.test.problem.objectives.len() as u32,
        };
        self.context.write(&self.task, bytemuck::bytes_of(&task));
        let group = self
            .context
            .bind(&self.kernel, &[&self.task, variables, position, objectives])?;
        let (x, y) = groups(candidates);
        self.context.run(|encoder| {
            let mut pass = encoder.begin_compute_pass(&Default::default());
            pass.set_pipeline(&self.kernel.pipeline);
            pass.set_bind_group(0, &group, &[]);
            pass.dispatch_workgroups(x, y, 1);
        })
    }
}

impl Evaluator for GpuTestEvaluator<'_> {
    fn problem(&self) -> &Problem {
        &self.test.problem
    }

    fn backend(&self) -> BackendInfo {
        self.context.backend_info()
    }

    fn evaluate(&mut self, population: &[f64]) -> Result<Evaluation> {
        let problem = &self.test.problem;
        let (d, width) = (problem.variables.len(), problem.objectives.len());
        let mut evaluation = Vec::with_capacity(population.len() / d * width);
        for batch in population.chunks(BATCH * d) {
            let count = batch.len() / d;
            let lanes = count.next_multiple_of(BLOCK);
            let mut rows = vec![0.0f32; lanes * d];
            for (i, candidate) in batch.chunks_exact(d).enumerate() {
                for (k, x) in candidate.iter().enumerate() {
                    rows[(i / BLOCK * d + k) * BLOCK + i % BLOCK] = *x as f32;
                }
            }
            let bytes = (lanes * width * 4) as u64;
            let position =
                self.context
                    .buffer_of("candidates", bytemuck::cast_slice(&rows), Usage::STORAGE)?;
            let objectives = self
                .context
                .buffer("objectives", bytes, Usage::STORAGE | Usage::COPY_SRC)?;
            let readback = self
                .context
                .buffer("readback", bytes, Usage::MAP_READ | Usage::COPY_DST)?;
            self.dispatch((count, d), &self.plain, &position, &objectives)?;
            self.context
                .read_back((&objectives, 0), &readback, bytes, |data| {
                    let rows: &[f32] = bytemuck::cast_slice(data);
                    let at = |i: usize, k: usize| rows[(i / BLOCK * width + k) * BLOCK + i % BLOCK];
                    evaluation.extend((0..count * width).map(|j| f64::from(at(j / width, j % width))));
                })?;
        }
        let failures = failures(population, d, &mut evaluation, width);
        Ok(Evaluation {
            objectives: evaluation,
            failures,
            violations: Vec::new(),
        })
    }
}

impl DeviceObjectives for GpuTestEvaluator<'_> {
    fn problem(&self) -> &Problem {
        &self.test.problem
    }

    fn evaluate(
        &mut self,
        particles: usize,
        position: &wgpu::Buffer,
        objectives: &wgpu::Buffer,
    ) -> Result<()> {
        if self.free == 0 {
            return Err(Error::Device("a swarm without a free variable".to_owned()));
        }
        self.dispatch((particles, self.free), &self.scaled, position, objectives)
    }
}
