//! The graphics backend: `f32`, one lane per lap.

use super::problem::{Figure, HybridObjective, HybridProblem};
use crate::error::Result;
use crate::evaluate::gpu::shader::EnergyShape;
use crate::evaluate::gpu::{Batching, Binding, DeviceKind, GpuContext};
use crate::evaluate::line::gpu::{Exchange, LineBatches, LineKernel, LineTables, Scaled};
use crate::evaluate::{DeviceKernel, GpuBackend, OnDevice, ProblemKind};
use crate::line::energy::FIGURES;
use crate::line::energy::{EnergyLap, EnergyPlan, EnergyTable, Mode};
use crate::line::kernel::Wanted;
use bytemuck::{Pod, Zeroable};
use rayon::prelude::*;
use std::sync::Arc;
use wgpu::BufferUsages as Usage;

/// Figures of the car that a dispatch needs. Twin of `EnergyAccount` in `shaders/energy.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct EnergyAccount {
    /// Mass, kg.
    pub mass: f32,
    /// Mass that is accelerated over that of the car.
    pub rotating: f32,
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
    /// What the store takes beyond the charge at the start, J.
    pub store_room: f32,
    /// Energy of the MGU-H for each kilogram of fuel, J/kg.
    pub exhaust_gain: f32,
    /// Energy that the wheels lack for each joule of the MGU-H.
    pub exhaust_cost: f32,
    /// Energy out of the store for each joule at the wheels by the MGU-H as a motor, beyond the MGU-K's.
    pub assist_extra: f32,
    /// Its force over mass for each joule out of the store, over the MGU-K's.
    pub assist_share: f32,
    /// Speed squared from which the MGU-H generates, m^2/s^2.
    pub exhaust_from: f32,
    /// Acceleration up to which it does, m/s^2.
    pub exhaust_to_ax: f32,
    /// Rows per speed squared, s^2/m^2.
    pub rows_per_speed_squared: f32,
    /// The section that a lap is run in from.
    pub run_in: u32,
}

/// The energy kernel on a device.
pub struct EnergyDevice {
    batches: LineBatches<FIGURES>,
    /// For swarms that live on the device.
    exchange: Option<Exchange>,
}

/// Between a swarm and the kernel, where variables are figures of the kernel as they are, no gate is free and the kernel has
/// all objectives.
fn exchange_of(hybrid: &HybridProblem, context: &GpuContext) -> Result<Option<Exchange>> {
    let Some(variables) = hybrid.variables_of_figures() else {
        return Ok(None);
    };
    let scaled = Scaled::variables(&hybrid.problem.variables);
    let figures: Vec<Scaled> = variables
        .into_iter()
        .map(|figure| match figure {
            Figure::Variable(k) => scaled[k],
            Figure::Fixed(value) => Scaled::fixed(value),
        })
        .collect();
    // In the order of the figures of a lap.
    let objectives: Option<Vec<Scaled>> = hybrid
        .objectives()
        .iter()
        .map(|objective| match objective {
            HybridObjective::LapTime => Some(Scaled::of_result(0, 1.0)),
            HybridObjective::Fuel => Some(Scaled::of_result(1, hybrid.car().fuel_density_kgpl)),
            HybridObjective::EnergyUsed => Some(Scaled::of_result(2, 1e6)),
            HybridObjective::SocSwing => Some(Scaled::of_result(6, hybrid.car().hybrid.store.capacity_j)),
            // The host works them out of the line.
            HybridObjective::Length | HybridObjective::Gamma => None,
        })
        .collect();
    let Some(objectives) = objectives else {
        return Ok(None);
    };
    let free = hybrid.problem.variables.iter().filter(|v| v.is_free()).count();
    let tables = (figures.as_slice(), objectives.as_slice());
    Exchange::new(context, free, tables, HybridProblem::WITHOUT_COST).map(Some)
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

/// Scores laps with energy on a graphics processor.
pub type GpuHybridEvaluator<'a> = GpuBackend<'a, HybridProblem>;

impl OnDevice for HybridProblem {
    type Device = EnergyDevice;
}

impl DeviceKernel<HybridProblem> for EnergyDevice {
    fn open(hybrid: &HybridProblem, context: Arc<GpuContext>) -> Result<Self> {
        let device = context.limits();
        let plan = hybrid.plan().stored::<f32>();
        let envelope = hybrid.car().envelope_table.stored::<f32>();
        let table = hybrid.car().table.stored::<f32>();
        let wanted = Wanted {
            integral: false,
            lap: true,
        };
        let tables = LineTables::new(&context, &plan, &envelope, wanted)?;
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
        let both = Usage::STORAGE | Usage::UNIFORM;
        let account = EnergyAccount {
            mass: table.mass,
            rotating: table.rotating,
            deploy_cost: table.deploy_cost,
            harvest_gain: table.harvest_gain,
            force_per_deployed: table.force_per_deployed,
            force_per_harvested: table.force_per_harvested,
            harvest_most: table.harvest_most,
            store_room: table.store_room,
            exhaust_gain: table.exhaust_gain,
            exhaust_cost: table.exhaust_cost,
            assist_extra: table.assist_extra,
            assist_share: table.assist_share,
            exhaust_from: table.exhaust_from,
            exhaust_to_ax: table.exhaust_to_ax,
            rows_per_speed_squared: table.rows_per_speed_squared,
            run_in: hybrid.energy().run_in as u32,
        };
        let account = context.buffer_of("account", bytemuck::bytes_of(&account), Usage::UNIFORM)?;
        let energy = context.buffer_of("energy", bytemuck::cast_slice(&vectors), both)?;
        let energy_binding = if uniform_energy {
            Binding::Uniform
        } else {
            Binding::Read
        };
        let kernel = LineKernel {
            source: &shape.source(),
            entry: "energy_line",
            tables,
            plan: &plan,
            envelope: &envelope,
            others: vec![(Binding::Uniform, account), (energy_binding, energy)],
            variables: hybrid.line_variables() + hybrid.strategy_figures(),
            lap: true,
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

    fn score_resident(
        &mut self,
        hybrid: &HybridProblem,
        particles: usize,
        position: &wgpu::Buffer,
        objectives: &wgpu::Buffer,
    ) -> Result<bool> {
        if self.exchange.is_none() {
            self.exchange = exchange_of(hybrid, self.batches.context())?;
        }
        let Some(exchange) = &self.exchange else {
            return Ok(false);
        };
        self.batches
            .score_resident(exchange, particles, position, objectives)?;
        Ok(true)
    }

    fn outcomes(&mut self, hybrid: &HybridProblem, candidates: &[&[f64]]) -> Result<Vec<EnergyLap<f64>>> {
        let figures: Vec<Vec<f64>> = candidates.par_iter().map(|c| hybrid.figures(c)).collect();
        let score = |candidate: usize, figure: usize| figures[candidate][figure];
        let laps = self.batches.score(candidates.len(), score)?;
        Ok(laps.into_iter().map(EnergyLap::from_array).collect())
    }
}
