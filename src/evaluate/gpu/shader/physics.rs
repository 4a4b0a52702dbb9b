//! The kernels of cars, lines and drives.

use super::{WheelOrder, elementary};
use crate::evaluate::replay::Norm;
use crate::line::kernel::Wanted;
use crate::line::{TRACTION_ROOTS, TRACTION_SPEEDS, TRACTION_WIDTH};
use crate::vehicle::tyre::Tyre;
use crate::vehicle::{Chassis, LinearTyre, MagicFormula, TyreModel};

const CHASSIS: &str = include_str!("../../../../shaders/chassis.wgsl");
const AERO: &str = include_str!("../../../../shaders/aero.wgsl");
const LOADS: &str = include_str!("../../../../shaders/loads.wgsl");
const TYRE_INTERFACE: &str = include_str!("../../../../shaders/tyre_interface.wgsl");
const TYRE_MAGIC_FORMULA: &str = include_str!("../../../../shaders/tyre.wgsl");
const TYRE_LINEAR: &str = include_str!("../../../../shaders/tyre_linear.wgsl");
const CAR: &str = include_str!("../../../../shaders/car.wgsl");
const CAR_SIDE_BY_SIDE: &str = include_str!("../../../../shaders/car_side_by_side.wgsl");
const CAR_BY_AXLE: &str = include_str!("../../../../shaders/car_by_axle.wgsl");
const REPLAY_COMMON: &str = include_str!("../../../../shaders/replay_common.wgsl");
const REPLAY: &str = include_str!("../../../../shaders/replay.wgsl");
const REPLAY_REDUCE: &str = include_str!("../../../../shaders/replay_reduce.wgsl");
const TRAJECTORIES: &str = include_str!("../../../../shaders/trajectories.wgsl");
const PATH: &str = include_str!("../../../../shaders/path.wgsl");
const DRIVER: &str = include_str!("../../../../shaders/driver.wgsl");
const DRIVE: &str = include_str!("../../../../shaders/drive.wgsl");
const STEADY: &str = include_str!("../../../../shaders/steady.wgsl");
const LINE: &str = include_str!("../../../../shaders/line.wgsl");
/// Engine, motors, store and fuel on a lap of a line.
const ENERGY: &str = include_str!("../../../../shaders/energy.wgsl");

/// The car's fragments with the tyre model's. The loaders are not among them.
pub fn car_fragments(model: TyreModel, wheels: WheelOrder) -> String {
    let tyre = match model {
        TyreModel::MagicFormula => TYRE_MAGIC_FORMULA,
        TyreModel::Linear => TYRE_LINEAR,
    };
    let order = match wheels {
        WheelOrder::SideBySide => CAR_SIDE_BY_SIDE,
        WheelOrder::ByAxle => CAR_BY_AXLE,
    };
    let elementary = elementary(wheels);
    [
        &elementary,
        CHASSIS,
        AERO,
        LOADS,
        TYRE_INTERFACE,
        tyre,
        CAR,
        order,
    ]
    .concat()
}

/// The tyre model's struct, which has one name in WGSL and in Rust, with its fields in order.
pub fn tyre_struct(model: TyreModel) -> (&'static str, &'static [&'static str]) {
    match model {
        TyreModel::MagicFormula => ("MagicFormula", <MagicFormula<f32> as Tyre<f32>>::FIELDS),
        TyreModel::Linear => ("LinearTyre", <LinearTyre<f32> as Tyre<f32>>::FIELDS),
    }
}

/// The generated lines of a kernel.
struct Generated(String);

impl Generated {
    fn new() -> Self {
        Self("\n// Generated.\n".to_owned())
    }

    fn line(mut self, line: &str) -> Self {
        self.0.push_str(line);
        self.0.push('\n');
        self
    }

    /// A constant that is a whole number.
    fn count(self, name: &str, figure: impl std::fmt::Display) -> Self {
        self.line(&format!("const {name}: u32 = {figure}u;"))
    }

    /// A whole number as a float constant.
    fn float(self, name: &str, figure: usize) -> Self {
        self.line(&format!("const {name}: f32 = {figure}.0;"))
    }

    fn flag(self, name: &str, flag: bool) -> Self {
        self.line(&format!("const {name}: bool = {flag};"))
    }

    /// A table at a binding: uniform if its length is given, else in storage.
    fn table(self, binding: usize, name: &str, of: &str, uniform: Option<usize>) -> Self {
        self.line(&match uniform {
            Some(rows) => format!("@group(0) @binding({binding}) var<uniform> {name}: array<{of}, {rows}>;"),
            None => format!("@group(0) @binding({binding}) var<storage, read> {name}: array<{of}>;"),
        })
    }

    fn end(self) -> String {
        self.line("").0
    }
}

/// What every kernel of cars is specialised to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CarShape<'a> {
    /// The tyre model.
    pub model: TyreModel,
    /// How it goes through the wheels.
    pub wheels: WheelOrder,
    /// For each figure of a ready car, which varying figure it is, if it varies: `ModelTable::sources`.
    pub sources: &'a [Option<usize>],
    /// Lanes of a workgroup.
    pub workgroup: u32,
}

impl CarShape<'_> {
    fn constants(&self) -> Generated {
        Generated::new()
            .count("WORKGROUP", self.workgroup)
            .count("BASE_VECTORS", base_vectors(self.sources.len()))
    }

    /// The car, the constants, the fragments and the loaders.
    fn kernel(&self, constants: Generated, fragments: &[&str]) -> String {
        let mut source = car_fragments(self.model, self.wheels);
        source.push_str(&constants.end());
        source.extend(fragments.iter().copied());
        source.push_str(&loaders(self.model, self.wheels, self.sources));
        source
    }

    /// The same for a kernel that takes candidates on step by step. `VARYING` figures of a candidate vary; the figures that are
    /// not its car's stand behind them.
    fn trajectories(&self, constants: Generated, fragments: &[&str]) -> String {
        let constants = constants.count(
            "VARYING",
            self.sources.iter().flatten().max().map_or(0, |last| last + 1),
        );
        self.kernel(constants, &[&[TRAJECTORIES], fragments].concat())
    }

    /// Source of the kernel of steady-state cornering; entry point `settle`.
    pub fn steady(&self) -> String {
        self.trajectories(self.constants(), &[STEADY])
    }
}

/// What a replay kernel is specialised to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ReplayShape<'a> {
    /// The car.
    pub car: CarShape<'a>,
    /// The norm.
    pub norm: Norm,
}

impl ReplayShape<'_> {
    /// Source of the kernel that drives and scores; entry point `replay`.
    pub fn replay(&self) -> String {
        self.car.kernel(self.constants(), &[REPLAY_COMMON, REPLAY])
    }

    /// Source of the kernel that joins the windows; entry point `replay_reduce`.
    pub fn reduce(&self) -> String {
        [&self.constants().end(), REPLAY_COMMON, REPLAY_REDUCE].concat()
    }

    fn constants(&self) -> Generated {
        let norm = match self.norm {
            Norm::One => 0,
            Norm::Two => 1,
            Norm::Infinity => 2,
            Norm::MeanSquare => 3,
        };
        self.car
            .constants()
            .count("NORM_ONE", 0)
            .count("NORM_TWO", 1)
            .count("NORM_INFINITY", 2)
            .count("NORM_MEAN_SQUARE", 3)
            .count("NORM", norm)
    }
}

/// What a kernel of closed-loop laps is specialised to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DriveShape<'a> {
    /// The car.
    pub car: CarShape<'a>,
    /// Stretches of the powertrain's torque.
    pub stretches: usize,
    /// The most rows that a driver looks ahead.
    pub rows_ahead: usize,
    /// The most cells of a plan that a driver looks ahead.
    pub cells_ahead: usize,
    /// Whether there are plans to blend.
    pub blends: bool,
    /// Of roads that are not level and dry, the first vector of surfaces in the table of paths.
    pub relief_at: Option<usize>,
}

impl DriveShape<'_> {
    /// Source of the kernel; entry point `drive`.
    pub fn source(&self) -> String {
        let constants = self
            .car
            .constants()
            .count("STRETCHES", self.stretches)
            .float("ROWS_AHEAD", self.rows_ahead)
            .float("CELLS_AHEAD", self.cells_ahead)
            .flag("BLENDS", self.blends)
            .flag("HAS_RELIEF", self.relief_at.is_some())
            .count("RELIEF_AT", self.relief_at.unwrap_or(0));
        let hilly = self.relief_at.is_some();
        // A car whose figures are loaded where they are used has its gravity from a variable.
        let by_axle = hilly && self.car.wheels == WheelOrder::ByAxle;
        let under_load = if by_axle {
            "var<private> felt_gravity: f32;\n\nfn under_load(car: CarModel, load: f32) -> CarModel {\n    felt_gravity = load;\n    \
             return car;\n}\n\n"
        } else if hilly {
            "fn under_load(car: CarModel, load: f32) -> CarModel {\n    var loaded = car;\n    loaded.chassis.gravity = load;\n    \
             return loaded;\n}\n\n"
        } else {
            "fn under_load(car: CarModel, load: f32) -> CarModel {\n    return car;\n}\n\n"
        };
        let source = self
            .car
            .trajectories(constants, &[PATH, DRIVER, under_load, DRIVE]);
        if by_axle {
            with_felt_gravity(&source)
        } else {
            source
        }
    }
}

/// The source with the variable in the place where the chassis' gravity is loaded.
fn with_felt_gravity(source: &str) -> String {
    let lines = source.lines().map(|line| {
        if line.ends_with(" // gravity") {
            "        felt_gravity, // gravity"
        } else {
            line
        }
    });
    lines.flat_map(|line| [line, "\n"]).collect()
}

/// What a line kernel is specialised to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LineShape {
    /// Whether the line's end joins its start.
    pub closed: bool,
    /// Terms of the sum that gives `alpha` at a cross-section: none, one or four.
    pub terms: usize,
    /// What is asked for beyond lengths.
    pub wanted: Wanted,
    /// Rows of the table of limits.
    pub envelope_rows: usize,
    /// Rows of the table of corner speeds.
    pub corner_rows: usize,
    /// Rows of the table of the ellipse, zero where there is none.
    pub ellipse_rows: usize,
    /// Whether the rate of steering is limited.
    pub steering_rate: bool,
    /// Whether cells of traction in bends follow the table of limits.
    pub traction: bool,
    /// Whether the limits with the DRS open follow those with it shut.
    pub drs: bool,
    /// Of a road in three dimensions, how many tables of limits under loads follow those of the weight.
    pub relief: Option<usize>,
    /// Cross-sections, if their table is to be uniform.
    pub uniform_sections: Option<usize>,
    /// Whether the tables of limits, of corner speeds and of the ellipse are to be uniform.
    pub uniform_envelope: bool,
    /// Lanes of a workgroup.
    pub workgroup: u32,
    /// Lanes whose figures of a cross-section stand together in memory; divides the workgroup.
    pub tile: u32,
}

impl LineShape {
    /// Source of the kernel; entry point `line`.
    pub fn source(&self) -> String {
        let rows = |rows: usize| self.uniform_envelope.then_some(rows);
        let cells = if self.traction {
            TRACTION_SPEEDS * TRACTION_ROOTS * (TRACTION_WIDTH / 4)
        } else {
            0
        };
        let of_load = 2 * self.envelope_rows + cells;
        let limits = of_load * (1 + self.relief.unwrap_or(0));
        let generated = Generated::new()
            .flag("CLOSED", self.closed)
            .count("TERMS", self.terms)
            .flag("WANTS_INTEGRAL", self.wanted.integral)
            .flag("WANTS_LAP", self.wanted.lap)
            .count("ENVELOPE_ROWS", self.envelope_rows)
            .count("CORNER_ROWS", self.corner_rows)
            .count("ELLIPSE_ROWS", self.ellipse_rows)
            .flag("HAS_STEERING_RATE", self.steering_rate)
            .flag("HAS_TRACTION", self.traction)
            .count("TRACTION_SPEEDS", TRACTION_SPEEDS)
            .count("TRACTION_ROOTS", TRACTION_ROOTS)
            .flag("HAS_DRS", self.drs)
            .count("OPEN_AT", limits)
            .flag("HAS_RELIEF", self.relief.is_some())
            .count("LOADS", self.relief.unwrap_or(2))
            .count("LOADS_AT", of_load)
            .count("LOAD_STEP", of_load)
            .count("WORKGROUP", self.workgroup)
            .count("TILE", self.tile)
            .table(1, "sections", "Section", self.uniform_sections)
            .table(
                2,
                "envelope",
                "vec4<f32>",
                rows(limits * (1 + usize::from(self.drs))),
            )
            .table(3, "corners", "vec4<f32>", rows(self.corner_rows))
            .table(4, "ellipse", "vec4<f32>", rows(self.ellipse_rows.max(1)));
        [&elementary(WheelOrder::SideBySide), &generated.end(), LINE].concat()
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
    /// Whether the state of charge helps decide where the motor works.
    pub counts_charge: bool,
    /// Vectors of four in the energy tables, if they are to be uniform.
    pub uniform_energy: Option<usize>,
}

impl EnergyShape {
    /// Source of the kernel; entry point `energy_line`.
    pub fn source(&self) -> String {
        // Where in the table of vectors of four the flows, the boosts and the zones begin.
        let rows = self.line.envelope_rows;
        let generated = Generated::new()
            .count("STRATEGY", self.line_variables)
            .flag("ADDITIONAL", self.additional)
            .flag("COUNTS_CHARGE", self.counts_charge)
            .count("FLOWS_AT", 2 * rows)
            .count("BOOSTS_AT", 4 * rows)
            .count("ZONES_AT", 6 * rows)
            .table(10, "energy", "vec4<f32>", self.uniform_energy);
        [&self.line.source(), &generated.end(), ENERGY].concat()
    }
}

/// How many `vec4` a uniform table of `count` floats takes.
pub fn base_vectors(count: usize) -> usize {
    count.div_ceil(4).max(1)
}

/// The loaders `load_chassis` and `load_tyres`, or one for each axle's tyres: a figure that candidates share comes from the uniform
/// table `base`, where the compiler sees that all lanes read the same, one that varies from its row of `figures`.
pub fn loaders(model: TyreModel, wheels: WheelOrder, sources: &[Option<usize>]) -> String {
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
    let tyres = |name: &str, figures: &dyn Fn(usize) -> String| {
        let lines = tyre.iter().enumerate();
        let lines: Vec<String> = lines
            .map(|(i, field)| format!("        Wheels({}), // {field}\n", figures(i)))
            .collect();
        function(name, structure, &lines)
    };
    let tyres = match wheels {
        WheelOrder::SideBySide => tyres("load_tyres", &|i| {
            let (front, rear) = (place(front + i), place(rear + i));
            format!("{front}, {front}, {rear}, {rear}")
        }),
        WheelOrder::ByAxle => {
            let front = tyres("load_front_tyres", &|i| place(front + i));
            front + &tyres("load_rear_tyres", &|i| place(rear + i))
        }
    };
    let chassis = function("load_chassis", "Chassis", &chassis_lines);
    ["\n// Generated.\n", &chassis, &tyres].concat()
}
