//! Every kernel: for the tests of their sources, and for compilers that need no device.

use super::{UNKNOWNS, bundled_car, linear_car, problem};
use lapswarm::evaluate::gpu::shader::{
    CarShape, DriveShape, EnergyShape, LineShape, ReplayShape, WheelOrder, line_swarm, swarm, swarm_gather,
    test_problem,
};
use lapswarm::evaluate::replay::{ModelTable, Norm};
use lapswarm::line::kernel::Wanted;
use lapswarm::parity::synthetic_lap::Lap;
use lapswarm::swarm::problems::NAMES;

const NORMS: [Norm; 4] = [Norm::One, Norm::Two, Norm::Infinity, Norm::MeanSquare];

/// A kernel's source, and what it is specialised to.
pub struct KernelSource {
    /// Its entry point.
    pub entry: &'static str,
    /// What it is specialised to, in a few words.
    pub shape: String,
    /// Its source.
    pub source: String,
}

/// Every kernel for both tyre models, a few sets of free parameters and all norms.
pub fn kernels() -> Vec<KernelSource> {
    let lap = Lap {
        samples: 200,
        ..Lap::default()
    };
    let chassis_only = ["mass_kg", "roll_stiffness_nm_per_rad", "aero_balance_front"];
    let mixed = ["front.rBx1", "rear.pKy1", "mass_kg", "front_camber_deg"];
    let linear = ["front.cornering_stiffness_n_per_rad"];
    let cars = [
        ("magic formula, 22 unknowns", bundled_car(), &UNKNOWNS[..]),
        ("magic formula, none", bundled_car(), &[]),
        ("magic formula, mixed", bundled_car(), &mixed),
        ("linear, none", linear_car(), &[]),
        ("linear, chassis", linear_car(), &chassis_only),
        ("linear, one", linear_car(), &linear),
    ];
    let mut kernels = Vec::new();
    let mut add = |entry, shape: &str, source| {
        kernels.push(KernelSource {
            entry,
            shape: shape.to_owned(),
            source,
        });
    };
    for (free, car, unknowns) in cars {
        let problem = problem(car, unknowns, lap);
        let table = ModelTable::new(&problem.free, &problem.problem.variables);
        for wheels in [WheelOrder::ByAxle, WheelOrder::SideBySide] {
            let car = CarShape {
                model: problem.tyre_model(),
                wheels,
                sources: &table.sources,
                workgroup: 64,
            };
            let order = match wheels {
                WheelOrder::ByAxle => "by axle",
                WheelOrder::SideBySide => "side by side",
            };
            let of = format!("{order}, {free}");
            for norm in NORMS {
                let shape = ReplayShape { car, norm };
                add("replay", &format!("{of}, {norm:?}"), shape.replay());
                add("replay_reduce", &format!("{of}, {norm:?}"), shape.reduce());
            }
            add("settle", &of, car.steady());
            let hills = DriveShape {
                relief_at: Some(3000),
                ..drive_shape(car, false)
            };
            add("drive", &format!("{of}, hills"), hills.source());
            for blends in [false, true] {
                let plans = if blends { "plans blended" } else { "one plan" };
                add(
                    "drive",
                    &format!("{of}, {plans}"),
                    drive_shape(car, blends).source(),
                );
            }
        }
    }
    for closed in [false, true] {
        for terms in [0, 1, 4] {
            let of = format!("{}, {terms} terms", if closed { "closed" } else { "open" });
            let hills = LineShape {
                relief: Some(4),
                uniform_sections: None,
                uniform_envelope: false,
                ..line_shape(closed, terms, true)
            };
            add("line", &format!("{of}, hills"), hills.source());
            for lap in [false, true] {
                let measures = if lap { "lap" } else { "lengths" };
                add(
                    "line",
                    &format!("{of}, {measures}"),
                    line_shape(closed, terms, lap).source(),
                );
            }
            for additional in [false, true] {
                let motor = if additional { "adds" } else { "shares" };
                let source = energy_shape(closed, terms, additional).source();
                add("energy_line", &format!("{of}, motor {motor}"), source);
                let hills = EnergyShape {
                    line: hills,
                    uniform_energy: None,
                    ..energy_shape(closed, terms, additional)
                };
                add(
                    "energy_line",
                    &format!("{of}, motor {motor}, hills"),
                    hills.source(),
                );
            }
        }
    }
    for entry in ["scatter", "learn", "note", "advance"] {
        add(entry, "", swarm());
    }
    add("gather", "", swarm_gather());
    for entry in ["figures_of_positions", "objectives_of_results"] {
        add(entry, "", line_swarm());
    }
    for (name, number) in NAMES.iter().zip(0..) {
        add("test_problem", name, test_problem(number, 1.5e30));
    }
    kernels
}

/// A kernel of drives.
pub fn drive_shape(car: CarShape<'_>, blends: bool) -> DriveShape<'_> {
    DriveShape {
        car,
        stretches: 31,
        rows_ahead: 52,
        cells_ahead: 20,
        blends,
        relief_at: None,
    }
}

/// A kernel of laps with energy.
pub fn energy_shape(closed: bool, terms: usize, additional: bool) -> EnergyShape {
    EnergyShape {
        line: line_shape(closed, terms, true),
        line_variables: 12,
        additional,
        counts_charge: closed,
        uniform_energy: (terms == 4).then_some(5 * 512 + 360),
    }
}

/// A kernel of lines.
pub fn line_shape(closed: bool, terms: usize, lap: bool) -> LineShape {
    LineShape {
        closed,
        terms,
        wanted: Wanted {
            integral: terms > 0,
            lap,
        },
        envelope_rows: 512,
        corner_rows: 1024,
        ellipse_rows: if closed { 256 } else { 0 },
        steering_rate: terms != 1,
        traction: terms != 1,
        relief: None,
        drs: terms == 0,
        uniform_sections: closed.then_some(360),
        uniform_envelope: terms == 4,
        workgroup: 64,
        tile: if terms == 4 { 8 } else { 64 },
    }
}
