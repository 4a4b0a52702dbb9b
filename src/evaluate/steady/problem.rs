//! Problems of steady-state cornering: which parameters are free, the bounds of speed and steering, and the objectives.

use super::kernel::{INTEGRATED, SettlePlan, Settling, ending};
use super::modes::{displaced, slopes};
use crate::error::{Error, Result};
use crate::evaluate::objectives::{listed, missing_or_twice, objectives};
use crate::evaluate::{Failure, FreeCar, Problem, Variable};
use crate::vehicle::aero::aero_forces;
use crate::vehicle::{Car, CarParameter, Chassis, Trim, TyreModel};

objectives! {
    /// What of a trim can be minimised.
    SteadyObjective {
        /// Lateral acceleration with its sign changed (m/s^2), so that the least is the most to the left.
        Cornering: "minus_ay_mps2", "m/s^2", "lateral acceleration to the right";
        /// Sideslip angle, either way (rad).
        Sideslip: "sideslip_rad", "rad", "sideslip";
        /// Yaw rate, either way (rad/s).
        YawRate: "yaw_rate_radps", "rad/s", "yaw rate";
        /// Roll angle, either way (rad).
        Roll: "roll_rad", "rad", "roll";
        /// Slip ratio of the driven wheels, either way.
        SlipRatio: "slip_ratio", "-", "slip ratio";
    }
}

impl SteadyObjective {
    /// The figure of a trim.
    pub fn of(self, trim: &Settled) -> f64 {
        match self {
            Self::Cornering => -trim.ay_mps2,
            Self::Sideslip => trim.sideslip_rad.abs(),
            Self::YawRate => trim.yaw_rate_radps.abs(),
            Self::Roll => trim.roll_rad.abs(),
            Self::SlipRatio => trim.slip_ratio.abs(),
        }
    }
}

/// A car that has settled; the figures mean what those of [`crate::vehicle::Trim`] do.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settled {
    /// Lateral acceleration across the path (m/s^2).
    pub ay_mps2: f64,
    /// Sideslip angle (rad).
    pub sideslip_rad: f64,
    /// Yaw rate (rad/s).
    pub yaw_rate_radps: f64,
    /// Roll angle (rad).
    pub roll_rad: f64,
    /// Slip ratio of the driven rear wheels.
    pub slip_ratio: f64,
    /// The greatest acceleration that a trim has none of (m/s^2).
    pub residual_mps2: f64,
}

/// Greatest residual of a car that has settled (m/s^2). Single precision leaves up to 1e-5 of the loads of each force (the
/// layer of steps of [`crate::parity`]): 2e-4 m/s^2 of 20, which roll and yaw, light for their height and length, double; this is
/// ten times as much. What it leaves open of lateral acceleration is as little, by the stiffness of the trim: 0.03 % of 15 m/s^2.
pub const SETTLED: f64 = 5e-3;
/// Slowest and greatest speed that may be asked for (m/s).
pub(super) const SPEEDS: [f64; 2] = [3.0, 160.0];
/// Greatest steering angle that may be asked for (rad).
const GREATEST_STEER: f64 = 0.6;
/// Figures of a candidate that kernels read beside its car: speed and steering.
pub const AIM_FIGURES: usize = 2;

/// Cars in steady-state cornering.
#[derive(Clone, Debug)]
pub struct SteadyProblem {
    /// Variables and objectives. The car's parameters come first, then `speed_mps` and `steer_rad`.
    pub problem: Problem,
    /// The car and which of its parameters are free.
    pub free: FreeCar,
    plan: SettlePlan<f64>,
    pub(super) objectives: Vec<SteadyObjective>,
}

impl SteadyProblem {
    /// The problem of `car`, with parameters `free` between their bounds, at path speeds (m/s) and under angles of the front
    /// road wheels (rad) between these bounds.
    ///
    /// # Errors
    /// [`Error::Input`] as [`FreeCar::new`], for bounds out of range, and for objectives that are missing or come twice.
    pub fn new(
        car: Car,
        free: Vec<(CarParameter, f64, f64)>,
        speeds: [f64; 2],
        steers: [f64; 2],
        objectives: &[SteadyObjective],
    ) -> Result<Self> {
        let refuse = |place: &str, found: String, expected: String| {
            Err(Error::input("the steady states", place, found, expected))
        };
        let within =
            |[low, high]: [f64; 2], [least, most]: [f64; 2]| least <= low && low <= high && high <= most;
        if !within(speeds, SPEEDS) {
            let expected = format!("rising bounds of {} to {} m/s", SPEEDS[0], SPEEDS[1]);
            return refuse("speed_mps", format!("{speeds:?}"), expected);
        }
        if !within(steers, [-GREATEST_STEER, GREATEST_STEER]) {
            let expected = format!("rising bounds of -{GREATEST_STEER} to {GREATEST_STEER} rad");
            return refuse("steer_rad", format!("{steers:?}"), expected);
        }
        if missing_or_twice(objectives) {
            let found = format!("{objectives:?}");
            return refuse("objectives", found, "at least one, each once".to_owned());
        }
        let (free, mut variables) = FreeCar::new(car, free)?;
        variables.push(Variable::new("speed_mps", "m/s", speeds[0], speeds[1]));
        variables.push(Variable::new("steer_rad", "rad", steers[0], steers[1]));
        Ok(Self {
            plan: SettlePlan::new(&free, &variables),
            problem: Problem {
                variables,
                objectives: listed(objectives),
            },
            free,
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

    /// How candidates are brought to settle.
    pub fn plan(&self) -> &SettlePlan<f64> {
        &self.plan
    }

    /// Speed (m/s) and steering (rad) of a candidate.
    pub fn aim_figures(&self, candidate: &[f64]) -> [f64; AIM_FIGURES] {
        let first = self.free.parameters.len();
        [candidate[first], candidate[first + 1]]
    }

    /// What a candidate's last state comes to.
    ///
    /// # Errors
    /// Why it is in no trim.
    pub fn settled(&self, candidate: &[f64], state: &Settling<f64>) -> std::result::Result<Settled, Failure> {
        if state.ending == ending::OFF_THE_ENVELOPE {
            return Err(Failure::OffTheEnvelope);
        }
        if state.ending != ending::SETTLING {
            return Err(Failure::Spun);
        }
        if state.residual.is_nan() || state.residual >= SETTLED {
            return Err(Failure::Unsettled);
        }
        let [speed, _] = self.aim_figures(candidate);
        let [vy, yaw_rate, roll, _, _, slip] = state.figures;
        Ok(Settled {
            ay_mps2: speed * yaw_rate,
            sideslip_rad: (vy / speed).asin(),
            yaw_rate_radps: yaw_rate,
            roll_rad: roll,
            slip_ratio: slip,
            residual_mps2: state.residual,
        })
    }

    /// The most by which lateral acceleration (m/s^2) of a settled car differs from that of the trim with these figures. `None` if
    /// nothing holds the car in that trim.
    pub fn left_open(&self, candidate: &[f64], figures: [f64; INTEGRATED]) -> Option<f64> {
        let flat = self.free.flat(candidate);
        let c = Chassis::from_flat(&flat);
        let [speed, steer] = self.aim_figures(candidate);
        let gain = self.plan.gain;
        // The rates of change of figures, each as great as the residual lets it be.
        let off = [
            SETTLED,
            SETTLED / (c.cg_to_front + c.cg_to_rear),
            SETTLED * c.mass * c.cg_height / c.roll_damping,
            SETTLED / c.cg_height,
            SETTLED / c.pitch_lag,
            SETTLED * gain,
        ];
        let slopes = slopes((self.tyre_model(), &flat), gain, (speed, steer), figures);
        Some(speed * displaced(&slopes, &off)?[1])
    }

    /// The same of the car itself in a trim at `speed` (m/s), for problems without free parameters.
    pub fn left_open_at(&self, speed: f64, trim: &Trim) -> Option<f64> {
        let chassis = &self.free.car.chassis;
        let (vx, vy) = (speed * trim.sideslip_rad.cos(), speed * trim.sideslip_rad.sin());
        let drag = aero_forces(chassis, vx, 0.0).drag / chassis.mass;
        let figures = [
            vy,
            trim.yaw_rate_radps,
            trim.roll_rad,
            0.0,
            -vy * trim.yaw_rate_radps - drag,
            trim.slip_ratio,
        ];
        self.left_open(&[speed, trim.steer_rad], figures)
    }
}
