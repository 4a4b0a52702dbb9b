//! The graphics backend: `f32`, one lane per car.

use super::kernel::{STATE, Settling};
use super::problem::{AIM_FIGURES, SteadyProblem};
use crate::error::Result;
use crate::evaluate::gpu::shader::CarShape;
use crate::evaluate::gpu::{
    Batching, Binding, GpuContext, Trajectories, TrajectoryKernel, made_ahead, rounds_of, workgroup,
};
use crate::evaluate::{DeviceKernel, GpuBackend, ModelTable, OnDevice};
use crate::vehicle::model::STAGES;
use bytemuck::{Pod, Zeroable};
use rayon::prelude::*;
use std::sync::Arc;

/// How candidates are brought to settle. Twin of `SettlePlan` in `shaders/steady.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct DevicePlan {
    /// Length of a step, s.
    pub step: f32,
    /// Share of the steering angle that each of the first steps adds.
    pub steer_per_step: f32,
    /// How fast slip follows the push, s/m.
    pub gain: f32,
}

/// The kernel of steady-state cornering on a device.
pub struct SteadyDevice {
    table: ModelTable,
    trajectories: Trajectories<STATE>,
}

/// Settles cars on a graphics processor.
pub type GpuSteadyEvaluator<'a> = GpuBackend<'a, SteadyProblem>;

impl OnDevice for SteadyProblem {
    type Device = SteadyDevice;
}

impl DeviceKernel<SteadyProblem> for SteadyDevice {
    fn open(steady: &SteadyProblem, context: Arc<GpuContext>) -> Result<Self> {
        let table = ModelTable::new(&steady.free, &steady.problem.variables);
        let shape = CarShape {
            model: steady.tyre_model(),
            wheels: context.wheels(),
            sources: &table.sources,
            workgroup: workgroup(&context),
        };
        let plan = steady.plan().stored::<f32>();
        let plan = DevicePlan {
            step: plan.step,
            steer_per_step: plan.steer_per_step,
            gain: plan.gain,
        };
        let plan = context.buffer_of("plan", bytemuck::bytes_of(&plan), wgpu::BufferUsages::UNIFORM)?;
        let kernel = TrajectoryKernel {
            source: &shape.steady(),
            entry: "settle",
            table: &table,
            others: AIM_FIGURES,
            tables: vec![(Binding::Uniform, plan)],
            rounds_per_step: 1 + rounds_of(STAGES.len()),
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

    fn outcomes(&mut self, steady: &SteadyProblem, candidates: &[&[f64]]) -> Result<Vec<Settling<f64>>> {
        let Self { table, trajectories } = self;
        let mut found = Vec::with_capacity(candidates.len());
        let all = steady.plan().steps as usize;
        let planes = trajectories.figures();
        let figures = |batch: &[&[f64]]| {
            let rows = table.rows(&steady.free, batch);
            planes.of(batch.len(), &rows, |lane| steady.aim_figures(batch[lane]))
        };
        let batches = candidates.chunks(trajectories.batch_size());
        made_ahead(batches, figures, |batch, figures| {
            trajectories.load(batch.len(), &figures)?;
            let mut done = 0;
            while done < all {
                done += trajectories.go_on(batch.len(), done, all - done)?;
            }
            let states = trajectories.states(batch.len())?.into_par_iter();
            found.par_extend(states.map(|state| Settling::from_array(state).widened()));
            Ok(())
        })?;
        Ok(found)
    }
}
