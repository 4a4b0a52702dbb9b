//! The graphics backend: `f32`, one lane per lap.

use super::problem::{DriveProblem, LAP_FIGURES};
use crate::drive::kernel::{DrivenLap, STATE, ending};
use crate::error::{Error, Result};
use crate::evaluate::gpu::shader::DriveShape;
use crate::evaluate::gpu::{
    Binding, GpuContext, StepBatching, Trajectories, TrajectoryKernel, rounds_of, workgroup,
};
use crate::evaluate::sound::{joined, sound};
use crate::evaluate::{BackendInfo, Evaluation, Evaluator, Failure, ModelTable, Problem};
use crate::vehicle::model::STAGES;
use std::sync::Arc;
use wgpu::BufferUsages as Usage;

/// Drives laps on a graphics processor.
pub struct GpuDriveEvaluator<'a> {
    drive: &'a DriveProblem,
    table: ModelTable,
    trajectories: Trajectories<STATE>,
}

impl<'a> GpuDriveEvaluator<'a> {
    /// An evaluator of `drive` on `context`'s device.
    ///
    /// # Errors
    /// [`Error::Device`] if the kernel does not compile or the lines do not fit the device.
    pub fn new(drive: &'a DriveProblem, context: Arc<GpuContext>) -> Result<Self> {
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
            workgroup: workgroup(&context),
        };
        let storage = |label: &str, data: &[f32]| {
            let bytes = size_of_val(data) as u64;
            let most = context.limits().max_storage_buffer_binding_size;
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
        use Binding::{Read, Uniform};
        let tables = vec![
            (Read, storage("paths", &road.path)?),
            (Read, storage("plans", &road.plans)?),
            (Read, storage("courses", &road.courses)?),
            (
                Uniform,
                context.buffer_of("driver", bytemuck::cast_slice(&driver), Usage::UNIFORM)?,
            ),
            (
                Uniform,
                context.buffer_of("torque", bytemuck::cast_slice(&stretches), Usage::UNIFORM)?,
            ),
        ];
        let kernel = TrajectoryKernel {
            source: &shape.source(),
            entry: "drive",
            table: &table,
            others: LAP_FIGURES,
            tables,
            rounds_per_step: 1 + rounds_of(STAGES.len()) + rounds_of(drive.torque().stretches.len()),
        };
        Ok(Self {
            drive,
            trajectories: Trajectories::new(context, kernel)?,
            table,
        })
    }

    /// Cuts the work differently.
    pub fn with_batching(mut self, batching: StepBatching) -> Self {
        self.trajectories.cut(batching);
        self
    }

    /// How the work is cut.
    pub fn batching(&self) -> StepBatching {
        self.trajectories.batching()
    }

    /// Dispatches of the last evaluation.
    pub fn dispatches(&self) -> usize {
        self.trajectories.dispatches()
    }

    /// Puts the figures of a batch on the device.
    fn load(&mut self, batch: &[&[f64]]) -> Result<()> {
        let drive = self.drive;
        let rows = self.table.rows(&drive.free, batch);
        self.trajectories
            .load(batch.len(), &rows, |lane| drive.lap_figures(batch[lane]))
    }

    /// The last states of one batch, once the last lap has ended.
    fn driven(&mut self, batch: &[&[f64]]) -> Result<Vec<[f32; STATE]>> {
        self.load(batch)?;
        let mut done = 0;
        loop {
            done += self.trajectories.go_on(batch.len(), done, usize::MAX)?;
            // How a lap ended is the last figure of its state.
            let under_way = self.trajectories.last_figures(batch.len(), |endings| {
                endings.iter().any(|x| f64::from(*x) == ending::UNDER_WAY)
            })?;
            if !under_way {
                return self.trajectories.states(batch.len());
            }
        }
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
        self.trajectories.put(states)?;
        self.trajectories.dispatch(candidates.len(), number, 1)?;
        self.trajectories.states(candidates.len())
    }

    /// The laps of candidates.
    ///
    /// # Errors
    /// [`Error::Device`] if the device fails.
    pub fn laps(&mut self, candidates: &[&[f64]]) -> Result<Vec<std::result::Result<DrivenLap, Failure>>> {
        let drive = self.drive;
        self.trajectories.count_anew();
        let (preliminary, rows) = sound(candidates, |c| drive.preliminary_failure(c));
        let mut laps = Vec::with_capacity(rows.len());
        for batch in rows.chunks(self.trajectories.batch_size()) {
            let states = self.driven(batch)?.into_iter();
            laps.extend(states.map(|s| drive.lap(s.map(f64::from))));
        }
        Ok(joined(preliminary, laps.into_iter()))
    }
}

impl Evaluator for GpuDriveEvaluator<'_> {
    fn problem(&self) -> &Problem {
        &self.drive.problem
    }

    fn backend(&self) -> BackendInfo {
        self.trajectories.context().backend_info()
    }

    fn evaluate(&mut self, population: &[f64]) -> Result<Evaluation> {
        let candidates: Vec<&[f64]> = population.chunks_exact(self.drive.dimensions().max(1)).collect();
        let laps = self.laps(&candidates)?;
        let rows = laps.into_iter().map(|lap| self.drive.objective_row(lap));
        Ok(Evaluation::of_rows(rows.collect()))
    }
}
