//! Lines of a swarm that lives on the device: neither candidates nor objectives cross the bus. Twin of
//! `shaders/line_swarm.wgsl`.

use crate::error::{Error, Result};
use crate::evaluate::gpu::shader::line_swarm;
use crate::evaluate::gpu::{Binding, GpuContext, Kernel};
use crate::evaluate::line::problem::LineProblem;
use crate::evaluate::resident::groups;
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
    /// Variables whose bounds differ, all variables, and objectives.
    widths: [usize; 3],
}

impl Exchange {
    /// # Errors
    /// [`Error::Device`] if no variable is free or the device fails.
    pub fn new(line: &LineProblem, context: &GpuContext) -> Result<Self> {
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
                row: *objective as u32,
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
            widths: [free, line.dimensions(), line.objectives().len()],
        })
    }

    fn dispatch(
        &self,
        context: &GpuContext,
        kernel: &Kernel,
        [first, candidates, stride]: [usize; 3],
        [table, from, to]: [&wgpu::Buffer; 3],
    ) -> Result<()> {
        let [rows, variables, objectives] = self.widths.map(|width| width as u32);
        let task = DeviceExchange {
            first: first as u32,
            candidates: candidates as u32,
            stride: stride as u32,
            variables,
            rows,
            objectives,
            padding: [0; 2],
        };
        context.write(&self.task, bytemuck::bytes_of(&task));
        let group = context.bind(kernel, &[&self.task, table, from, to])?;
        let (x, y) = groups(candidates);
        context.dispatch(kernel, &group, [x, y], None).map(drop)
    }

    /// Takes the variables of a batch from the swarm's positions. `batch` holds its first particle, the number of particles, and
    /// the distance between the rows of its figures.
    ///
    /// # Errors
    /// [`Error::Device`] if the device fails.
    pub fn take(
        &self,
        context: &GpuContext,
        batch: [usize; 3],
        position: &wgpu::Buffer,
        variables: &wgpu::Buffer,
    ) -> Result<()> {
        self.dispatch(context, &self.take, batch, [&self.variables, position, variables])
    }

    /// Gives a batch's objectives to the swarm.
    ///
    /// # Errors
    /// [`Error::Device`] if the device fails.
    pub fn give(
        &self,
        context: &GpuContext,
        batch: [usize; 3],
        results: &wgpu::Buffer,
        objectives: &wgpu::Buffer,
    ) -> Result<()> {
        self.dispatch(
            context,
            &self.give,
            batch,
            [&self.objectives, results, objectives],
        )
    }
}
