//! The graphics backend: `f32`, one lane per car.

use super::kernel::{STATE, Settling};
use super::problem::{AIM_FIGURES, Settled, SteadyProblem, joined};
use crate::error::{Error, Result};
use crate::evaluate::gpu::shader::{SteadyShape, base_vectors};
use crate::evaluate::gpu::{Binding, GpuContext, Kernel, Pacing, StepBatching};
use crate::evaluate::{BackendInfo, Evaluation, Evaluator, Failure, ModelTable, Problem};
use crate::vehicle::model::STAGES;
use bytemuck::{Pod, Zeroable};
use std::sync::Arc;
use std::time::Instant;
use wgpu::BufferUsages as Usage;

/// What a dispatch is to do. Twin of `SteadyStretch` in `shaders/steady.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct SteadyStretch {
    /// Candidates in this batch.
    pub candidates: u32,
    /// Distance between their rows in the buffers.
    pub stride: u32,
    /// The first step.
    pub first_step: u32,
    /// How many steps.
    pub steps: u32,
    /// Length of a step, s.
    pub step: f32,
    /// Share of the steering angle that each of the first steps adds.
    pub steer_per_step: f32,
    /// How fast slip follows the push, s/m.
    pub gain: f32,
}

/// Lanes of a workgroup, where the device allows: a multiple of every device's subgroup.
const WORKGROUP: u32 = 64;

/// Buffers that grow with the batch, and the kernel's bindings to them.
struct BatchBuffers {
    stride: usize,
    figures: wgpu::Buffer,
    progress: wgpu::Buffer,
    readback: wgpu::Buffer,
    group: wgpu::BindGroup,
}

/// Settles cars on a graphics processor.
pub struct GpuSteadyEvaluator<'a> {
    steady: &'a SteadyProblem,
    table: ModelTable,
    context: Arc<GpuContext>,
    batching: StepBatching,
    kernel: Arc<Kernel>,
    workgroup: usize,
    stretch: wgpu::Buffer,
    base: wgpu::Buffer,
    batch: Option<BatchBuffers>,
    pacing: Pacing,
}

impl<'a> GpuSteadyEvaluator<'a> {
    /// An evaluator of `steady` on `context`'s device.
    ///
    /// # Errors
    /// [`Error::Device`] if the kernel does not compile.
    pub fn new(steady: &'a SteadyProblem, context: Arc<GpuContext>) -> Result<Self> {
        let limits = context.limits();
        let workgroup = WORKGROUP
            .min(limits.max_compute_invocations_per_workgroup)
            .min(limits.max_compute_workgroup_size_x);
        let table = ModelTable::new(&steady.free, &steady.problem.variables);
        let shape = SteadyShape {
            model: steady.tyre_model(),
            sources: &table.sources,
            varying: table.varying.len(),
            workgroup,
        };
        use Binding::{Read, Uniform, Write};
        let kernel = context.kernel(&shape.source(), "settle", &[Uniform, Uniform, Read, Write])?;
        let mut base = table.base.clone();
        base.resize(base_vectors(base.len()) * 4, 0.0);
        let base = context.buffer_of("parameters", bytemuck::cast_slice(&base), Usage::UNIFORM)?;
        let stretch = context.buffer(
            "stretch",
            size_of::<SteadyStretch>() as u64,
            Usage::UNIFORM | Usage::COPY_DST,
        )?;
        Ok(Self {
            steady,
            table,
            batching: StepBatching::for_kind(context.summary().kind),
            context,
            kernel,
            workgroup: workgroup as usize,
            stretch,
            base,
            batch: None,
            pacing: Pacing::new(1 + STAGES.len()),
        })
    }

    /// Cuts the work differently.
    pub fn with_batching(mut self, batching: StepBatching) -> Self {
        self.batching = batching;
        self.batch = None;
        self
    }

    /// Figures of a candidate on the device.
    fn figures(&self) -> usize {
        self.table.varying.len() + AIM_FIGURES
    }

    /// The most candidates of one batch.
    fn batch_size(&self) -> usize {
        let limits = self.context.limits();
        let binding = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
        let planes = self.figures().max(STATE) as u64;
        let most_groups = limits.max_compute_workgroups_per_dimension as usize;
        let lanes = self.batching.lanes.min((binding / (4 * planes)) as usize) / self.workgroup;
        lanes.clamp(1, most_groups) * self.workgroup
    }

    /// Makes room for a batch of `candidates`.
    fn reserve(&mut self, candidates: usize) -> Result<()> {
        let stride = candidates.next_multiple_of(self.workgroup);
        if self.batch.as_ref().is_some_and(|b| b.stride >= stride) {
            return Ok(());
        }
        // The old buffers go before the new ones come.
        self.batch = None;
        let context = &self.context;
        let bytes = |planes: usize| (planes * stride * 4) as u64;
        let figures = context.buffer("figures", bytes(self.figures()), Usage::STORAGE | Usage::COPY_DST)?;
        let progress = context.buffer("progress", bytes(STATE), Usage::STORAGE | Usage::COPY_SRC)?;
        let readback = context.buffer("readback", bytes(STATE), Usage::MAP_READ | Usage::COPY_DST)?;
        let group = context.bind(&self.kernel, &[&self.stretch, &self.base, &figures, &progress])?;
        self.batch = Some(BatchBuffers {
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

    /// Makes room for a batch and puts its figures on the device.
    fn load(&mut self, batch: &[&[f64]]) -> Result<()> {
        let varying = self.table.varying.len();
        self.reserve(batch.len())?;
        let stride = self.buffers()?.stride;
        let by_candidate = self.table.rows(&self.steady.free, batch);
        // Figure by figure, so that neighbouring lanes read neighbouring memory.
        let mut figures = vec![0.0f32; stride * self.figures()];
        for (lane, candidate) in batch.iter().enumerate() {
            let row = by_candidate[lane * varying..(lane + 1) * varying].iter().copied();
            let aim = self.steady.aim_figures(candidate).map(|x| x as f32);
            for (figure, value) in row.chain(aim).enumerate() {
                figures[figure * stride + lane] = value;
            }
        }
        self.context
            .write(&self.buffers()?.figures, bytemuck::cast_slice(&figures));
        Ok(())
    }

    /// Takes a batch, whose figures are on the device, some steps further; hands back how long that took, ms.
    fn dispatch(&self, candidates: usize, first_step: usize, steps: usize) -> Result<f64> {
        let batch = self.buffers()?;
        let plan = self.steady.plan().stored::<f32>();
        let stretch = SteadyStretch {
            candidates: candidates as u32,
            stride: batch.stride as u32,
            first_step: first_step as u32,
            steps: steps as u32,
            step: plan.step,
            steer_per_step: plan.steer_per_step,
            gain: plan.gain,
        };
        self.context.write(&self.stretch, bytemuck::bytes_of(&stretch));
        let begin = Instant::now();
        self.context.run(|encoder| {
            let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
                label: Some("settle"),
                timestamp_writes: None,
            });
            pass.set_pipeline(&self.kernel.pipeline);
            pass.set_bind_group(0, &batch.group, &[]);
            pass.dispatch_workgroups(candidates.div_ceil(self.workgroup) as u32, 1, 1);
        })?;
        Ok((begin.elapsed().as_secs_f64() * 1e3).max(1e-3))
    }

    /// The last states of one batch, whose figures are on the device.
    fn settle_batch(&mut self, candidates: usize) -> Result<Vec<Settling<f32>>> {
        let lanes = candidates.next_multiple_of(self.workgroup);
        let all = self.steady.plan().steps as usize;
        let mut first_step = 0;
        while first_step < all {
            let steps = self.pacing.steps(lanes, &self.batching).min(all - first_step);
            let ms = self.dispatch(candidates, first_step, steps)?;
            self.pacing.took(steps, lanes, ms);
            first_step += steps;
        }
        let buffers = self.buffers()?;
        let stride = buffers.stride;
        let bytes = (stride * STATE * 4) as u64;
        self.context.run(|encoder| {
            encoder.copy_buffer_to_buffer(&buffers.progress, 0, &buffers.readback, 0, bytes);
        })?;
        self.context.read(&buffers.readback, bytes, |data| {
            let planes: &[f32] = bytemuck::cast_slice(data);
            let state = |lane: usize| std::array::from_fn(|k| planes[k * stride + lane]);
            (0..candidates)
                .map(|lane| Settling::from_array(state(lane)))
                .collect()
        })
    }

    /// The last states of candidates, or why there are none.
    ///
    /// # Errors
    /// [`Error::Device`] if the device fails.
    pub fn states(
        &mut self,
        candidates: &[&[f64]],
    ) -> Result<Vec<std::result::Result<Settling<f32>, Failure>>> {
        let (preliminary, rows) = self.steady.sound(candidates);
        let mut states = Vec::with_capacity(rows.len());
        for batch in rows.chunks(self.batch_size()) {
            self.load(batch)?;
            states.extend(self.settle_batch(batch.len())?);
        }
        Ok(joined(preliminary, states.into_iter()))
    }

    /// The trims of candidates, or why there are none.
    ///
    /// # Errors
    /// [`Error::Device`] if the device fails.
    pub fn trims(&mut self, candidates: &[&[f64]]) -> Result<Vec<std::result::Result<Settled, Failure>>> {
        let states = self.states(candidates)?;
        Ok(self.steady.trims_of(candidates, states))
    }
}

impl Evaluator for GpuSteadyEvaluator<'_> {
    fn problem(&self) -> &Problem {
        &self.steady.problem
    }

    fn backend(&self) -> BackendInfo {
        self.context.backend_info()
    }

    fn evaluate(&mut self, population: &[f64]) -> Result<Evaluation> {
        let candidates: Vec<&[f64]> = population.chunks_exact(self.steady.dimensions()).collect();
        let trims = self.trims(&candidates)?;
        Ok(self.steady.evaluation_of(trims))
    }
}
