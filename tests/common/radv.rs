//! What the compiler of Mesa's driver for AMD graphics processors says of kernels. The driver compiles for a processor that is not
//! there if it is told which. It reads that from the environment, so that each processor has a process of its own.

use super::kernels::KernelSource;
use ash::vk;
use naga::back::spv;
use naga::proc::{BoundsCheckPolicies, BoundsCheckPolicy};
use naga::valid::{Capabilities, ValidationFlags, Validator};
use serde::{Deserialize, Serialize};
use std::ffi::{CStr, CString};
use std::path::PathBuf;
use std::process::{Command, Stdio};

/// Processors that the driver of Mesa 22.3 knows: the names are the driver's.
pub const FAMILIES: [&str; 3] = ["navi21", "gfx1100", "vega20"];

/// What the driver reads.
const FAMILY: &str = "RADV_FORCE_FAMILY";

/// The Mesa whose figures the tests hold to. Another one allots registers otherwise.
const MESA: (u32, u32) = (22, 3);

/// What a compiler says of kernels.
#[derive(Clone, Debug, Deserialize, Serialize)]
pub struct Answer {
    /// The version of Mesa, the first two numbers of it.
    pub mesa: (u32, u32),
    /// The kernels.
    pub kernels: Vec<Compiled>,
}

/// What a compiler says of a kernel.
#[derive(Clone, Debug, Deserialize, Serialize)]
pub struct Compiled {
    /// Its entry point.
    pub entry: String,
    /// What it is specialised to.
    pub shape: String,
    /// Names and figures.
    pub statistics: Vec<(String, u64)>,
}

impl Compiled {
    /// Its entry point and what it is specialised to.
    pub fn name(&self) -> String {
        name(&self.entry, &self.shape)
    }

    /// The figure of that name.
    pub fn figure(&self, name: &str) -> u64 {
        let found = self.statistics.iter().find(|(known, _)| known == name);
        found.unwrap_or_else(|| panic!("no {name} in {self:?}")).1
    }
}

fn name(entry: &str, shape: &str) -> String {
    if shape.is_empty() {
        entry.to_owned()
    } else {
        format!("{entry}: {shape}")
    }
}

/// Whether the driver is there in the version that tests have bars for.
///
/// # Errors
/// That it is not.
pub fn with_bars() -> Result<(), String> {
    let found = ask(FAMILIES[0], &["gather"])?.mesa;
    if found == MESA {
        return Ok(());
    }
    Err(format!(
        "registers are known for RADV of Mesa {}.{}, here is {}.{}",
        MESA.0, MESA.1, found.0, found.1
    ))
}

/// The driver's file for the Vulkan loader.
///
/// # Errors
/// That there is none.
pub fn driver() -> Result<PathBuf, String> {
    installed("radeon_icd")
        .ok_or_else(|| "no RADV here (Mesa's driver for AMD; Debian package mesa-vulkan-drivers)".to_owned())
}

/// The file of lavapipe for the Vulkan loader.
///
/// # Errors
/// That there is none.
pub fn software_driver() -> Result<PathBuf, String> {
    installed("lvp_icd").ok_or_else(|| {
        "no lavapipe here (Mesa's driver on the processor; Debian package mesa-vulkan-drivers)".to_owned()
    })
}

/// The file of a driver, by what its name begins with.
fn installed(beginning: &str) -> Option<PathBuf> {
    let folders = [
        "/usr/share/vulkan/icd.d",
        "/etc/vulkan/icd.d",
        "/usr/local/share/vulkan/icd.d",
    ];
    let files = folders.iter().filter_map(|folder| std::fs::read_dir(folder).ok());
    let mut files = files.flatten().flatten().map(|entry| entry.path());
    files.find(|path| {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        name.starts_with(beginning) && name.contains(std::env::consts::ARCH)
    })
}

/// What the compiler for `family` says of the kernels whose names contain one of `wanted`: of all where that is empty. The program
/// itself does the work, see [`answer_parent`].
///
/// # Errors
/// That the driver is not there or fails.
pub fn ask(family: &str, wanted: &[&str]) -> Result<Answer, String> {
    let driver = driver()?;
    let program = std::env::current_exe().map_err(|e| e.to_string())?;
    let output = Command::new(program)
        .env(FAMILY, family)
        .env("LAPSWARM_RADV_KERNELS", wanted.join("\n"))
        .env("VK_ICD_FILENAMES", &driver)
        .env("VK_DRIVER_FILES", &driver)
        .env("MESA_SHADER_CACHE_DISABLE", "1")
        .stderr(Stdio::inherit())
        .output()
        .map_err(|e| e.to_string())?;
    if !output.status.success() {
        return Err(format!("RADV for {family}: {}", output.status));
    }
    serde_json::from_slice(&output.stdout).map_err(|e| format!("RADV for {family}: {e}"))
}

/// In a process that [`ask`] has started: compiles, writes what it is told to standard output, and returns true. The first line of
/// `main` calls it.
pub fn answer_parent(kernels: impl FnOnce() -> Vec<KernelSource>) -> bool {
    let Ok(wanted) = std::env::var("LAPSWARM_RADV_KERNELS") else {
        return false;
    };
    let driver = Driver::open();
    let compiled = kernels()
        .iter()
        .filter(|kernel| {
            let name = name(kernel.entry, &kernel.shape);
            wanted.lines().all(str::is_empty) || wanted.lines().any(|wanted| name.contains(wanted))
        })
        .map(|kernel| driver.compile(kernel))
        .collect();
    let answer = Answer {
        mesa: driver.mesa,
        kernels: compiled,
    };
    serde_json::to_writer(std::io::stdout(), &answer).expect("a parent that listens");
    true
}

/// SPIR-V as wgpu makes it for this driver, and the buffers that the kernel names.
fn spirv(kernel: &KernelSource) -> (Vec<u32>, Vec<(u32, vk::DescriptorType)>) {
    let module = naga::front::wgsl::parse_str(&kernel.source).expect("WGSL");
    let info = Validator::new(ValidationFlags::all(), Capabilities::empty())
        .validate(&module)
        .expect("a valid kernel");
    let bindings = module
        .global_variables
        .iter()
        .filter_map(|(_, variable)| {
            let kind = match variable.space {
                naga::AddressSpace::Uniform => vk::DescriptorType::UNIFORM_BUFFER,
                _ => vk::DescriptorType::STORAGE_BUFFER,
            };
            Some((variable.binding.as_ref()?.binding, kind))
        })
        .collect();
    let options = spv::Options {
        lang_version: (1, 6),
        force_loop_bounding: true,
        // The driver keeps reads within buffers itself.
        bounds_check_policies: BoundsCheckPolicies {
            index: BoundsCheckPolicy::Restrict,
            buffer: BoundsCheckPolicy::Unchecked,
            ..Default::default()
        },
        ..Default::default()
    };
    let pipeline = spv::PipelineOptions {
        shader_stage: naga::ShaderStage::Compute,
        entry_point: kernel.entry.to_owned(),
    };
    let words = spv::write_vec(&module, &info, &options, Some(&pipeline)).expect("SPIR-V");
    (words, bindings)
}

/// The driver, which stays open until the process ends.
struct Driver {
    // Holds the library.
    _entry: ash::Entry,
    mesa: (u32, u32),
    device: ash::Device,
    statistics: ash::khr::pipeline_executable_properties::Device,
}

impl Driver {
    fn open() -> Self {
        let application = vk::ApplicationInfo::default().api_version(vk::API_VERSION_1_3);
        let extensions = [
            ash::khr::pipeline_executable_properties::NAME.as_ptr(),
            ash::ext::robustness2::NAME.as_ptr(),
        ];
        let queue = [vk::DeviceQueueCreateInfo::default().queue_priorities(&[1.0])];
        let mut statistics = vk::PhysicalDevicePipelineExecutablePropertiesFeaturesKHR::default()
            .pipeline_executable_info(true);
        let mut memory_model = vk::PhysicalDeviceVulkan12Features::default().vulkan_memory_model(true);
        // As wgpu opens it.
        let mut robust = vk::PhysicalDeviceRobustness2FeaturesEXT::default().robust_buffer_access2(true);
        let features = vk::PhysicalDeviceFeatures::default().robust_buffer_access(true);
        let instance = vk::InstanceCreateInfo::default().application_info(&application);
        // SAFETY: every handle is used after it is made, and none is destroyed; the structs that pointers name live on this stack.
        unsafe {
            let entry = ash::Entry::load().expect("a Vulkan loader");
            let instance = entry.create_instance(&instance, None).expect("RADV");
            let adapters = instance.enumerate_physical_devices().expect("RADV's processor");
            let version = instance
                .get_physical_device_properties(adapters[0])
                .driver_version;
            let wanted = vk::DeviceCreateInfo::default()
                .queue_create_infos(&queue)
                .enabled_extension_names(&extensions)
                .enabled_features(&features)
                .push_next(&mut statistics)
                .push_next(&mut memory_model)
                .push_next(&mut robust);
            let device = instance.create_device(adapters[0], &wanted, None);
            let device = device.expect("RADV without a processor");
            let statistics = ash::khr::pipeline_executable_properties::Device::new(&instance, &device);
            Self {
                _entry: entry,
                mesa: (vk::api_version_major(version), vk::api_version_minor(version)),
                device,
                statistics,
            }
        }
    }

    fn compile(&self, kernel: &KernelSource) -> Compiled {
        let (words, bindings) = spirv(kernel);
        let bindings: Vec<_> = bindings
            .into_iter()
            .map(|(binding, kind)| {
                vk::DescriptorSetLayoutBinding::default()
                    .binding(binding)
                    .descriptor_type(kind)
                    .descriptor_count(1)
                    .stage_flags(vk::ShaderStageFlags::COMPUTE)
            })
            .collect();
        let entry = CString::new(kernel.entry).expect("a name");
        let module = vk::ShaderModuleCreateInfo::default().code(&words);
        let set = vk::DescriptorSetLayoutCreateInfo::default().bindings(&bindings);
        // SAFETY: as above; the module is SPIR-V that naga has validated, and the layout names every buffer of it.
        let statistics = unsafe {
            let module = self.device.create_shader_module(&module, None).expect("a module");
            let sets = [self
                .device
                .create_descriptor_set_layout(&set, None)
                .expect("a layout")];
            let layout = vk::PipelineLayoutCreateInfo::default().set_layouts(&sets);
            let layout = self
                .device
                .create_pipeline_layout(&layout, None)
                .expect("a layout");
            let stage = vk::PipelineShaderStageCreateInfo::default()
                .stage(vk::ShaderStageFlags::COMPUTE)
                .module(module)
                .name(&entry);
            let wanted = vk::ComputePipelineCreateInfo::default()
                .flags(vk::PipelineCreateFlags::CAPTURE_STATISTICS_KHR)
                .stage(stage)
                .layout(layout);
            let cache = vk::PipelineCache::null();
            let pipelines = self.device.create_compute_pipelines(cache, &[wanted], None);
            let executable =
                vk::PipelineExecutableInfoKHR::default().pipeline(pipelines.expect("a pipeline")[0]);
            self.statistics
                .get_pipeline_executable_statistics(&executable)
                .expect("statistics")
        };
        let named = statistics.iter().map(|statistic| {
            // SAFETY: the driver ends names with a zero, and all of its figures are whole.
            let (name, value) = unsafe { (CStr::from_ptr(statistic.name.as_ptr()), statistic.value.u64) };
            (name.to_string_lossy().into_owned(), value)
        });
        Compiled {
            entry: kernel.entry.to_owned(),
            shape: kernel.shape.clone(),
            statistics: named.collect(),
        }
    }
}
