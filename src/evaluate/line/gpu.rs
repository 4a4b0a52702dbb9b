//! The graphics backend: `f32`, one lane per line, for populations from the host and for swarms that live on the device.

mod batches;
mod exchange;
mod tables;

pub use crate::evaluate::gpu::Batching as LineBatching;
pub use batches::LineStretch;
pub(in crate::evaluate) use batches::{LineBatches, LineKernel};
pub use tables::DeviceSection;
pub(in crate::evaluate) use tables::LineTables;

use super::problem::{LineProblem, MEASURES, Measures};
use crate::error::Result;
use crate::evaluate::gpu::{Batching, GpuContext};
use crate::evaluate::{DeviceKernel, GpuBackend, OnDevice};
use crate::line::EnvelopeTable;
use exchange::Exchange;
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

    const RESIDENT: bool = true;

    fn score_resident(
        &mut self,
        line: &LineProblem,
        particles: usize,
        position: &wgpu::Buffer,
        objectives: &wgpu::Buffer,
    ) -> Result<()> {
        let Self { batches, exchange } = self;
        let context = Arc::clone(batches.context());
        let exchange = match exchange {
            Some(exchange) => exchange,
            None => exchange.insert(Exchange::new(line, &context)?),
        };
        let most = batches.batch_size();
        for first in (0..particles).step_by(most) {
            let candidates = (particles - first).min(most);
            batches.reserve(candidates)?;
            let (stride, variables, _) = batches.rows()?;
            exchange.take(&context, [first, candidates, stride], position, variables)?;
            batches.score_batch(candidates)?;
            let (_, _, results) = batches.rows()?;
            exchange.give(&context, [first, candidates, stride], results, objectives)?;
        }
        Ok(())
    }
}

impl GpuBackend<'_, LineProblem> {
    /// The longest dispatch of the last evaluation with its submission and the wait, ms.
    pub fn longest_dispatch_ms(&self) -> f64 {
        self.device.batches.longest_ms()
    }
}
