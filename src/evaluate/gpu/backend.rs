//! Kinds of problems on a device, and the evaluator that follows.

use super::spread::{Spread, joined};
use super::{Batching, FallbackEvaluator, GpuContext, devices};
use crate::error::{Error, Result};
use crate::evaluate::portions::portion;
use crate::evaluate::problem_kind::{Checked, candidates, evaluation};
use crate::evaluate::resident::{BLOCK, DeviceObjectives, failed_objective};
use crate::evaluate::{BackendChoice, BackendInfo, Evaluation, Evaluator, OutcomeOf, Problem, ProblemKind};
use rayon::prelude::*;
use std::sync::{Arc, OnceLock};
use wgpu::BufferUsages;

/// A kind of problem that devices evaluate.
pub trait OnDevice: ProblemKind {
    /// The kernel on a device, with its tables and buffers.
    type Device: DeviceKernel<Self> + Send;
}

/// The kernel of a kind of problem on a device.
pub trait DeviceKernel<K: ProblemKind>: Sized {
    /// The kernel and its tables on `context`'s device.
    ///
    /// # Errors
    /// [`crate::Error::Device`] if the kernel does not compile or the tables do not fit the device.
    fn open(kind: &K, context: Arc<GpuContext>) -> Result<Self>;

    /// The device.
    fn context(&self) -> &GpuContext;

    /// How the work is cut.
    fn batching(&self) -> Batching;

    /// Cross-sections the work differently.
    fn cut(&mut self, batching: Batching);

    /// Time that the device itself spent on the last outcomes (ms), where it can tell; else the time of the dispatches counts.
    fn kernel_ms(&self) -> Option<f64> {
        None
    }

    /// The outcomes of candidates.
    ///
    /// # Errors
    /// [`crate::Error::Device`] if the device fails.
    fn outcomes(&mut self, kind: &K, candidates: &[&[f64]]) -> Result<Vec<K::Outcome>>;

    /// Writes the objectives of particles that live on the device, see [`DeviceObjectives::evaluate`], without the host; says
    /// whether it did. Where the kernel wants figures that the host makes of candidates, as those of cars are, it does not.
    ///
    /// # Errors
    /// [`crate::Error::Device`] if the device fails.
    fn score_resident(
        &mut self,
        _kind: &K,
        _particles: usize,
        _position: &wgpu::Buffer,
        _objectives: &wgpu::Buffer,
    ) -> Result<bool> {
        Ok(false)
    }
}

/// The graphics backend: `f32`, one lane per candidate.
pub struct GpuBackend<'a, K: OnDevice> {
    pub(in crate::evaluate) kind: &'a K,
    pub(in crate::evaluate) device: K::Device,
    dispatched_ms: Option<f64>,
    /// Takes positions to the host, with its size in bytes.
    readback: Option<(wgpu::Buffer, u64)>,
}

impl<'a, K: OnDevice> GpuBackend<'a, K> {
    /// An evaluator of `kind` on `context`'s device.
    ///
    /// # Errors
    /// [`crate::Error::Device`] if the kernel does not compile or its tables do not fit the device.
    pub fn new(kind: &'a K, context: Arc<GpuContext>) -> Result<Self> {
        Ok(Self {
            device: K::Device::open(kind, context)?,
            kind,
            dispatched_ms: None,
            readback: None,
        })
    }

    /// Cross-sections the work differently.
    pub fn with_batching(mut self, batching: Batching) -> Self {
        self.device.cut(batching);
        self
    }

    /// How the work is cut.
    pub fn batching(&self) -> Batching {
        self.device.batching()
    }

    /// The outcomes of candidates.
    ///
    /// # Errors
    /// [`crate::Error::Device`] if the device fails.
    pub fn outcomes(&mut self, candidates: &[&[f64]]) -> Result<Vec<OutcomeOf<K>>> {
        let checked = Checked::new(self.kind, candidates);
        let before = self.device.context().dispatched_ms();
        let outcomes = self.device.outcomes(self.kind, &checked.rows)?;
        self.dispatched_ms = Some(self.device.context().dispatched_ms() - before);
        Ok(checked.joined(outcomes))
    }
}

impl<K: OnDevice> Evaluator for GpuBackend<'_, K> {
    fn problem(&self) -> &Problem {
        self.kind.problem()
    }

    fn backend(&self) -> BackendInfo {
        self.device.context().backend_info()
    }

    fn last_kernel_ms(&self) -> Option<f64> {
        self.device.kernel_ms().or(self.dispatched_ms)
    }

    fn evaluate(&mut self, population: &[f64]) -> Result<Evaluation> {
        let candidates = candidates(self.kind.problem(), population);
        let outcomes = self.outcomes(&candidates)?;
        Ok(evaluation(self.kind, &candidates, outcomes))
    }
}

impl<K: OnDevice> DeviceObjectives for GpuBackend<'_, K> {
    fn problem(&self) -> &Problem {
        self.kind.problem()
    }

    fn evaluate(
        &mut self,
        particles: usize,
        position: &wgpu::Buffer,
        objectives: &wgpu::Buffer,
    ) -> Result<()> {
        let kind = self.kind;
        if self
            .device
            .score_resident(kind, particles, position, objectives)?
        {
            return Ok(());
        }
        // So many that their memory is that of a portion.
        let most = portion(kind.bytes_each()).next_multiple_of(BLOCK);
        for first in (0..particles).step_by(most) {
            self.by_way_of_the_host([first, most.min(particles - first)], position, objectives)?;
        }
        Ok(())
    }
}

impl<K: OnDevice> GpuBackend<'_, K> {
    /// Writes the objectives of some particles, from the first of a block on. Candidates are the very ones that a swarm on the host
    /// has at these positions, so that their figures are.
    fn by_way_of_the_host(
        &mut self,
        [first, count]: [usize; 2],
        position: &wgpu::Buffer,
        objectives: &wgpu::Buffer,
    ) -> Result<()> {
        let problem = self.kind.problem();
        let (variables, width) = (&problem.variables, problem.objectives.len());
        let d = variables.iter().filter(|v| v.is_free()).count();
        let lanes = count.next_multiple_of(BLOCK);
        let bytes = (lanes * d * 4) as u64;
        let context = self.device.context();
        if self.readback.as_ref().is_none_or(|(_, size)| *size < bytes) {
            self.readback = None;
            let usage = BufferUsages::MAP_READ | BufferUsages::COPY_DST;
            self.readback = Some((context.buffer("readback", bytes, usage)?, bytes));
        }
        let Some((readback, _)) = &self.readback else {
            return Err(Error::Device("no buffer to read positions through".to_owned()));
        };
        let from = (position, (first * d * 4) as u64);
        let rows: Vec<f32> = context.read_back(from, readback, bytes, bytemuck::pod_collect_to_vec)?;
        let mut population = vec![0.0; count * variables.len()];
        population
            .par_chunks_mut(BLOCK * variables.len())
            .zip(rows.par_chunks(BLOCK * d))
            .for_each(|(candidates, rows)| {
                for (lane, candidate) in candidates.chunks_exact_mut(variables.len()).enumerate() {
                    let mut place = lane;
                    for (value, v) in candidate.iter_mut().zip(variables) {
                        *value = v.lower;
                        if v.is_free() {
                            *value = v.at(f64::from(rows[place]));
                            place += BLOCK;
                        }
                    }
                }
            });
        let evaluation = Evaluator::evaluate(self, &population)?;
        let mut rows = vec![0.0f32; lanes * width];
        rows.par_chunks_exact_mut(BLOCK * width)
            .zip(evaluation.objectives.par_chunks(BLOCK * width))
            .zip(evaluation.failures.par_chunks(BLOCK))
            .for_each(|((block, told), failures)| {
                let told = told.chunks_exact(width).zip(failures);
                for (lane, (row, failure)) in told.enumerate() {
                    for (k, cost) in row.iter().enumerate() {
                        block[k * BLOCK + lane] = failure.map_or(*cost as f32, failed_objective);
                    }
                }
            });
        let place = (first * width * 4) as u64;
        let context = self.device.context();
        context.write_at(objectives, place, bytemuck::cast_slice(&rows));
        Ok(())
    }
}

/// Whether a real GPU is present. Asked once: it wakes every driver.
pub(in crate::evaluate) fn is_real() -> bool {
    static PRESENT: OnceLock<bool> = OnceLock::new();
    *PRESENT.get_or_init(|| devices().iter().any(|d| d.kind.is_real()))
}

/// The device that would evaluate, or the devices. They are opened, nothing is compiled.
pub(in crate::evaluate) fn would_be(adapter: Option<&str>) -> Result<BackendInfo> {
    let contexts = GpuContext::all_shared(adapter)?;
    Ok(joined(contexts.iter().map(|c| c.backend_info())))
}

/// An evaluator of `kind` on a device or on several, which `lanes` take over from.
pub(in crate::evaluate) fn open<'a, K: OnDevice>(
    kind: &'a K,
    (choice, adapter): (BackendChoice, Option<&str>),
    lanes: impl Fn() -> Box<dyn Evaluator + 'a> + 'a,
) -> Result<Box<dyn Evaluator + 'a>> {
    let name = adapter.map(str::to_owned);
    let open = move || -> Result<Box<dyn Evaluator + 'a>> {
        let contexts = GpuContext::all_shared(name.as_deref())?;
        let opened = contexts.into_iter().map(|context| GpuBackend::new(kind, context));
        let mut devices: Vec<_> = opened.collect::<Result<_>>()?;
        match devices.pop() {
            Some(only) if devices.is_empty() => Ok(Box::new(only)),
            last => Ok(Box::new(Spread::new(devices.into_iter().chain(last))?)),
        }
    };
    let evaluator = FallbackEvaluator::new(kind.problem(), (choice, adapter), open, lanes)?;
    Ok(Box::new(evaluator))
}
