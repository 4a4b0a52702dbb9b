//! The process's device: buffers, kernels and their errors.
//!
//! No error of wgpu reaches the user as a panic. Allocation and compilation run inside error scopes; handlers keep errors that
//! occur outside them and return them as [`Error::Device`] at the next check.

mod compile;

pub use compile::{Binding, Kernel};

use compile::Compiled;

use super::adapter::{DeviceKind, DeviceSummary, asks_for_all, choose, names_of_all};
use super::faults::{self, Fault, Place};
use super::shader::WheelOrder;
use super::tuning::Tuning;
use crate::error::{Error, Result};
use crate::evaluate::{BackendInfo, dispatches};
use std::collections::HashMap;
use std::ops::Range;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::RecvTimeoutError;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// How long a dispatch may take before the device counts as hung. Dispatches are cut to a tenth of a second; a
/// loaded machine's software driver may need far longer for its first, which also compiles.
const PATIENCE: Duration = Duration::from_secs(600);

/// A device with its queue, and the kernels compiled for it.
#[derive(Debug)]
pub struct GpuContext {
    device: wgpu::Device,
    queue: wgpu::Queue,
    summary: DeviceSummary,
    wheels: WheelOrder,
    tuning: Tuning,
    /// What earlier runs have compiled, where the device keeps such.
    compiled: Option<Compiled>,
    failure: Arc<Mutex<Option<String>>>,
    kernels: Mutex<HashMap<String, Arc<Kernel>>>,
    /// Time of all dispatches in whole microseconds, so that it fits an atomic.
    dispatched_us: AtomicU64,
}

/// What a device is asked for where its adapter has it.
const USEFUL: wgpu::Features = wgpu::Features::TIMESTAMP_QUERY.union(wgpu::Features::PIPELINE_CACHE);

/// What did not happen in all the time that a device is given.
fn hung(what: &str) -> String {
    format!(
        "{what} within {} s, so that the device counts as hung",
        PATIENCE.as_secs()
    )
}

fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    // What is guarded is replaced whole, so that a panic elsewhere leaves it sound.
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// A device that the process has open, with what it was asked for by.
type Opened = (Option<String>, Arc<GpuContext>);

/// The devices that the process has open: one, or those that were asked for together.
static SHARED: Mutex<Vec<Opened>> = Mutex::new(Vec::new());

/// What the devices that the process has opened were asked for by.
static OPENED: Mutex<Vec<Option<String>>> = Mutex::new(Vec::new());

impl GpuContext {
    /// The process's device, opened on the first call; `name` chooses the adapter (see
    /// [`super::devices`]). A lost device, or one that does not match `name`, is replaced by a new one.
    ///
    /// # Errors
    /// [`Error::NoDevice`] if no device has that name, [`Error::Device`] if it does not open.
    pub fn shared(name: Option<&str>) -> Result<Arc<Self>> {
        let context = Self::open_in(&mut locked(&SHARED), name)?;
        Self::note_open(name);
        Ok(context)
    }

    /// The process's devices that `name` chooses: as [`GpuContext::shared`], but with [`super::ALL_ADAPTERS`] every adapter of the
    /// best kind.
    ///
    /// # Errors
    /// As [`GpuContext::shared`].
    pub fn all_shared(name: Option<&str>) -> Result<Vec<Arc<Self>>> {
        if !asks_for_all(name) {
            return Ok(vec![Self::shared(name)?]);
        }
        let names = names_of_all();
        if names.is_empty() {
            // Says what is missing.
            return Ok(vec![Self::shared(name)?]);
        }
        let mut shared = locked(&SHARED);
        shared.retain(|(asked, _)| asked.as_ref().is_some_and(|asked| names.contains(asked)));
        let open = |name: &String| {
            // Each by itself, or one would take the place of the one before.
            let mut own = Vec::new();
            if let Some(place) = shared.iter().position(|(asked, _)| asked.as_ref() == Some(name)) {
                own.push(shared.swap_remove(place));
            }
            let context = Self::open_in(&mut own, Some(name))?;
            Ok((own, context))
        };
        let opened: Vec<_> = names.iter().map(open).collect::<Result<_>>()?;
        let (own, contexts): (Vec<_>, Vec<_>) = opened.into_iter().unzip();
        *shared = own.into_iter().flatten().collect();
        Self::note_open(name);
        Ok(contexts)
    }

    /// The one of `shared` that `name` means and that works; else a new one, which takes their place.
    fn open_in(shared: &mut Vec<Opened>, name: Option<&str>) -> Result<Arc<Self>> {
        let meant = |(asked, context): &&Opened| {
            name.is_none_or(|n| asked.as_deref() == Some(n) || context.summary.is_called(n))
                && context.check().is_ok()
        };
        if let Some((_, context)) = shared.iter().find(meant) {
            return Ok(Arc::clone(context));
        }
        // The old device closes first, unless an evaluator still holds it.
        shared.clear();
        let context = Arc::new(Self::open(name)?);
        shared.push((name.map(str::to_owned), Arc::clone(&context)));
        Ok(context)
    }

    fn note_open(name: Option<&str>) {
        let mut opened = locked(&OPENED);
        if !opened.iter().any(|known| known.as_deref() == name) {
            opened.push(name.map(str::to_owned));
        }
    }

    /// Whether the process has opened a device that matches `name` before. If it is absent now, it has gone.
    pub(crate) fn was_open(name: Option<&str>) -> bool {
        locked(&OPENED).iter().any(|known| known.as_deref() == name)
    }

    /// Releases the process's devices; the next call of [`GpuContext::shared`] opens a new one.
    pub fn forget() {
        locked(&SHARED).clear();
    }

    /// A device of its own that is held to the least that every WebGPU device has: storage bindings of 128 MiB, 65535
    /// workgroups in a dispatch.
    ///
    /// # Errors
    /// As [`GpuContext::shared`].
    pub fn with_least_limits(name: Option<&str>) -> Result<Arc<Self>> {
        Ok(Arc::new(Self::open_within(name, |_| wgpu::Limits::default())?))
    }

    /// A device of its own whose kernels go through wheels in that order, and whose swarms are shaped accordingly, whatever kind it is.
    ///
    /// # Errors
    /// As [`GpuContext::shared`].
    pub fn with_wheels(name: Option<&str>, wheels: WheelOrder) -> Result<Arc<Self>> {
        Ok(Arc::new(Self {
            wheels,
            ..Self::open(name)?
        }))
    }

    /// A device of its own with this tuning, whatever is remembered of the adapter.
    ///
    /// # Errors
    /// As [`GpuContext::shared`].
    pub fn with_tuning(name: Option<&str>, tuning: Tuning) -> Result<Arc<Self>> {
        Ok(Arc::new(Self {
            tuning,
            ..Self::open(name)?
        }))
    }

    fn open(name: Option<&str>) -> Result<Self> {
        Self::open_within(name, wgpu::Adapter::limits)
    }

    fn open_within(name: Option<&str>, limits: impl Fn(&wgpu::Adapter) -> wgpu::Limits) -> Result<Self> {
        if faults::adapter_is_gone() {
            return Err(Error::NoDevice("the adapter is gone".to_owned()));
        }
        let (adapter, summary) = choose(name)?;
        let descriptor = wgpu::DeviceDescriptor {
            label: Some("lapswarm"),
            // Whatever the adapter has of what is useful; nothing is demanded.
            required_features: adapter.features() & USEFUL,
            required_limits: limits(&adapter),
            ..Default::default()
        };
        let (device, queue) = pollster::block_on(adapter.request_device(&descriptor))
            .map_err(|e| Error::Device(format!("{summary} does not open: {e}")))?;
        let failure = Arc::new(Mutex::new(None));
        let keep = |failure: &Mutex<Option<String>>, message: String| {
            // The first failure is the cause of those that follow.
            locked(failure).get_or_insert(message);
        };
        let uncaptured = Arc::clone(&failure);
        device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| {
            keep(&uncaptured, error.to_string())
        }));
        let lost = Arc::clone(&failure);
        device.set_device_lost_callback(move |reason, message| {
            keep(&lost, format!("the device was lost ({reason:?}): {message}"));
        });
        Ok(Self {
            compiled: Compiled::of(&device, &summary),
            tuning: Tuning::of(&summary),
            device,
            queue,
            wheels: match summary.kind {
                DeviceKind::Software => WheelOrder::SideBySide,
                _ => WheelOrder::ByAxle,
            },
            summary,
            failure,
            kernels: Mutex::default(),
            dispatched_us: AtomicU64::new(0),
        })
    }

    /// What the device is.
    pub fn summary(&self) -> &DeviceSummary {
        &self.summary
    }

    /// How kernels go through the wheels of a car here.
    pub fn wheels(&self) -> WheelOrder {
        self.wheels
    }

    /// Whether work is shaped for a graphics processor, which only many lanes fill, instead of a software driver.
    pub(crate) fn is_shaped_for_a_card(&self) -> bool {
        self.wheels == WheelOrder::ByAxle
    }

    /// How kernels of lines and cars are dispatched here.
    pub fn tuning(&self) -> Tuning {
        self.tuning
    }

    /// The device, as evaluators report it.
    pub(crate) fn backend_info(&self) -> BackendInfo {
        BackendInfo {
            backend: "gpu",
            device: self.summary.name.clone(),
            driver: format!("{} {}", self.summary.driver, self.summary.driver_info)
                .trim()
                .to_owned(),
        }
    }

    /// The device's limits.
    pub fn limits(&self) -> wgpu::Limits {
        self.device.limits()
    }

    /// # Errors
    /// [`Error::Device`] if something failed since the device opened.
    pub fn check(&self) -> Result<()> {
        match locked(&self.failure).as_ref() {
            Some(message) => Err(Error::Device(format!("{}: {message}", self.summary))),
            None => Ok(()),
        }
    }

    /// Runs `work` in error scopes; `what` names it in errors.
    fn scoped<T>(&self, what: &str, work: impl FnOnce() -> T) -> Result<T> {
        self.check()?;
        let scopes = [
            wgpu::ErrorFilter::Internal,
            wgpu::ErrorFilter::OutOfMemory,
            wgpu::ErrorFilter::Validation,
        ]
        .map(|filter| self.device.push_error_scope(filter));
        let result = work();
        let mut error = None;
        for scope in scopes.into_iter().rev() {
            error = error.or(pollster::block_on(scope.pop()));
        }
        match error {
            Some(error) => Err(Error::Device(format!("{}: cannot {what}: {error}", self.summary))),
            None => self.check().map(|()| result),
        }
    }

    /// A buffer of at least `bytes`.
    ///
    /// # Errors
    /// [`Error::Device`] if the device cannot hold it.
    pub(crate) fn buffer(&self, label: &str, bytes: u64, usage: wgpu::BufferUsages) -> Result<wgpu::Buffer> {
        // Bindings of no bytes are not allowed, copies go by fours.
        let size = bytes.max(16).next_multiple_of(4);
        let what = format!("allocate {size} bytes for {label}");
        if let Some(fault) = faults::next(Place::Allocation) {
            self.suffer(fault, &what)?;
        }
        self.scoped(&what, || {
            self.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(label),
                size,
                usage,
                mapped_at_creation: false,
            })
        })
    }

    /// A buffer that holds `data`.
    ///
    /// # Errors
    /// [`Error::Device`] if the device cannot hold it.
    pub(crate) fn buffer_of(
        &self,
        label: &str,
        data: &[u8],
        usage: wgpu::BufferUsages,
    ) -> Result<wgpu::Buffer> {
        let buffer = self.buffer(label, data.len() as u64, usage | wgpu::BufferUsages::COPY_DST)?;
        self.write(&buffer, data);
        Ok(buffer)
    }

    /// A table that kernels read from storage.
    ///
    /// # Errors
    /// [`Error::Device`] if it does not fit a binding or the device.
    pub(crate) fn table(&self, label: &str, data: &[u8], usage: wgpu::BufferUsages) -> Result<wgpu::Buffer> {
        let most = self.limits().max_storage_buffer_binding_size;
        if data.len() as u64 > most {
            return Err(Error::Device(format!(
                "{} holds at most {most} bytes of {label}, {} are needed",
                self.summary(),
                data.len()
            )));
        }
        self.buffer_of(label, data, usage | wgpu::BufferUsages::STORAGE)
    }

    /// Writes to the front of `buffer` before the next submission.
    pub(crate) fn write(&self, buffer: &wgpu::Buffer, data: &[u8]) {
        self.write_at(buffer, 0, data);
    }

    /// Writes to the place `first` of `buffer` before the next submission.
    pub(crate) fn write_at(&self, buffer: &wgpu::Buffer, first: u64, data: &[u8]) {
        if !data.is_empty() {
            self.queue.write_buffer(buffer, first, data);
        }
    }

    /// Records with `record`, submits, and waits for the device to finish.
    ///
    /// # Errors
    /// [`Error::Device`] if that fails or takes too long.
    pub(crate) fn run(&self, record: impl FnOnce(&mut wgpu::CommandEncoder)) -> Result<()> {
        let begin = Instant::now();
        let submission = self.submit(record)?;
        self.wait(Some(submission))?;
        dispatches::note(begin.elapsed());
        Ok(())
    }

    /// Records with `record` and submits. What is submitted next comes after it, and finds what became of it.
    ///
    /// # Errors
    /// [`Error::Device`] if that fails.
    pub(crate) fn run_ahead(&self, record: impl FnOnce(&mut wgpu::CommandEncoder)) -> Result<()> {
        self.submit(record).map(drop)
    }

    fn submit(&self, record: impl FnOnce(&mut wgpu::CommandEncoder)) -> Result<wgpu::SubmissionIndex> {
        let what = "run a kernel";
        let fault = faults::next(Place::Submission);
        if let Some(fault) = fault {
            self.suffer(fault, what)?;
        }
        let submission = self.scoped(what, || {
            let mut encoder = self.device.create_command_encoder(&Default::default());
            record(&mut encoder);
            self.queue.submit([encoder.finish()])
        })?;
        if fault == Some(Fault::Hung) {
            self.waited(Err(wgpu::PollError::Timeout))?;
        }
        Ok(submission)
    }

    /// Waits for all that was submitted.
    ///
    /// # Errors
    /// [`Error::Device`] if any of it fails or takes too long.
    pub fn settle(&self) -> Result<()> {
        self.wait(None)
    }

    /// Runs `kernel` over so many workgroups; returns how long that took with its submission and the wait (ms, above zero).
    ///
    /// # Errors
    /// [`Error::Device`] if that fails or takes too long.
    pub fn dispatch(
        &self,
        kernel: &Kernel,
        group: &wgpu::BindGroup,
        [wide, high]: [u32; 2],
        timestamp_writes: Option<wgpu::ComputePassTimestampWrites<'_>>,
    ) -> Result<f64> {
        let begin = Instant::now();
        self.run(|encoder| {
            let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
                label: Some(&kernel.entry),
                timestamp_writes,
            });
            pass.set_pipeline(&kernel.pipeline);
            pass.set_bind_group(0, group, &[]);
            pass.dispatch_workgroups(wide, high, 1);
        })?;
        let took = begin.elapsed();
        self.dispatched_us
            .fetch_add(took.as_micros() as u64, Ordering::Relaxed);
        Ok((took.as_secs_f64() * 1e3).max(1e-3))
    }

    /// Time of all dispatches of evaluators since the device was opened, with their submissions and the waits (ms).
    pub fn dispatched_ms(&self) -> f64 {
        self.dispatched_us.load(Ordering::Relaxed) as f64 * 1e-3
    }

    /// What an injected fault does to the device that is about to do `what`.
    fn suffer(&self, fault: Fault, what: &str) -> Result<()> {
        match fault {
            // What is submitted next finds it gone.
            Fault::Lost | Fault::Gone => {
                self.device.destroy();
                Ok(())
            }
            Fault::OutOfMemory => {
                let limits = self.device.limits();
                // Hundreds of gigabytes on any device, terabytes on most.
                self.scoped(what, || {
                    drop(self.device.create_texture(&wgpu::TextureDescriptor {
                        label: Some("fault"),
                        size: wgpu::Extent3d {
                            width: limits.max_texture_dimension_2d,
                            height: limits.max_texture_dimension_2d,
                            depth_or_array_layers: limits.max_texture_array_layers,
                        },
                        mip_level_count: 1,
                        sample_count: 1,
                        dimension: wgpu::TextureDimension::D2,
                        format: wgpu::TextureFormat::Rgba32Float,
                        usage: wgpu::TextureUsages::COPY_DST,
                        view_formats: &[],
                    }));
                })?;
                // A driver that promises memory before it has it.
                Err(Error::Device(format!(
                    "{}: cannot {what}: out of memory",
                    self.summary
                )))
            }
            Fault::Validation => self.scoped(what, || {
                // No buffer may be mapped for reading and writing at once.
                drop(self.device.create_buffer(&wgpu::BufferDescriptor {
                    label: Some("fault"),
                    size: 16,
                    usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::MAP_WRITE,
                    mapped_at_creation: false,
                }));
            }),
            // Shows when the work is waited for.
            Fault::Hung => Ok(()),
        }
    }

    fn wait(&self, submission_index: Option<wgpu::SubmissionIndex>) -> Result<()> {
        self.waited(self.device.poll(wgpu::PollType::Wait {
            submission_index,
            timeout: Some(PATIENCE),
        }))
    }

    /// What a wait has come to.
    fn waited(&self, outcome: std::result::Result<wgpu::PollStatus, wgpu::PollError>) -> Result<()> {
        match outcome {
            Ok(_) => self.check(),
            Err(wgpu::PollError::Timeout) => {
                locked(&self.failure).get_or_insert_with(|| hung("a dispatch did not come to its end"));
                // Closing it would wait for that work without end: it stays open for as long as the process lives.
                std::mem::forget((self.device.clone(), self.queue.clone()));
                self.check()
            }
            // A device that has gone takes nothing that it could be waited for, and may yet say so itself.
            Err(error) => {
                let _ = self.device.poll(wgpu::PollType::Poll);
                self.check()?;
                Err(Error::Device(format!("{}: {error}", self.summary)))
            }
        }
    }

    /// Hands the first `bytes` of `buffer`, which is mappable, to `read`.
    ///
    /// # Errors
    /// [`Error::Device`] if they cannot be read.
    pub(crate) fn read<T>(
        &self,
        buffer: &wgpu::Buffer,
        bytes: u64,
        read: impl FnOnce(&[u8]) -> T,
    ) -> Result<T> {
        let failed =
            |reason: String| Error::Device(format!("{}: cannot read results: {reason}", self.summary));
        let (sender, receiver) = std::sync::mpsc::channel();
        buffer.map_async(wgpu::MapMode::Read, 0..bytes, move |outcome| {
            // Nobody listens any more only if waiting has failed already.
            let _ = sender.send(outcome);
        });
        // Another thread's poll may have taken up the callback and be yet to call it: this thread's poll then
        // comes back before the answer does.
        let start = Instant::now();
        let outcome = loop {
            self.wait(None)?;
            match receiver.recv_timeout(Duration::from_millis(1)) {
                Err(RecvTimeoutError::Timeout) if start.elapsed() < PATIENCE => {}
                Err(RecvTimeoutError::Timeout) => return Err(failed(hung("they were not handed over"))),
                answer => break answer.map_err(|e| failed(e.to_string()))?,
            }
        };
        outcome.map_err(|e| failed(e.to_string()))?;
        let view = buffer
            .get_mapped_range(0..bytes)
            .map_err(|e| failed(e.to_string()))?;
        let result = read(&view);
        drop(view);
        buffer.unmap();
        Ok(result)
    }

    /// Copies `bytes` bytes from the place `first` of `from` to `readback`, which is mappable, and hands them to `read`.
    ///
    /// # Errors
    /// [`Error::Device`] if they cannot be read.
    pub(crate) fn read_back<T>(
        &self,
        from: (&wgpu::Buffer, u64),
        readback: &wgpu::Buffer,
        bytes: u64,
        read: impl FnOnce(&[u8]) -> T,
    ) -> Result<T> {
        let (buffer, first) = from;
        let from = [(buffer, first..first + bytes)];
        self.run_and_read_back(|_| (), &from, readback, read)
    }

    /// The same of several pieces of buffers one after the other, after what `record` records, in one submission.
    ///
    /// # Errors
    /// [`Error::Device`] if that fails or takes too long.
    pub(crate) fn run_and_read_back<T>(
        &self,
        record: impl FnOnce(&mut wgpu::CommandEncoder),
        pieces: &[(&wgpu::Buffer, Range<u64>)],
        readback: &wgpu::Buffer,
        read: impl FnOnce(&[u8]) -> T,
    ) -> Result<T> {
        let mut bytes = 0;
        self.run(|encoder| {
            record(encoder);
            for (from, piece) in pieces {
                let size = piece.end - piece.start;
                encoder.copy_buffer_to_buffer(from, piece.start, readback, bytes, size);
                bytes += size;
            }
        })?;
        self.read(readback, bytes, read)
    }

    /// A set of `count` timestamps with a buffer to resolve it into, where the device has such.
    pub(crate) fn timestamps(&self, count: u32) -> Result<Option<wgpu::QuerySet>> {
        if !self.device.features().contains(wgpu::Features::TIMESTAMP_QUERY) {
            return Ok(None);
        }
        self.scoped("set up timestamps", || {
            Some(self.device.create_query_set(&wgpu::QuerySetDescriptor {
                label: Some("timestamps"),
                ty: wgpu::QueryType::Timestamp,
                count,
            }))
        })
    }

    /// Milliseconds per tick of a timestamp.
    pub(crate) fn tick_ms(&self) -> f64 {
        f64::from(self.queue.get_timestamp_period()) * 1e-6
    }

    /// Runs a one-off kernel with `lanes` lanes in workgroups of 64 over `input` (binding 0, read) and returns
    /// the `outputs` floats that it wrote (binding 1). Made for testing single shader functions.
    ///
    /// # Errors
    /// [`Error::Device`] if the kernel does not compile or run.
    pub fn run_array(
        &self,
        source: &str,
        entry: &str,
        input: &[f32],
        outputs: usize,
        lanes: usize,
    ) -> Result<Vec<f32>> {
        use wgpu::BufferUsages as U;
        let kernel = self.kernel(source, entry, &[Binding::Read, Binding::Write])?;
        let bytes = (outputs * 4) as u64;
        let from = self.buffer_of("inputs", bytemuck::cast_slice(input), U::STORAGE)?;
        let to = self.buffer("outputs", bytes, U::STORAGE | U::COPY_SRC)?;
        let readback = self.buffer("readback", bytes, U::MAP_READ | U::COPY_DST)?;
        let group = self.bind(&kernel, &[&from, &to])?;
        let groups = u32::try_from(lanes.div_ceil(64)).unwrap_or(u32::MAX);
        self.run(|encoder| {
            let mut pass = encoder.begin_compute_pass(&Default::default());
            pass.set_pipeline(&kernel.pipeline);
            pass.set_bind_group(0, &group, &[]);
            pass.dispatch_workgroups(groups, 1, 1);
            drop(pass);
            encoder.copy_buffer_to_buffer(&to, 0, &readback, 0, bytes);
        })?;
        self.read(&readback, bytes, bytemuck::pod_collect_to_vec)
    }
}
