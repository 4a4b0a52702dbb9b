//! The single-precision kernels on this machine against the `f64` reference: what `lapswarm parity` reports and the
//! parity tests hold to.
//!
//! Every [`Subject`] (lanes of an instruction set, a device) runs the same cases as the reference does; an
//! [`Agreement`] says how far it was off, in relative terms and in spacings of `f32` at the exact value (ULP), and
//! whether that is within a tolerance derived from the roundings of the kernel.

mod cases;
pub mod drive;
pub mod elementary;
pub mod energy;
pub mod laps;
pub mod lines;
pub mod steady;
pub mod step;
pub mod synthetic_lap;

pub use lines::{in_relief, line_tolerances};

use crate::error::{Error, Result};
use crate::evaluate::gpu::shader::{WheelOrder, car_fragments, elementary, loaders};
use crate::evaluate::gpu::{DeviceKind, GpuContext, devices};
use crate::evaluate::simd::InstructionSet;
use crate::evaluate::{BackendChoice, GpuBackend, OnDevice, OutcomeOf, SimdBackend};
use crate::random::Random;
use crate::vehicle::{Car, CarParameter, TyreModel};
use serde::Serialize;
use std::sync::Arc;

/// What is held against the reference.
#[derive(Clone, Debug)]
pub enum Subject {
    /// Lanes of an instruction set.
    Lanes(InstructionSet),
    /// A device, real or of software.
    Device(Arc<GpuContext>),
}

impl Subject {
    /// The name that kernels' names start with: `simd` and the set, or `gpu`.
    pub fn name(&self) -> String {
        match self {
            Self::Lanes(set) => format!("simd {}", set.name()),
            Self::Device(_) => "gpu".to_owned(),
        }
    }

    /// The outcomes of candidates on it.
    ///
    /// # Errors
    /// [`Error::Device`] if the device fails.
    pub fn outcomes<K: OnDevice>(&self, kind: &K, candidates: &[&[f64]]) -> Result<Vec<OutcomeOf<K>>> {
        match self {
            Self::Lanes(set) => Ok(SimdBackend::new(kind, *set).outcomes(candidates)),
            Self::Device(context) => GpuBackend::new(kind, Arc::clone(context))?.outcomes(candidates),
        }
    }

    /// Whether it is known to round every operation as the processor does. Other devices may contract a product and
    /// a sum, or divide to 2.5 ULP, as WGSL lets them.
    pub fn rounds_like_the_processor(&self) -> bool {
        match self {
            Self::Lanes(_) => true,
            Self::Device(context) => {
                let summary = context.summary();
                summary.kind == DeviceKind::Software && summary.driver == "llvmpipe"
            }
        }
    }
}

/// The subjects that `choice` means: with `Auto`, every instruction set of the processor and the device that `adapter`
/// names (the best one without a name), if there is any.
///
/// # Errors
/// [`crate::Error::NoDevice`] if a device was asked for and there is none, [`crate::Error::Device`] if it does not open.
pub fn subjects(choice: BackendChoice, adapter: Option<&str>) -> Result<Vec<Subject>> {
    let mut subjects = Vec::new();
    if matches!(choice, BackendChoice::Auto | BackendChoice::Simd) {
        subjects.extend(InstructionSet::available().into_iter().map(Subject::Lanes));
    }
    let asked = choice == BackendChoice::Gpu || adapter.is_some();
    if asked || (choice == BackendChoice::Auto && !devices().is_empty()) {
        subjects.push(Subject::Device(GpuContext::shared(adapter)?));
    }
    Ok(subjects)
}

/// How one kernel of one subject compares with the reference.
#[derive(Clone, Debug, Serialize)]
pub struct Agreement {
    /// The kernel's name.
    #[serde(skip)]
    pub kernel: String,
    /// The subject's name.
    pub subject: String,
    /// Figures compared.
    pub figures: usize,
    /// Greatest difference as a share of the exact value, or of what its parts add up to where they cancel.
    pub max_relative: f64,
    /// The same in spacings of `f32` at that value.
    pub max_ulp: f64,
    /// Greatest difference as a share of what is allowed.
    pub share_of_tolerance: f64,
    /// Whether the bits are those of the plain `f32` scalar; `None` where that was not looked at.
    pub bits_as_scalar: Option<bool>,
    /// Whether every figure is within its tolerance, and every verdict on a candidate the same.
    pub pass: bool,
    /// The case that was furthest off, in words.
    pub worst: String,
}

impl Agreement {
    /// Nothing compared yet.
    pub fn new(kernel: &str, subject: &Subject) -> Self {
        Self {
            kernel: kernel.to_owned(),
            subject: subject.name(),
            figures: 0,
            max_relative: 0.0,
            max_ulp: 0.0,
            share_of_tolerance: 0.0,
            bits_as_scalar: None,
            pass: true,
            worst: String::new(),
        }
    }

    /// The key of this comparison in reports.
    pub fn key(&self) -> String {
        format!("{}: {}", self.subject, self.kernel)
    }

    /// Takes up one figure: `found` for `exact`, errors measured against `scale`, at most `allowed` off (in the
    /// figure's unit).
    pub fn note(&mut self, found: f64, exact: f64, scale: f64, allowed: f64, case: impl FnOnce() -> String) {
        self.figures += 1;
        let off = (found - exact).abs();
        // Not a number is infinitely far off.
        let off = if off.is_nan() { f64::INFINITY } else { off };
        self.max_relative = self.max_relative.max(off / scale);
        self.max_ulp = self.max_ulp.max(off / spacing(scale));
        let share = off / allowed;
        if share > self.share_of_tolerance {
            self.share_of_tolerance = share;
            self.worst = format!("{}: {found:e} for {exact:e}", case());
        }
        self.pass &= off <= allowed;
    }

    /// Takes up whether all bits are those of the plain scalar, which those of lanes must be.
    fn bits(&mut self, alike: bool, subject: &Subject) {
        self.bits_as_scalar = Some(alike);
        let must = matches!(subject, Subject::Lanes(_));
        self.verdict(alike || !must, || {
            "lanes have other bits than one float".to_owned()
        });
    }

    /// Takes up a verdict that must be the reference's own.
    pub fn verdict(&mut self, same: bool, case: impl FnOnce() -> String) {
        if !same && self.pass {
            self.worst = case();
        }
        self.pass &= same;
    }
}

/// The spacing of `f32` at a magnitude.
pub fn spacing(magnitude: f64) -> f64 {
    magnitude
        .abs()
        .max(f64::from(f32::MIN_POSITIVE))
        .log2()
        .floor()
        .exp2()
        * 2f64.powi(-23)
}

/// Compares the kernels of one layer on a subject.
///
/// # Errors
/// Those of the evaluators: a device that fails.
pub type Layer = Box<dyn Fn(&Subject) -> Result<Vec<Agreement>>>;

/// The layers, each of which needs those before it.
const LAYERS: &[fn() -> Result<Layer>] = &[
    || Ok(Box::new(elementary::compare)),
    || Ok(Box::new(step::compare)),
    laps::layer,
    lines::layer,
    energy::layer,
    drive::layer,
    steady::layer,
];

/// Compares every kernel of every subject; `observe` is told of each comparison as it is done.
///
/// # Errors
/// Those of the evaluators: a device that fails. Disagreement is no error but a comparison that does not pass.
pub fn compare(subjects: &[Subject], mut observe: impl FnMut(&Agreement)) -> Result<Vec<Agreement>> {
    let layers: Vec<Layer> = LAYERS.iter().map(|layer| layer()).collect::<Result<_>>()?;
    let mut all = Vec::new();
    for subject in subjects {
        for layer in &layers {
            let found = layer(subject)?;
            found.iter().for_each(&mut observe);
            all.extend(found);
        }
    }
    Ok(all)
}

/// Random numbers one after the other: those of cases, which every backend must be given alike.
pub struct Draws {
    random: Random,
    drawn: u32,
}

impl Draws {
    /// From a seed.
    pub fn new(seed: u64) -> Self {
        Self {
            random: Random::new(seed),
            drawn: 0,
        }
    }

    /// The next number from `low` to `high`.
    pub fn within(&mut self, low: f64, high: f64) -> f64 {
        self.drawn += 1;
        low + (high - low) * self.random.uniform(PARITY, 0, 0, self.drawn)
    }
}

/// Random candidates from all over the bounds of a problem.
pub fn candidates(problem: &impl OnDevice, count: usize, draws: &mut Draws) -> Vec<Vec<f64>> {
    let variables = &problem.problem().variables;
    (0..count)
        .map(|_| {
            let values = variables.iter().map(|v| {
                let x = draws.within(v.lower, v.upper);
                if v.whole { x.round() } else { x }
            });
            values.collect()
        })
        .collect()
}

/// Parameters of `car` that are free within a share of themselves about themselves; those near zero, within a share of a thousandth.
///
/// # Errors
/// [`Error::Input`] naming a parameter that the car lacks.
fn free_about(car: &Car, names: &[&str], share: f64) -> Result<Vec<(CarParameter, f64, f64)>> {
    let flat = car.to_flat();
    let free = names.iter().map(|name| {
        let known = || Error::input(&car.name, *name, "no such parameter", "a parameter of the car");
        let parameter = car.parameter(name).ok_or_else(known)?;
        let value = flat[parameter.slots[0]];
        let reach = share * value.abs().max(1e-3);
        Ok((parameter, value - reach, value + reach))
    });
    free.collect()
}

/// Purpose of the draws of cases in the counter.
const PARITY: u32 = 0xa61;

/// The car's fragments with loaders that take every figure from rows of `lanes` floats at the front of the input,
/// which is bound as `figures`; `to_host` is the output.
pub fn car_source(
    (model, wheels): (TyreModel, WheelOrder),
    figures: usize,
    lanes: usize,
    entry: &str,
) -> String {
    let sources: Vec<_> = (0..figures).map(Some).collect();
    format!(
        "{}
        struct Rows {{ stride: u32 }}
        const stretch = Rows({lanes}u);
        const AFTER_FIGURES = {}u;
        @group(0) @binding(0) var<storage, read> figures: array<f32>;
        @group(0) @binding(1) var<storage, read_write> to_host: array<f32>;
        {}
        {entry}",
        car_fragments(model, wheels),
        figures * lanes,
        loaders(model, wheels, &sources),
    )
}

/// `function` (of four figures at once) over `inputs`, whose count is a multiple of four.
pub(crate) fn map(context: &GpuContext, function: &str, inputs: &[f32]) -> Result<Vec<f32>> {
    let source = format!(
        "{}
        @group(0) @binding(0) var<storage, read> from_host: array<vec4<f32>>;
        @group(0) @binding(1) var<storage, read_write> to_host: array<vec4<f32>>;
        @compute @workgroup_size(64) fn apply(@builtin(global_invocation_id) id: vec3<u32>) {{
            if id.x < arrayLength(&from_host) {{ to_host[id.x] = {function}(from_host[id.x]); }}
        }}",
        elementary(WheelOrder::SideBySide),
    );
    context.run_array(&source, "apply", inputs, inputs.len(), inputs.len() / 4)
}
