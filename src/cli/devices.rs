//! `lapswarm devices`.

use super::print_json;
use crate::cli::output::outln;
use lapswarm::Result;
use lapswarm::evaluate::gpu::devices;
use lapswarm::evaluate::simd::InstructionSet;
use serde::Serialize;

/// Flags of `devices`.
#[derive(clap::Args)]
pub struct Arguments {
    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

#[derive(Serialize)]
struct Row {
    name: String,
    backend: String,
    kind: String,
    pci_bus_id: String,
    driver: String,
    max_buffer_mib: u64,
    max_binding_mib: u64,
    max_workgroups: u32,
    timestamps: bool,
}

#[derive(Serialize)]
struct Listing {
    simd: &'static str,
    gpus: Vec<Row>,
}

/// Lists them.
pub fn run(arguments: &Arguments) -> Result<()> {
    let gpus = devices().into_iter().map(|d| Row {
        kind: d.kind.to_string(),
        driver: format!("{} {}", d.driver, d.driver_info).trim().to_owned(),
        name: d.name,
        backend: d.backend,
        pci_bus_id: d.pci_bus_id,
        max_buffer_mib: d.max_buffer_bytes >> 20,
        max_binding_mib: d.max_binding_bytes >> 20,
        max_workgroups: d.max_workgroups,
        timestamps: d.timestamps,
    });
    let listing = Listing {
        simd: InstructionSet::best().name(),
        gpus: gpus.collect(),
    };
    if arguments.json {
        return print_json(&listing);
    }
    outln!("processor: f64 reference (cpu) and {} lanes (simd)", listing.simd);
    if listing.gpus.is_empty() {
        outln!("no GPU: neither Vulkan, Metal nor DX12 found an adapter");
    }
    for (i, d) in listing.gpus.iter().enumerate() {
        // What tells it from others of its name.
        let alike = |others: &[Row]| others.iter().filter(|other| other.name == d.name).count();
        let number = match alike(&listing.gpus) {
            1 => String::new(),
            _ => format!("#{}", alike(&listing.gpus[..=i])),
        };
        let bus = Some(&d.pci_bus_id)
            .filter(|id| !id.is_empty())
            .map_or(String::new(), |id| format!(", PCI {id}"));
        outln!(
            "{}{number}\n  {} ({}){bus}, driver {}\n  buffers to {} MiB, bindings to {} MiB, {} workgroups per dimension, timestamps: {}",
            d.name,
            d.backend,
            d.kind,
            d.driver,
            d.max_buffer_mib,
            d.max_binding_mib,
            d.max_workgroups,
            if d.timestamps { "yes" } else { "no" }
        );
    }
    Ok(())
}
