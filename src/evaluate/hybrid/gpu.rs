//! The graphics backend: `f32`, one lane per lap.

use super::problem::HybridProblem;
use crate::error::{Error, Result};
use crate::evaluate::gpu::shader::EnergyShape;
use crate::evaluate::gpu::{Binding, DeviceKind, GpuContext, Kernel};
use crate::evaluate::line::{LineBatching, LineStretch, LineTables};
use crate::evaluate::{BackendInfo, Evaluation, Evaluator, Problem};
use crate::line::energy::kernel::FIGURES;
use crate::line::energy::{EnergyLap, EnergyPlan, EnergyTable, Mode};
use crate::line::kernel::Wanted;
use bytemuck::{Pod, Zeroable};
use std::sync::Arc;
use std::time::Instant;
use wgpu::BufferUsages as Usage;

/// Figures of the car that a dispatch needs. Twin of `EnergyAccount` in `shaders/energy.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct EnergyAccount {
    /// Mass, kg.
    pub mass: f32,
    /// Energy out of the store for each joule at the wheels.
    pub deploy_cost: f32,
    /// Energy into the store for each joule at the wheels.
    pub harvest_gain: f32,
    /// Force over mass for each joule out of the store, times the length, m^2/s^2/J.
    pub force_per_deployed: f32,
    /// Force over mass for each joule of the MGU-K, times the length, m^2/s^2/J.
    pub force_per_harvested: f32,
    /// What the MGU-K may put into the store in a lap, J.
    pub harvest_most: f32,
    /// Energy of the MGU-H for each kilogram of fuel, J/kg.
    pub exhaust_gain: f32,
    /// Fuel for each joule of the MGU-H, kg/J.
    pub exhaust_cost: f32,
    /// Speed squared from which the MGU-H generates, m^2/s^2.
    pub exhaust_from: f32,
    /// Acceleration up to which it does, m/s^2.
    pub exhaust_to_ax: f32,
    /// Rows per speed squared, s^2/m^2.
    pub rows_per_speed_squared: f32,
    /// The section that a lap is run in from.
    pub run_in: u32,
}

/// Floats per candidate and section in the course: length and curvature.
const COURSE_WIDTH: usize = 2;

/// Buffers that grow with the batch, and the kernel's bindings to them.
struct BatchBuffers {
    stride: usize,
    variables: wgpu::Buffer,
    results: wgpu::Buffer,
    readback: wgpu::Buffer,
    group: wgpu::BindGroup,
}

/// Scores laps with energy on a graphics processor.
pub struct GpuHybridEvaluator<'a> {
    hybrid: &'a HybridProblem,
    context: Arc<GpuContext>,
    batching: LineBatching,
    kernel: Arc<Kernel>,
    workgroup: usize,
    stretch: wgpu::Buffer,
    /// In the order of the kernel's bindings 1 to 4.
    tables: [wgpu::Buffer; 4],
    account: wgpu::Buffer,
    energy: wgpu::Buffer,
    batch: Option<BatchBuffers>,
    /// Lanes and time of the last dispatch, by which the next is sized.
    pace: Option<(usize, f64)>,
}

/// The energy tables one after the other, in vectors of four.
fn energy_vectors(table: &EnergyTable<f32>, plan: &EnergyPlan<f32>) -> Vec<[f32; 4]> {
    let fours = |values: &[f32]| -> Vec<[f32; 4]> {
        let (whole, _) = values.as_chunks::<4>();
        whole.to_vec()
    };
    let mut vectors = fours(&table.forces);
    vectors.extend(fours(&table.flows));
    vectors.extend(fours(&table.boosts));
    // Whole numbers below 2^24 keep their value as floats.
    vectors.extend(
        plan.zones
            .iter()
            .map(|row| [row.zone as f32, row.position, row.per_share, 0.0]),
    );
    vectors
}

impl<'a> GpuHybridEvaluator<'a> {
    /// An evaluator of `hybrid` on `context`'s device.
    ///
    /// # Errors
    /// [`Error::Device`] if the kernel does not compile or the device has too few bindings or too little memory for it.
    pub fn new(hybrid: &'a HybridProblem, context: Arc<GpuContext>) -> Result<Self> {
        let device = context.limits();
        let plan = hybrid.plan().stored::<f32>();
        let limits = hybrid.car().limits.stored::<f32>();
        let table = hybrid.car().table.stored::<f32>();
        let wanted = Wanted {
            integral: false,
            lap: true,
        };
        let tables = LineTables::new(&context, &plan, &limits, wanted)?;
        let vectors = energy_vectors(&table, &hybrid.energy().stored::<f32>());
        // A software driver is faster with uniform tables, see the line kernel.
        let uniform_energy = context.summary().kind == DeviceKind::Software
            && size_of_val(vectors.as_slice()) as u64 <= device.max_uniform_buffer_binding_size;
        let shape = EnergyShape {
            line: tables.shape,
            line_variables: hybrid.line_variables(),
            additional: hybrid.energy().mode == Mode::Additional,
            counts_charge: hybrid.energy().counts_charge,
            uniform_energy: uniform_energy.then_some(vectors.len()),
        };
        use Binding::{Read, Uniform, Write};
        let [sections, speeds, corners, ellipse] = tables.bindings;
        let energy = if uniform_energy { Uniform } else { Read };
        let bindings = [
            Uniform, sections, speeds, corners, ellipse, Read, Write, Write, Write, Uniform, energy,
        ];
        let stored = bindings.iter().filter(|b| !matches!(b, Uniform)).count() as u32;
        if stored > device.max_storage_buffers_per_shader_stage {
            return Err(Error::Device(format!(
                "{} binds at most {} storage buffers, {stored} are needed",
                context.summary(),
                device.max_storage_buffers_per_shader_stage
            )));
        }
        let kernel = context.kernel(&shape.source(), "energy_line", &bindings)?;
        let both = Usage::STORAGE | Usage::UNIFORM;
        let account = EnergyAccount {
            mass: table.mass,
            deploy_cost: table.deploy_cost,
            harvest_gain: table.harvest_gain,
            force_per_deployed: table.force_per_deployed,
            force_per_harvested: table.force_per_harvested,
            harvest_most: table.harvest_most,
            exhaust_gain: table.exhaust_gain,
            exhaust_cost: table.exhaust_cost,
            exhaust_from: table.exhaust_from,
            exhaust_to_ax: table.exhaust_to_ax,
            rows_per_speed_squared: table.rows_per_speed_squared,
            run_in: hybrid.energy().run_in as u32,
        };
        let stretch = context.buffer(
            "stretch",
            size_of::<LineStretch>() as u64,
            Usage::UNIFORM | Usage::COPY_DST,
        )?;
        let account = context.buffer_of("account", bytemuck::bytes_of(&account), Usage::UNIFORM)?;
        let energy = context.buffer_of("energy", bytemuck::cast_slice(&vectors), both)?;
        Ok(Self {
            hybrid,
            batching: LineBatching::for_kind(context.summary().kind),
            context,
            kernel,
            workgroup: tables.shape.workgroup as usize,
            stretch,
            tables: tables.buffers,
            account,
            energy,
            batch: None,
            pace: None,
        })
    }

    /// Cuts the work differently.
    pub fn with_batching(mut self, batching: LineBatching) -> Self {
        self.batching = batching;
        self.batch = None;
        self
    }

    /// Figures of a candidate on the device.
    fn figures(&self) -> usize {
        self.hybrid.line_variables() + self.hybrid.strategy_figures()
    }

    /// The most candidates of one batch.
    fn batch_size(&self) -> usize {
        let device = self.context.limits();
        let planes = (COURSE_WIDTH * self.hybrid.plan().rows.len())
            .max(self.figures())
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
        let sections = self.hybrid.plan().rows.len();
        let variables = context.buffer(
            "variables",
            bytes(self.figures()),
            Usage::STORAGE | Usage::COPY_DST,
        )?;
        let speeds = context.buffer("speeds", bytes(sections), Usage::STORAGE)?;
        let course = context.buffer("course", bytes(COURSE_WIDTH * sections), Usage::STORAGE)?;
        let results = context.buffer("results", bytes(FIGURES), Usage::STORAGE | Usage::COPY_SRC)?;
        let readback = context.buffer("readback", bytes(FIGURES), Usage::MAP_READ | Usage::COPY_DST)?;
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
                &self.account,
                &self.energy,
            ],
        )?;
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

    /// Lanes of the next dispatch, in whole workgroups.
    fn next_lanes(&self) -> usize {
        /// Sections of all laps of the first dispatch: tens of milliseconds on a software driver.
        const FIRST: usize = 1 << 17;
        let by_time = match self.pace {
            // A device that was not full takes no longer for more: it is approached in steps.
            Some((lanes, ms)) => (lanes as f64 * (self.batching.dispatch_ms / ms).min(4.0)) as usize,
            None => FIRST / self.hybrid.plan().rows.len(),
        };
        let most_groups = self.context.limits().max_compute_workgroups_per_dimension as usize;
        let lanes = by_time.min(self.batching.lanes) / self.workgroup;
        lanes.clamp(1, most_groups) * self.workgroup
    }

    /// Scores one batch, whose figures are on the device in rows of `stride`.
    fn score_batch(&mut self, candidates: usize, stride: usize) -> Result<()> {
        let limits = &self.hybrid.car().limits;
        let plan = self.hybrid.plan();
        let mut first = 0;
        while first < candidates {
            let lanes = self
                .next_lanes()
                .min((candidates - first).next_multiple_of(self.workgroup));
            let stretch = LineStretch {
                candidates: candidates.min(first + lanes) as u32,
                stride: stride as u32,
                first: first as u32,
                sections: plan.rows.len() as u32,
                start: plan.start as u32,
                entry: plan.entry as f32,
                rows_per_speed_squared: limits.rows_per_speed_squared as f32,
                rows_per_radius: limits.rows_per_radius as f32,
            };
            self.context.write(&self.stretch, bytemuck::bytes_of(&stretch));
            let batch = self.buffers()?;
            let begin = Instant::now();
            self.context.run(|encoder| {
                let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
                    label: Some("energy_line"),
                    timestamp_writes: None,
                });
                pass.set_pipeline(&self.kernel.pipeline);
                pass.set_bind_group(0, &batch.group, &[]);
                pass.dispatch_workgroups((lanes / self.workgroup) as u32, 1, 1);
            })?;
            self.pace = Some((lanes, (begin.elapsed().as_secs_f64() * 1e3).max(1e-3)));
            first += lanes;
        }
        Ok(())
    }

    /// The laps of candidates.
    ///
    /// # Errors
    /// [`Error::Device`] if the device fails.
    pub fn laps(&mut self, candidates: &[&[f64]]) -> Result<Vec<EnergyLap<f64>>> {
        let mut laps = Vec::with_capacity(candidates.len());
        let count = self.figures();
        for batch in candidates.chunks(self.batch_size()) {
            self.reserve(batch.len())?;
            let stride = self.buffers()?.stride;
            // Figure by figure, so that neighbouring lanes read neighbouring memory. What is no number never reaches the
            // device, where it may count as anything.
            let mut figures = vec![0.0f32; stride * count];
            for (lane, candidate) in batch.iter().enumerate() {
                for (k, value) in self.hybrid.figures(candidate).into_iter().enumerate() {
                    let value = value as f32;
                    figures[k * stride + lane] = if value.is_finite() { value } else { 0.0 };
                }
            }
            self.context
                .write(&self.buffers()?.variables, bytemuck::cast_slice(&figures));
            self.score_batch(batch.len(), stride)?;
            let buffers = self.buffers()?;
            let bytes = (stride * FIGURES * 4) as u64;
            self.context.run(|encoder| {
                encoder.copy_buffer_to_buffer(&buffers.results, 0, &buffers.readback, 0, bytes)
            })?;
            self.context.read(&buffers.readback, bytes, |data| {
                let planes: &[f32] = bytemuck::cast_slice(data);
                laps.extend((0..batch.len()).map(|candidate| {
                    EnergyLap::from_array(std::array::from_fn(|k| f64::from(planes[k * stride + candidate])))
                }));
            })?;
        }
        Ok(laps)
    }
}

impl Evaluator for GpuHybridEvaluator<'_> {
    fn problem(&self) -> &Problem {
        &self.hybrid.problem
    }

    fn backend(&self) -> BackendInfo {
        self.context.backend_info()
    }

    fn evaluate(&mut self, population: &[f64]) -> Result<Evaluation> {
        let hybrid = self.hybrid;
        let candidates = hybrid.candidates(population);
        let laps = self.laps(&candidates)?;
        Ok(hybrid.evaluation(&candidates, &laps))
    }
}
