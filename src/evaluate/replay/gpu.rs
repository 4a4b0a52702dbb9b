//! The graphics backend: `f32`, one lane per candidate and window, the windows joined on the device.

pub use crate::evaluate::gpu::Batching;

use super::kernel::{BLOCK, CHANNELS};
use super::problem::ReplayProblem;
use crate::error::{Error, Result};
use crate::evaluate::gpu::shader::{CarShape, ReplayShape, base_vectors};
use crate::evaluate::gpu::{
    Binding, GpuContext, Kernel, LOOP_ROUNDS, made_ahead, most_rounds, planes, rounds_of, workgroup,
};
use crate::evaluate::{DeviceKernel, GpuBackend, ModelTable, OnDevice};
use crate::vehicle::model::STAGES;
use bytemuck::{Pod, Zeroable};
use std::sync::Arc;
use wgpu::BufferUsages as Usage;

/// One sample of the log on the device. Twin of `Sample` in `shaders/replay.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct DeviceSample {
    /// Wheel speeds FL FR RL RR, rad/s.
    pub wheel_speed: [f32; 4],
    /// Measured outputs.
    pub measured: [f32; 4],
    /// Road-wheel angle, rad.
    pub steer: f32,
    /// How far the DRS is open, 0 to 1.
    pub flap: f32,
    /// Nothing: vectors of four are aligned to 16 bytes.
    pub padding: [f32; 2],
}

/// One window on the device. Twin of `Window` in `shaders/replay.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct DeviceWindow {
    /// First sample.
    pub start: u32,
    /// One past the last sample.
    pub end: u32,
    /// Samples from the start that are not scored.
    pub scored_from: u32,
    /// State at the first sample.
    pub initial: [f32; 6],
}

/// What a dispatch is to do. Twin of `Stretch` in `shaders/replay_common.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct Stretch {
    /// Candidates in this batch.
    pub candidates: u32,
    /// Distance between their rows in the buffers.
    pub stride: u32,
    /// Windows in this batch.
    pub windows: u32,
    /// The first of them.
    pub first_window: u32,
    /// The first sample within every window.
    pub first_sample: u32,
    /// How many samples.
    pub samples: u32,
    /// Runge-Kutta steps per sample interval.
    pub substeps: u32,
    /// Integration step, s.
    pub step: f32,
}

/// Floats per lane between dispatches: state, totals and the drives flag.
const PROGRESS_PLANES: usize = 6 + CHANNELS + 1;
/// Floats per candidate that come back.
const RESULT_PLANES: usize = CHANNELS + 1;

/// Rounds of the kernel's loops in a step between samples: itself and its stages.
const fn rounds_per_substep() -> usize {
    1 + rounds_of(STAGES.len())
}

/// Rounds of the kernel's loops in a sample: itself and its steps.
const fn rounds_per_sample(substeps: usize) -> usize {
    1 + rounds_of(0) + substeps * rounds_per_substep()
}

/// Dispatches that one set of timestamps covers.
const TIMED_DISPATCHES: u32 = 1024;

/// What the last evaluation asked of the device.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DispatchStatistics {
    /// Dispatches of the replay kernel.
    pub dispatches: usize,
    /// The longest of them with its submission and the wait, ms.
    pub longest_ms: f64,
}

/// How fast the last dispatch went, from which the next is sized.
#[derive(Clone, Copy)]
struct Pace {
    lanes: usize,
    ms_per_sample: f64,
}

/// Buffers that grow with the batch, and the kernels' bindings to them.
struct BatchBuffers {
    /// Lanes and candidates that fit.
    lanes: usize,
    stride: usize,
    figures: wgpu::Buffer,
    results: wgpu::Buffer,
    readback: wgpu::Buffer,
    replay_group: wgpu::BindGroup,
    reduce_group: wgpu::BindGroup,
}

/// Timestamps of the replay dispatches.
struct Stopwatch {
    set: wgpu::QuerySet,
    resolved: wgpu::Buffer,
    readback: wgpu::Buffer,
}

/// The replay kernels on a device.
pub struct ReplayDevice {
    table: ModelTable,
    context: Arc<GpuContext>,
    batching: Batching,
    drive: Arc<Kernel>,
    reduce: Arc<Kernel>,
    workgroup: usize,
    windows: usize,
    substeps: usize,
    stretch: wgpu::Buffer,
    /// In the order of the replay kernel's bindings 1 to 4.
    tables: [wgpu::Buffer; 4],
    batch: Option<BatchBuffers>,
    stopwatch: Option<Stopwatch>,
    pace: Option<Pace>,
    statistics: DispatchStatistics,
    kernel_ms: Option<f64>,
}

/// Scores replays on a graphics processor.
pub type GpuEvaluator<'a> = GpuBackend<'a, ReplayProblem>;

impl OnDevice for ReplayProblem {
    type Device = ReplayDevice;
}

impl DeviceKernel<ReplayProblem> for ReplayDevice {
    fn open(replay: &ReplayProblem, context: Arc<GpuContext>) -> Result<Self> {
        let workgroup = workgroup(&context);
        let table = ModelTable::new(&replay.free, &replay.problem.variables);
        let shape = ReplayShape {
            car: CarShape {
                model: replay.tyre_model(),
                wheels: context.wheels(),
                sources: &table.sources,
                workgroup,
            },
            norm: replay.plan.norm,
        };
        use Binding::{Read, Uniform, Write};
        let drive = context.kernel(
            &shape.replay(),
            "replay",
            &[Uniform, Uniform, Read, Read, Read, Read, Write],
        )?;
        let reduce = context.kernel(&shape.reduce(), "replay_reduce", &[Uniform, Read, Write])?;

        let plan = replay.plan.to_f32();
        let substeps = plan.fractions.len();
        if Self::most_samples(&context, substeps) == 0 {
            return Err(Error::Device(format!(
                "{} limits the length of loops: it can drive at most {} steps between samples, {substeps} are needed",
                context.summary(),
                (LOOP_ROUNDS / BLOCK - rounds_per_sample(0)) / rounds_per_substep(),
            )));
        }
        let mut base = table.base.clone();
        base.resize(base_vectors(base.len()) * 4, 0.0);
        let samples: Vec<DeviceSample> = plan
            .samples
            .iter()
            .map(|s| DeviceSample {
                wheel_speed: s.wheel_speed,
                measured: s.measured,
                steer: s.steer,
                flap: s.flap,
                padding: [0.0; 2],
            })
            .collect();
        let narrow = |x: usize| {
            u32::try_from(x).map_err(|_| Error::Device(format!("a log of {x} samples does not fit a device")))
        };
        let windows = plan
            .windows
            .iter()
            .map(|w| {
                Ok(DeviceWindow {
                    start: narrow(w.start)?,
                    end: narrow(w.end)?,
                    scored_from: narrow(w.scored_from)?,
                    initial: w.initial,
                })
            })
            .collect::<Result<Vec<_>>>()?;
        let fractions: Vec<[f32; 4]> = plan.fractions.iter().map(|f| [f[0], f[1], f[2], 0.0]).collect();
        let storage = |label: &str, data: &[u8]| context.table(label, data, Usage::STORAGE);
        let tables = [
            context.buffer_of("parameters", bytemuck::cast_slice(&base), Usage::UNIFORM)?,
            storage("samples", bytemuck::cast_slice(&samples))?,
            storage("windows", bytemuck::cast_slice(&windows))?,
            storage("fractions", bytemuck::cast_slice(&fractions))?,
        ];
        let stretch = context.buffer(
            "stretch",
            size_of::<Stretch>() as u64,
            Usage::UNIFORM | Usage::COPY_DST,
        )?;
        let stopwatch = match context.timestamps(2 * TIMED_DISPATCHES)? {
            Some(set) => {
                let bytes = u64::from(2 * TIMED_DISPATCHES) * 8;
                Some(Stopwatch {
                    set,
                    resolved: context.buffer("ticks", bytes, Usage::QUERY_RESOLVE | Usage::COPY_SRC)?,
                    readback: context.buffer("ticks", bytes, Usage::MAP_READ | Usage::COPY_DST)?,
                })
            }
            None => None,
        };
        Ok(Self {
            table,
            // The first dispatch of a block of samples must end in reasonable time on a software driver, and fill a large card.
            batching: Batching::new(context.summary().kind, context.tuning().lanes, 128 << 20),
            windows: plan.windows.len(),
            substeps,
            context,
            drive,
            reduce,
            workgroup: workgroup as usize,
            stretch,
            tables,
            batch: None,
            stopwatch,
            pace: None,
            statistics: DispatchStatistics::default(),
            kernel_ms: None,
        })
    }

    fn context(&self) -> &GpuContext {
        &self.context
    }

    fn batching(&self) -> Batching {
        self.batching
    }

    fn cut(&mut self, batching: Batching) {
        self.batching = batching;
        self.batch = None;
    }

    fn kernel_ms(&self) -> Option<f64> {
        self.kernel_ms
    }

    fn outcomes(
        &mut self,
        replay: &ReplayProblem,
        candidates: &[&[f64]],
    ) -> Result<Vec<Option<[f64; CHANNELS]>>> {
        self.statistics = DispatchStatistics::default();
        self.kernel_ms = None;
        let errors = self.drive(replay, candidates)?;
        self.kernel_ms = self.read_stopwatch()?;
        Ok(errors)
    }
}

impl GpuBackend<'_, ReplayProblem> {
    /// What the last evaluation asked of the device.
    pub fn statistics(&self) -> DispatchStatistics {
        self.device.statistics
    }

    /// How long the replay kernel took to compile, ms.
    pub fn compile_ms(&self) -> f64 {
        self.device.drive.compile_ms
    }
}

impl ReplayDevice {
    /// The most candidates and windows of one batch, for a population of `count`.
    fn batch_size(&self, count: usize) -> (usize, usize) {
        let limits = self.context.limits();
        let binding = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
        let per_lane = (PROGRESS_PLANES * 4) as u64;
        let fitting = (self.batching.bytes.min(binding) / per_lane) as usize;
        let lanes = self.batching.lanes.min(fitting).max(self.workgroup);
        let most_groups = limits.max_compute_workgroups_per_dimension as usize;
        // The kernel that joins windows takes a round for each, and they are split only into whole blocks, because they are
        // summed by the block.
        let most_groups = most_groups.min(most_rounds(self.context.summary().kind));
        let all = self.windows;
        let whole_blocks = (lanes / self.workgroup).min(most_groups) / BLOCK * BLOCK;
        let windows = if all * self.workgroup <= lanes && all <= most_groups {
            all
        } else {
            all.min(whole_blocks.max(BLOCK))
        };
        let per_candidate = (self.table.varying.len().max(RESULT_PLANES) * 4) as u64;
        let candidates = (lanes / windows)
            .min((binding / per_candidate) as usize)
            .min(most_groups * self.workgroup);
        let whole_groups = (candidates / self.workgroup).max(1) * self.workgroup;
        (whole_groups.min(count), windows)
    }

    /// Makes room for a batch.
    fn reserve(&mut self, candidates: usize, windows: usize) -> Result<()> {
        let stride = candidates.next_multiple_of(self.workgroup);
        let lanes = stride * windows;
        if self
            .batch
            .as_ref()
            .is_some_and(|b| b.lanes >= lanes && b.stride >= stride)
        {
            return Ok(());
        }
        // The old buffers go before the new ones come.
        self.batch = None;
        let context = &self.context;
        let floats = |count: usize| (count * 4) as u64;
        let figures = context.buffer(
            "figures",
            floats(stride * self.table.varying.len()),
            Usage::STORAGE | Usage::COPY_DST,
        )?;
        let progress = context.buffer("progress", floats(lanes * PROGRESS_PLANES), Usage::STORAGE)?;
        let result_bytes = floats(stride * RESULT_PLANES);
        let results = context.buffer("results", result_bytes, Usage::STORAGE | Usage::COPY_SRC)?;
        let readback = context.buffer("readback", result_bytes, Usage::MAP_READ | Usage::COPY_DST)?;
        let [base, samples, window_table, fractions] = &self.tables;
        let replay_group = context.bind(
            &self.drive,
            &[
                &self.stretch,
                base,
                samples,
                window_table,
                fractions,
                &figures,
                &progress,
            ],
        )?;
        let reduce_group = context.bind(&self.reduce, &[&self.stretch, &progress, &results])?;
        self.batch = Some(BatchBuffers {
            lanes,
            stride,
            figures,
            results,
            readback,
            replay_group,
            reduce_group,
        });
        Ok(())
    }

    fn buffers(&self) -> Result<&BatchBuffers> {
        self.batch
            .as_ref()
            .ok_or_else(|| Error::Device("a batch without buffers".to_owned()))
    }

    /// The most samples of a dispatch, in whole blocks: a kernel's loops have a limit, see [`most_rounds`].
    fn most_samples(context: &GpuContext, substeps: usize) -> usize {
        most_rounds(context.summary().kind) / rounds_per_sample(substeps) / BLOCK * BLOCK
    }

    /// Samples of the next dispatch, in whole blocks.
    fn next_samples(&self, lanes: usize) -> usize {
        let by_time = self.pace.map_or(BLOCK, |pace| {
            let ms_per_sample = pace.ms_per_sample * (lanes as f64 / pace.lanes as f64).max(1.0);
            (self.batching.dispatch_ms / ms_per_sample) as usize
        });
        let samples = by_time
            .min(self.batching.steps.unwrap_or(usize::MAX))
            .min(Self::most_samples(&self.context, self.substeps));
        (samples / BLOCK).max(1) * BLOCK
    }

    /// Drives one batch of candidates, whose figures are on the device, through one batch of windows.
    fn drive_batch(&mut self, replay: &ReplayProblem, mut stretch: Stretch) -> Result<()> {
        let first = stretch.first_window as usize;
        let windows = &replay.plan.windows[first..first + stretch.windows as usize];
        let longest = windows.iter().map(|w| w.end - w.start).max().unwrap_or(0);
        let lanes = stretch.candidates as usize * windows.len();
        let groups = stretch.candidates.div_ceil(self.workgroup as u32);
        let mut done = 0;
        while done < longest {
            let samples = self
                .next_samples(lanes)
                .min((longest - done).next_multiple_of(BLOCK));
            stretch.first_sample = done as u32;
            stretch.samples = samples as u32;
            self.context.write(&self.stretch, bytemuck::bytes_of(&stretch));
            let query = 2 * self.statistics.dispatches as u32;
            let timestamp_writes = self
                .stopwatch
                .as_ref()
                .filter(|_| query < 2 * TIMED_DISPATCHES)
                .map(|stopwatch| wgpu::ComputePassTimestampWrites {
                    query_set: &stopwatch.set,
                    beginning_of_pass_write_index: Some(query),
                    end_of_pass_write_index: Some(query + 1),
                });
            let batch = self.buffers()?;
            let ms = self.context.dispatch(
                &self.drive,
                &batch.replay_group,
                [groups, stretch.windows],
                timestamp_writes,
            )?;
            // The first dispatch of all may have compiled; the next one corrects what it taught.
            self.pace = Some(Pace {
                lanes,
                ms_per_sample: (ms / samples as f64).max(1e-9),
            });
            self.statistics.dispatches += 1;
            self.statistics.longest_ms = self.statistics.longest_ms.max(ms);
            done += samples;
        }
        let batch = self.buffers()?;
        self.context
            .dispatch(&self.reduce, &batch.reduce_group, [groups, 1], None)
            .map(drop)
    }

    /// Errors per channel of candidates that can be driven; `None` of those that do not reach the end.
    fn drive(&mut self, replay: &ReplayProblem, rows: &[&[f64]]) -> Result<Vec<Option<[f64; CHANNELS]>>> {
        let mut errors = Vec::with_capacity(rows.len());
        if rows.is_empty() {
            return Ok(errors);
        }
        let (most_candidates, most_windows) = self.batch_size(rows.len());
        let all_windows = self.windows;
        self.reserve(most_candidates, most_windows)?;
        // `self` is what the device works with.
        let (table, workgroup) = (self.table.clone(), self.workgroup);
        let stride_of = |candidates: usize| candidates.next_multiple_of(workgroup);
        let figures = |candidates: &[&[f64]]| {
            let varying = table.varying.len();
            let rows = table.rows(&replay.free, candidates);
            let sizes = [candidates.len(), stride_of(candidates.len()), varying];
            planes(sizes, |candidate, figure| rows[candidate * varying + figure])
        };
        made_ahead(rows.chunks(most_candidates), figures, |candidates, figures| {
            let stride = stride_of(candidates.len());
            let batch = self.buffers()?;
            self.context.write(&batch.figures, bytemuck::cast_slice(&figures));
            for first_window in (0..all_windows).step_by(most_windows) {
                let stretch = Stretch {
                    candidates: candidates.len() as u32,
                    stride: stride as u32,
                    windows: most_windows.min(all_windows - first_window) as u32,
                    first_window: first_window as u32,
                    first_sample: 0,
                    samples: 0,
                    substeps: self.substeps as u32,
                    step: replay.plan.step as f32,
                };
                self.drive_batch(replay, stretch)?;
            }
            let batch = self.buffers()?;
            let bytes = (stride * RESULT_PLANES * 4) as u64;
            let results = (&batch.results, 0);
            self.context.read_back(results, &batch.readback, bytes, |data| {
                let planes: &[f32] = bytemuck::cast_slice(data);
                errors.extend((0..candidates.len()).map(|candidate| {
                    let at = |plane: usize| f64::from(planes[plane * stride + candidate]);
                    (at(CHANNELS) != 0.0).then(|| std::array::from_fn(at))
                }));
            })
        })?;
        Ok(errors)
    }

    /// Sums up the timestamps of the dispatches so far.
    fn read_stopwatch(&self) -> Result<Option<f64>> {
        let dispatches = self.statistics.dispatches as u32;
        let Some(stopwatch) = self.stopwatch.as_ref().filter(|_| dispatches > 0) else {
            return Ok(None);
        };
        if dispatches > TIMED_DISPATCHES {
            return Ok(None);
        }
        let bytes = u64::from(2 * dispatches) * 8;
        self.context.run(|encoder| {
            encoder.resolve_query_set(&stopwatch.set, 0..2 * dispatches, &stopwatch.resolved, 0);
            encoder.copy_buffer_to_buffer(&stopwatch.resolved, 0, &stopwatch.readback, 0, bytes);
        })?;
        let ticks: u64 = self.context.read(&stopwatch.readback, bytes, |data| {
            let ticks: Vec<u64> = bytemuck::pod_collect_to_vec(data);
            ticks
                .chunks_exact(2)
                .map(|pair| pair[1].saturating_sub(pair[0]))
                .sum()
        })?;
        Ok(Some(ticks as f64 * self.context.tick_ms()))
    }
}
