//! Kernels: how they are compiled, kept and bound.

use super::{GpuContext, locked};
use crate::error::{Error, Result};
use crate::evaluate::gpu::adapter::DeviceSummary;
use crate::evaluate::gpu::lint;
use crate::evaluate::gpu::tuning::file_of;
use crate::files::write_whole;
use std::path::PathBuf;
use std::sync::{Arc, Mutex};
use std::time::Instant;

/// How a kernel sees a buffer, in the order of its bindings.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Binding {
    /// A small table that all lanes share.
    Uniform,
    /// Read by lanes.
    Read,
    /// Read and written by lanes.
    Write,
}

/// A compiled kernel.
#[derive(Debug)]
pub struct Kernel {
    pub(super) entry: String,
    pub(crate) pipeline: wgpu::ComputePipeline,
    layout: wgpu::BindGroupLayout,
    /// How long parsing and compilation took, ms. Drivers may put off a part to the first dispatch.
    pub compile_ms: f64,
}

/// What a device has compiled, kept in the user's cache folder so that the next run need not compile it again.
#[derive(Debug)]
pub(super) struct Compiled {
    cache: wgpu::PipelineCache,
    file: PathBuf,
    /// The sum over what was kept last.
    kept: Mutex<u32>,
}

impl Compiled {
    /// What is kept for an adapter, where it keeps such and the user has a cache folder. A file that is damaged is as good as none.
    pub fn of(device: &wgpu::Device, adapter: &DeviceSummary) -> Option<Self> {
        if !device.features().contains(wgpu::Features::PIPELINE_CACHE) {
            return None;
        }
        let file = file_of(adapter, "kernels")?;
        let bytes = std::fs::read(&file).unwrap_or_default();
        let data = sound(&bytes);
        let described = wgpu::PipelineCacheDescriptor {
            label: Some("lapswarm"),
            data,
            fallback: true,
        };
        // SAFETY: the data has the sum that was written in front of what a cache handed out. wgpu itself refuses that of another
        // adapter, driver or version.
        let cache = unsafe { device.create_pipeline_cache(&described) };
        let kept = Mutex::new(data.map_or(0, crc32fast::hash));
        Some(Self { cache, file, kept })
    }

    /// Writes it down if there is more than before. A cache that cannot be kept is done without.
    fn keep(&self) {
        let Some(data) = self.cache.get_data() else {
            return;
        };
        let sum = crc32fast::hash(&data);
        if std::mem::replace(&mut *locked(&self.kept), sum) == sum {
            return;
        }
        let bytes = [&sum.to_le_bytes()[..], &data].concat();
        let folder = self.file.parent().map_or(Ok(()), std::fs::create_dir_all);
        let written = folder
            .map_err(|e| Error::io(&self.file, "write", e))
            .and_then(|()| write_whole(&self.file, &bytes));
        if let Err(error) = written {
            tracing::debug!("compiled kernels are not kept: {error}");
        }
    }
}

/// What follows the sum over it in a file, if that is right.
fn sound(bytes: &[u8]) -> Option<&[u8]> {
    let (sum, data) = bytes.split_first_chunk()?;
    (u32::from_le_bytes(*sum) == crc32fast::hash(data)).then_some(data)
}

impl GpuContext {
    /// The kernel of `source` at `entry`, compiled on the first call.
    ///
    /// # Errors
    /// [`Error::Device`] if it does not compile.
    pub fn kernel(&self, source: &str, entry: &str, bindings: &[Binding]) -> Result<Arc<Kernel>> {
        let key = format!("{entry} {bindings:?}\n{source}");
        if let Some(kernel) = locked(&self.kernels).get(&key) {
            return Ok(Arc::clone(kernel));
        }
        if cfg!(debug_assertions) {
            lint::check(source).map_err(|message| Error::Device(format!("kernel {entry}: {message}")))?;
        }
        let start = Instant::now();
        let entries: Vec<_> = bindings
            .iter()
            .zip(0..)
            .map(|(kind, binding)| wgpu::BindGroupLayoutEntry {
                binding,
                visibility: wgpu::ShaderStages::COMPUTE,
                ty: wgpu::BindingType::Buffer {
                    ty: match kind {
                        Binding::Uniform => wgpu::BufferBindingType::Uniform,
                        Binding::Read => wgpu::BufferBindingType::Storage { read_only: true },
                        Binding::Write => wgpu::BufferBindingType::Storage { read_only: false },
                    },
                    has_dynamic_offset: false,
                    min_binding_size: None,
                },
                count: None,
            })
            .collect();
        let (pipeline, layout) = self.scoped(&format!("compile the kernel {entry}"), || {
            let module = self.device.create_shader_module(wgpu::ShaderModuleDescriptor {
                label: Some(entry),
                source: wgpu::ShaderSource::Wgsl(source.into()),
            });
            let layout = self
                .device
                .create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
                    label: Some(entry),
                    entries: &entries,
                });
            let pipeline_layout = self
                .device
                .create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
                    label: Some(entry),
                    bind_group_layouts: &[Some(&layout)],
                    immediate_size: 0,
                });
            let pipeline = self
                .device
                .create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
                    label: Some(entry),
                    layout: Some(&pipeline_layout),
                    module: &module,
                    entry_point: Some(entry),
                    compilation_options: Default::default(),
                    cache: self.compiled.as_ref().map(|compiled| &compiled.cache),
                });
            (pipeline, layout)
        })?;
        let kernel = Arc::new(Kernel {
            entry: entry.to_owned(),
            pipeline,
            layout,
            compile_ms: start.elapsed().as_secs_f64() * 1e3,
        });
        locked(&self.kernels).insert(key, Arc::clone(&kernel));
        if let Some(compiled) = &self.compiled {
            compiled.keep();
        }
        Ok(kernel)
    }

    /// Binds `buffers` to the kernel's bindings in order.
    ///
    /// # Errors
    /// [`Error::Device`] if a buffer does not fit its binding.
    pub fn bind(&self, kernel: &Kernel, buffers: &[&wgpu::Buffer]) -> Result<wgpu::BindGroup> {
        let entries: Vec<_> = buffers
            .iter()
            .zip(0..)
            .map(|(buffer, binding)| wgpu::BindGroupEntry {
                binding,
                resource: buffer.as_entire_binding(),
            })
            .collect();
        self.scoped("bind buffers", || {
            self.device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: None,
                layout: &kernel.layout,
                entries: &entries,
            })
        })
    }
}

#[cfg(test)]
mod tests {
    use super::sound;

    #[test]
    fn damaged_caches_are_as_good_as_none() {
        let data = b"compiled";
        let whole = [&crc32fast::hash(data).to_le_bytes()[..], data].concat();
        assert_eq!(sound(&whole), Some(&data[..]));
        for damaged in [&[][..], &whole[..3], &whole[..9], &whole[1..]] {
            assert_eq!(sound(damaged), None);
        }
    }
}
