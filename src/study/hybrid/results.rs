//! What a hybrid study leaves behind: figures for people and scripts, laps, pictures.

mod figures;
mod page;

pub(super) use page::write as write_page;

use super::{
    FoundStrategy, Hybrid, HybridSetup, Outcome, ReportedLap, Sizing, StintLap, correlation, mean_worths,
};
use crate::config::kinds::Choice;
use crate::error::Result;
use crate::files::stem;
use crate::line::energy::SegmentEnergy;
use crate::report::Table;
use crate::study::framework::{Head, Solved};
use figures::power_kw;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;

/// The figures of a scenario.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct ScenarioFigures {
    /// `offset` or `additional`.
    pub mode: String,
    /// Energy out of the store (MJ).
    pub deployed_mj: f64,
    /// Energy of the MGU-K into the store (MJ).
    pub harvested_k_mj: f64,
    /// Energy of the MGU-H into the store (MJ).
    pub harvested_h_mj: f64,
    /// State of charge at the end.
    pub soc_end: f64,
    /// Greatest state of charge along the lap.
    pub soc_greatest: f64,
    /// Fuel (l).
    pub fuel_l: f64,
    /// Share of the lap's time with the motor on.
    pub motor_time_share: f64,
    /// Share of the lap's time with the generator on.
    pub generator_time_share: f64,
    /// Time (s).
    pub lap_time_s: f64,
    /// Time by the same gates with the motor adding to the engine (s).
    pub additional_lap_time_s: f64,
    /// Energy out of the store then (MJ).
    pub additional_deployed_mj: f64,
    /// What charge at the end, harvest and deployment do not balance by (J).
    pub balance_error_j: f64,
    /// Least state of charge along the lap.
    #[serde(default)]
    pub soc_least: f64,
    /// Energy out of the store less what went in (MJ).
    #[serde(default)]
    pub net_deployed_mj: f64,
    /// Fuel as a share of that of the engine alone (%).
    #[serde(default)]
    pub fuel_percent: f64,
}

/// What a further search found.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct SearchFigures {
    /// `offset` or `additional`.
    pub mode: String,
    /// Time (s).
    pub lap_time_s: f64,
    /// Fuel (l).
    pub fuel_l: f64,
    /// Fuel as a share of that of the engine alone (%).
    pub fuel_percent: f64,
    /// Energy out of the store (MJ).
    pub deployed_mj: f64,
    /// State of charge at the end.
    pub soc_end: f64,
    /// Share of the lap's time with the motor on.
    pub motor_time_share: f64,
    /// Laps evaluated.
    pub evaluations: u64,
    /// The gates, or the share of each zone.
    pub variables: BTreeMap<String, f64>,
}

impl SearchFigures {
    fn of(outcome: &Outcome, found: &FoundStrategy) -> Self {
        let (setup, lap) = (&outcome.setup, &found.lap.lap);
        Self {
            mode: found.lap.mode.name().to_owned(),
            lap_time_s: lap.time,
            fuel_l: lap.fuel / setup.car.fuel_density_kgpl,
            fuel_percent: 100.0 * lap.fuel / outcome.engine.lap.fuel,
            deployed_mj: lap.deployed / 1e6,
            soc_end: found.lap.soc(lap.change),
            motor_time_share: lap.motor_time / lap.time,
            evaluations: found.evaluations,
            variables: found.names.iter().cloned().zip(found.shares.clone()).collect(),
        }
    }
}

/// A stretch of the lap on which the motor works.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Site {
    /// Station of its start (m).
    pub start_m: f64,
    /// Station of its end (m), before its start if it passes the start line.
    pub end_m: f64,
    /// Energy out of the store (MJ).
    pub deployed_mj: f64,
    /// Share of all that leaves the store in the lap: its allocation factor.
    pub allocation: f64,
}

/// The sites of a lap, in their order.
fn sites(lap: &ReportedLap, closed: bool) -> Vec<Site> {
    let (n, total) = (lap.segments.len(), lap.lap.deployed);
    let end_of = |i: usize| lap.station_m[i] + lap.length_m[i];
    let mut sites: Vec<Site> = Vec::new();
    let mut working = false;
    for (i, segment) in lap.segments.iter().enumerate() {
        let works = segment.deployed > 0.0;
        if works {
            if !working {
                sites.push(Site {
                    start_m: lap.station_m[i],
                    end_m: 0.0,
                    deployed_mj: 0.0,
                    allocation: 0.0,
                });
            }
            if let Some(site) = sites.last_mut() {
                site.end_m = end_of(i);
                site.deployed_mj += segment.deployed / 1e6;
                site.allocation += segment.deployed / total;
            }
        }
        working = works;
    }
    let passes = closed && sites.len() > 1 && working && lap.segments[0].deployed > 0.0 && n > 1;
    if passes && let Some(last) = sites.pop() {
        let first = &mut sites[0];
        first.start_m = last.start_m;
        first.deployed_mj += last.deployed_mj;
        first.allocation += last.allocation;
    }
    sites
}

impl ScenarioFigures {
    fn of(outcome: &Outcome, own: &ReportedLap, additional: &ReportedLap) -> Self {
        let (setup, lap) = (&outcome.setup, &own.lap);
        let changes = own.change_j();
        let greatest = changes.iter().copied().fold(0.0, f64::max);
        let least = changes.into_iter().fold(0.0, f64::min);
        let generating = own.segments.iter().filter(|s| s.generator > 0.0).map(|s| s.time);
        Self {
            mode: own.mode.name().to_owned(),
            deployed_mj: lap.deployed / 1e6,
            harvested_k_mj: lap.harvested_k / 1e6,
            harvested_h_mj: lap.harvested_h / 1e6,
            soc_end: own.soc(lap.change),
            soc_greatest: own.soc(greatest),
            fuel_l: lap.fuel / setup.car.fuel_density_kgpl,
            motor_time_share: lap.motor_time / lap.time,
            generator_time_share: generating.sum::<f64>() / lap.time,
            lap_time_s: lap.time,
            additional_lap_time_s: additional.lap.time,
            additional_deployed_mj: additional.lap.deployed / 1e6,
            balance_error_j: own.balance_error_j(),
            soc_least: own.soc(least),
            net_deployed_mj: (lap.deployed - lap.harvested_k - lap.harvested_h) / 1e6,
            fuel_percent: 100.0 * lap.fuel / outcome.engine.lap.fuel,
        }
    }
}

/// A point of the front of time against energy.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct FrontFigures {
    /// Energy that may leave the store (MJ).
    pub energy_mj: f64,
    /// Energy that did (MJ).
    pub deployed_mj: f64,
    /// Time of the reference optimum (s).
    pub lap_time_s: f64,
}

/// The deployment of the study's energy.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct DeploymentFigures {
    /// Energy that may leave the store (MJ).
    pub energy_mj: f64,
    /// Time of the reference optimum (s).
    pub exact_lap_time_s: f64,
    /// Energy that it uses (MJ).
    pub exact_deployed_mj: f64,
    /// How its solver ended.
    pub exact_status: String,
    /// Cone programs solved.
    pub exact_programs: usize,
    /// The last program's bound on the time, to first order (s); `null` where it has none.
    pub exact_bound_s: Option<f64>,
    /// Time that the solver took (s).
    pub exact_elapsed_s: f64,
    /// Time of the swarm's lap (s).
    pub swarm_lap_time_s: f64,
    /// Energy that it uses (MJ).
    pub swarm_deployed_mj: f64,
    /// How much slower than the reference optimum it is (s).
    pub swarm_above_exact_s: f64,
    /// What the swarm's deployment gains on the engine alone (s).
    pub gain_s: f64,
    /// Zones that the swarm shares the energy out over.
    pub zones: usize,
    /// The energy that an endless store is used for (MJ): no greater budget binds.
    pub binds_up_to_mj: f64,
    /// Time against energy, by the reference optimum.
    pub front: Vec<FrontFigures>,
    /// Laps on the swarm's front between the study's objectives.
    pub swarm_front_size: Option<usize>,
    /// Correlation of what a joule buys with the speed at which it is deployed, over the stretches of the lap on which the
    /// motor is of use; `null` for too few.
    pub worth_speed_correlation: Option<f64>,
    /// What a megajoule buys by itself on the mean (s), where the swarm deploys,
    pub worth_taken_s_per_mj: Option<f64>,
    /// and where it does not.
    pub worth_left_s_per_mj: Option<f64>,
    /// Where the swarm deploys.
    #[serde(default)]
    pub sites: Vec<Site>,
}

/// The figures of a study; `--json` prints this.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct HybridSummary {
    /// The study; its rate is that of the swarms.
    #[serde(flatten)]
    pub head: Head,
    /// The line.
    pub line: String,
    /// Its length (m).
    pub length_m: f64,
    /// What the rules allow to be deployed on this lap (MJ); `null` without a limit.
    pub rules_deployed_mj: Option<f64>,
    /// Time of the engine alone (s).
    pub engine_lap_time_s: f64,
    /// Fuel of the engine alone (l).
    pub engine_fuel_l: f64,
    /// The scenarios.
    pub scenarios: BTreeMap<String, ScenarioFigures>,
    /// The deployment of the study's energy.
    pub deployment: Option<DeploymentFigures>,
    /// The further searches, by their names: `offset_zones`, `additional_gates`, `offset_gates`.
    #[serde(default)]
    pub searches: BTreeMap<String, SearchFigures>,
    /// The laps of a stint.
    pub stint: Vec<StintLap>,
    /// Motors with which the car laps in the time asked for.
    pub sizing: Vec<Sizing>,
    /// Whether the accounts let the charge pass one, as published ones do.
    #[serde(default)]
    pub store_overflow: bool,
    /// What a reader must know before believing the figures.
    pub warnings: Vec<String>,
}

/// Puts the figures together.
pub(super) fn summarise(solved: &Solved<'_, Hybrid>) -> HybridSummary {
    let outcome = solved.outcome;
    let setup = &outcome.setup;
    let figures = outcome.scenarios.iter();
    let figures = figures.map(|s| ScenarioFigures::of(outcome, &s.own, &s.additional));
    let names = outcome.scenarios.iter().map(|s| s.own.name.clone());
    let scenarios: BTreeMap<String, ScenarioFigures> = names.zip(figures).collect();
    let mut warnings = setup.raceline.surface_notes();
    if setup.car.hybrid.store.overflow {
        warnings
            .push("store_overflow: the accounts let the charge pass one, as published ones do".to_owned());
    }
    let rules = setup.car.hybrid.rules.deployed_on(setup.length_m);
    let rules = rules.map(|j| j / 1e6);
    for (name, s) in &scenarios {
        if let Some(most) = rules.filter(|most| s.deployed_mj > most + 1e-9) {
            warnings.push(format!(
                "{name}: {:.2} MJ deployed, which the rules hold to {most:.2} MJ",
                s.deployed_mj
            ));
        }
        if s.soc_end < 0.0 {
            warnings.push(format!(
                "{name}: the charge of the store falls to {:.3}: the store is too small",
                s.soc_end
            ));
        }
        if s.soc_greatest > 1.0 + 1e-9 {
            warnings.push(format!(
                "{name}: the charge reaches {:.3} of the store: the store is too small",
                s.soc_greatest
            ));
        }
    }
    HybridSummary {
        head: solved.head(),
        line: setup.line_name.clone(),
        length_m: setup.length_m,
        rules_deployed_mj: rules,
        engine_lap_time_s: outcome.engine.lap.time,
        engine_fuel_l: outcome.engine.lap.fuel / setup.car.fuel_density_kgpl,
        scenarios,
        deployment: outcome.optimised.as_ref().map(|o| DeploymentFigures {
            energy_mj: o.budget_j / 1e6,
            exact_lap_time_s: o.exact.lap.time,
            exact_deployed_mj: o.exact.lap.deployed / 1e6,
            exact_status: o.exact.status.to_string(),
            exact_programs: o.exact.programs,
            exact_bound_s: o.exact.bound_s,
            exact_elapsed_s: o.exact.seconds,
            swarm_lap_time_s: o.swarm.lap.lap.time,
            swarm_deployed_mj: o.swarm.lap.lap.deployed / 1e6,
            swarm_above_exact_s: o.swarm.lap.lap.time - o.exact.lap.time,
            gain_s: outcome.engine.lap.time - o.swarm.lap.lap.time,
            zones: o.swarm.shares.len(),
            binds_up_to_mj: o.unbound_j / 1e6,
            front: o.front.clone(),
            swarm_front_size: o.swarm_front.as_ref().map(|f| f.objectives.len()),
            worth_speed_correlation: correlation(&o.worth),
            worth_taken_s_per_mj: mean_worths(&o.worth)[0],
            worth_left_s_per_mj: mean_worths(&o.worth)[1],
            sites: sites(&o.swarm.lap, setup.closed),
        }),
        searches: outcome
            .optimised
            .iter()
            .flat_map(|o| &o.further)
            .map(|found| (stem(&found.lap.name), SearchFigures::of(outcome, found)))
            .collect(),
        stint: outcome.stint.clone(),
        sizing: outcome.sizing.clone(),
        store_overflow: setup.car.hybrid.store.overflow,
        warnings,
    }
}

impl HybridSummary {
    /// The figures in words.
    pub fn to_text(&self) -> String {
        let mut text = format!(
            "{}, {} line of {:.0} m: {:.3} s and {:.3} l by the engine alone\n",
            self.head.subject.words(),
            self.line,
            self.length_m,
            self.engine_lap_time_s,
            self.engine_fuel_l
        );
        if !self.scenarios.is_empty() {
            text += &page::scenarios_table(self).first(10).to_text();
        }
        if let Some(d) = &self.deployment {
            text += &format!(
                "{:.2} MJ beside the engine: swarm {:.3} s with {:.3} MJ over {} zones, reference optimum {:.3} s with {:.3} MJ; \
                 {:.3} s gained\nNo more than {:.2} MJ are of use. Time against energy:\n",
                d.energy_mj,
                d.swarm_lap_time_s,
                d.swarm_deployed_mj,
                d.zones,
                d.exact_lap_time_s,
                d.exact_deployed_mj,
                d.gain_s,
                d.binds_up_to_mj
            );
            for p in &d.front {
                text += &format!("{:>8.2} MJ{:>10.3} s\n", p.energy_mj, p.lap_time_s);
            }
            if let (Some(taken), Some(left), Some(with)) = (
                d.worth_taken_s_per_mj,
                d.worth_left_s_per_mj,
                d.worth_speed_correlation,
            ) {
                text += &format!(
                    "A megajoule by itself buys {taken:.2} s where the swarm deploys and {left:.2} s where it does not \
                     (correlation with speed {with:.2})\n"
                );
            }
        }
        if !self.searches.is_empty() {
            text += &page::searches_table(self).to_text();
        }
        if !self.stint.is_empty() {
            text += &page::stint_table(&self.stint).to_text();
        }
        for sizing in &self.sizing {
            text += &(sizing_in_words(sizing) + "\n");
        }
        let record = &self.head.record;
        if record.evaluations_per_s.is_finite() {
            text += &format!(
                "{} laps evaluated ({:.0} per second) on {}\n",
                record.evaluations,
                record.evaluations_per_s,
                record.device()
            );
        }
        text + &record.ending("Laps", &self.warnings)
    }
}

/// What a motor of a power does for a lap time, in words.
fn sizing_in_words(s: &Sizing) -> String {
    let Some(mj) = s.energy_mj else {
        let (power, time) = (s.power_kw, s.lap_time_s);
        return format!("A motor of {power:.0} kW is not enough: {time:.3} s at best.");
    };
    let saved = match (s.engine_share, s.fuel_saving_l) {
        (Some(share), Some(saving)) => format!(
            ", {saving:.3} l less than a car without a motor whose engine has {share:.3} times the power and that laps as fast"
        ),
        _ => String::new(),
    };
    format!(
        "A motor of {:.0} kW with {mj:.2} MJ a lap, {:.2} MJ of them harvested, and a store of {:.2} MJ laps in {:.3} s (exact \
         deployment {:.3} s) with {:.3} l{saved}.",
        s.power_kw,
        s.harvested_mj,
        s.store_mj,
        s.lap_time_s,
        s.exact_lap_time_s.unwrap_or(s.lap_time_s),
        s.fuel_l
    )
}

/// The laps that a study tells of.
fn reported_laps(outcome: &Outcome) -> Vec<&ReportedLap> {
    let mut laps = vec![&outcome.engine];
    laps.extend(outcome.scenarios.iter().map(|s| &s.own));
    if let Some(o) = &outcome.optimised {
        laps.extend([&o.exact_lap, &o.swarm.lap]);
        laps.extend(o.further.iter().map(|found| &found.lap));
    }
    laps
}

/// Writes the car, the line, laps and the front into `folder`.
///
/// # Errors
/// [`crate::Error::Io`] if one cannot be written.
pub(super) fn write_files(folder: &Path, solved: &Solved<'_, Hybrid>) -> Result<()> {
    let (settings, outcome) = (solved.settings, solved.outcome);
    let setup = &outcome.setup;
    setup.car.car.write(folder, "car")?;
    let (x, y): (Vec<f64>, Vec<f64>) = setup.points_m.iter().map(|p| (p.x, p.y)).unzip();
    let line = Table::new().numbers("x", "m", x).numbers("y", "m", y);
    line.write_csv(folder.join("line.csv"))?;
    for lap in reported_laps(outcome) {
        write_lap(&folder.join(format!("lap_{}.csv", stem(&lap.name))), setup, lap)?;
    }
    if let Some(front) = outcome.optimised.as_ref().and_then(|o| o.swarm_front.as_ref()) {
        let rows = front.objectives.iter().zip(&front.candidates);
        let objectives = settings.objectives.iter().map(|o| (o.name(), o.unit()));
        let variables = front.names.iter().map(|name| (name.as_str(), "-"));
        let table = Table::rows(rows.map(|(objectives, candidate)| [&objectives[..], candidate].concat()));
        let table = table.each(objectives.chain(variables)).table();
        table.write_csv(folder.join("front.csv"))?;
    }
    Ok(())
}

/// A lap, segment by segment: place, speed, powers at the wheels, energies, charge, fuel; on a road that is not level and dry also
/// height, sine of the gradient and friction.
fn write_lap(path: &Path, setup: &HybridSetup, lap: &ReportedLap) -> Result<()> {
    let each = |f: fn(&SegmentEnergy<f64>) -> f64| lap.segments.iter().map(f).collect::<Vec<f64>>();
    let power = |f: fn(&SegmentEnergy<f64>) -> f64| power_kw(setup, lap, f);
    let change_j = lap.change_j();
    let soc = change_j[..lap.segments.len()].iter().map(|c| lap.soc(*c));
    let table = Table::new()
        .numbers("station", "m", &lap.station_m)
        .numbers("v", "m/s", each(|s| s.start.sqrt()))
        .numbers("time", "s", each(|s| s.time))
        .numbers("engine_power", "kW", power(|s| s.engine))
        .numbers("motor_power", "kW", power(|s| s.motor))
        .numbers("generator_power", "kW", power(|s| s.generator))
        .numbers("brake_power", "kW", power(|s| s.hydraulic))
        .numbers("load", "-", each(|s| s.load))
        .numbers("deployed", "J", each(|s| s.deployed))
        .numbers("harvested_k", "J", each(|s| s.harvested_k))
        .numbers("harvested_h", "J", each(|s| s.harvested_h))
        .numbers("soc", "-", soc.collect::<Vec<f64>>())
        .numbers("fuel", "kg", each(|s| s.fuel));
    if setup.surface.is_empty() {
        return table.write_csv(path);
    }
    let own = setup.surface.iter().take(lap.segments.len());
    let surface = |k: usize| own.clone().map(|surface| surface[k]).collect::<Vec<f64>>();
    table
        .numbers("height", "m", surface(0))
        .numbers("gradient", "-", &lap.gradient)
        .numbers("friction", "-", surface(2))
        .write_csv(path)
}
