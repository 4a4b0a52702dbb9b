//! Candidates that a kernel takes on step by step: the figures of their cars and their states on the device, a batch at a time.

use super::DeviceKind;
use super::context::{Binding, GpuContext, Kernel};
use super::pacing::{Batching, Pacing, most_rounds};
use super::planes::planes;
use super::shader::base_vectors;
use crate::error::{Error, Result};
use crate::evaluate::ModelTable;
use bytemuck::{Pod, Zeroable};
use rayon::prelude::*;
use std::sync::Arc;
use wgpu::BufferUsages as Usage;

/// What a dispatch is to do. Twin of `TrajectoryStretch` in `shaders/trajectories.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct TrajectoryStretch {
    /// Candidates in this batch.
    pub candidates: u32,
    /// Distance between their rows in the buffers.
    pub stride: u32,
    /// The first step since the beginning.
    pub first_step: u32,
    /// How many steps.
    pub steps: u32,
}

/// Lanes of a workgroup on `context`'s device.
pub(crate) fn workgroup(context: &GpuContext) -> u32 {
    let limits = context.limits();
    context
        .tuning()
        .workgroup
        .min(limits.max_compute_invocations_per_workgroup)
        .min(limits.max_compute_workgroup_size_x)
}

/// A kernel that takes candidates on, and what it reads.
pub(crate) struct TrajectoryKernel<'k> {
    pub source: &'k str,
    pub entry: &'k str,
    /// The candidates' cars.
    pub table: &'k ModelTable,
    /// Figures of a candidate behind those of its car.
    pub others: usize,
    /// From binding 4 on.
    pub tables: Vec<(Binding, wgpu::Buffer)>,
    /// Rounds of its loops in a step.
    pub rounds_per_step: usize,
}

/// How the figures of a batch lie on the device.
#[derive(Clone, Copy)]
pub(crate) struct FigurePlanes {
    workgroup: usize,
    /// Figures of a candidate: those of its car that vary and the others.
    varying: usize,
    all: usize,
}

impl FigurePlanes {
    /// Distance between the planes of so many candidates.
    fn stride(self, candidates: usize) -> usize {
        candidates.next_multiple_of(self.workgroup)
    }

    /// The figures of candidates: the rows of their cars (see [`ModelTable::rows`]) and what `others` says of each.
    pub fn of<const OTHERS: usize>(
        self,
        candidates: usize,
        rows: &[f32],
        others: impl Fn(usize) -> [f64; OTHERS] + Sync,
    ) -> Vec<f32> {
        let others: Vec<[f64; OTHERS]> = (0..candidates).into_par_iter().map(&others).collect();
        let varying = self.varying;
        planes(
            [candidates, self.stride(candidates), self.all],
            |lane, figure| match figure.checked_sub(varying) {
                None => rows[lane * varying + figure],
                Some(other) => others[lane][other] as f32,
            },
        )
    }
}

/// Buffers that grow with the batch, and the kernel's bindings to them.
struct BatchBuffers {
    /// Candidates that fit.
    room: usize,
    /// Distance between the planes of the present batch.
    stride: usize,
    figures: wgpu::Buffer,
    progress: wgpu::Buffer,
    readback: wgpu::Buffer,
    group: wgpu::BindGroup,
}

/// Batches of candidates on a device, whose states have `STATE` figures.
pub(crate) struct Trajectories<const STATE: usize> {
    context: Arc<GpuContext>,
    kernel: Arc<Kernel>,
    batching: Batching,
    figures: FigurePlanes,
    stretch: wgpu::Buffer,
    base: wgpu::Buffer,
    tables: Vec<wgpu::Buffer>,
    batch: Option<BatchBuffers>,
    pacing: Pacing,
    dispatches: usize,
}

impl<const STATE: usize> Trajectories<STATE> {
    /// # Errors
    /// [`Error::Device`] if the kernel does not compile.
    pub fn new(context: Arc<GpuContext>, parts: TrajectoryKernel<'_>) -> Result<Self> {
        use Binding::{Read, Uniform, Write};
        let (kinds, tables): (Vec<_>, Vec<_>) = parts.tables.into_iter().unzip();
        let bindings = [vec![Uniform, Uniform, Read, Write], kinds].concat();
        let kernel = context.kernel(parts.source, parts.entry, &bindings)?;
        let mut base = parts.table.base.clone();
        base.resize(base_vectors(base.len()) * 4, 0.0);
        let base = context.buffer_of("parameters", bytemuck::cast_slice(&base), Usage::UNIFORM)?;
        let stretch = context.buffer(
            "stretch",
            size_of::<TrajectoryStretch>() as u64,
            Usage::UNIFORM | Usage::COPY_DST,
        )?;
        let varying = parts.table.varying.len();
        let figures = FigurePlanes {
            workgroup: workgroup(&context) as usize,
            varying,
            all: varying + parts.others,
        };
        Ok(Self {
            // A step of all lanes takes milliseconds on a software driver, and fills a large card.
            batching: match context.summary().kind {
                kind @ DeviceKind::Software => Batching::new(kind, context.tuning().lanes / 4, u64::MAX),
                kind => Batching::new(kind, context.tuning().lanes / 2, u64::MAX),
            },
            pacing: Pacing::new(parts.rounds_per_step, most_rounds(context.summary().kind)),
            figures,
            context,
            kernel,
            stretch,
            base,
            tables,
            batch: None,
            dispatches: 0,
        })
    }

    pub fn context(&self) -> &GpuContext {
        &self.context
    }

    /// Cross-sections the work differently.
    pub fn cut(&mut self, batching: Batching) {
        self.batching = batching;
        self.batch = None;
    }

    pub fn batching(&self) -> Batching {
        self.batching
    }

    /// Dispatches since the last call of [`Trajectories::count_anew`].
    pub fn dispatches(&self) -> usize {
        self.dispatches
    }

    pub fn count_anew(&mut self) {
        self.dispatches = 0;
    }

    /// The most candidates of one batch.
    pub fn batch_size(&self) -> usize {
        let limits = self.context.limits();
        let bytes = limits
            .max_storage_buffer_binding_size
            .min(limits.max_buffer_size)
            .min(self.batching.bytes);
        let planes = self.figures.all.max(STATE) as u64;
        let most_groups = limits.max_compute_workgroups_per_dimension as usize;
        let workgroup = self.figures.workgroup;
        let lanes = self.batching.lanes.min((bytes / (4 * planes)) as usize) / workgroup;
        lanes.clamp(1, most_groups) * workgroup
    }

    /// Makes room for a batch of `candidates`.
    fn reserve(&mut self, candidates: usize) -> Result<()> {
        let stride = self.figures.stride(candidates);
        if let Some(batch) = self.batch.as_mut().filter(|batch| batch.room >= stride) {
            batch.stride = stride;
            return Ok(());
        }
        // The old buffers go before the new ones come.
        self.batch = None;
        let context = &self.context;
        let bytes = |planes: usize| (planes * stride * 4) as u64;
        let figures = context.buffer(
            "figures",
            bytes(self.figures.all),
            Usage::STORAGE | Usage::COPY_DST,
        )?;
        let both_ways = Usage::STORAGE | Usage::COPY_SRC | Usage::COPY_DST;
        let progress = context.buffer("progress", bytes(STATE), both_ways)?;
        let readback = context.buffer("readback", bytes(STATE), Usage::MAP_READ | Usage::COPY_DST)?;
        let mut bound = vec![&self.stretch, &self.base, &figures, &progress];
        bound.extend(&self.tables);
        let group = context.bind(&self.kernel, &bound)?;
        self.batch = Some(BatchBuffers {
            room: stride,
            stride,
            figures,
            progress,
            readback,
            group,
        });
        Ok(())
    }

    fn buffers(&self) -> Result<&BatchBuffers> {
        self.batch
            .as_ref()
            .ok_or_else(|| Error::Device("a batch without buffers".to_owned()))
    }

    /// How the figures of a batch are to lie.
    pub fn figures(&self) -> FigurePlanes {
        self.figures
    }

    /// Makes room for a batch of `candidates` and puts its figures on the device.
    ///
    /// # Errors
    /// [`Error::Device`] if the device fails.
    pub fn load(&mut self, candidates: usize, figures: &[f32]) -> Result<()> {
        self.reserve(candidates)?;
        let batch = self.buffers()?;
        self.context.write(&batch.figures, bytemuck::cast_slice(figures));
        Ok(())
    }

    /// Takes a batch, whose figures are on the device, some steps further, as many as the last dispatch taught but `most`;
    /// returns how many.
    ///
    /// # Errors
    /// [`Error::Device`] if the device fails.
    pub fn go_on(&mut self, candidates: usize, first_step: usize, most: usize) -> Result<usize> {
        let lanes = self.figures.stride(candidates);
        let steps = self.pacing.steps(lanes, &self.batching).min(most);
        let ms = self.dispatch(candidates, first_step, steps)?;
        self.pacing.took(steps, lanes, ms);
        self.dispatches += 1;
        Ok(steps)
    }

    /// Takes a batch so many steps further; returns how long that took, ms.
    ///
    /// # Errors
    /// [`Error::Device`] if the device fails.
    pub fn dispatch(&self, candidates: usize, first_step: usize, steps: usize) -> Result<f64> {
        let batch = self.buffers()?;
        let stretch = TrajectoryStretch {
            candidates: candidates as u32,
            stride: batch.stride as u32,
            first_step: first_step as u32,
            steps: steps as u32,
        };
        self.context.write(&self.stretch, bytemuck::bytes_of(&stretch));
        let groups = candidates.div_ceil(self.figures.workgroup) as u32;
        self.context
            .dispatch(&self.kernel, &batch.group, [groups, 1], None)
    }

    /// Hands the planes from `first` on of the states of a batch, and the distance between them, to `read`.
    fn read_planes<T>(&self, first: usize, read: impl FnOnce(&[f32], usize) -> T) -> Result<T> {
        let buffers = self.buffers()?;
        let plane = (buffers.stride * 4) as u64;
        let bytes = plane * (STATE - first) as u64;
        let from = (&buffers.progress, plane * first as u64);
        self.context.read_back(from, &buffers.readback, bytes, |data| {
            read(bytemuck::cast_slice(data), buffers.stride)
        })
    }

    /// The last figure of the states of a batch.
    ///
    /// # Errors
    /// [`Error::Device`] if the device fails.
    pub fn last_figures<T>(&self, candidates: usize, read: impl FnOnce(&[f32]) -> T) -> Result<T> {
        self.read_planes(STATE - 1, |plane, _| read(&plane[..candidates]))
    }

    /// The states of a batch.
    ///
    /// # Errors
    /// [`Error::Device`] if the device fails.
    pub fn states(&self, candidates: usize) -> Result<Vec<[f32; STATE]>> {
        self.read_planes(0, |planes, stride| {
            (0..candidates)
                .into_par_iter()
                .map(|lane| std::array::from_fn(|k| planes[k * stride + lane]))
                .collect()
        })
    }

    /// Puts states of a batch, whose figures are on the device, in the place of those that it has there.
    ///
    /// # Errors
    /// [`Error::Device`] if the device fails.
    pub fn put(&self, states: &[[f32; STATE]]) -> Result<()> {
        let batch = self.buffers()?;
        let mut planes = vec![0.0f32; STATE * batch.stride];
        for (lane, state) in states.iter().enumerate() {
            for (plane, figure) in state.iter().enumerate() {
                planes[plane * batch.stride + lane] = *figure;
            }
        }
        self.context.write(&batch.progress, bytemuck::cast_slice(&planes));
        Ok(())
    }
}
