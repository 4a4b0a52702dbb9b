//! Problems: those of cars and lines, set up as the studies do, and those of one's own.

use crate::errors::{OrRaise, refused};
use lapswarm::config::kinds::Choice;
use lapswarm::config::settings::Settings;
use lapswarm::evaluate::drive::{DriveProblem, open_drive_evaluator};
use lapswarm::evaluate::energy::{HybridProblem, open_hybrid_evaluator};
use lapswarm::evaluate::line::{LineProblem, open_line_evaluator};
use lapswarm::evaluate::replay::{ReplayProblem, open_evaluator};
use lapswarm::evaluate::steady::{SteadyObjective, SteadyProblem, open_steady_evaluator};
use lapswarm::evaluate::{self, BackendChoice, Objective, Variable};
use lapswarm::line::Parametrisation;
use lapswarm::study::framework::Study;
use lapswarm::study::identify::{self, IdentifySettings};
use lapswarm::study::raceline::{self, RacelineSettings};
use lapswarm::study::transient::{Transient, TransientSettings, drive_problem};
use lapswarm::study::{hybrid, hybrid::HybridStudySettings};
use lapswarm::vehicle::Car;
use lapswarm::{Error, Result};
use numpy::PyArray2;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::ops::ControlFlow;
use std::path::Path;
use std::sync::Arc;

/// What is evaluated.
pub enum Kind {
    Replay(ReplayProblem),
    Line(LineProblem),
    Energy(Box<HybridProblem>),
    Drive(Box<DriveProblem>),
    Steady(SteadyProblem),
    /// Variables and objectives of one's own, which nothing here evaluates.
    Own(evaluate::Problem),
}

/// An evaluator of a kind's problem.
type Boxed<'a> = Box<dyn evaluate::Evaluator + 'a>;

impl Kind {
    pub fn problem(&self) -> &evaluate::Problem {
        match self {
            Self::Replay(kind) => &kind.problem,
            Self::Line(kind) => &kind.problem,
            Self::Energy(kind) => &kind.problem,
            Self::Drive(kind) => &kind.problem,
            Self::Steady(kind) => &kind.problem,
            Self::Own(problem) => problem,
        }
    }

    /// An evaluator on the backend that is chosen.
    ///
    /// # Errors
    /// [`Error::NoDevice`] if a GPU was asked for and none fits; [`Error::Input`] for a problem of one's own.
    pub fn open(&self, choice: BackendChoice, adapter: Option<&str>) -> Result<Boxed<'_>> {
        match self {
            Self::Replay(kind) => open_evaluator(kind, choice, adapter),
            Self::Line(kind) => open_line_evaluator(kind, choice, adapter),
            Self::Energy(kind) => open_hybrid_evaluator(kind.as_ref(), choice, adapter),
            Self::Drive(kind) => open_drive_evaluator(kind.as_ref(), choice, adapter),
            Self::Steady(kind) => open_steady_evaluator(kind, choice, adapter),
            Self::Own(_) => Err(Error::input(
                "Evaluator",
                "problem",
                "a problem of one's own",
                "a problem of cars or lines; a function of one's own is called by minimise()",
            )),
        }
    }
}

/// The settings in a text, whose files are relative to the working folder.
fn settings<S: Settings>(name: &str, text: &str) -> Result<S> {
    S::parse(Path::new(name), text, Path::new(""))
}

fn replay(text: &str) -> Result<Kind> {
    let settings: IdentifySettings = settings("ReplayProblem", text)?;
    Ok(Kind::Replay(identify::set_up(&settings)?.replay))
}

fn line(text: &str, control_points: Option<usize>) -> Result<Kind> {
    let settings: RacelineSettings = settings("LineProblem", text)?;
    let setup = raceline::set_up(&settings)?;
    let way = control_points.map_or_else(Parametrisation::sections, Parametrisation::control_points);
    Ok(Kind::Line(setup.problem(way, &settings.objectives, &settings)?))
}

fn energy(text: &str) -> Result<Kind> {
    let settings: HybridStudySettings = settings("EnergyProblem", text)?;
    let setup = hybrid::set_up(&settings)?;
    let energy_mj = setup.budget_j(settings.energy_mj) / 1e6;
    let problem = setup.zone_problem(&[], energy_mj, &settings.objectives)?;
    Ok(Kind::Energy(Box::new(problem)))
}

fn drive(text: &str) -> Result<Kind> {
    let settings: TransientSettings = settings("DriveProblem", text)?;
    let prepared = Transient::prepare(&settings)?;
    let problem = drive_problem(&settings, &prepared, || ControlFlow::Continue(()))?;
    let problem = problem.ok_or_else(|| Error::Study("the lines were not planned".to_owned()))?;
    Ok(Kind::Drive(Box::new(problem)))
}

/// Parameters by name, with their bounds.
type FreeParameters = Vec<(String, f64, f64)>;

fn steady(
    car: &str,
    free: FreeParameters,
    speeds_mps: [f64; 2],
    steers_rad: [f64; 2],
    objectives: &[String],
) -> Result<Kind> {
    let car = Car::load(car)?;
    let known = |(name, lower, upper): (String, f64, f64)| {
        Ok((car.known_parameter("SteadyProblem", "free", &name)?, lower, upper))
    };
    let free = free.into_iter().map(known).collect::<Result<Vec<_>>>()?;
    let objective = |name: &String| {
        SteadyObjective::named(name).ok_or_else(|| {
            Error::input(
                "SteadyProblem",
                "objectives",
                name.clone(),
                SteadyObjective::names(),
            )
        })
    };
    let objectives = objectives.iter().map(objective).collect::<Result<Vec<_>>>()?;
    let problem = SteadyProblem::new(car.clone(), free, speeds_mps, steers_rad, &objectives)?;
    Ok(Kind::Steady(problem))
}

/// A problem: bounded decision variables and objectives, all of which are minimised.
#[pyclass(frozen, subclass, module = "lapswarm._native")]
pub struct Problem {
    pub kind: Arc<Kind>,
}

impl Problem {
    fn each<T>(&self, what: impl Fn(&Variable) -> T) -> Vec<T> {
        self.kind.problem().variables.iter().map(what).collect()
    }

    fn each_objective<T>(&self, what: impl Fn(&Objective) -> T) -> Vec<T> {
        self.kind.problem().objectives.iter().map(what).collect()
    }
}

#[pymethods]
impl Problem {
    /// From the settings of a study, as the text of its file: `replay`, `line`, `energy`, `drive`.
    #[staticmethod]
    #[pyo3(signature = (kind, text, control_points=None))]
    fn of_study(py: Python<'_>, kind: &str, text: &str, control_points: Option<usize>) -> PyResult<Self> {
        let found = py.detach(|| match kind {
            "replay" => replay(text),
            "line" => line(text, control_points),
            "energy" => energy(text),
            "drive" => drive(text),
            _ => Err(Error::input(
                "Problem",
                "kind",
                kind,
                "replay, line, energy or drive",
            )),
        });
        let kind = Arc::new(found.or_raise(py)?);
        Ok(Self { kind })
    }

    /// Cars in steady-state cornering.
    #[staticmethod]
    fn of_steady(
        py: Python<'_>,
        car: &str,
        free: FreeParameters,
        speeds_mps: [f64; 2],
        steers_rad: [f64; 2],
        objectives: Vec<String>,
    ) -> PyResult<Self> {
        let found = py.detach(|| steady(car, free, speeds_mps, steers_rad, &objectives));
        let kind = Arc::new(found.or_raise(py)?);
        Ok(Self { kind })
    }

    /// Variables and objectives of one's own: names, units, bounds, and whether only whole numbers will do.
    #[staticmethod]
    fn of_own(
        py: Python<'_>,
        variables: Vec<(String, String, f64, f64, bool)>,
        objectives: Vec<(String, String)>,
    ) -> PyResult<Self> {
        if variables.is_empty() || objectives.is_empty() {
            let expected = "at least one of each";
            return Err(refused(py, "Problem", "bounds, objectives", "none", expected));
        }
        let variable = |(name, unit, lower, upper, whole): (String, String, f64, f64, bool)| Variable {
            whole,
            ..Variable::new(name, &unit, lower, upper)
        };
        let objective = |(name, unit): (String, String)| Objective::new(name, &unit);
        let problem = evaluate::Problem {
            variables: variables.into_iter().map(variable).collect(),
            objectives: objectives.into_iter().map(objective).collect(),
        };
        let kind = Arc::new(Kind::Own(problem));
        Ok(Self { kind })
    }

    /// The problem itself, for subclasses that are made of one.
    #[new]
    fn new(other: PyRef<'_, Self>) -> Self {
        let kind = Arc::clone(&other.kind);
        Self { kind }
    }

    /// Least and greatest value of each variable, in its unit: an array of shape (d, 2).
    #[getter]
    fn bounds<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        crate::arrays::array(py, self.each(|v| [v.lower, v.upper]).concat(), 2)
    }

    /// Names of the variables.
    #[getter]
    fn names(&self) -> Vec<String> {
        self.each(|v| v.name.clone())
    }

    /// Units of the variables, `-` for none.
    #[getter]
    fn units(&self) -> Vec<String> {
        self.each(|v| v.unit.clone())
    }

    /// Which variables take whole numbers alone.
    #[getter]
    fn whole(&self) -> Vec<bool> {
        self.each(|v| v.whole)
    }

    /// Names of the objectives.
    #[getter]
    fn objectives(&self) -> Vec<String> {
        self.each_objective(|o| o.name.clone())
    }

    /// Units of the objectives, `-` for none.
    #[getter]
    fn objective_units(&self) -> Vec<String> {
        self.each_objective(|o| o.unit.clone())
    }

    /// The variables as a frame: `name`, `unit`, `lower`, `upper`, `whole`. kind: `pandas`, `polars` or `numpy` (a dict of arrays);
    /// without it the first of these that is installed.
    #[pyo3(signature = (kind=None))]
    fn frame<'py>(&self, py: Python<'py>, kind: Option<&str>) -> PyResult<Bound<'py, PyAny>> {
        let columns = PyDict::new(py);
        columns.set_item("name", self.names())?;
        columns.set_item("unit", self.units())?;
        columns.set_item("lower", self.each(|v| v.lower))?;
        columns.set_item("upper", self.each(|v| v.upper))?;
        columns.set_item("whole", self.whole())?;
        let frames = py.import("lapswarm._frames")?;
        frames.call_method1("frame_of", (columns, kind))
    }

    fn __repr__(&self) -> String {
        let problem = self.kind.problem();
        format!(
            "<problem of {} variables and {} objectives>",
            problem.variables.len(),
            problem.objectives.len()
        )
    }
}

/// The files of a bundled or written car with other values of its parameters: names and texts, the car itself last.
#[pyfunction]
pub fn car_files(py: Python<'_>, base: &str, values: Vec<(String, f64)>) -> PyResult<Vec<(String, String)>> {
    let made = || -> Result<_> {
        let car = Car::load(base)?;
        let mut flat = car.to_flat();
        for (name, value) in values {
            for slot in car.known_parameter("Car", "parameters", &name)?.slots {
                flat[slot] = value;
            }
        }
        Ok(car.with_flat(&flat).files("car"))
    };
    made().or_raise(py)
}
