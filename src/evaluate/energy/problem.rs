//! Problems of laps with energy: the line, the strategy, which parts of both are free, and the objectives.

use crate::error::{Error, Result};
use crate::evaluate::objectives::{listed, missing_or_twice, objectives};
use crate::evaluate::{Problem, Variable};
use crate::line::energy::{EnergyCar, EnergyPlan, GATES, Gates};
use crate::line::kernel::{Course, Wanted, shape};
use crate::line::{LinePlan, Parametrisation};
use crate::track::{CrossSections, Surface};
use glam::DVec2;

objectives! {
    /// What of a lap can be minimised.
    HybridObjective {
        /// Its time, s.
        LapTime: "lap_time_s", "s", "lap time";
        /// Its fuel, l.
        Fuel: "fuel_l", "l", "fuel";
        /// Energy out of the store, MJ.
        EnergyUsed: "energy_used_mj", "MJ", "energy used";
        /// Greatest less least state of charge.
        SocSwing: "soc_swing", "-", "swing of charge";
        /// Length of the line, m.
        Length: "length_m", "m", "length";
        /// Root of the sum of the line's squared curvatures, 1/m.
        Gamma: "gamma_1pm", "1/m", "Gamma";
    }
}

/// The line that laps are driven on.
#[derive(Clone, Debug)]
pub enum HybridLine {
    /// One line through these points (m); whether its end joins its start.
    Fixed {
        /// The points.
        points_m: Vec<DVec2>,
        /// Whether the last is followed by the first.
        closed: bool,
        /// Whether the DRS may be open from each point to the next; nowhere if empty.
        drs: Vec<bool>,
        /// The surface at each point; empty on a level and dry road.
        surface: Vec<Surface>,
    },
    /// A line across cross-sections, given by the first variables.
    Free {
        /// The cross-sections.
        cross_sections: Box<CrossSections>,
        /// How variables give a line.
        parametrisation: Parametrisation,
    },
}

/// A part of the strategy that may be free.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Free {
    /// Greatest steering angle, rad.
    Steer,
    /// Greatest speed, m/s.
    Speed,
    /// Least acceleration, m/s^2.
    Acceleration,
    /// Least state of charge.
    Soc,
    /// Energy that may leave the store, MJ.
    Energy,
    /// Greatest power of the MGU-K, kW; its torque goes with it.
    Motor,
    /// The share of a zone in which the motor works.
    Zone(usize),
}

/// A figure of the kernels that is a variable as it is, or the same for all candidates.
#[cfg(feature = "gpu")]
pub(super) enum Figure {
    /// The variable of that place.
    Variable(usize),
    /// The value.
    Fixed(f64),
}

/// The strongest motor that may be asked for, as a share of the car's own.
pub const MOST_MOTOR: f64 = 2.0;

impl Free {
    fn variable(self, power_w: f64) -> Variable {
        match self {
            Self::Steer => Variable::new("steer", "rad", 0.0, 0.2),
            Self::Speed => Variable::new("speed", "m/s", 10.0, 100.0),
            Self::Acceleration => Variable::new("ax", "m/s^2", 0.0, 10.0),
            Self::Soc => Variable::new("soc", "-", 0.0, 1.1),
            Self::Energy => Variable::new("energy", "MJ", 0.0, 20.0),
            Self::Motor => Variable::new("motor power", "kW", 0.0, MOST_MOTOR * power_w / 1e3),
            Self::Zone(zone) => Variable::new(format!("zone {zone}"), "-", 0.0, 1.0),
        }
    }
}

/// A strategy, and what of it is free.
#[derive(Clone, Debug, PartialEq)]
pub struct Strategy {
    /// The gates.
    pub gates: Gates,
    /// The share of each zone in which the motor works.
    pub shares: Vec<f64>,
    /// What variables set instead, in their order.
    pub free: Vec<Free>,
}

impl Strategy {
    /// Gates that nothing moves, all zones open.
    pub fn fixed(gates: Gates, zones: usize) -> Self {
        Self {
            gates,
            shares: vec![1.0; zones],
            free: Vec::new(),
        }
    }

    /// The gates and shares with the free ones set.
    fn with(&self, power_w: f64, values: &[f64]) -> (Gates, Vec<f64>) {
        let (mut gates, mut shares) = (self.gates, self.shares.clone());
        for (free, &value) in self.free.iter().zip(values) {
            match free {
                Free::Steer => gates.steer_rad = value,
                Free::Speed => gates.speed_mps = value,
                Free::Acceleration => gates.ax_mps2 = value,
                Free::Soc => gates.soc = value,
                Free::Energy => gates.energy_mj = value,
                // A car without a motor has no power at any share.
                Free::Motor => gates.motor_share = 1e3 * value / power_w.max(1.0),
                Free::Zone(zone) => shares[*zone] = value,
            }
        }
        (gates, shares)
    }
}

/// Finding strategies, lines or both.
#[derive(Clone, Debug)]
pub struct HybridProblem {
    /// Variables and objectives: those of the line, then those of the strategy.
    pub problem: Problem,
    line: HybridLine,
    plan: LinePlan<f64>,
    energy: EnergyPlan<f64>,
    car: EnergyCar,
    strategy: Strategy,
    pub(super) objectives: Vec<HybridObjective>,
    line_variables: usize,
}

impl HybridProblem {
    /// The problem of `car` on `line` by `strategy` in the zones of `energy`; `entry_mps` is the greatest speed at the start
    /// of an open line (m/s).
    ///
    /// # Errors
    /// [`Error::Input`] if there are too few sections, if zones do not fit, if objectives are missing or come twice.
    pub fn new(
        line: HybridLine,
        car: EnergyCar,
        energy: EnergyPlan<f64>,
        strategy: Strategy,
        objectives: &[HybridObjective],
        entry_mps: f64,
    ) -> Result<Self> {
        let wrong =
            |place: &str, found: String, expected: &str| Err(Error::input("hybrid", place, found, expected));
        let (mut plan, mut variables) = match &line {
            HybridLine::Fixed {
                points_m,
                closed,
                drs,
                surface,
            } => {
                let plan = LinePlan::of_points(points_m, *closed).with_drs(drs);
                (plan.with_surface(surface), Vec::new())
            }
            HybridLine::Free {
                cross_sections,
                parametrisation,
            } => {
                let mut plan = LinePlan::of_cross_sections(
                    &cross_sections.right_m,
                    &cross_sections.left_m,
                    cross_sections.closed,
                )
                .spaced(&cross_sections.spacing_m())
                .with_drs(&cross_sections.drs)
                .with_relief(cross_sections);
                parametrisation.apply(cross_sections, &mut plan)?;
                (plan, parametrisation.variables(cross_sections))
            }
        };
        let n = plan.rows.len();
        if n < 3 {
            return wrong("sections", n.to_string(), "at least three");
        }
        if !plan.relief.is_empty() && (plan.relief.len() != n || !car.point_mass.relief) {
            let found = format!("a surface at {} of {n} sections", plan.relief.len());
            let expected = "one at each, and a car with limits under loads";
            return wrong("surface", found, expected);
        }
        if energy.zones.len() != n || energy.run_in >= n {
            let found = format!("{} rows, run-in from {}", energy.zones.len(), energy.run_in);
            return wrong("zones", found, "one for each section");
        }
        if strategy.shares.len() < energy.count() {
            let found = format!("{} for {} zones", strategy.shares.len(), energy.count());
            return wrong("shares", found, "one for each zone");
        }
        let beyond = strategy
            .free
            .iter()
            .find(|f| matches!(f, Free::Zone(zone) if *zone >= strategy.shares.len()));
        if let Some(free) = beyond {
            return wrong("free", format!("{free:?}"), "a zone that there is");
        }
        if missing_or_twice(objectives) {
            return wrong("objectives", format!("{objectives:?}"), "at least one, each once");
        }
        if !(0.0..=1000.0).contains(&entry_mps) {
            return wrong("entry speed", format!("{entry_mps} m/s"), "0 to 1000 m/s");
        }
        plan.entry = entry_mps * entry_mps;
        plan.start = match &line {
            HybridLine::Fixed { points_m, closed, .. } => slowest(points_m, *closed),
            HybridLine::Free { cross_sections, .. } => {
                slowest(&cross_sections.points(&vec![0.5; n]), cross_sections.closed)
            }
        };
        // A floor that no lap can reach does not count.
        let mut energy = energy;
        let [_, _, _, floor_j, budget_j, _] = car.gate_figures(&strategy.gates);
        let most_j = if strategy.free.contains(&Free::Energy) {
            1e6 * Free::Energy.variable(0.0).upper
        } else {
            budget_j
        };
        energy.counts_charge = strategy.free.contains(&Free::Soc) || floor_j > -most_j;
        let line_variables = variables.len();
        let power_w = car.hybrid.mgu_k.power_w;
        variables.extend(strategy.free.iter().map(|f| f.variable(power_w)));
        Ok(Self {
            problem: Problem {
                variables,
                objectives: listed(objectives),
            },
            line,
            plan,
            energy,
            car,
            strategy,
            objectives: objectives.to_vec(),
            line_variables,
        })
    }

    /// The line.
    pub fn line(&self) -> &HybridLine {
        &self.line
    }

    /// The car.
    pub fn car(&self) -> &EnergyCar {
        &self.car
    }

    /// What the kernels read of the sections.
    pub fn plan(&self) -> &LinePlan<f64> {
        &self.plan
    }

    /// Length (m) and Gamma (1/m) of a candidate's line. They take no kernel: lines are few beside the laps that they cost.
    pub(super) fn line_measures(&self, candidate: &[f64]) -> [f64; 2] {
        let wanted = Wanted {
            integral: false,
            lap: false,
        };
        let line = &candidate[..self.line_variables];
        let shape = shape::<f64>(&self.plan, wanted, line, &mut Course::default());
        [shape.length, shape.second_differences.sqrt()]
    }

    /// What the kernels read of the zones.
    pub fn energy(&self) -> &EnergyPlan<f64> {
        &self.energy
    }

    /// The objectives.
    pub fn objectives(&self) -> &[HybridObjective] {
        &self.objectives
    }

    /// Number of variables.
    pub fn dimensions(&self) -> usize {
        self.problem.variables.len()
    }

    /// Variables of the line, which come first.
    pub fn line_variables(&self) -> usize {
        self.line_variables
    }

    /// Figures of the kernels' strategy.
    pub fn strategy_figures(&self) -> usize {
        GATES + self.strategy.shares.len()
    }

    /// The gates and the shares of zones of a candidate.
    pub fn strategy_of(&self, candidate: &[f64]) -> (Gates, Vec<f64>) {
        self.strategy
            .with(self.car.hybrid.mgu_k.power_w, &candidate[self.line_variables..])
    }

    /// What each of the kernels' figures is. Nothing where figures are made of
    /// variables in other ways, as those of gates are, or the gates' own are no numbers in single precision.
    #[cfg(feature = "gpu")]
    pub(super) fn variables_of_figures(&self) -> Option<Vec<Figure>> {
        let gates = self.car.gate_figures(&self.strategy.gates);
        if !crate::evaluate::are_numbers(&gates) {
            return None;
        }
        let mut figures: Vec<_> = (0..self.line_variables).map(Figure::Variable).collect();
        figures.extend(gates.into_iter().map(Figure::Fixed));
        let zones = figures.len();
        figures.extend(self.strategy.shares.iter().copied().map(Figure::Fixed));
        for (place, free) in self.strategy.free.iter().enumerate() {
            let Free::Zone(zone) = free else {
                return None;
            };
            figures[zones + zone] = Figure::Variable(self.line_variables + place);
        }
        Some(figures)
    }

    /// The kernels' figures of a candidate: variables of the line, gates, shares of zones.
    pub fn figures(&self, candidate: &[f64]) -> Vec<f64> {
        let (gates, shares) = self.strategy_of(candidate);
        let mut figures = candidate[..self.line_variables].to_vec();
        figures.extend(self.car.gate_figures(&gates));
        figures.extend(shares);
        figures
    }
}

/// The section where a car is slowest, by the sharpest bend.
fn slowest(points_m: &[DVec2], closed: bool) -> usize {
    let curvature = crate::line::geometry(points_m, closed).curvature_1pm;
    (0..curvature.len())
        .max_by(|&i, &j| curvature[i].abs().total_cmp(&curvature[j].abs()))
        .unwrap_or(0)
}
