//! The kernels without a driver: they parse, validate, keep the rules, translate to what every platform's driver
//! takes, and their structs are the host's.

use crate::common::kernels::{KernelSource, drive_shape, energy_shape, kernels, line_shape};
use crate::common::{UNKNOWNS, bundled_car, problem};
use lapswarm::drive::driver::DriverTable;
use lapswarm::drive::{Course, PATH_WIDTH};
use lapswarm::evaluate::energy::EnergyAccount;
use lapswarm::evaluate::gpu::TrajectoryStretch;
use lapswarm::evaluate::gpu::lint;
use lapswarm::evaluate::gpu::shader::{CarShape, WheelOrder, swarm, tyre_struct};
use lapswarm::evaluate::line::{DeviceSection, LineStretch};
use lapswarm::evaluate::replay::{DeviceSample, DeviceWindow, ModelTable, Stretch};
use lapswarm::evaluate::steady::DevicePlan;
use lapswarm::parity::synthetic_lap::Lap;
use lapswarm::swarm::Generation;
use lapswarm::vehicle::{Chassis, TyreModel};
use naga::back::{hlsl, msl, spv};
use naga::valid::{Capabilities, ValidationFlags, Validator};
use std::mem::offset_of;

tests! {
    kernels_validate_pass_the_lint_and_translate_to_every_platform: everywhere,
    the_lint_finds_what_kernels_must_not_contain: everywhere,
    structs_shared_with_the_host_have_its_offsets: everywhere,
    structs_of_lines_have_the_hosts_offsets: everywhere,
    the_structs_of_drives_have_the_hosts_fields: everywhere,
    the_struct_of_circles_has_the_hosts_offsets: everywhere,
    a_generation_has_the_hosts_offsets: everywhere,
    the_struct_of_energies_has_the_hosts_offsets: everywhere,
    parameter_structs_have_the_fields_of_their_rust_twins_in_order: everywhere,
}

fn kernels_validate_pass_the_lint_and_translate_to_every_platform() {
    for KernelSource { entry, source, .. } in kernels() {
        let module = lint::check(&source).unwrap_or_else(|message| panic!("{entry}: {message}"));
        // No capabilities: what WebGPU has at its barest must do.
        let info = Validator::new(ValidationFlags::all(), Capabilities::empty())
            .validate(&module)
            .unwrap_or_else(|e| panic!("{entry}: {}", e.emit_to_string(&source)));

        let stage = naga::ShaderStage::Compute;
        let spirv = spv::write_vec(
            &module,
            &info,
            &spv::Options::default(),
            Some(&spv::PipelineOptions {
                shader_stage: stage,
                entry_point: entry.to_owned(),
            }),
        );
        assert!(!spirv.expect("SPIR-V").is_empty());

        let options = msl::Options {
            lang_version: (2, 0),
            ..Default::default()
        };
        let pipeline = msl::PipelineOptions {
            entry_point: Some((stage, entry.to_owned())),
            ..Default::default()
        };
        let (metal, _) = msl::write_string(&module, &info, &options, &pipeline).expect("MSL");
        assert!(metal.contains("kernel void"));

        let options = hlsl::Options::default();
        let pipeline = hlsl::PipelineOptions {
            entry_point: Some((stage, entry.to_owned())),
        };
        let mut text = String::new();
        hlsl::Writer::new(&mut text, &options, &pipeline)
            .write(&module, &info, None)
            .expect("HLSL");
        assert!(text.contains("numthreads(64, 1, 1)"));
    }
}

fn the_lint_finds_what_kernels_must_not_contain() {
    let spoilt = |expression: &str| {
        format!(
            "@group(0) @binding(0) var<storage, read_write> data: array<f32>;\n\
             fn helper(x: f32) -> f32 {{ return {expression}; }}\n\
             @compute @workgroup_size(1) fn main() {{ data[0] = helper(data[1]); }}"
        )
    };
    for bad in [
        "sin(x)",
        "cos(x)",
        "tan(x)",
        "atan(x)",
        "atan2(x, 2.0)",
        "exp(x)",
        "exp2(x)",
        "log(x)",
        "pow(x, 1.5)",
        "fma(x, x, x)",
        "inverseSqrt(x)",
        "mix(x, 2.0, 0.5)",
        "f32(f64(x) * 2.0lf)",
    ] {
        let findings = lint::check(&spoilt(bad)).expect_err(bad);
        assert!(
            bad.contains("f64") || findings.contains("helper"),
            "{bad}: {findings}"
        );
    }
    lint::check(&spoilt("sqrt(abs(x)) + floor(x) + max(x, 1.0)")).expect("these round alike everywhere");
    // The kernels' own sources, with a built-in slipped in.
    let kernels = kernels();
    let linear = kernels.iter().find(|kernel| kernel.shape.contains("linear"));
    let source = linear
        .expect("a kernel")
        .source
        .replace("own_atan(input", "atan(input");
    assert!(lint::check(&source).expect_err("atan").contains("Atan"));
}

/// Name and offset of each member of the struct called `name`, and the struct's size.
fn layout(module: &naga::Module, name: &str) -> (Vec<(String, usize)>, usize) {
    let (_, ty) = module
        .types
        .iter()
        .find(|(_, ty)| ty.name.as_deref() == Some(name))
        .unwrap_or_else(|| panic!("no struct {name}"));
    let naga::TypeInner::Struct { members, span } = &ty.inner else {
        panic!("{name} is no struct");
    };
    let members = members
        .iter()
        .map(|m| (m.name.clone().unwrap_or_default(), m.offset as usize))
        .collect();
    (members, *span as usize)
}

fn structs_shared_with_the_host_have_its_offsets() {
    let module = lint::check(&kernels()[0].source).expect("the kernel parses");
    let named = |pairs: &[(&str, usize)]| -> Vec<(String, usize)> {
        pairs
            .iter()
            .map(|(name, offset)| ((*name).to_owned(), *offset))
            .collect()
    };

    let (members, size) = layout(&module, "Stretch");
    let host = [
        ("candidates", offset_of!(Stretch, candidates)),
        ("stride", offset_of!(Stretch, stride)),
        ("windows", offset_of!(Stretch, windows)),
        ("first_window", offset_of!(Stretch, first_window)),
        ("first_sample", offset_of!(Stretch, first_sample)),
        ("samples", offset_of!(Stretch, samples)),
        ("substeps", offset_of!(Stretch, substeps)),
        ("step", offset_of!(Stretch, step)),
    ];
    assert_eq!((members, size), (named(&host), size_of::<Stretch>()));

    let (members, size) = layout(&module, "Sample");
    let host = [
        ("wheel_speed", offset_of!(DeviceSample, wheel_speed)),
        ("measured", offset_of!(DeviceSample, measured)),
        ("steer", offset_of!(DeviceSample, steer)),
        ("flap", offset_of!(DeviceSample, flap)),
    ];
    assert_eq!((members, size), (named(&host), size_of::<DeviceSample>()));

    let (members, size) = layout(&module, "Window");
    let host = [
        ("start", offset_of!(DeviceWindow, start)),
        ("end", offset_of!(DeviceWindow, end)),
        ("scored_from", offset_of!(DeviceWindow, scored_from)),
        ("initial", offset_of!(DeviceWindow, initial)),
    ];
    assert_eq!((members, size), (named(&host), size_of::<DeviceWindow>()));
}

fn structs_of_lines_have_the_hosts_offsets() {
    let source = line_shape(true, 4, true).source();
    let module = lint::check(&source).expect("the kernel parses");
    let (members, size) = layout(&module, "LineStretch");
    let host = [
        ("candidates", offset_of!(LineStretch, candidates)),
        ("stride", offset_of!(LineStretch, stride)),
        ("first", offset_of!(LineStretch, first)),
        ("sections", offset_of!(LineStretch, sections)),
        ("start", offset_of!(LineStretch, start)),
        ("entry", offset_of!(LineStretch, entry)),
        (
            "rows_per_speed_squared",
            offset_of!(LineStretch, rows_per_speed_squared),
        ),
        ("rows_per_radius", offset_of!(LineStretch, rows_per_radius)),
        ("load_first", offset_of!(LineStretch, load_first)),
        ("tables_per_load", offset_of!(LineStretch, tables_per_load)),
        ("load_least", offset_of!(LineStretch, load_least)),
        ("load_most", offset_of!(LineStretch, load_most)),
        ("lock_radius", offset_of!(LineStretch, lock_radius)),
        ("gravity", offset_of!(LineStretch, gravity)),
        ("coasting", offset_of!(LineStretch, coasting)),
        (
            "curvature_rate_squared",
            offset_of!(LineStretch, curvature_rate_squared),
        ),
    ];
    let named = |pairs: &[(&str, usize)]| -> Vec<(String, usize)> {
        pairs
            .iter()
            .map(|(name, offset)| ((*name).to_owned(), *offset))
            .collect()
    };
    assert_eq!((members, size), (named(&host), size_of::<LineStretch>()));

    let (members, size) = layout(&module, "Section");
    let host = [
        ("sources", offset_of!(DeviceSection, sources)),
        ("weights", offset_of!(DeviceSection, weights)),
        ("step", offset_of!(DeviceSection, step)),
        ("across", offset_of!(DeviceSection, across)),
        ("constant", offset_of!(DeviceSection, constant)),
        ("inverse_spacing", offset_of!(DeviceSection, inverse_spacing)),
        ("until", offset_of!(DeviceSection, until)),
        ("drs", offset_of!(DeviceSection, drs)),
    ];
    assert_eq!((members, size), (named(&host), size_of::<DeviceSection>()));
}

fn the_structs_of_drives_have_the_hosts_fields() {
    let problem = problem(bundled_car(), &UNKNOWNS, Lap::default());
    let table = ModelTable::new(&problem.free, &problem.problem.variables);
    let source = drive_shape(
        CarShape {
            model: problem.tyre_model(),
            wheels: WheelOrder::ByAxle,
            sources: &table.sources,
            workgroup: 64,
        },
        true,
    )
    .source();
    let module = lint::check(&source).expect("the kernel parses");
    let (members, size) = layout(&module, "TrajectoryStretch");
    let host = [
        ("candidates", offset_of!(TrajectoryStretch, candidates)),
        ("stride", offset_of!(TrajectoryStretch, stride)),
        ("first_step", offset_of!(TrajectoryStretch, first_step)),
        ("steps", offset_of!(TrajectoryStretch, steps)),
    ];
    let named: Vec<(String, usize)> = host.iter().map(|(name, at)| ((*name).to_owned(), *at)).collect();
    assert_eq!((members, size), (named, size_of::<TrajectoryStretch>()));
    // These go to the device as rows of floats in the order of their fields.
    for (name, fields) in [("Course", Course::FIELDS), ("Driver", DriverTable::<f32>::FIELDS)] {
        let (members, size) = layout(&module, name);
        let expected: Vec<(String, usize)> = fields
            .iter()
            .enumerate()
            .map(|(i, field)| ((*field).to_owned(), 4 * i))
            .collect();
        assert_eq!((members, size), (expected, 4 * fields.len()), "{name}");
    }
    let (members, _) = layout(&module, "PathRow");
    assert_eq!(members.len(), PATH_WIDTH);
}

fn the_struct_of_circles_has_the_hosts_offsets() {
    let kernels = kernels();
    let kernel = kernels.iter().find(|kernel| kernel.entry == "settle");
    let module = lint::check(&kernel.expect("a kernel").source).expect("the kernel parses");
    macro_rules! offsets {
        ($($field:ident),*) => {
            [$((stringify!($field).to_owned(), offset_of!(DevicePlan, $field))),*]
        };
    }
    let host = offsets!(step, steer_per_step, gain);
    let (members, size) = layout(&module, "SettlePlan");
    assert_eq!((members, size), (host.to_vec(), size_of::<DevicePlan>()));
}

fn a_generation_has_the_hosts_offsets() {
    let module = lint::check(&swarm()).expect("the kernel parses");
    let (members, size) = layout(&module, "Generation");
    macro_rules! offsets {
        ($($field:ident),*) => {
            [$((stringify!($field).to_owned(), offset_of!(Generation, $field))),*]
        };
    }
    let host = offsets!(
        key,
        when,
        particles,
        dimensions,
        objectives,
        members,
        pushed_members,
        signed,
        per_dimension,
        tournament,
        constrained,
        violation,
        allowance,
        inertia,
        cognitive,
        social,
        speed_limit,
        rebound,
        crossings,
        no_pulls,
        mutation_share,
        mutation_power,
        mutation_root,
        pulls
    );
    assert_eq!((members, size), (host.to_vec(), size_of::<Generation>()));
}

fn the_struct_of_energies_has_the_hosts_offsets() {
    let source = energy_shape(true, 4, true).source();
    let module = lint::check(&source).expect("the kernel parses");
    let (members, size) = layout(&module, "EnergyAccount");
    let host = [
        ("mass", offset_of!(EnergyAccount, mass)),
        ("rotating", offset_of!(EnergyAccount, rotating)),
        ("deploy_cost", offset_of!(EnergyAccount, deploy_cost)),
        ("harvest_gain", offset_of!(EnergyAccount, harvest_gain)),
        (
            "force_per_deployed",
            offset_of!(EnergyAccount, force_per_deployed),
        ),
        (
            "force_per_harvested",
            offset_of!(EnergyAccount, force_per_harvested),
        ),
        ("harvest_most", offset_of!(EnergyAccount, harvest_most)),
        ("store_room", offset_of!(EnergyAccount, store_room)),
        ("exhaust_gain", offset_of!(EnergyAccount, exhaust_gain)),
        ("exhaust_cost", offset_of!(EnergyAccount, exhaust_cost)),
        ("assist_extra", offset_of!(EnergyAccount, assist_extra)),
        ("assist_share", offset_of!(EnergyAccount, assist_share)),
        ("exhaust_from", offset_of!(EnergyAccount, exhaust_from)),
        ("exhaust_to_ax", offset_of!(EnergyAccount, exhaust_to_ax)),
        (
            "rows_per_speed_squared",
            offset_of!(EnergyAccount, rows_per_speed_squared),
        ),
        ("run_in", offset_of!(EnergyAccount, run_in)),
    ];
    let named: Vec<(String, usize)> = host.iter().map(|(name, at)| ((*name).to_owned(), *at)).collect();
    assert_eq!((members, size), (named, size_of::<EnergyAccount>()));
}

fn parameter_structs_have_the_fields_of_their_rust_twins_in_order() {
    for model in [TyreModel::MagicFormula, TyreModel::Linear] {
        let (structure, fields) = tyre_struct(model);
        let car = CarShape {
            model,
            wheels: WheelOrder::ByAxle,
            sources: &vec![None; Chassis::<f32>::FIELDS.len() + 2 * fields.len()],
            workgroup: 64,
        };
        let module = lint::check(&car.steady()).expect("the kernel parses");
        let names = |name: &str| -> Vec<String> {
            layout(&module, name)
                .0
                .into_iter()
                .map(|(member, _)| member)
                .collect()
        };
        assert_eq!(names("Chassis"), Chassis::<f32>::FIELDS);
        assert_eq!(names(structure), fields);
    }
}
