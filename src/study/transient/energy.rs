//! A hybrid's lap: the motor works where a lap of the study `hybrid` has it work, in the quasi-steady-state lap and in the driven
//! one, and both have accounts.

use super::drive::INTERVAL_S;
use super::{NamedLine, TransientSettings};
use crate::config::kinds::Choice;
use crate::drive::{Drive, SpeedPlan};
use crate::error::{Error, Result};
use crate::evaluate::energy::{HybridLine, HybridObjective, HybridProblem, Strategy};
use crate::line::energy::{
    DrivenLapEnergy, DrivenMoment, EnergyCar, EnergyLap, EnergyPlan, Gates, Mode, MotorPlan, SegmentEnergy,
    driven_energy, late_bend,
};
use crate::line::{FineLine, LapProfile, LineRelief, PointMass, read_columns};
use crate::report::{LapLine, LapView, Table};
use crate::study::hybrid::ReportedLap;
use crate::vehicle::aero::aero_forces;
use crate::vehicle::powertrain::GRAVITY_MPS2;
use crate::vehicle::wheels::Moment;
use crate::vehicle::{Car, Traction};
use serde::{Deserialize, Serialize};

/// Where the motor works, as a file says.
#[derive(Clone, Debug)]
pub struct Motor {
    /// The car with its energy, and with the charge that the lap of the file begins with.
    pub car: EnergyCar,
    /// Where it works.
    pub plan: MotorPlan,
    /// Whether it takes the engine's place or adds to it.
    pub mode: Mode,
}

impl Motor {
    /// Reads the lap that the settings name; nothing if they name none. The first of the lines is the one that it is of.
    ///
    /// # Errors
    /// [`Error::Input`] for a file that is no lap of the study `hybrid` or of another line, and for a car without a hybrid drive.
    pub(super) fn read(
        settings: &TransientSettings,
        car: &Car,
        limits: &PointMass,
        lines: &[NamedLine],
    ) -> Result<Option<Self>> {
        let (Some(path), Some(line)) = (&settings.deployment, lines.first()) else {
            return Ok(None);
        };
        let expected = "a lap of the study hybrid: columns station, v, time, motor_power and soc";
        let rows = read_columns(path, ["station", "v", "time", "motor_power", "soc"], expected)?;
        let own = |car: &Car| {
            let traction = Traction::of(car, &limits.envelope);
            EnergyCar::of(car.clone(), limits.clone(), traction)
        };
        let energy = own(car)?;
        let mut charged = car.clone();
        if let Some(hybrid) = &mut charged.hybrid {
            hybrid.store.start_soc = rows[0][4];
        }
        let after = |i: usize| rows[(i + 1) % rows.len()][1];
        let share = rows.iter().enumerate().map(|(i, [_, v, _, motor_kw, _])| {
            let mean = 0.5 * (v + after(i));
            let force_mps2 = 1e3 * motor_kw / (energy.table.mass * mean);
            let most = energy.greatest_motors_mps2((0.5 * (v * v + after(i).powi(2))).sqrt());
            (force_mps2 / most).clamp(0.0, 1.0)
        });
        let [station, v, time, ..] = rows[rows.len() - 1];
        let plan = MotorPlan {
            share: share.collect(),
            station_m: rows.iter().map(|row| row[0]).collect(),
            length_m: station + time * 0.5 * (v + rows[0][1]),
        };
        let rising = plan.station_m.windows(2).all(|pair| pair[0] < pair[1]);
        let length_m = line.circuit.length_m;
        let alike = (plan.length_m / length_m - 1.0).abs() < MOST_STRETCH;
        if !rising || plan.station_m[0] != 0.0 || !alike {
            let found = format!("{:.1} m", plan.length_m);
            let expected = format!(
                "rising stations from 0 of a lap on {}, {length_m:.1} m",
                line.name
            );
            return Err(Error::input(path, "station", found, expected));
        }
        Ok(Some(Self {
            car: own(&charged)?,
            plan: plan.stretched_to(length_m),
            mode: settings.deployment_mode,
        }))
    }

    /// The quasi-steady-state lap on a line within a share of the grip, whose limits are given.
    ///
    /// # Errors
    /// Those of [`EnergyCar::new`] and [`HybridProblem::new`].
    pub(super) fn ideal(
        &self,
        limits: &PointMass,
        traction: Traction,
        fine: &FineLine,
        drs: &[bool],
    ) -> Result<Ideal> {
        let car = EnergyCar::of(self.car.car.clone(), limits.clone(), traction)?;
        let n = fine.points_m.len();
        let ends = fine.station_m.iter().zip(&fine.segment_m);
        let shares = ends.map(|(start, h)| self.plan.mean(*start, start + h)).collect();
        // The store pays for all that the motor does.
        let gates = Gates {
            ax_mps2: -1e3,
            ..Gates::OPEN
        };
        let strategy = Strategy {
            shares,
            ..Strategy::fixed(gates, n)
        };
        let line = HybridLine::Fixed {
            points_m: fine.points_m.clone(),
            closed: true,
            drs: fine.drs_of(drs),
            surface: fine
                .relief
                .as_ref()
                .map_or(Vec::new(), |relief| relief.surface.clone()),
        };
        let plan = EnergyPlan::single(n, late_bend(&fine.curvature_1pm), self.mode);
        let problem = HybridProblem::new(line, car, plan, strategy, &[HybridObjective::LapTime], 0.0)?;
        let lap = ReportedLap::of("quasi-steady state", &problem, &[]);
        let car = problem.car().clone();
        let share = lap.segments.iter().map(|s| {
            let most = car.greatest_motors_mps2((0.5 * (s.start + s.end)).sqrt());
            (s.motor / most).min(1.0)
        });
        let plan = MotorPlan {
            share: share.collect(),
            station_m: fine.station_m.clone(),
            length_m: fine.length_m,
        };
        Ok(Ideal { car, lap, plan })
    }
}

/// Lines whose lengths differ by more than this are not one.
const MOST_STRETCH: f64 = 0.002;

/// The quasi-steady-state lap of a hybrid.
#[derive(Clone, Debug)]
pub struct Ideal {
    /// The car within its limits.
    pub car: EnergyCar,
    /// The lap.
    pub lap: ReportedLap,
    /// Where its motor works.
    pub plan: MotorPlan,
}

impl Ideal {
    /// The lap, section by section, and as speeds to drive at.
    pub(super) fn profile(&self, fine: &FineLine) -> (LapProfile, SpeedPlan) {
        let speed_squared: Vec<f64> = self.lap.segments.iter().map(|s| s.start).collect();
        let shape = (&fine.segment_m[..], &fine.curvature_1pm[..]);
        let lap = LapProfile::of_speeds(
            &self.car.point_mass,
            shape,
            fine.relief.as_ref(),
            &speed_squared,
            self.lap.lap.time,
            Vec::new(),
        );
        let plan = SpeedPlan::of_speeds(&lap.station_m, &lap.v_mps, fine.length_m);
        (lap, plan)
    }

    /// Torque of the motor at the driven wheels (N m) at a station (m) and a speed (m/s).
    pub(super) fn torque_nm(&self, station_m: f64, speed_mps: f64) -> f64 {
        let most = self.car.greatest_motors_mps2(speed_mps);
        self.plan.at(station_m) * most * self.car.table.mass * self.car.car.chassis.radius_rear
    }

    /// The accounts of the lap that was driven on a line.
    pub(super) fn accounts(&self, drive: &Drive, moments: &[Moment], line: &FineLine) -> DrivenLapEnergy {
        let length_m = line.length_m;
        let climb_mps2 = |station_m: f64| {
            let after = line.station_m.partition_point(|s| *s <= station_m);
            let sine = |relief: &LineRelief| relief.gradient[after.saturating_sub(1)];
            line.relief
                .as_ref()
                .map_or(0.0, |relief| GRAVITY_MPS2 * sine(relief))
        };
        let chassis = &self.car.car.chassis;
        let radii = [chassis.radius_front, chassis.radius_rear];
        let samples = drive.states.len();
        let moment = |i: usize, station_m: f64, time_s: f64| {
            let rims = drive.inputs[i].wheel_speed;
            let power = |k: usize| moments[i].wheels[k].longitudinal_n * rims[k] * radii[k / 2];
            DrivenMoment {
                time_s,
                station_m,
                speed_mps: drive.states[i][0],
                // A sensor on the car reads gravity, too.
                ax_mps2: moments[i].ax_mps2 - climb_mps2(station_m),
                climb_mps2: climb_mps2(station_m),
                wheels_w: [power(0) + power(1), power(2) + power(3)],
                drag_n: aero_forces(chassis, drive.states[i][0], drive.inputs[i].flap).drag,
            }
        };
        // From the start line to the first sample, and up to the line after the last one, which may lie beyond it.
        let first = moment(0, 0.0, (drive.station_m[0] / drive.states[0][0]).max(0.0));
        let along = (0..samples).map(|i| {
            let rest_s = (length_m - drive.station_m[i]) / drive.states[i][0];
            let most_s = if i + 1 < samples {
                INTERVAL_S
            } else {
                f64::INFINITY
            };
            moment(i, drive.station_m[i], rest_s.min(most_s).max(0.0))
        });
        let driven: Vec<DrivenMoment> = [first].into_iter().chain(along).collect();
        driven_energy(&self.car, &self.plan, &driven)
    }
}

/// The accounts of a lap.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Accounts {
    /// Time (s).
    pub lap_time_s: f64,
    /// Work of the engine at the wheels (MJ).
    pub engine_mj: f64,
    /// Work that moves the car along its way (MJ), where it is driven.
    pub moving_mj: f64,
    /// Work that is lost in the tyres (MJ), where the car is driven.
    pub tyres_mj: f64,
    /// Energy out of the store (MJ).
    pub deployed_mj: f64,
    /// Energy of the MGU-K into the store (MJ).
    pub harvested_k_mj: f64,
    /// Energy of the MGU-H into the store (MJ).
    pub harvested_h_mj: f64,
    /// State of charge at the end.
    pub soc_end: f64,
    /// Fuel (l).
    pub fuel_l: f64,
    /// Share of the lap's time with the motor on.
    pub motor_time_share: f64,
    /// What charge at the end, harvest and deployment do not balance by (J).
    pub balance_error_j: f64,
}

impl Accounts {
    fn of(
        car: &EnergyCar,
        lap: &EnergyLap<f64>,
        segments: &[SegmentEnergy<f64>],
        moving_j: Option<f64>,
    ) -> Self {
        let work = |of: fn(&SegmentEnergy<f64>) -> f64| {
            let along = |s: &SegmentEnergy<f64>| 0.5 * (s.start.sqrt() + s.end.sqrt()) * s.time;
            let each = segments.iter().map(|s| car.table.mass * of(s) * along(s));
            each.sum::<f64>()
        };
        let wheels_j = work(|s| s.engine + s.motor);
        let moving_j = moving_j.unwrap_or_else(|| work(|s| (s.engine + s.motor - s.lost).max(0.0)));
        Self {
            lap_time_s: lap.time,
            engine_mj: work(|s| s.engine) / 1e6,
            moving_mj: moving_j / 1e6,
            tyres_mj: (wheels_j - moving_j) / 1e6,
            deployed_mj: lap.deployed / 1e6,
            harvested_k_mj: lap.harvested_k / 1e6,
            harvested_h_mj: lap.harvested_h / 1e6,
            soc_end: car.hybrid.store.start_soc + lap.change / car.hybrid.store.capacity_j,
            fuel_l: lap.fuel / car.fuel_density_kgpl,
            motor_time_share: lap.motor_time / lap.time,
            balance_error_j: lap.change - ((lap.harvested_k + lap.harvested_h) - lap.deployed),
        }
    }
}

/// The accounts of a hybrid's lap, driven and in quasi-steady state.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct EnergyFigures {
    /// `offset` or `additional`.
    pub mode: String,
    /// The driven lap.
    pub driven: Accounts,
    /// The quasi-steady-state lap with the same share of the grip.
    pub quasi_steady_state: Accounts,
    /// How far the energy out of the store is above that of the quasi-steady-state lap (%),
    pub deployed_difference_percent: f64,
    /// that of the MGU-K into the store,
    pub harvested_k_difference_percent: f64,
    /// and the work that moves the car.
    pub moving_difference_percent: f64,
}

impl EnergyFigures {
    pub(super) fn of(mode: Mode, ideal: &Ideal, driven: &DrivenLapEnergy) -> Self {
        let own = Accounts::of(&ideal.car, &driven.lap, &driven.segments, Some(driven.moving_j));
        let quasi = Accounts::of(&ideal.car, &ideal.lap.lap, &ideal.lap.segments, None);
        let above = |of: fn(&Accounts) -> f64| {
            let (driven, quasi) = (of(&own), of(&quasi));
            if quasi == 0.0 {
                0.0
            } else {
                100.0 * (driven / quasi - 1.0)
            }
        };
        Self {
            mode: mode.name().to_owned(),
            deployed_difference_percent: above(|a| a.deployed_mj),
            harvested_k_difference_percent: above(|a| a.harvested_k_mj),
            moving_difference_percent: above(|a| a.moving_mj),
            driven: own,
            quasi_steady_state: quasi,
        }
    }

    /// The figures in words.
    pub(super) fn to_text(&self) -> String {
        let (own, quasi) = (&self.driven, &self.quasi_steady_state);
        format!(
            "Energy, driven (in quasi-steady state): {:.3} ({:.3}) MJ out of the store, {:.3} ({:.3}) MJ in by the MGU-K, {:.3} ({:.3}) \
             MJ by the MGU-H, charge {:.3} ({:.3}) at the end, {:.3} ({:.3}) l of fuel. {:.2} ({:.2}) MJ move the car, and its tyres lose \
             {:.2} ({:.2}) MJ; the books are off by {:.1e} J.\n",
            own.deployed_mj,
            quasi.deployed_mj,
            own.harvested_k_mj,
            quasi.harvested_k_mj,
            own.harvested_h_mj,
            quasi.harvested_h_mj,
            own.soc_end,
            quasi.soc_end,
            own.fuel_l,
            quasi.fuel_l,
            own.moving_mj,
            quasi.moving_mj,
            own.tyres_mj,
            quasi.tyres_mj,
            own.balance_error_j.abs()
        )
    }

    /// Both accounts as a table.
    pub(super) fn table(&self) -> Table<'static> {
        let laps = [
            ("driven", &self.driven),
            ("quasi-steady state", &self.quasi_steady_state),
        ];
        Table::rows(laps)
            .text("lap", |(name, _)| *name)
            .number("time", "s", |(_, a)| a.lap_time_s)
            .number("moves the car", "MJ", |(_, a)| a.moving_mj)
            .number("lost in tyres", "MJ", |(_, a)| a.tyres_mj)
            .number("engine at the wheels", "MJ", |(_, a)| a.engine_mj)
            .number("out", "MJ", |(_, a)| a.deployed_mj)
            .number("MGU-K in", "MJ", |(_, a)| a.harvested_k_mj)
            .number("MGU-H in", "MJ", |(_, a)| a.harvested_h_mj)
            .number("charge at the end", "-", |(_, a)| a.soc_end)
            .number("motor on", "% of time", |(_, a)| 100.0 * a.motor_time_share)
            .number("fuel", "l", |(_, a)| a.fuel_l)
            .number("balance error", "J", |(_, a)| a.balance_error_j)
            .table()
    }
}

/// Power at the wheels (kW) of a force over the mass.
fn power_kw(
    car: &EnergyCar,
    segments: &[SegmentEnergy<f64>],
    of: fn(&SegmentEnergy<f64>) -> f64,
) -> Vec<f64> {
    let power = |s: &SegmentEnergy<f64>| {
        let v = 0.5 * (s.start.sqrt() + s.end.sqrt());
        car.table.mass * of(s) * v / 1e3
    };
    segments.iter().map(power).collect()
}

/// State of charge at the start of each segment.
fn soc(car: &EnergyCar, segments: &[SegmentEnergy<f64>]) -> Vec<f64> {
    let store = &car.hybrid.store;
    let mut soc = store.start_soc;
    let along = segments.iter().map(|s| {
        let here = soc;
        soc += (s.harvested_k + s.harvested_h - s.deployed) / store.capacity_j;
        here
    });
    along.collect()
}

/// The columns of the accounts behind those of a drive.
pub(super) fn with_accounts<'a>(table: Table<'a>, ideal: &Ideal, driven: &DrivenLapEnergy) -> Table<'a> {
    let samples = &driven.segments[1..];
    let power = |of| power_kw(&ideal.car, samples, of);
    let sum = |of: fn(&SegmentEnergy<f64>) -> f64| samples.iter().map(of).collect::<Vec<f64>>();
    table
        .numbers("engine_power", "kW", power(|s| s.engine))
        .numbers("motor_power", "kW", power(|s| s.motor))
        .numbers("generator_power", "kW", power(|s| s.generator))
        .numbers("brake_power", "kW", power(|s| s.hydraulic))
        .numbers("deployed", "J", sum(|s| s.deployed))
        .numbers("harvested_k", "J", sum(|s| s.harvested_k))
        .numbers("harvested_h", "J", sum(|s| s.harvested_h))
        .numbers("soc", "-", soc(&ideal.car, &driven.segments).split_off(1))
        .numbers("fuel", "kg", sum(|s| s.fuel))
}

/// Powers and charge along both laps.
pub(super) fn view(ideal: &Ideal, driven: &DrivenLapEnergy, drive: &Drive) -> LapView {
    let line = |name: &str, x: &[f64], segments: &[SegmentEnergy<f64>]| {
        let samples = &segments[segments.len() - x.len()..];
        LapLine::new(name, x)
            .trace(0, power_kw(&ideal.car, samples, |s| s.engine))
            .trace(1, power_kw(&ideal.car, samples, |s| s.motor))
            .trace(2, power_kw(&ideal.car, samples, |s| s.generator))
            .trace(3, &soc(&ideal.car, segments)[segments.len() - x.len()..])
    };
    LapView::new("Energy")
        .note("Powers are at the wheels.")
        .x("distance along the line", "m")
        .panel("engine", "kW")
        .panel("motor", "kW")
        .panel("regeneration", "kW")
        .panel("state of charge", "")
        .lines([
            line("4DOF car and driver", &drive.station_m, &driven.segments),
            line(
                "quasi-steady-state lap",
                &ideal.lap.station_m,
                &ideal.lap.segments,
            ),
        ])
}
