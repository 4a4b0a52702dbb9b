//! Lines of a swarm that lives on the device: neither candidates nor objectives cross the bus. Twin of
//! `shaders/line_swarm.wgsl`.

use super::gpu::GpuLineEvaluator;
use super::problem::{LineObjective, LineProblem};
use crate::error::{Error, Result};
use crate::evaluate::Problem;
use crate::evaluate::gpu::shader::line_swarm;
use crate::evaluate::gpu::{Binding, GpuContext, Kernel};
use crate::swarm::device::{DeviceObjectives, groups};
use bytemuck::{Pod, Zeroable};
use std::sync::Arc;
use wgpu::BufferUsages as Usage;

/// Twin of `Exchange` in `shaders/line_swarm.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct DeviceExchange {
    first: u32,
    candidates: u32,
    stride: u32,
    variables: u32,
    rows: u32,
    objectives: u32,
    /// Nothing: a uniform is a multiple of 16 bytes.
    padding: [u32; 2],
}

/// Twin of `Scaled` in `shaders/line_swarm.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Scaled {
    lower: f32,
    range: f32,
    row: u32,
}

/// What brings a swarm's positions to the line kernel and its figures back.
pub(super) struct Exchange {
    take: Arc<Kernel>,
    give: Arc<Kernel>,
    task: wgpu::Buffer,
    /// Bounds and rows of the variables, and the figures of the objectives.
    variables: wgpu::Buffer,
    objectives: wgpu::Buffer,
    /// Variables whose bounds differ.
    free: usize,
}

impl Exchange {
    fn new(line: &LineProblem, context: &GpuContext) -> Result<Self> {
        use Binding::{Read, Uniform, Write};
        let bindings = [Uniform, Read, Read, Write];
        let source = line_swarm();
        let mut free = 0;
        let variables: Vec<Scaled> = line
            .problem
            .variables
            .iter()
            .map(|v| {
                let moves = v.upper > v.lower;
                free += usize::from(moves);
                Scaled {
                    lower: v.lower as f32,
                    range: (v.upper - v.lower) as f32,
                    // A fixed variable has no row: with no range, any will do.
                    row: if moves { free as u32 - 1 } else { 0 },
                }
            })
            .collect();
        let figures: Vec<Scaled> = line
            .objectives()
            .iter()
            .map(|objective| Scaled {
                lower: 0.0,
                range: 1.0,
                row: figure(*objective),
            })
            .collect();
        if free == 0 {
            return Err(Error::Device("a swarm without a free variable".to_owned()));
        }
        let table = |label: &str, rows: &[Scaled]| {
            context.buffer_of(label, bytemuck::cast_slice(rows), Usage::STORAGE)
        };
        let size = size_of::<DeviceExchange>() as u64;
        Ok(Self {
            take: context.kernel(&source, "variables_of_positions", &bindings)?,
            give: context.kernel(&source, "objectives_of_figures", &bindings)?,
            task: context.buffer("exchange", size, Usage::UNIFORM | Usage::COPY_DST)?,
            variables: table("scaled variables", &variables)?,
            objectives: table("figures of objectives", &figures)?,
            free,
        })
    }

    fn dispatch(
        &self,
        context: &GpuContext,
        kernel: &Kernel,
        task: DeviceExchange,
        [table, from, to]: [&wgpu::Buffer; 3],
    ) -> Result<()> {
        context.write(&self.task, bytemuck::bytes_of(&task));
        let group = context.bind(kernel, &[&self.task, table, from, to])?;
        let (x, y) = groups(task.candidates as usize);
        context.dispatch(kernel, &group, [x, y], None).map(drop)
    }
}

/// Which of the kernel's figures an objective is made of.
fn figure(objective: LineObjective) -> u32 {
    match objective {
        LineObjective::Length => 0,
        LineObjective::LengthSquared => 1,
        LineObjective::Gamma => 2,
        LineObjective::Kappa2 => 3,
        LineObjective::LapTime => 4,
    }
}

impl DeviceObjectives for GpuLineEvaluator<'_> {
    fn problem(&self) -> &Problem {
        &self.line.problem
    }

    fn evaluate(
        &mut self,
        particles: usize,
        position: &wgpu::Buffer,
        objectives: &wgpu::Buffer,
    ) -> Result<()> {
        let context = Arc::clone(self.batches.context());
        let exchange = match self.exchange.take() {
            Some(exchange) => exchange,
            None => Exchange::new(self.line, &context)?,
        };
        let most = self.batches.batch_size();
        let mut first = 0;
        while first < particles {
            let candidates = (particles - first).min(most);
            self.batches.reserve(candidates)?;
            let (stride, variables, _) = self.batches.rows()?;
            let task = DeviceExchange {
                first: first as u32,
                candidates: candidates as u32,
                stride: stride as u32,
                variables: self.line.dimensions() as u32,
                rows: exchange.free as u32,
                objectives: self.line.objectives().len() as u32,
                padding: [0; 2],
            };
            let buffers = [&exchange.variables, position, variables];
            exchange.dispatch(&context, &exchange.take, task, buffers)?;
            self.batches.score_batch(candidates)?;
            let (_, _, results) = self.batches.rows()?;
            let buffers = [&exchange.objectives, results, objectives];
            exchange.dispatch(&context, &exchange.give, task, buffers)?;
            first += candidates;
        }
        self.exchange = Some(exchange);
        Ok(())
    }
}
