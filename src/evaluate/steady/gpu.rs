//! The graphics backend: `f32`, one lane per car.

use super::kernel::{STATE, Settling};
use super::problem::{AIM_FIGURES, Settled, SteadyProblem};
use crate::error::Result;
use crate::evaluate::gpu::shader::SteadyShape;
use crate::evaluate::gpu::{
    Binding, GpuContext, StepBatching, Trajectories, TrajectoryKernel, rounds_of, workgroup,
};
use crate::evaluate::sound::{joined, sound};
use crate::evaluate::{BackendInfo, Evaluation, Evaluator, Failure, ModelTable, Problem};
use crate::vehicle::model::STAGES;
use bytemuck::{Pod, Zeroable};
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

/// Settles cars on a graphics processor.
pub struct GpuSteadyEvaluator<'a> {
    steady: &'a SteadyProblem,
    table: ModelTable,
    trajectories: Trajectories<STATE>,
}

impl<'a> GpuSteadyEvaluator<'a> {
    /// An evaluator of `steady` on `context`'s device.
    ///
    /// # Errors
    /// [`crate::Error::Device`] if the kernel does not compile.
    pub fn new(steady: &'a SteadyProblem, context: Arc<GpuContext>) -> Result<Self> {
        let table = ModelTable::new(&steady.free, &steady.problem.variables);
        let shape = SteadyShape {
            model: steady.tyre_model(),
            sources: &table.sources,
            varying: table.varying.len(),
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
            source: &shape.source(),
            entry: "settle",
            table: &table,
            others: AIM_FIGURES,
            tables: vec![(Binding::Uniform, plan)],
            rounds_per_step: 1 + rounds_of(STAGES.len()),
        };
        Ok(Self {
            steady,
            trajectories: Trajectories::new(context, kernel)?,
            table,
        })
    }

    /// Cuts the work differently.
    pub fn with_batching(mut self, batching: StepBatching) -> Self {
        self.trajectories.cut(batching);
        self
    }

    /// The last states of one batch.
    fn settled(&mut self, batch: &[&[f64]]) -> Result<Vec<[f32; STATE]>> {
        let steady = self.steady;
        let rows = self.table.rows(&steady.free, batch);
        self.trajectories
            .load(batch.len(), &rows, |lane| steady.aim_figures(batch[lane]))?;
        let all = steady.plan().steps as usize;
        let mut done = 0;
        while done < all {
            done += self.trajectories.go_on(batch.len(), done, all - done)?;
        }
        self.trajectories.states(batch.len())
    }

    /// The last states of candidates, or why there are none.
    ///
    /// # Errors
    /// [`crate::Error::Device`] if the device fails.
    pub fn states(
        &mut self,
        candidates: &[&[f64]],
    ) -> Result<Vec<std::result::Result<Settling<f32>, Failure>>> {
        let steady = self.steady;
        let (preliminary, rows) = sound(candidates, |c| steady.preliminary_failure(c));
        let mut states = Vec::with_capacity(rows.len());
        for batch in rows.chunks(self.trajectories.batch_size()) {
            states.extend(self.settled(batch)?.into_iter().map(Settling::from_array));
        }
        Ok(joined(preliminary, states.into_iter()))
    }

    /// The trims of candidates, or why there are none.
    ///
    /// # Errors
    /// [`crate::Error::Device`] if the device fails.
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
        self.trajectories.context().backend_info()
    }

    fn evaluate(&mut self, population: &[f64]) -> Result<Evaluation> {
        let candidates: Vec<&[f64]> = population.chunks_exact(self.steady.dimensions()).collect();
        let trims = self.trims(&candidates)?;
        Ok(self.steady.evaluation_of(trims))
    }
}
