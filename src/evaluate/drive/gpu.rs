//! The graphics backend: `f32`, one lane per lap.

pub use crate::evaluate::gpu::Batching as DriveBatching;

use super::problem::{DriveProblem, LAP_FIGURES};
use crate::drive::kernel::{DrivenLap, STATE, ending};
use crate::error::Result;
use crate::evaluate::gpu::shader::{CarShape, DriveShape};
use crate::evaluate::gpu::{
    Batching, Binding, GpuContext, Trajectories, TrajectoryKernel, rounds_of, workgroup,
};
use crate::evaluate::{DeviceKernel, GpuBackend, ModelTable, OnDevice};
use crate::vehicle::model::STAGES;
use rayon::prelude::*;
use std::sync::Arc;
use wgpu::BufferUsages as Usage;

/// The drive kernel on a device.
pub struct DriveDevice {
    table: ModelTable,
    trajectories: Trajectories<STATE>,
}

impl DriveDevice {
    /// Puts the figures of a batch on the device.
    fn load(&mut self, drive: &DriveProblem, batch: &[&[f64]]) -> Result<()> {
        let rows = self.table.rows(&drive.free, batch);
        self.trajectories
            .load(batch.len(), &rows, |lane| drive.lap_figures(batch[lane]))
    }

    /// The last states of one batch, once the last lap has ended.
    fn driven(&mut self, drive: &DriveProblem, batch: &[&[f64]]) -> Result<Vec<[f32; STATE]>> {
        self.load(drive, batch)?;
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
}

/// Drives laps on a graphics processor.
pub type GpuDriveEvaluator<'a> = GpuBackend<'a, DriveProblem>;

impl OnDevice for DriveProblem {
    type Device = DriveDevice;
}

impl DeviceKernel<DriveProblem> for DriveDevice {
    fn open(drive: &DriveProblem, context: Arc<GpuContext>) -> Result<Self> {
        let table = ModelTable::new(&drive.free, &drive.problem.variables);
        let road = drive.road().stored::<f32>();
        let torque = drive.torque().stored::<f32>();
        let shape = DriveShape {
            car: CarShape {
                model: drive.tyre_model(),
                wheels: context.wheels(),
                sources: &table.sources,
                workgroup: workgroup(&context),
            },
            stretches: torque.stretches.len(),
            rows_ahead: road.rows_ahead,
            cells_ahead: road.cells_ahead,
            blends: road.plans_per_line > 1,
            relief_at: (!road.relief.is_empty()).then_some(road.path.len() / 4),
        };
        let storage =
            |label: &str, data: &[f32]| context.table(label, bytemuck::cast_slice(data), Usage::STORAGE);
        let stretches: Vec<[f32; 4]> = torque.stretches.iter().map(|s| [s[0], s[1], s[2], 0.0]).collect();
        let driver = drive.driver().stored::<f32>().to_row();
        use Binding::{Read, Uniform};
        let tables = vec![
            (
                Read,
                storage("paths", &[road.path.as_slice(), &road.relief].concat())?,
            ),
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
            trajectories: Trajectories::new(context, kernel)?,
            table,
        })
    }

    fn context(&self) -> &GpuContext {
        self.trajectories.context()
    }

    fn batching(&self) -> Batching {
        self.trajectories.batching()
    }

    fn cut(&mut self, batching: Batching) {
        self.trajectories.cut(batching);
    }

    fn outcomes(&mut self, drive: &DriveProblem, candidates: &[&[f64]]) -> Result<Vec<DrivenLap>> {
        self.trajectories.count_anew();
        let mut laps = Vec::with_capacity(candidates.len());
        for batch in candidates.chunks(self.trajectories.batch_size()) {
            let states = self.driven(drive, batch)?.into_par_iter();
            laps.par_extend(states.map(|s| drive.lap(s.map(f64::from))));
        }
        Ok(laps)
    }
}

impl GpuBackend<'_, DriveProblem> {
    /// Dispatches of the last evaluation.
    pub fn dispatches(&self) -> usize {
        self.device.trajectories.dispatches()
    }

    /// The states of candidates that can be driven, one batch of them, a step after the given ones, which is the
    /// `number`-th since the run-up began, from the first on.
    ///
    /// # Errors
    /// [`crate::Error::Device`] if the device fails.
    pub fn advance(
        &mut self,
        candidates: &[&[f64]],
        states: &[[f32; STATE]],
        number: usize,
    ) -> Result<Vec<[f32; STATE]>> {
        self.device.load(self.kind, candidates)?;
        let trajectories = &mut self.device.trajectories;
        trajectories.put(states)?;
        trajectories.dispatch(candidates.len(), number, 1)?;
        trajectories.states(candidates.len())
    }
}
