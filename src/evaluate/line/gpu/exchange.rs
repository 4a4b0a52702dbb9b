//! Lines and laps of a swarm that lives on the device: neither candidates nor objectives cross the bus. Twin of
//! `shaders/line_swarm.wgsl`.

use crate::error::{Error, Result};
use crate::evaluate::gpu::shader::line_swarm;
use crate::evaluate::gpu::{Binding, GpuContext, Kernel};
use crate::evaluate::resident::{failed_objective, groups, sliced_groups};
use crate::evaluate::{Failure, Variable};
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
    figures: u32,
    rows: u32,
    objectives: u32,
    /// What stands in the place of an objective that is no number.
    failed: f32,
    /// Nothing: a uniform is a multiple of 16 bytes.
    padding: u32,
}

/// Twin of `Scaled` in `shaders/line_swarm.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
pub(in crate::evaluate) struct Scaled {
    lower: f32,
    range: f32,
    row: u32,
    root: u32,
}

impl Scaled {
    /// A figure of all candidates alike: with no range, any row will do.
    pub fn fixed(value: f64) -> Self {
        Self {
            lower: value as f32,
            range: 0.0,
            row: 0,
            root: 0,
        }
    }

    /// An objective that is the result of that place over `unit`.
    pub fn of_result(row: usize, unit: f64) -> Self {
        Self {
            lower: 0.0,
            range: unit as f32,
            row: row as u32,
            root: 0,
        }
    }

    /// The same of the root of the result.
    pub fn of_root(row: usize) -> Self {
        Self {
            root: 1,
            ..Self::of_result(row, 1.0)
        }
    }

    /// The variables themselves.
    pub fn variables(variables: &[Variable]) -> Vec<Self> {
        let mut free = 0;
        let scaled = variables.iter().map(|v| {
            if !v.is_free() {
                return Self::fixed(v.lower);
            }
            free += 1;
            Self {
                lower: v.lower as f32,
                range: (v.upper - v.lower) as f32,
                row: free - 1,
                root: 0,
            }
        });
        scaled.collect()
    }
}

/// What brings a swarm's positions to the line kernel and its figures back.
pub(in crate::evaluate) struct Exchange {
    take: Arc<Kernel>,
    give: Arc<Kernel>,
    task: wgpu::Buffer,
    figures: wgpu::Buffer,
    objectives: wgpu::Buffer,
    /// Variables whose bounds differ, figures of a candidate, and objectives.
    widths: [usize; 3],
    failed: f32,
}

impl Exchange {
    /// For candidates with these figures and objectives, of `rows` variables whose bounds differ.
    ///
    /// # Errors
    /// [`Error::Device`] if no variable is free or the device fails.
    pub fn new(
        context: &GpuContext,
        rows: usize,
        (figures, objectives): (&[Scaled], &[Scaled]),
        without_cost: Failure,
    ) -> Result<Self> {
        use Binding::{Read, Uniform, Write};
        if rows == 0 {
            return Err(Error::Device("a swarm without a free variable".to_owned()));
        }
        let source = line_swarm();
        let kernel = |entry: &str| context.kernel(&source, entry, &[Uniform, Read, Read, Write]);
        let table = |label: &str, rows: &[u8]| context.buffer_of(label, rows, Usage::STORAGE);
        let size = size_of::<DeviceExchange>() as u64;
        Ok(Self {
            take: kernel("figures_of_positions")?,
            give: kernel("objectives_of_results")?,
            task: context.buffer("exchange", size, Usage::UNIFORM | Usage::COPY_DST)?,
            figures: table("scaled figures", bytemuck::cast_slice(figures))?,
            objectives: table("objectives of results", bytemuck::cast_slice(objectives))?,
            widths: [rows, figures.len(), objectives.len()],
            failed: failed_objective(without_cost),
        })
    }

    fn dispatch(
        &self,
        context: &GpuContext,
        (kernel, [x, y, z]): (&Kernel, [u32; 3]),
        [first, candidates, stride]: [usize; 3],
        [table, from, to]: [&wgpu::Buffer; 3],
    ) -> Result<()> {
        let [rows, figures, objectives] = self.widths.map(|width| width as u32);
        let task = DeviceExchange {
            first: first as u32,
            candidates: candidates as u32,
            stride: stride as u32,
            figures,
            rows,
            objectives,
            failed: self.failed,
            padding: 0,
        };
        context.write(&self.task, bytemuck::bytes_of(&task));
        let group = context.bind(kernel, &[&self.task, table, from, to])?;
        context.run_ahead(|encoder| {
            let mut pass = encoder.begin_compute_pass(&Default::default());
            pass.set_pipeline(&kernel.pipeline);
            pass.set_bind_group(0, &group, &[]);
            pass.dispatch_workgroups(x, y, z);
        })
    }

    /// Takes the figures of a batch from the swarm's positions. `batch` holds its first particle, the number of particles, and
    /// the distance between the rows of its figures.
    ///
    /// # Errors
    /// [`Error::Device`] if the device fails.
    pub fn take(
        &self,
        context: &GpuContext,
        batch: [usize; 3],
        position: &wgpu::Buffer,
        figures: &wgpu::Buffer,
    ) -> Result<()> {
        let groups = sliced_groups(context, batch[1], self.widths[1]);
        let buffers = [&self.figures, position, figures];
        self.dispatch(context, (&self.take, groups), batch, buffers)
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
        let (x, y) = groups(batch[1]);
        let buffers = [&self.objectives, results, objectives];
        self.dispatch(context, (&self.give, [x, y, 1]), batch, buffers)
    }
}
