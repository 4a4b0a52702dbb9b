//! The graphics backend: `f32`, one lane per line, for populations from the host and for swarms that live on the device.

mod batches;
mod exchange;
mod tables;

pub use crate::evaluate::gpu::Batching as LineBatching;
pub use batches::LineStretch;
pub(in crate::evaluate) use batches::{LineBatches, LineKernel};
pub use tables::DeviceSection;
pub(in crate::evaluate) use tables::LineTables;

use super::problem::{LineObjective, LineProblem, MEASURES, Measures};
use crate::error::Result;
use crate::evaluate::gpu::{Batching, GpuContext};
use crate::evaluate::{DeviceKernel, GpuBackend, OnDevice, ProblemKind};
use crate::line::EnvelopeTable;
pub(in crate::evaluate) use exchange::{Exchange, Scaled};
use std::sync::Arc;

/// The line kernel on a device.
pub struct LineDevice {
    batches: LineBatches<MEASURES>,
    /// For swarms that live on the device.
    exchange: Option<Exchange>,
}

/// Scores lines on a graphics processor.
pub type GpuLineEvaluator<'a> = GpuBackend<'a, LineProblem>;

impl OnDevice for LineProblem {
    type Device = LineDevice;
}

impl DeviceKernel<LineProblem> for LineDevice {
    fn open(line: &LineProblem, context: Arc<GpuContext>) -> Result<Self> {
        let plan = line.plan().stored::<f32>();
        // Without laps the tables are there but not read.
        let envelope = line.envelope().map_or(
            EnvelopeTable {
                top: 0.0,
                rows_per_speed_squared: 0.0,
                rows: vec![0.0; 8],
                rows_per_radius: 0.0,
                corners: vec![0.0; 2],
                ellipse: Vec::new(),
                traction: Vec::new(),
                open: None,
                loads: Default::default(),
                curvature_rate_squared: None,
            },
            |envelope| envelope.stored::<f32>(),
        );
        let tables = LineTables::new(&context, &plan, &envelope, line.wanted())?;
        let kernel = LineKernel {
            source: &tables.shape.source(),
            entry: "line",
            tables,
            plan: &plan,
            envelope: &envelope,
            others: Vec::new(),
            variables: line.dimensions(),
            lap: line.wanted().lap,
        };
        Ok(Self {
            batches: LineBatches::new(context, kernel)?,
            exchange: None,
        })
    }

    fn context(&self) -> &GpuContext {
        self.batches.context()
    }

    fn batching(&self) -> Batching {
        self.batches.batching()
    }

    fn cut(&mut self, batching: Batching) {
        self.batches.cut(batching);
    }

    fn outcomes(&mut self, _: &LineProblem, candidates: &[&[f64]]) -> Result<Vec<Measures>> {
        self.batches.watch_anew();
        self.batches.score(candidates.len(), |candidate, variable| {
            candidates[candidate][variable]
        })
    }

    fn score_resident(
        &mut self,
        line: &LineProblem,
        particles: usize,
        position: &wgpu::Buffer,
        objectives: &wgpu::Buffer,
    ) -> Result<bool> {
        let Self { batches, exchange } = self;
        let exchange = match exchange {
            Some(exchange) => exchange,
            None => exchange.insert(exchange_of(line, batches.context())?),
        };
        batches.score_resident(exchange, particles, position, objectives)?;
        Ok(true)
    }
}

/// Between a swarm and the line kernel.
fn exchange_of(line: &LineProblem, context: &GpuContext) -> Result<Exchange> {
    let variables = &line.problem.variables;
    let objectives: Vec<Scaled> = line
        .objectives()
        .iter()
        .map(|objective| match objective {
            LineObjective::Gamma => Scaled::of_root(*objective as usize),
            _ => Scaled::of_result(*objective as usize, 1.0),
        })
        .collect();
    let free = variables.iter().filter(|v| v.is_free()).count();
    let figures = Scaled::variables(variables);
    Exchange::new(context, free, (&figures, &objectives), LineProblem::WITHOUT_COST)
}

impl GpuBackend<'_, LineProblem> {
    /// The longest dispatch of the last evaluation with its submission and the wait, ms.
    pub fn longest_dispatch_ms(&self) -> f64 {
        self.device.batches.longest_ms()
    }
}
