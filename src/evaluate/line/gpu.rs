//! The graphics backend: `f32`, one lane per line.

use super::problem::{LineProblem, MEASURES, Measures};
use super::swarm::Exchange;
use super::tables::LineTables;
use crate::error::{Error, Result};
use crate::evaluate::gpu::{Binding, DeviceKind, GpuContext, Kernel};
use crate::evaluate::{BackendInfo, Evaluation, Evaluator, Problem};
use crate::line::LimitTable;
use bytemuck::{Pod, Zeroable};
use rayon::prelude::*;
use std::sync::Arc;
use std::time::Instant;
use wgpu::BufferUsages as Usage;

/// What a dispatch is to do. Twin of `LineStretch` in `shaders/line.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct LineStretch {
    /// One past the last candidate of this dispatch.
    pub candidates: u32,
    /// Distance between candidates' rows in the buffers.
    pub stride: u32,
    /// The first candidate of this dispatch.
    pub first: u32,
    /// Sections of the line.
    pub sections: u32,
    /// Where a closed lap's passes start.
    pub start: u32,
    /// Speed squared at the start of an open line, m^2/s^2.
    pub entry: f32,
    /// Rows of limits per speed squared, s^2/m^2.
    pub rows_per_speed_squared: f32,
    /// Rows of corner speeds per radius, 1/m.
    pub rows_per_radius: f32,
}

/// Floats per candidate and section in the course: length and curvature.
const COURSE_WIDTH: usize = 2;
/// How work is cut. Results do not depend on it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LineBatching {
    /// The most bytes of any buffer that grows with the candidates.
    pub bytes: u64,
    /// The most candidates of one dispatch.
    pub lanes: usize,
    /// How long a dispatch should take, ms: well under the watchdogs' two seconds, well over its overhead.
    pub dispatch_ms: f64,
}

impl LineBatching {
    /// What suits a kind of device: a large card is only filled by many lines at once.
    pub fn for_kind(kind: DeviceKind) -> Self {
        Self {
            bytes: match kind {
                // So few that a batch goes through the processor's caches.
                DeviceKind::Software => 24 << 20,
                _ => 1 << 30,
            },
            lanes: usize::MAX,
            dispatch_ms: 70.0,
        }
    }
}

/// Buffers that grow with the batch, and the kernel's bindings to them.
pub(super) struct BatchBuffers {
    pub(super) stride: usize,
    pub(super) variables: wgpu::Buffer,
    pub(super) results: wgpu::Buffer,
    readback: wgpu::Buffer,
    group: wgpu::BindGroup,
}

/// Scores lines on a graphics processor.
pub struct GpuLineEvaluator<'a> {
    pub(super) line: &'a LineProblem,
    pub(super) context: Arc<GpuContext>,
    batching: LineBatching,
    kernel: Arc<Kernel>,
    workgroup: usize,
    limits: LimitTable<f32>,
    stretch: wgpu::Buffer,
    /// In the order of the kernel's bindings 1 to 4.
    tables: [wgpu::Buffer; 4],
    batch: Option<BatchBuffers>,
    /// For swarms that live on the device.
    pub(super) exchange: Option<Exchange>,
    /// Lanes and time of the last dispatch, by which the next is sized.
    pace: Option<(usize, f64)>,
    longest_ms: f64,
}

impl<'a> GpuLineEvaluator<'a> {
    /// An evaluator of `line` on `context`'s device.
    ///
    /// # Errors
    /// [`Error::Device`] if the kernel does not compile or the sections do not fit the device.
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
        use Binding::{Read, Uniform, Write};
        let [sections, speeds, corners, ellipse] = tables.bindings;
        let bindings = [
            Uniform, sections, speeds, corners, ellipse, Read, Write, Write, Write,
        ];
        let kernel = context.kernel(&tables.shape.source(), "line", &bindings)?;
        let stretch = context.buffer(
            "stretch",
            size_of::<LineStretch>() as u64,
            Usage::UNIFORM | Usage::COPY_DST,
        )?;
        Ok(Self {
            line,
            batching: LineBatching::for_kind(context.summary().kind),
            context,
            kernel,
            workgroup: tables.shape.workgroup as usize,
            limits,
            stretch,
            tables: tables.buffers,
            batch: None,
            exchange: None,
            pace: None,
            longest_ms: 0.0,
        })
    }

    /// Cuts the work differently.
    pub fn with_batching(mut self, batching: LineBatching) -> Self {
        self.batching = batching;
        self.batch = None;
        self
    }

    /// How the work is cut.
    pub fn batching(&self) -> LineBatching {
        self.batching
    }

    /// The longest dispatch of the last evaluation with its submission and the wait, ms.
    pub fn longest_dispatch_ms(&self) -> f64 {
        self.longest_ms
    }

    /// Floats per candidate in the largest of the buffers.
    fn planes(&self) -> usize {
        let course = if self.line.wanted().lap {
            COURSE_WIDTH * self.line.plan().rows.len()
        } else {
            0
        };
        course.max(self.line.dimensions()).max(MEASURES)
    }

    /// The most candidates of one batch.
    pub(super) fn batch_size(&self) -> usize {
        let device = self.context.limits();
        let bytes = self
            .batching
            .bytes
            .min(device.max_storage_buffer_binding_size)
            .min(device.max_buffer_size)
            // Places in the buffers are counted in 32 bits.
            .min(1 << 33);
        let fitting = (bytes / (4 * self.planes() as u64)) as usize;
        (fitting / self.workgroup).max(1) * self.workgroup
    }

    /// Makes room for a batch of `candidates`.
    pub(super) fn reserve(&mut self, candidates: usize) -> Result<()> {
        let stride = candidates.next_multiple_of(self.workgroup);
        if self.batch.as_ref().is_none_or(|b| b.stride < stride) {
            // The old buffers go before the new ones come.
            self.batch = None;
            let context = &self.context;
            let bytes = |planes: usize| (planes * stride * 4) as u64;
            let course = if self.line.wanted().lap {
                COURSE_WIDTH * self.line.plan().rows.len()
            } else {
                0
            };
            let variables = context.buffer(
                "variables",
                bytes(self.line.dimensions()),
                Usage::STORAGE | Usage::COPY_DST,
            )?;
            let speeds = context.buffer("speeds", bytes(course / COURSE_WIDTH), Usage::STORAGE)?;
            let course = context.buffer("course", bytes(course), Usage::STORAGE)?;
            let results = context.buffer("results", bytes(MEASURES), Usage::STORAGE | Usage::COPY_SRC)?;
            let readback = context.buffer("readback", bytes(MEASURES), Usage::MAP_READ | Usage::COPY_DST)?;
            let [sections, limits, corners, ellipse] = &self.tables;
            let group = context.bind(
                &self.kernel,
                &[
                    &self.stretch,
                    sections,
                    limits,
                    corners,
                    ellipse,
                    &variables,
                    &course,
                    &speeds,
                    &results,
                ],
            )?;
            self.batch = Some(BatchBuffers {
                stride,
                variables,
                results,
                readback,
                group,
            });
        }
        Ok(())
    }

    pub(super) fn buffers(&self) -> Result<&BatchBuffers> {
        self.batch
            .as_ref()
            .ok_or_else(|| Error::Device("a batch without buffers".to_owned()))
    }

    /// Lanes of the next dispatch, in whole workgroups.
    fn next_lanes(&self) -> usize {
        /// Sections of all lines of the first dispatch: tens of milliseconds on a software driver.
        const FIRST: usize = 1 << 18;
        let by_time = match self.pace {
            // A device that was not full takes no longer for more: it is approached in steps.
            Some((lanes, ms)) => (lanes as f64 * (self.batching.dispatch_ms / ms).min(4.0)) as usize,
            None => FIRST / self.line.plan().rows.len(),
        };
        let most_groups = self.context.limits().max_compute_workgroups_per_dimension as usize;
        let lanes = by_time.min(self.batching.lanes) / self.workgroup;
        lanes.clamp(1, most_groups) * self.workgroup
    }

    /// Scores one batch, whose variables are on the device in rows of `stride`.
    pub(super) fn score_batch(&mut self, candidates: usize, stride: usize) -> Result<()> {
        let mut first = 0;
        while first < candidates {
            let lanes = self
                .next_lanes()
                .min((candidates - first).next_multiple_of(self.workgroup));
            let plan = self.line.plan();
            let stretch = LineStretch {
                candidates: candidates.min(first + lanes) as u32,
                stride: stride as u32,
                first: first as u32,
                sections: plan.rows.len() as u32,
                start: plan.start as u32,
                entry: plan.entry as f32,
                rows_per_speed_squared: self.limits.rows_per_speed_squared,
                rows_per_radius: self.limits.rows_per_radius,
            };
            self.context.write(&self.stretch, bytemuck::bytes_of(&stretch));
            let batch = self.buffers()?;
            let begin = Instant::now();
            self.context.run(|encoder| {
                let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
                    label: Some("line"),
                    timestamp_writes: None,
                });
                pass.set_pipeline(&self.kernel.pipeline);
                pass.set_bind_group(0, &batch.group, &[]);
                pass.dispatch_workgroups((lanes / self.workgroup) as u32, 1, 1);
            })?;
            let ms = begin.elapsed().as_secs_f64() * 1e3;
            // The first dispatch of all may have compiled; the next one corrects what it taught.
            self.pace = Some((lanes, ms.max(1e-3)));
            self.longest_ms = self.longest_ms.max(ms);
            first += lanes;
        }
        Ok(())
    }

    /// Figures of every candidate's line.
    fn score(&mut self, candidates: &[&[f64]]) -> Result<Vec<Measures>> {
        let mut measures = Vec::with_capacity(candidates.len());
        let dimensions = self.line.dimensions();
        for batch in candidates.chunks(self.batch_size()) {
            self.reserve(batch.len())?;
            let stride = self.buffers()?.stride;
            // Variable by variable, so that neighbouring lanes read neighbouring memory. What is no number never
            // reaches the device, where it may count as anything.
            let mut variables = vec![0.0f32; stride * dimensions];
            variables
                .par_chunks_exact_mut(stride)
                .enumerate()
                .for_each(|(variable, row)| {
                    for (out, candidate) in row.iter_mut().zip(batch) {
                        let value = candidate[variable] as f32;
                        *out = if value.is_finite() { value } else { 0.0 };
                    }
                });
            self.context
                .write(&self.buffers()?.variables, bytemuck::cast_slice(&variables));
            self.score_batch(batch.len(), stride)?;
            let buffers = self.buffers()?;
            let bytes = (stride * MEASURES * 4) as u64;
            self.context.run(|encoder| {
                encoder.copy_buffer_to_buffer(&buffers.results, 0, &buffers.readback, 0, bytes)
            })?;
            self.context.read(&buffers.readback, bytes, |data| {
                let planes: &[f32] = bytemuck::cast_slice(data);
                measures.extend((0..batch.len()).map(|candidate| {
                    std::array::from_fn::<f64, MEASURES, _>(|m| f64::from(planes[m * stride + candidate]))
                }));
            })?;
        }
        Ok(measures)
    }
}

impl Evaluator for GpuLineEvaluator<'_> {
    fn problem(&self) -> &Problem {
        &self.line.problem
    }

    fn backend(&self) -> BackendInfo {
        self.context.backend_info()
    }

    fn evaluate(&mut self, population: &[f64]) -> Result<Evaluation> {
        self.longest_ms = 0.0;
        let line = self.line;
        let candidates: Vec<&[f64]> = population.chunks_exact(line.dimensions().max(1)).collect();
        let measures = self.score(&candidates)?;
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
