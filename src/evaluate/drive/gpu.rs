//! The graphics backend: `f32`, one lane per lap.

use super::problem::{DriveProblem, LAP_FIGURES};
use crate::drive::kernel::{DrivenLap, STATE, ending};
use crate::error::{Error, Result};
use crate::evaluate::gpu::shader::{DriveShape, base_vectors};
use crate::evaluate::gpu::{Binding, GpuContext, Kernel, Pacing, StepBatching};
use crate::evaluate::{BackendInfo, Evaluation, Evaluator, Failure, ModelTable, Problem};
use crate::vehicle::model::STAGES;
use bytemuck::{Pod, Zeroable};
use rayon::prelude::*;
use std::sync::Arc;
use std::time::Instant;
use wgpu::BufferUsages as Usage;

/// What a dispatch is to do. Twin of `DriveStretch` in `shaders/drive.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct DriveStretch {
    /// Candidates in this batch.
    pub candidates: u32,
    /// Distance between their rows in the buffers.
    pub stride: u32,
    /// The first step since the run-up began.
    pub first_step: u32,
    /// How many steps.
    pub steps: u32,
}

/// The plane of [`crate::drive::kernel::DriveState::to_array`] that says how a lap ended, the last one.
const ENDING: usize = STATE - 1;
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

/// Drives laps on a graphics processor.
pub struct GpuDriveEvaluator<'a> {
    drive: &'a DriveProblem,
    table: ModelTable,
    context: Arc<GpuContext>,
    batching: StepBatching,
    kernel: Arc<Kernel>,
    workgroup: usize,
    stretch: wgpu::Buffer,
    base: wgpu::Buffer,
    /// In the order of the kernel's bindings 4 to 8.
    tables: [wgpu::Buffer; 5],
    batch: Option<BatchBuffers>,
    pacing: Pacing,
    dispatches: usize,
}

impl<'a> GpuDriveEvaluator<'a> {
    /// An evaluator of `drive` on `context`'s device.
    ///
    /// # Errors
    /// [`Error::Device`] if the kernel does not compile or the lines do not fit the device.
    pub fn new(drive: &'a DriveProblem, context: Arc<GpuContext>) -> Result<Self> {
        let limits = context.limits();
        let workgroup = WORKGROUP
            .min(limits.max_compute_invocations_per_workgroup)
            .min(limits.max_compute_workgroup_size_x);
        let table = ModelTable::new(&drive.free, &drive.problem.variables);
        let road = drive.road().stored::<f32>();
        let torque = drive.torque().stored::<f32>();
        let shape = DriveShape {
            model: drive.tyre_model(),
            sources: &table.sources,
            varying: table.varying.len(),
            stretches: torque.stretches.len(),
            rows_ahead: road.rows_ahead,
            cells_ahead: road.cells_ahead,
            blends: road.plans_per_line > 1,
            workgroup,
        };
        use Binding::{Read, Uniform, Write};
        let bindings = [Uniform, Uniform, Read, Write, Read, Read, Read, Uniform, Uniform];
        let kernel = context.kernel(&shape.source(), "drive", &bindings)?;
        let storage = |label: &str, data: &[f32]| {
            let bytes = size_of_val(data) as u64;
            let most = limits.max_storage_buffer_binding_size;
            if bytes > most {
                return Err(Error::Device(format!(
                    "{} holds at most {most} bytes of {label}, {bytes} are needed",
                    context.summary()
                )));
            }
            context.buffer_of(label, bytemuck::cast_slice(data), Usage::STORAGE)
        };
        let stretches: Vec<[f32; 4]> = torque.stretches.iter().map(|s| [s[0], s[1], s[2], 0.0]).collect();
        let driver = drive.driver().stored::<f32>().to_row();
        let tables = [
            storage("paths", &road.path)?,
            storage("plans", &road.plans)?,
            storage("courses", &road.courses)?,
            context.buffer_of("driver", bytemuck::cast_slice(&driver), Usage::UNIFORM)?,
            context.buffer_of("torque", bytemuck::cast_slice(&stretches), Usage::UNIFORM)?,
        ];
        let mut base = table.base.clone();
        base.resize(base_vectors(base.len()) * 4, 0.0);
        let base = context.buffer_of("parameters", bytemuck::cast_slice(&base), Usage::UNIFORM)?;
        let stretch = context.buffer(
            "stretch",
            size_of::<DriveStretch>() as u64,
            Usage::UNIFORM | Usage::COPY_DST,
        )?;
        Ok(Self {
            drive,
            table,
            batching: StepBatching::for_kind(context.summary().kind),
            context,
            kernel,
            workgroup: workgroup as usize,
            stretch,
            base,
            tables,
            batch: None,
            pacing: Pacing::new(1 + STAGES.len() + drive.torque().stretches.len()),
            dispatches: 0,
        })
    }

    /// Cuts the work differently.
    pub fn with_batching(mut self, batching: StepBatching) -> Self {
        self.batching = batching;
        self.batch = None;
        self
    }

    /// How the work is cut.
    pub fn batching(&self) -> StepBatching {
        self.batching
    }

    /// Dispatches of the last evaluation.
    pub fn dispatches(&self) -> usize {
        self.dispatches
    }

    /// Figures of a candidate on the device.
    fn figures(&self) -> usize {
        self.table.varying.len() + LAP_FIGURES
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
        let progress = context.buffer(
            "progress",
            bytes(STATE),
            Usage::STORAGE | Usage::COPY_SRC | Usage::COPY_DST,
        )?;
        let readback = context.buffer("readback", bytes(STATE), Usage::MAP_READ | Usage::COPY_DST)?;
        let [path, plans, courses, driver, torque] = &self.tables;
        let group = context.bind(
            &self.kernel,
            &[
                &self.stretch,
                &self.base,
                &figures,
                &progress,
                path,
                plans,
                courses,
                driver,
                torque,
            ],
        )?;
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

    /// Hands the planes from `first` on of the state of all candidates to `read`.
    fn read_planes<T>(&self, first: usize, read: impl FnOnce(&[f32]) -> T) -> Result<T> {
        let buffers = self.buffers()?;
        let plane = (buffers.stride * 4) as u64;
        let bytes = plane * (STATE - first) as u64;
        self.context.run(|encoder| {
            let from = plane * first as u64;
            encoder.copy_buffer_to_buffer(&buffers.progress, from, &buffers.readback, 0, bytes);
        })?;
        self.context
            .read(&buffers.readback, bytes, |data| read(bytemuck::cast_slice(data)))
    }

    /// Drives a batch, whose figures are on the device, for some steps; hands back how long that took, ms.
    fn dispatch(&self, candidates: usize, first_step: usize, steps: usize) -> Result<f64> {
        let batch = self.buffers()?;
        let stretch = DriveStretch {
            candidates: candidates as u32,
            stride: batch.stride as u32,
            first_step: first_step as u32,
            steps: steps as u32,
        };
        self.context.write(&self.stretch, bytemuck::bytes_of(&stretch));
        let begin = Instant::now();
        self.context.run(|encoder| {
            let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
                label: Some("drive"),
                timestamp_writes: None,
            });
            pass.set_pipeline(&self.kernel.pipeline);
            pass.set_bind_group(0, &batch.group, &[]);
            pass.dispatch_workgroups(candidates.div_ceil(self.workgroup) as u32, 1, 1);
        })?;
        Ok((begin.elapsed().as_secs_f64() * 1e3).max(1e-3))
    }

    /// Drives one batch, whose figures are on the device, until the last lap has ended.
    fn drive_batch(&mut self, candidates: usize) -> Result<()> {
        let mut first_step = 0;
        loop {
            let lanes = candidates.next_multiple_of(self.workgroup);
            let steps = self.pacing.steps(lanes, &self.batching);
            let ms = self.dispatch(candidates, first_step, steps)?;
            self.pacing.took(steps, lanes, ms);
            self.dispatches += 1;
            first_step += steps;
            let under_way = self.read_planes(ENDING, |plane| {
                plane[..candidates]
                    .iter()
                    .any(|x| f64::from(*x) == ending::UNDER_WAY)
            })?;
            if !under_way {
                return Ok(());
            }
        }
    }

    /// Makes room for a batch and puts its figures on the device.
    fn load(&mut self, batch: &[&[f64]]) -> Result<()> {
        let varying = self.table.varying.len();
        self.reserve(batch.len())?;
        let stride = self.buffers()?.stride;
        let by_candidate = self.table.rows(&self.drive.free, batch);
        // Figure by figure, so that neighbouring lanes read neighbouring memory.
        let mut figures = vec![0.0f32; stride * self.figures()];
        for (lane, candidate) in batch.iter().enumerate() {
            let row = by_candidate[lane * varying..(lane + 1) * varying].iter().copied();
            let lap = self.drive.lap_figures(candidate).map(|x| x as f32);
            for (figure, value) in row.chain(lap).enumerate() {
                figures[figure * stride + lane] = value;
            }
        }
        self.context
            .write(&self.buffers()?.figures, bytemuck::cast_slice(&figures));
        Ok(())
    }

    /// The states of a batch.
    fn states(&self, candidates: usize) -> Result<Vec<[f32; STATE]>> {
        let stride = self.buffers()?.stride;
        self.read_planes(0, |planes| {
            (0..candidates)
                .map(|lane| std::array::from_fn(|k| planes[k * stride + lane]))
                .collect()
        })
    }

    /// The states of candidates that can be driven, one batch of them, a step after the given ones, which is the
    /// `number`-th since the run-up began, from the first on.
    ///
    /// # Errors
    /// [`Error::Device`] if the device fails.
    pub fn advance(
        &mut self,
        candidates: &[&[f64]],
        states: &[[f32; STATE]],
        number: usize,
    ) -> Result<Vec<[f32; STATE]>> {
        self.load(candidates)?;
        let batch = self.buffers()?;
        let mut planes = vec![0.0f32; STATE * batch.stride];
        for (lane, state) in states.iter().enumerate() {
            for (plane, figure) in state.iter().enumerate() {
                planes[plane * batch.stride + lane] = *figure;
            }
        }
        self.context.write(&batch.progress, bytemuck::cast_slice(&planes));
        self.dispatch(candidates.len(), number, 1)?;
        self.states(candidates.len())
    }

    /// The laps of candidates that can be driven.
    fn driven(&mut self, rows: &[&[f64]]) -> Result<Vec<DrivenLap>> {
        let mut laps = Vec::with_capacity(rows.len());
        for batch in rows.chunks(self.batch_size()) {
            self.load(batch)?;
            self.drive_batch(batch.len())?;
            let states = self.states(batch.len())?;
            laps.extend(states.iter().map(|s| self.drive.lap(s.map(f64::from))));
        }
        Ok(laps)
    }

    /// The laps of candidates.
    ///
    /// # Errors
    /// [`Error::Device`] if the device fails.
    pub fn laps(&mut self, candidates: &[&[f64]]) -> Result<Vec<std::result::Result<DrivenLap, Failure>>> {
        let drive = self.drive;
        self.dispatches = 0;
        let preliminary: Vec<_> = candidates
            .par_iter()
            .map(|c| drive.preliminary_failure(c))
            .collect();
        // Only what can be driven takes a lane.
        let rows: Vec<&[f64]> = candidates
            .iter()
            .zip(&preliminary)
            .filter(|(_, failure)| failure.is_none())
            .map(|(candidate, _)| *candidate)
            .collect();
        let mut driven = self.driven(&rows)?.into_iter();
        Ok(preliminary
            .into_iter()
            .map(|failure| match failure {
                Some(failure) => Err(failure),
                None => driven.next().ok_or(Failure::Undefined),
            })
            .collect())
    }
}

impl Evaluator for GpuDriveEvaluator<'_> {
    fn problem(&self) -> &Problem {
        &self.drive.problem
    }

    fn backend(&self) -> BackendInfo {
        self.context.backend_info()
    }

    fn evaluate(&mut self, population: &[f64]) -> Result<Evaluation> {
        let candidates: Vec<&[f64]> = population.chunks_exact(self.drive.dimensions().max(1)).collect();
        let laps = self.laps(&candidates)?;
        let rows = laps.into_iter().map(|lap| self.drive.objective_row(lap));
        Ok(Evaluation::of_rows(rows.collect()))
    }
}
