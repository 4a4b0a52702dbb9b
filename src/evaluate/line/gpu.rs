//! The graphics backend: `f32`, one lane per line.

use super::batches::{LineBatches, LineBatching, LineKernel};
use super::problem::{LineProblem, MEASURES};
use super::swarm::Exchange;
use super::tables::LineTables;
use crate::error::Result;
use crate::evaluate::gpu::GpuContext;
use crate::evaluate::{BackendInfo, Evaluation, Evaluator, Problem};
use crate::line::LimitTable;
use rayon::prelude::*;
use std::sync::Arc;

/// Scores lines on a graphics processor.
pub struct GpuLineEvaluator<'a> {
    pub(super) line: &'a LineProblem,
    pub(super) batches: LineBatches<MEASURES>,
    /// For swarms that live on the device.
    pub(super) exchange: Option<Exchange>,
}

impl<'a> GpuLineEvaluator<'a> {
    /// An evaluator of `line` on `context`'s device.
    ///
    /// # Errors
    /// [`crate::Error::Device`] if the kernel does not compile or the sections do not fit the device.
    pub fn new(line: &'a LineProblem, context: Arc<GpuContext>) -> Result<Self> {
        let plan = line.plan().stored::<f32>();
        // Without laps the tables are there but not read.
        let limits = line.limits().map_or(
            LimitTable {
                top: 0.0,
                rows_per_speed_squared: 0.0,
                limits: vec![0.0; 8],
                rows_per_radius: 0.0,
                corners: vec![0.0; 2],
                ellipse: Vec::new(),
            },
            |limits| limits.stored::<f32>(),
        );
        let tables = LineTables::new(&context, &plan, &limits, line.wanted())?;
        let kernel = LineKernel {
            source: &tables.shape.source(),
            entry: "line",
            tables,
            plan: &plan,
            limits: &limits,
            others: Vec::new(),
            variables: line.dimensions(),
            lap: line.wanted().lap,
        };
        Ok(Self {
            line,
            batches: LineBatches::new(context, kernel)?,
            exchange: None,
        })
    }

    /// Cuts the work differently.
    pub fn with_batching(mut self, batching: LineBatching) -> Self {
        self.batches.cut(batching);
        self
    }

    /// How the work is cut.
    pub fn batching(&self) -> LineBatching {
        self.batches.batching()
    }

    /// The longest dispatch of the last evaluation with its submission and the wait, ms.
    pub fn longest_dispatch_ms(&self) -> f64 {
        self.batches.longest_ms()
    }
}

impl Evaluator for GpuLineEvaluator<'_> {
    fn problem(&self) -> &Problem {
        &self.line.problem
    }

    fn backend(&self) -> BackendInfo {
        self.batches.context().backend_info()
    }

    fn evaluate(&mut self, population: &[f64]) -> Result<Evaluation> {
        self.batches.watch_anew();
        let line = self.line;
        let candidates: Vec<&[f64]> = population.chunks_exact(line.dimensions().max(1)).collect();
        let measures = self.batches.score(candidates.len(), |candidate, variable| {
            candidates[candidate][variable]
        })?;
        let rows = candidates
            .par_iter()
            .zip(&measures)
            .map(
                |(candidate, measures)| match line.preliminary_failure(candidate) {
                    Some(failure) => line.failed_row(failure),
                    None => line.objective_row(measures),
                },
            )
            .collect();
        Ok(Evaluation::of_rows(rows))
    }
}
