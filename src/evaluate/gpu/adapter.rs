//! Graphics processors: the adapters of the machine, and the choice among them.

use crate::error::{Error, Result};
use std::fmt;
use std::sync::OnceLock;

/// The environment variable that names an adapter if no flag does.
pub const ADAPTER_VARIABLE: &str = "LAPSWARM_ADAPTER";

/// Asks for all adapters of the best kind that is present, instead of one.
pub const ALL_ADAPTERS: &str = "all";

/// Kinds of devices, best first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum DeviceKind {
    /// A card with memory of its own.
    Discrete,
    /// Part of the processor's package.
    Integrated,
    /// A share of a host's device.
    Virtual,
    /// A driver that runs on the processor, such as lavapipe or WARP.
    Software,
    /// The driver does not say.
    Other,
}

impl DeviceKind {
    /// Whether it is known to be a graphics processor, and not a software driver that presents itself as one.
    pub fn is_real(self) -> bool {
        matches!(self, Self::Discrete | Self::Integrated | Self::Virtual)
    }

    /// How long a dispatch should take (ms): well under the watchdogs' two seconds and a desktop's patience, well over its
    /// overhead. A software driver shares the processor: other work may double the time.
    pub(crate) fn dispatch_ms(self) -> f64 {
        match self {
            Self::Software => 40.0,
            _ => 70.0,
        }
    }
}

impl fmt::Display for DeviceKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Discrete => "discrete",
            Self::Integrated => "integrated",
            Self::Virtual => "virtual",
            Self::Software => "software",
            Self::Other => "other",
        })
    }
}

impl From<wgpu::DeviceType> for DeviceKind {
    fn from(kind: wgpu::DeviceType) -> Self {
        match kind {
            wgpu::DeviceType::DiscreteGpu => Self::Discrete,
            wgpu::DeviceType::IntegratedGpu => Self::Integrated,
            wgpu::DeviceType::VirtualGpu => Self::Virtual,
            wgpu::DeviceType::Cpu => Self::Software,
            wgpu::DeviceType::Other => Self::Other,
        }
    }
}

/// An adapter as users choose it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DeviceSummary {
    /// Its name, by which it is chosen.
    pub name: String,
    /// `Vulkan`, `Metal` or `Dx12`.
    pub backend: String,
    /// The driver's name.
    pub driver: String,
    /// The driver's version, as far as it tells.
    pub driver_info: String,
    /// What sort of device it is.
    pub kind: DeviceKind,
    /// Its place on the PCI bus, as in `0000:41:00.0`; empty where the driver does not tell.
    pub pci_bus_id: String,
    /// The largest buffer, bytes.
    pub max_buffer_bytes: u64,
    /// The largest part of a buffer that a kernel sees at once, bytes.
    pub max_binding_bytes: u64,
    /// Workgroups per dimension of one dispatch.
    pub max_workgroups: u32,
    /// Lanes per workgroup.
    pub max_lanes_per_workgroup: u32,
    /// Whether kernels can be timed on the device.
    pub timestamps: bool,
}

impl DeviceSummary {
    fn of(adapter: &wgpu::Adapter) -> Self {
        let info = adapter.get_info();
        let limits = adapter.limits();
        Self {
            name: info.name,
            backend: format!("{:?}", info.backend),
            driver: info.driver,
            driver_info: info.driver_info,
            kind: info.device_type.into(),
            pci_bus_id: info.device_pci_bus_id,
            max_buffer_bytes: limits.max_buffer_size,
            max_binding_bytes: limits.max_storage_buffer_binding_size,
            max_workgroups: limits.max_compute_workgroups_per_dimension,
            max_lanes_per_workgroup: limits.max_compute_invocations_per_workgroup,
            timestamps: adapter.features().contains(wgpu::Features::TIMESTAMP_QUERY),
        }
    }
}

impl DeviceSummary {
    /// Whether its name contains `name`, regardless of case, or `name` is its place on the PCI bus.
    pub(super) fn is_called(&self, name: &str) -> bool {
        let name = name.trim().to_lowercase();
        self.name.to_lowercase().contains(&name) || self.pci_bus_id.to_lowercase() == name
    }
}

impl fmt::Display for DeviceSummary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} ({}, {})", self.name, self.backend, self.kind)
    }
}

/// The first instance lives as long as the process, so that drivers stay loaded: after it had been loaded three dozen times in a process,
/// that of an NVIDIA card found no adapter.
static FIRST: OnceLock<wgpu::Instance> = OnceLock::new();

fn new_instance() -> wgpu::Instance {
    let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
    descriptor.backends = wgpu::Backends::VULKAN | wgpu::Backends::METAL | wgpu::Backends::DX12;
    descriptor.flags = wgpu::InstanceFlags::empty();
    wgpu::Instance::new(descriptor)
}

fn enumerate() -> Vec<(wgpu::Adapter, DeviceSummary)> {
    // Later ones see what has come and gone since.
    let instance = match FIRST.get() {
        Some(_) => new_instance(),
        None => FIRST.get_or_init(new_instance).clone(),
    };
    let mut adapters: Vec<_> = pollster::block_on(instance.enumerate_adapters(wgpu::Backends::all()))
        .into_iter()
        .filter(|adapter| {
            let capabilities = adapter.get_downlevel_capabilities();
            capabilities.flags.contains(wgpu::DownlevelFlags::COMPUTE_SHADERS)
        })
        .map(|adapter| {
            let summary = DeviceSummary::of(&adapter);
            (adapter, summary)
        })
        .collect();
    adapters.sort_by_key(|(_, summary)| summary.kind);
    adapters
}

/// Every adapter that can run kernels, best first.
pub fn devices() -> Vec<DeviceSummary> {
    enumerate().into_iter().map(|(_, summary)| summary).collect()
}

/// The best adapter, or the best whose name contains `name` regardless of case; where `name` is `None`, that of
/// [`ADAPTER_VARIABLE`] counts. `name#2` is the second of those whose name contains `name`, and a place on the PCI bus names one
/// card among several.
///
/// # Errors
/// [`Error::NoDevice`] if no adapter fits, listing the adapters.
pub(super) fn choose(name: Option<&str>) -> Result<(wgpu::Adapter, DeviceSummary)> {
    let wanted = wanted(name);
    let wanted = wanted.as_deref();
    let adapters = enumerate();
    let present: Vec<DeviceSummary> = adapters.iter().map(|(_, summary)| summary.clone()).collect();
    let place = pick(&present, wanted)?;
    adapters
        .into_iter()
        .nth(place)
        .ok_or_else(|| Error::NoDevice("the adapter is gone".to_owned()))
}

/// What is asked for, by name or by [`ADAPTER_VARIABLE`].
fn wanted(name: Option<&str>) -> Option<String> {
    let from_environment = || {
        std::env::var(ADAPTER_VARIABLE)
            .ok()
            .filter(|x| !x.trim().is_empty())
    };
    let wanted = name.map(str::to_owned).or_else(from_environment)?;
    Some(wanted.trim().to_owned())
}

/// Whether all adapters are asked for.
pub fn asks_for_all(name: Option<&str>) -> bool {
    wanted(name).is_some_and(|x| x.eq_ignore_ascii_case(ALL_ADAPTERS))
}

/// What [`choose`] knows each adapter of the best kind by.
pub(super) fn names_of_all() -> Vec<String> {
    numbered_alike(&devices())
}

/// The numbers of those in `present` (best first) that are of the first one's kind. A population goes to its adapters in equal
/// shares, which the slowest of another kind would hold up.
fn numbered_alike(present: &[DeviceSummary]) -> Vec<String> {
    let alike = present.iter().take_while(|other| other.kind == present[0].kind);
    (1..=alike.count()).map(|number| format!("#{number}")).collect()
}

/// The place in `present` (best first) of the adapter that `wanted` names.
fn pick(present: &[DeviceSummary], wanted: Option<&str>) -> Result<usize> {
    if present.is_empty() {
        return Err(Error::NoDevice(
            "no Vulkan, Metal or DX12 adapter was found. Install a driver (a software one such as lavapipe, \
             Debian package mesa-vulkan-drivers, will do), or use the backend simd"
                .to_owned(),
        ));
    }
    let Some(wanted) = wanted else { return Ok(0) };
    if wanted.eq_ignore_ascii_case(ALL_ADAPTERS) {
        return Err(Error::NoDevice(format!(
            "adapter {ALL_ADAPTERS} spreads populations over several devices, and this works on one: name one of them"
        )));
    }
    let numbered = wanted
        .rsplit_once('#')
        .and_then(|(name, number)| Some((name, number.parse().ok()?)));
    let (name, number): (&str, usize) = numbered.unwrap_or((wanted, 1));
    let fitting: Vec<usize> = (0..present.len())
        .filter(|i| present[*i].is_called(name))
        .collect();
    let place = number.checked_sub(1).and_then(|k| fitting.get(k).copied());
    place.ok_or_else(|| {
        let list = |places: &[usize]| {
            let names = places.iter().map(|i| {
                let at = Some(&present[*i].pci_bus_id).filter(|id| !id.is_empty());
                at.map_or(present[*i].to_string(), |id| format!("{} at {id}", present[*i]))
            });
            names.collect::<Vec<_>>().join(", ")
        };
        Error::NoDevice(match fitting.len() {
            0 => {
                let all: Vec<usize> = (0..present.len()).collect();
                format!("no adapter's name contains {name:?}; there is {}", list(&all))
            }
            count => format!(
                "there is no adapter {wanted:?}: {count} of that name are here, counted from #1: {}",
                list(&fitting)
            ),
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn summary(name: &str, kind: DeviceKind) -> DeviceSummary {
        DeviceSummary {
            name: name.to_owned(),
            backend: "Vulkan".to_owned(),
            driver: String::new(),
            driver_info: String::new(),
            kind,
            pci_bus_id: String::new(),
            max_buffer_bytes: 0,
            max_binding_bytes: 0,
            max_workgroups: 0,
            max_lanes_per_workgroup: 0,
            timestamps: false,
        }
    }

    #[test]
    fn an_adapter_is_found_by_part_of_its_name_in_any_case() {
        let present = [
            summary("NVIDIA H200", DeviceKind::Discrete),
            summary("llvmpipe (LLVM 15)", DeviceKind::Software),
        ];
        assert_eq!(pick(&present, None).ok(), Some(0));
        assert_eq!(pick(&present, Some("LLVMpipe")).ok(), Some(1));
        let message = pick(&present, Some("radeon")).map_err(|e| e.to_string());
        let message = message.expect_err("there is no such adapter");
        assert!(
            message.contains("radeon") && message.contains("NVIDIA H200 (Vulkan, discrete)"),
            "{message}"
        );
        assert!(matches!(pick(&[], None), Err(Error::NoDevice(_))));
    }

    #[test]
    fn adapters_of_one_name_are_told_apart() {
        let card = |bus: &str| DeviceSummary {
            pci_bus_id: bus.to_owned(),
            ..summary("NVIDIA H200", DeviceKind::Discrete)
        };
        let present = [
            card("0000:41:00.0"),
            card("0000:C1:00.0"),
            summary("llvmpipe", DeviceKind::Software),
        ];
        for (wanted, place) in [
            ("h200", 0),
            ("H200#1", 0),
            ("h200#2", 1),
            ("0000:c1:00.0", 1),
            ("#3", 2),
        ] {
            assert_eq!(pick(&present, Some(wanted)).ok(), Some(place), "{wanted}");
        }
        for (wanted, told) in [
            ("h200#3", "2 of that name are here"),
            ("h200#0", "at 0000:C1:00.0"),
            ("0000:02:00.0", "llvmpipe"),
        ] {
            let message = pick(&present, Some(wanted))
                .map_err(|e| e.to_string())
                .expect_err("no such adapter");
            assert!(message.contains(told), "{message}");
        }
    }

    #[test]
    fn all_adapters_are_those_of_the_best_kind() {
        let present = [
            summary("NVIDIA H200", DeviceKind::Discrete),
            summary("Radeon Pro", DeviceKind::Discrete),
            summary("llvmpipe", DeviceKind::Software),
        ];
        assert_eq!(numbered_alike(&present), ["#1", "#2"]);
        assert_eq!(numbered_alike(&present[2..]), ["#1"]);
        assert!(numbered_alike(&[]).is_empty());
        let refused = pick(&present, Some("All")).map_err(|e| e.to_string());
        assert!(refused.expect_err("one is wanted").contains("name one of them"));
    }

    #[test]
    fn kinds_are_ordered_best_first() {
        use DeviceKind::*;
        let kinds = [Discrete, Integrated, Virtual, Software, Other];
        assert!(kinds.is_sorted());
    }
}
