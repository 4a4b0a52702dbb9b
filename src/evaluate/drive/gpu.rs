//! The graphics backend: `f32`, one lane per lap.

pub use crate::evaluate::gpu::Batching as DriveBatching;

use super::problem::{DriveProblem, LAP_FIGURES};
use crate::drive::kernel::{DrivenLap, STATE, ending};
use crate::error::Result;
use crate::evaluate::gpu::shader::{CarShape, DriveShape};
use crate::evaluate::gpu::{
    Batching, Binding, FigurePlanes, GpuContext, Trajectories, TrajectoryKernel, made_ahead, rounds_of,
    workgroup,
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

/// The figures of a batch.
fn figures_of(drive: &DriveProblem, table: &ModelTable, planes: FigurePlanes, batch: &[&[f64]]) -> Vec<f32> {
    let rows = table.rows(&drive.free, batch);
    planes.of(batch.len(), &rows, |lane| drive.lap_figures(batch[lane]))
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
        let stretches = torque.stretches.iter().flat_map(|s| [s[0], s[1], s[2], 0.0]);
        let cornering = drive.cornering().stored::<f32>();
        let known: Vec<f32> = stretches.chain(cornering.figures).collect();
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
                context.buffer_of("torque", bytemuck::cast_slice(&known), Usage::UNIFORM)?,
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
        let Self { table, trajectories } = self;
        let mut laps = Vec::with_capacity(candidates.len());
        let planes = trajectories.figures();
        let figures = |batch: &[&[f64]]| figures_of(drive, table, planes, batch);
        let batches = candidates.chunks(trajectories.batch_size());
        made_ahead(batches, figures, |batch, figures| {
            trajectories.load(batch.len(), &figures)?;
            let mut done = 0;
            loop {
                done += trajectories.go_on(batch.len(), done, usize::MAX)?;
                // How a lap ended is the last figure of its state.
                let under_way = trajectories.last_figures(batch.len(), |endings| {
                    endings.iter().any(|x| f64::from(*x) == ending::UNDER_WAY)
                })?;
                if !under_way {
                    break;
                }
            }
            let states = trajectories.states(batch.len())?.into_par_iter();
            laps.par_extend(states.map(|s| drive.lap(s.map(f64::from))));
            Ok(())
        })?;
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
        let DriveDevice { table, trajectories } = &mut self.device;
        let figures = figures_of(self.kind, table, trajectories.figures(), candidates);
        trajectories.load(candidates.len(), &figures)?;
        trajectories.put(states)?;
        trajectories.dispatch(candidates.len(), number, 1)?;
        trajectories.states(candidates.len())
    }
}
