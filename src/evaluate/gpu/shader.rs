//! Composition of the kernels from the fragments under `shaders/`, one list per kernel, and the generated parts:
//! constants, and the loaders that tell the figures that candidates share from those in which they differ.

use crate::evaluate::replay::Norm;
use crate::line::kernel::Wanted;
use crate::vehicle::tyre::Tyre;
use crate::vehicle::{Chassis, LinearTyre, MagicFormula, TyreModel};

/// Our own `sin`, `cos`, `atan` and `exp`.
pub const ELEMENTARY: &str = include_str!("../../../shaders/elementary.wgsl");
const CHASSIS: &str = include_str!("../../../shaders/chassis.wgsl");
const AERO: &str = include_str!("../../../shaders/aero.wgsl");
const LOADS: &str = include_str!("../../../shaders/loads.wgsl");
const TYRE_INTERFACE: &str = include_str!("../../../shaders/tyre_interface.wgsl");
const TYRE_MAGIC_FORMULA: &str = include_str!("../../../shaders/tyre.wgsl");
const TYRE_LINEAR: &str = include_str!("../../../shaders/tyre_linear.wgsl");
const CAR: &str = include_str!("../../../shaders/car.wgsl");
const REPLAY_COMMON: &str = include_str!("../../../shaders/replay_common.wgsl");
const REPLAY: &str = include_str!("../../../shaders/replay.wgsl");
const REPLAY_REDUCE: &str = include_str!("../../../shaders/replay_reduce.wgsl");
const TRAJECTORIES: &str = include_str!("../../../shaders/trajectories.wgsl");
const PATH: &str = include_str!("../../../shaders/path.wgsl");
const DRIVER: &str = include_str!("../../../shaders/driver.wgsl");
const DRIVE: &str = include_str!("../../../shaders/drive.wgsl");
const STEADY: &str = include_str!("../../../shaders/steady.wgsl");
const RANDOM: &str = include_str!("../../../shaders/random.wgsl");
const SWARM: &str = include_str!("../../../shaders/swarm.wgsl");
const SWARM_GATHER: &str = include_str!("../../../shaders/swarm_gather.wgsl");
const TEST_PROBLEMS: &str = include_str!("../../../shaders/test_problems.wgsl");

const LINE_SWARM: &str = include_str!("../../../shaders/line_swarm.wgsl");
const LINE: &str = include_str!("../../../shaders/line.wgsl");
/// Engine, motors, store and fuel on a lap of a line.
const ENERGY: &str = include_str!("../../../shaders/energy.wgsl");

/// Philox, the twin of [`crate::random`].
pub fn random() -> &'static str {
    RANDOM
}

/// Source of the kernels that move a swarm; entry points `scatter`, `learn` and `advance`.
pub fn swarm() -> String {
    [ELEMENTARY, RANDOM, SWARM].concat()
}

/// Source of the kernel that copies a few particles' positions; entry point `gather`.
pub fn swarm_gather() -> String {
    SWARM_GATHER.to_owned()
}

/// Source of the kernels between a swarm on the device and the line kernel; entry points `variables_of_positions` and
/// `objectives_of_figures`.
pub fn line_swarm() -> String {
    LINE_SWARM.to_owned()
}

/// Source of the kernel of the test problem of that number among
/// [`crate::swarm::problems::NAMES`]; entry point `test_problem`.
pub fn test_problem(number: u32) -> String {
    let constants = format!("\n// Generated.\nconst PROBLEM: u32 = {number}u;\n\n");
    [ELEMENTARY, &constants, TEST_PROBLEMS].concat()
}

/// The car's fragments with the tyre model's.
pub fn car_fragments(model: TyreModel) -> [&'static str; 7] {
    let tyre = match model {
        TyreModel::MagicFormula => TYRE_MAGIC_FORMULA,
        TyreModel::Linear => TYRE_LINEAR,
    };
    [ELEMENTARY, CHASSIS, AERO, LOADS, TYRE_INTERFACE, tyre, CAR]
}

/// The tyre model's struct, which has one name in WGSL and in Rust, with its fields in order.
pub fn tyre_struct(model: TyreModel) -> (&'static str, &'static [&'static str]) {
    match model {
        TyreModel::MagicFormula => ("MagicFormula", <MagicFormula<f32> as Tyre<f32>>::FIELDS),
        TyreModel::Linear => ("LinearTyre", <LinearTyre<f32> as Tyre<f32>>::FIELDS),
    }
}

/// What a replay kernel is specialised to.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ReplayShape<'a> {
    /// The tyre model.
    pub model: TyreModel,
    /// For each figure of a ready car, which varying figure it is, if it varies: `ModelTable::sources`.
    pub sources: &'a [Option<usize>],
    /// The norm.
    pub norm: Norm,
    /// Lanes of a workgroup.
    pub workgroup: u32,
}

impl ReplayShape<'_> {
    /// Source of the kernel that drives and scores; entry point `replay`.
    pub fn replay(&self) -> String {
        let mut source = car_fragments(self.model).concat();
        source.push_str(&self.constants());
        source.push_str(REPLAY_COMMON);
        source.push_str(REPLAY);
        source.push_str(&loaders(self.model, self.sources));
        source
    }

    /// Source of the kernel that joins the windows; entry point `replay_reduce`.
    pub fn reduce(&self) -> String {
        [&self.constants(), REPLAY_COMMON, REPLAY_REDUCE].concat()
    }

    fn constants(&self) -> String {
        format!(
            "\n// Generated.\nconst NORM_ONE: u32 = 0u;\nconst NORM_TWO: u32 = 1u;\nconst NORM_INFINITY: u32 = 2u;\n\
             const NORM_MEAN_SQUARE: u32 = 3u;\nconst NORM: u32 = {}u;\nconst WORKGROUP: u32 = {}u;\n\
             const BASE_VECTORS: u32 = {}u;\n\n",
            match self.norm {
                Norm::One => 0,
                Norm::Two => 1,
                Norm::Infinity => 2,
                Norm::MeanSquare => 3,
            },
            self.workgroup,
            base_vectors(self.sources.len()),
        )
    }
}

/// What a drive kernel is specialised to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DriveShape<'a> {
    /// The tyre model.
    pub model: TyreModel,
    /// For each figure of a ready car, which varying figure it is, if it varies: `ModelTable::sources`.
    pub sources: &'a [Option<usize>],
    /// How many figures vary; behind them stand the line, the plan and the share of the next plan.
    pub varying: usize,
    /// Stretches of the powertrain's torque.
    pub stretches: usize,
    /// The most rows that a driver looks ahead.
    pub rows_ahead: usize,
    /// The most cells of a plan that a driver looks ahead.
    pub cells_ahead: usize,
    /// Whether there are plans to blend.
    pub blends: bool,
    /// Lanes of a workgroup.
    pub workgroup: u32,
}

impl DriveShape<'_> {
    /// Source of the kernel; entry point `drive`.
    pub fn source(&self) -> String {
        let constants = format!(
            "\n// Generated.\nconst WORKGROUP: u32 = {}u;\nconst BASE_VECTORS: u32 = {}u;\nconst VARYING: u32 = {}u;\n\
             const STRETCHES: u32 = {}u;\nconst ROWS_AHEAD: f32 = {}.0;\nconst CELLS_AHEAD: f32 = {}.0;\n\
             const BLENDS: bool = {};\n\n",
            self.workgroup,
            base_vectors(self.sources.len()),
            self.varying,
            self.stretches,
            self.rows_ahead,
            self.cells_ahead,
            self.blends,
        );
        let [car, loaders] = [
            car_fragments(self.model).concat(),
            loaders(self.model, self.sources),
        ];
        [&car, &constants, TRAJECTORIES, PATH, DRIVER, DRIVE, &loaders].concat()
    }
}

/// What a kernel of steady states is specialised to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SteadyShape<'a> {
    /// The tyre model.
    pub model: TyreModel,
    /// For each figure of a ready car, which varying figure it is, if it varies: `ModelTable::sources`.
    pub sources: &'a [Option<usize>],
    /// Varying figures of a candidate's car.
    pub varying: usize,
    /// Lanes of a workgroup.
    pub workgroup: u32,
}

impl SteadyShape<'_> {
    /// Source of the kernel; entry point `settle`.
    pub fn source(&self) -> String {
        let constants = format!(
            "\n// Generated.\nconst WORKGROUP: u32 = {}u;\nconst BASE_VECTORS: u32 = {}u;\nconst VARYING: u32 = {}u;\n\n",
            self.workgroup,
            base_vectors(self.sources.len()),
            self.varying,
        );
        let [car, loaders] = [
            car_fragments(self.model).concat(),
            loaders(self.model, self.sources),
        ];
        [&car, &constants, TRAJECTORIES, STEADY, &loaders].concat()
    }
}

/// What a line kernel is specialised to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LineShape {
    /// Whether the line's end joins its start.
    pub closed: bool,
    /// Terms of the sum that gives `alpha` at a section: none, one or four.
    pub terms: usize,
    /// What is asked for beyond lengths.
    pub wanted: Wanted,
    /// Rows of the table of limits.
    pub limit_rows: usize,
    /// Rows of the table of corner speeds.
    pub corner_rows: usize,
    /// Rows of the table of the ellipse, nought where there is none.
    pub ellipse_rows: usize,
    /// Sections, if their table is to be uniform.
    pub uniform_sections: Option<usize>,
    /// Whether the tables of limits, of corner speeds and of the ellipse are to be uniform.
    pub uniform_limits: bool,
    /// Lanes of a workgroup.
    pub workgroup: u32,
    /// Lanes whose figures of a section stand together in memory; divides the workgroup.
    pub tile: u32,
}

impl LineShape {
    /// Source of the kernel; entry point `line`.
    pub fn source(&self) -> String {
        let table = |name: &str, rows: usize| {
            if self.uniform_limits {
                format!("var<uniform> {name}: array<vec4<f32>, {rows}>")
            } else {
                format!("var<storage, read> {name}: array<vec4<f32>>")
            }
        };
        let constants = format!(
            "\n// Generated.\nconst CLOSED: bool = {};\nconst TERMS: u32 = {}u;\nconst WANTS_INTEGRAL: bool = {};\n\
             const WANTS_LAP: bool = {};\nconst LIMIT_ROWS: u32 = {}u;\nconst CORNER_ROWS: u32 = {}u;\n\
             const ELLIPSE_ROWS: u32 = {}u;\nconst WORKGROUP: u32 = {}u;\nconst TILE: u32 = {}u;\n\
             @group(0) @binding(1) {};\n@group(0) @binding(2) {};\n@group(0) @binding(3) {};\n\
             @group(0) @binding(4) {};\n\n",
            self.closed,
            self.terms,
            self.wanted.integral,
            self.wanted.lap,
            self.limit_rows,
            self.corner_rows,
            self.ellipse_rows,
            self.workgroup,
            self.tile,
            match self.uniform_sections {
                Some(count) => format!("var<uniform> sections: array<Section, {count}>"),
                None => "var<storage, read> sections: array<Section>".to_owned(),
            },
            table("limits", 2 * self.limit_rows),
            table("corners", self.corner_rows),
            table("ellipse", self.ellipse_rows.max(1)),
        );
        [ELEMENTARY, &constants, LINE].concat()
    }
}

/// What an energy kernel is specialised to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct EnergyShape {
    /// The line kernel that it continues; it wants a lap.
    pub line: LineShape,
    /// Variables of the line, after which the strategy's figures come.
    pub line_variables: usize,
    /// Whether the motor adds to the engine.
    pub additional: bool,
    /// Whether the charge has a say in where the motor works.
    pub counts_charge: bool,
    /// Vectors of four in the energy tables, if they are to be uniform.
    pub uniform_energy: Option<usize>,
}

impl EnergyShape {
    /// Where in the table of vectors of four the flows, the boosts and the zones begin.
    pub fn places(&self) -> [usize; 3] {
        let rows = self.line.limit_rows;
        [2 * rows, 4 * rows, 5 * rows]
    }

    /// Source of the kernel; entry point `energy_line`.
    pub fn source(&self) -> String {
        let [flows, boosts, zones] = self.places();
        let constants = format!(
            "\n// Generated.\nconst STRATEGY: u32 = {}u;\nconst ADDITIONAL: bool = {};\nconst COUNTS_CHARGE: bool = {};\nconst FLOWS_AT: u32 = {flows}u;\n\
             const BOOSTS_AT: u32 = {boosts}u;\nconst ZONES_AT: u32 = {zones}u;\n@group(0) @binding(10) {};\n\n",
            self.line_variables,
            self.additional,
            self.counts_charge,
            match self.uniform_energy {
                Some(vectors) => format!("var<uniform> energy: array<vec4<f32>, {vectors}>"),
                None => "var<storage, read> energy: array<vec4<f32>>".to_owned(),
            },
        );
        [&self.line.source(), &constants, ENERGY].concat()
    }
}

/// How many `vec4` a uniform table of `count` floats takes.
pub fn base_vectors(count: usize) -> usize {
    count.div_ceil(4).max(1)
}

/// The loaders `load_chassis` and `load_tyres`: a figure that candidates share comes from the uniform table `base`,
/// where the compiler sees that all lanes read the same, one that varies from its row of `figures`.
pub fn loaders(model: TyreModel, sources: &[Option<usize>]) -> String {
    let chassis = Chassis::<f32>::FIELDS;
    let (structure, tyre) = tyre_struct(model);
    let place = |slot: usize| match sources[slot] {
        Some(figure) => format!("figures[{figure}u * stretch.stride + candidate]"),
        None => format!("base[{}].{}", slot / 4, ["x", "y", "z", "w"][slot % 4]),
    };
    let function = |name: &str, structure: &str, lines: &[String]| {
        let body = lines.concat();
        format!("fn {name}(candidate: u32) -> {structure} {{\n    return {structure}(\n{body}    );\n}}\n\n")
    };
    let (front, rear) = (chassis.len(), chassis.len() + tyre.len());
    let chassis_lines: Vec<String> = chassis
        .iter()
        .enumerate()
        .map(|(i, field)| format!("        {}, // {field}\n", place(i)))
        .collect();
    let tyre_lines: Vec<String> = tyre
        .iter()
        .enumerate()
        .map(|(i, field)| {
            let (front, rear) = (place(front + i), place(rear + i));
            format!("        Wheels({front}, {front}, {rear}, {rear}), // {field}\n")
        })
        .collect();
    [
        "\n// Generated.\n".to_owned(),
        function("load_chassis", "Chassis", &chassis_lines),
        function("load_tyres", structure, &tyre_lines),
    ]
    .concat()
}
