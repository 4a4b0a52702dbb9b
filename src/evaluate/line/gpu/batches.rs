//! Lines on a device, a batch at a time: what the kernels of lines and of laps with energy have in common.

use super::exchange::Exchange;
use super::tables::LineTables;
use crate::error::{Error, Result};
use crate::evaluate::gpu::{Batching, Binding, DeviceKind, GpuContext, Kernel, LanePacing, planes};
use crate::line::{EnvelopeTable, LinePlan};
use crate::vehicle::powertrain::GRAVITY_MPS2;
use bytemuck::{Pod, Zeroable};
use std::sync::Arc;
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
    /// Rows of the envelope per speed squared, s^2/m^2.
    pub rows_per_speed_squared: f32,
    /// Rows of corner speeds per radius, 1/m.
    pub rows_per_radius: f32,
    /// Of roads in three dimensions: load over mass of the first table of limits, m/s^2.
    pub load_first: f32,
    /// Tables of limits per load over mass, s^2/m.
    pub tables_per_load: f32,
    /// The least load that is told from others, in tables.
    pub load_least: f32,
    /// The greatest load that is told from others, in tables.
    pub load_most: f32,
    /// Radius on the steering lock, m.
    pub lock_radius: f32,
    /// Gravity, m/s^2.
    pub gravity: f32,
    /// The share of the mass that is accelerated which rotates.
    pub coasting: f32,
    /// Square of the greatest rate at which the curvature may change in time, 1/(m^2 s^2).
    pub curvature_rate_squared: f32,
}

impl LineStretch {
    /// What all dispatches of a plan have in common.
    fn of(plan: &LinePlan<f32>, envelope: &EnvelopeTable<f32>) -> Self {
        Self {
            candidates: 0,
            stride: 0,
            first: 0,
            sections: plan.rows.len() as u32,
            start: plan.start as u32,
            entry: plan.entry,
            rows_per_speed_squared: envelope.rows_per_speed_squared,
            rows_per_radius: envelope.rows_per_radius,
            load_first: envelope.loads.first,
            tables_per_load: envelope.loads.per_load,
            load_least: envelope.loads.least,
            load_most: envelope.loads.most,
            lock_radius: envelope.loads.lock_radius,
            gravity: GRAVITY_MPS2 as f32,
            coasting: envelope.loads.coasting,
            curvature_rate_squared: envelope.curvature_rate_squared.unwrap_or(0.0),
        }
    }
}

/// A kernel that scores lines, and what it reads.
pub(in crate::evaluate) struct LineKernel<'k> {
    pub source: &'k str,
    pub entry: &'k str,
    pub tables: LineTables,
    pub plan: &'k LinePlan<f32>,
    pub envelope: &'k EnvelopeTable<f32>,
    /// From binding 9 on.
    pub others: Vec<(Binding, wgpu::Buffer)>,
    /// Figures of a candidate.
    pub variables: usize,
    /// Whether laps are driven.
    pub lap: bool,
}

/// Floats per candidate and section in the course: length and curvature, and on a road that is not level and dry six more, the last of
/// them spare.
const COURSE_WIDTH: usize = 2;
const RELIEF_WIDTH: usize = 8;
/// Sections of all lines of the first dispatch: tens of milliseconds on a software driver.
const FIRST: usize = 1 << 17;

/// Buffers that grow with the batch, and the kernel's bindings to them.
struct BatchBuffers {
    stride: usize,
    variables: wgpu::Buffer,
    results: wgpu::Buffer,
    readback: wgpu::Buffer,
    group: wgpu::BindGroup,
}

/// Batches of lines on a device, which come to `FIGURES` figures each.
pub(in crate::evaluate) struct LineBatches<const FIGURES: usize> {
    context: Arc<GpuContext>,
    kernel: Arc<Kernel>,
    batching: Batching,
    workgroup: usize,
    task: LineStretch,
    stretch: wgpu::Buffer,
    /// In the order of the kernel's bindings 1 to 4, and from 9 on.
    tables: [wgpu::Buffer; 4],
    others: Vec<wgpu::Buffer>,
    variables: usize,
    /// Sections whose course is kept: none where no laps are driven.
    sections: usize,
    /// Floats per candidate and section in the course.
    course_width: usize,
    batch: Option<BatchBuffers>,
    pacing: LanePacing,
    longest_ms: f64,
}

impl<const FIGURES: usize> LineBatches<FIGURES> {
    /// # Errors
    /// [`Error::Device`] if the kernel does not compile or the device has too few bindings for it.
    pub fn new(context: Arc<GpuContext>, parts: LineKernel<'_>) -> Result<Self> {
        use Binding::{Read, Uniform, Write};
        let (kinds, others): (Vec<_>, Vec<_>) = parts.others.into_iter().unzip();
        let bindings = [
            vec![Uniform],
            parts.tables.bindings.to_vec(),
            vec![Read, Write, Write, Write],
            kinds,
        ]
        .concat();
        let stored = bindings.iter().filter(|b| !matches!(b, Uniform)).count() as u32;
        let most = context.limits().max_storage_buffers_per_shader_stage;
        if stored > most {
            return Err(Error::Device(format!(
                "{} binds at most {most} storage buffers, {stored} are needed",
                context.summary(),
            )));
        }
        let kernel = context.kernel(parts.source, parts.entry, &bindings)?;
        let stretch = context.buffer(
            "stretch",
            size_of::<LineStretch>() as u64,
            Usage::UNIFORM | Usage::COPY_DST,
        )?;
        let sections = parts.plan.rows.len();
        Ok(Self {
            batching: match context.summary().kind {
                // So few bytes that a batch goes through the processor's caches.
                kind @ DeviceKind::Software => Batching::new(kind, usize::MAX, 24 << 20),
                // A large card is only filled by many lines at once.
                kind => Batching::new(kind, usize::MAX, 1 << 30),
            },
            context,
            kernel,
            workgroup: parts.tables.shape.workgroup as usize,
            task: LineStretch::of(parts.plan, parts.envelope),
            stretch,
            tables: parts.tables.buffers,
            others,
            variables: parts.variables,
            sections: if parts.lap { sections } else { 0 },
            course_width: if parts.tables.shape.relief.is_some() {
                RELIEF_WIDTH
            } else {
                COURSE_WIDTH
            },
            batch: None,
            pacing: LanePacing::new(FIRST / sections.max(1)),
            longest_ms: 0.0,
        })
    }

    pub fn context(&self) -> &Arc<GpuContext> {
        &self.context
    }

    /// Cross-sections the work differently.
    pub fn cut(&mut self, batching: Batching) {
        self.batching = batching;
        self.batch = None;
    }

    pub fn batching(&self) -> Batching {
        self.batching
    }

    /// The longest dispatch since the last call of [`LineBatches::watch_anew`], ms.
    pub fn longest_ms(&self) -> f64 {
        self.longest_ms
    }

    pub fn watch_anew(&mut self) {
        self.longest_ms = 0.0;
    }

    /// The most candidates of one batch.
    pub fn batch_size(&self) -> usize {
        let device = self.context.limits();
        let planes = (self.course_width * self.sections)
            .max(self.variables)
            .max(FIGURES);
        let bytes = self
            .batching
            .bytes
            .min(device.max_storage_buffer_binding_size)
            .min(device.max_buffer_size)
            // Places in the buffers are counted in 32 bits.
            .min(1 << 33);
        let fitting = (bytes / (4 * planes as u64)) as usize;
        (fitting / self.workgroup).max(1) * self.workgroup
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
        let variables = context.buffer(
            "variables",
            bytes(self.variables),
            Usage::STORAGE | Usage::COPY_DST,
        )?;
        let speeds = context.buffer("speeds", bytes(self.sections), Usage::STORAGE)?;
        let course = context.buffer("course", bytes(self.course_width * self.sections), Usage::STORAGE)?;
        let results = context.buffer("results", bytes(FIGURES), Usage::STORAGE | Usage::COPY_SRC)?;
        let readback = context.buffer("readback", bytes(FIGURES), Usage::MAP_READ | Usage::COPY_DST)?;
        let mut bound = vec![&self.stretch];
        bound.extend(&self.tables);
        bound.extend([&variables, &course, &speeds, &results]);
        bound.extend(&self.others);
        let group = context.bind(&self.kernel, &bound)?;
        self.batch = Some(BatchBuffers {
            stride,
            variables,
            results,
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

    /// Writes the objectives of particles that live on the device.
    ///
    /// # Errors
    /// [`Error::Device`] if the device fails.
    pub fn score_resident(
        &mut self,
        exchange: &Exchange,
        particles: usize,
        position: &wgpu::Buffer,
        objectives: &wgpu::Buffer,
    ) -> Result<()> {
        let most = self.batch_size();
        for first in (0..particles).step_by(most) {
            let candidates = (particles - first).min(most);
            self.reserve(candidates)?;
            let batch = self.buffers()?;
            let part = [first, candidates, batch.stride];
            exchange.take(&self.context, part, position, &batch.variables)?;
            self.score_batch(candidates)?;
            let batch = self.buffers()?;
            exchange.give(&self.context, part, &batch.results, objectives)?;
        }
        Ok(())
    }

    /// Scores one batch, whose figures are on the device.
    fn score_batch(&mut self, candidates: usize) -> Result<()> {
        let most_groups = self.context.limits().max_compute_workgroups_per_dimension as usize;
        let mut first = 0;
        while first < candidates {
            let wanted = self
                .pacing
                .lanes(self.batching.dispatch_ms)
                .min(self.batching.lanes);
            let lanes = ((wanted / self.workgroup).clamp(1, most_groups) * self.workgroup)
                .min((candidates - first).next_multiple_of(self.workgroup));
            let batch = self.buffers()?;
            let stretch = LineStretch {
                candidates: candidates.min(first + lanes) as u32,
                stride: batch.stride as u32,
                first: first as u32,
                ..self.task
            };
            self.context.write(&self.stretch, bytemuck::bytes_of(&stretch));
            let groups = (lanes / self.workgroup) as u32;
            let ms = self
                .context
                .dispatch(&self.kernel, &batch.group, [groups, 1], None)?;
            self.pacing.took(lanes, ms);
            self.longest_ms = self.longest_ms.max(ms);
            first += lanes;
        }
        Ok(())
    }

    /// The results of candidates, in order; `figure` gives a figure of a candidate.
    ///
    /// # Errors
    /// [`Error::Device`] if the device fails.
    pub fn score(
        &mut self,
        candidates: usize,
        figure: impl Fn(usize, usize) -> f64 + Sync,
    ) -> Result<Vec<[f64; FIGURES]>> {
        let mut found = Vec::with_capacity(candidates);
        let most = self.batch_size();
        for first in (0..candidates).step_by(most) {
            let count = most.min(candidates - first);
            self.reserve(count)?;
            let batch = self.buffers()?;
            let stride = batch.stride;
            // What is not a number never reaches the device, where it may count as anything.
            let variables = planes([count, stride, self.variables], |lane, variable| {
                let value = figure(first + lane, variable) as f32;
                if value.is_finite() { value } else { 0.0 }
            });
            self.context
                .write(&batch.variables, bytemuck::cast_slice(&variables));
            self.score_batch(count)?;
            let batch = self.buffers()?;
            let bytes = (stride * FIGURES * 4) as u64;
            let results = (&batch.results, 0);
            self.context.read_back(results, &batch.readback, bytes, |data| {
                let planes: &[f32] = bytemuck::cast_slice(data);
                found.extend((0..count).map(|lane| {
                    std::array::from_fn::<f64, FIGURES, _>(|k| f64::from(planes[k * stride + lane]))
                }));
            })?;
        }
        Ok(found)
    }
}
