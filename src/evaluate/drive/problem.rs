//! Problems of closed-loop laps: which parameters of the car are free, which lines and plans are to be chosen from, and the
//! objectives.

use crate::drive::CorneringMap;
use crate::drive::driver::{DriverTable, WheelTorque, cornering_of};
use crate::drive::kernel::{DriveState, DrivenLap, World};
use crate::drive::{DriverSettings, Line, Road};
use crate::error::{Error, Result};
use crate::evaluate::objectives::{listed, missing_or_twice, objectives};
use crate::evaluate::{FreeCar, Problem, Variable};
use crate::vehicle::{Car, CarParameter, TyreModel};

objectives! {
    /// What of a driven lap can be minimised.
    DriveObjective {
        /// Its time, s.
        LapTime: "lap_time_s", "s", "lap time";
        /// Greatest distance beyond an edge, m; below zero it is the least room left.
        Beyond: "beyond_m", "m", "distance beyond the edge";
        /// Mean rate at which the road wheels are turned, rad/s.
        Steering: "steering_radps", "rad/s", "steering rate";
    }
}

impl DriveObjective {
    /// The figure of a lap.
    pub fn of(self, lap: &DrivenLap) -> f64 {
        match self {
            Self::LapTime => lap.time_s,
            Self::Beyond => lap.beyond_m,
            Self::Steering => lap.steering_radps,
        }
    }
}

/// How laps are driven.
#[derive(Clone, Debug, PartialEq)]
pub struct DriveSettings {
    /// The driver; the pace is that of the plans.
    pub driver: DriverSettings,
    /// Integration step of the closed loop, s.
    pub step_s: f64,
    /// Distance beyond an edge (m) at which the lap is over. The edges are those of the lines' circuits.
    pub run_off_m: f64,
}

impl DriveSettings {
    /// Steps of a millisecond, and two metres of run-off.
    pub fn new(driver: DriverSettings) -> Self {
        Self {
            driver,
            step_s: 1e-3,
            run_off_m: 2.0,
        }
    }
}

/// Longest step of the closed loop, s: a sixth of the arms' and feet's time constants.
const LONGEST_STEP_S: f64 = 6e-3;
/// Shortest step, s.
const SHORTEST_STEP_S: f64 = 1e-4;
/// Figures of a candidate that kernels read beside its car: line, plan and share of the next plan.
pub const LAP_FIGURES: usize = 3;

/// Finding set-ups, lines and paces by driving them.
#[derive(Clone, Debug)]
pub struct DriveProblem {
    /// Variables and objectives. The car's parameters come first, then `line` (a whole number) if there are several, then
    /// `grip_share` if there are several plans.
    pub problem: Problem,
    /// The car and which of its parameters are free.
    pub free: FreeCar,
    road: Road<f64>,
    driver: DriverTable<f64>,
    torque: WheelTorque<f64>,
    cornering: CorneringMap<f64>,
    lines: usize,
    shares: Vec<f64>,
    pub(super) objectives: Vec<DriveObjective>,
}

impl DriveProblem {
    /// The problem of driving `car`, with parameters `free` between their bounds, round `lines`. Their plans are of these
    /// `shares` of grip, rising; between two of them speeds are in proportion.
    ///
    /// # Errors
    /// [`Error::Input`] as [`FreeCar::new`] and [`Road::new`], for shares that do not rise or fit the plans, for objectives
    /// that are missing or come twice, and for a step out of range.
    pub fn new(
        car: Car,
        free: Vec<(CarParameter, f64, f64)>,
        lines: &[Line<'_>],
        shares: &[f64],
        settings: &DriveSettings,
        objectives: &[DriveObjective],
    ) -> Result<Self> {
        let refuse = |place: &str, found: String, expected: &str| {
            Err(Error::input("the drive", place, found, expected))
        };
        if !(SHORTEST_STEP_S..=LONGEST_STEP_S).contains(&settings.step_s) {
            return refuse("step_s", settings.step_s.to_string(), "0.0001 to 0.006 s");
        }
        if !(0.0..=100.0).contains(&settings.run_off_m) {
            return refuse("run_off_m", settings.run_off_m.to_string(), "0 to 100 m");
        }
        let rising = shares.windows(2).all(|w| w[0] < w[1]) && shares.iter().all(|s| s.is_finite());
        if !rising || lines.iter().any(|l| l.plans.len() != shares.len()) {
            let found = format!("{shares:?}");
            return refuse("shares", found, "rising shares, one for each plan of a line");
        }
        if missing_or_twice(objectives) {
            let found = format!("{objectives:?}");
            return refuse("objectives", found, "at least one, each once");
        }
        let road = Road::new(lines, &settings.driver, settings.step_s)?;
        let driver = DriverTable::new(&settings.driver, &car, settings.step_s, settings.run_off_m);
        let torque = WheelTorque::of_car(&car)?;
        let cornering = cornering_of(&settings.driver, &car);
        let (free, mut variables) = FreeCar::new(car, free)?;
        if lines.len() > 1 {
            variables.push(Variable::whole("line", "-", 0, lines.len() as i32 - 1));
        }
        if shares.len() > 1 {
            let (least, most) = (shares[0], shares[shares.len() - 1]);
            variables.push(Variable::new("grip_share", "-", least, most));
        }
        Ok(Self {
            problem: Problem {
                variables,
                objectives: listed(objectives),
            },
            free,
            road,
            driver,
            torque,
            cornering,
            lines: lines.len(),
            shares: shares.to_vec(),
            objectives: objectives.to_vec(),
        })
    }

    /// Number of variables.
    pub fn dimensions(&self) -> usize {
        self.problem.variables.len()
    }

    /// The tyre model that the kernels must run.
    pub fn tyre_model(&self) -> TyreModel {
        self.free.tyre_model()
    }

    /// The lines and their plans.
    pub fn road(&self) -> &Road<f64> {
        &self.road
    }

    /// The driver's figures.
    pub fn driver(&self) -> &DriverTable<f64> {
        &self.driver
    }

    /// What the powertrain gives.
    pub fn torque(&self) -> &WheelTorque<f64> {
        &self.torque
    }

    /// What the driver takes the car's steady cornering for.
    pub fn cornering(&self) -> &CorneringMap<f64> {
        &self.cornering
    }

    /// What laps in `f64` share.
    pub fn world(&self) -> World<'_, f64> {
        World {
            road: &self.road,
            driver: &self.driver,
            torque: &self.torque,
            cornering: &self.cornering,
        }
    }

    /// The line of a candidate, its plan and the share of the next plan, the first two whole numbers.
    pub fn lap_figures(&self, candidate: &[f64]) -> [f64; LAP_FIGURES] {
        let mut rest = candidate[self.free.parameters.len()..].iter();
        let mut next = |there: bool| if there { rest.next().copied() } else { None };
        let line = next(self.lines > 1).map_or(0.0, |x| x.round().clamp(0.0, (self.lines - 1) as f64));
        let Some(wanted) = next(self.shares.len() > 1) else {
            return [line, 0.0, 0.0];
        };
        let shares = &self.shares;
        let plan = shares
            .partition_point(|s| *s <= wanted)
            .clamp(1, shares.len() - 1)
            - 1;
        let share = ((wanted - shares[plan]) / (shares[plan + 1] - shares[plan])).clamp(0.0, 1.0);
        [line, plan as f64, share]
    }

    /// The lap whose last state is given in the order of [`DriveState::to_array`].
    pub(super) fn lap(&self, state: [f64; crate::drive::kernel::STATE]) -> DrivenLap {
        DrivenLap::of_state(&DriveState::from_array(state), self.driver.step)
    }
}
