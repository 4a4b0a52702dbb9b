//! What a drive leaves behind.

use super::corners::CornerGrip;
use super::drive::{DrivenLine, INTERVAL_S, keeps_up};
use super::energy::{self, EnergyFigures};
use crate::drive::Drive;
use crate::error::Result;
use crate::line::energy::{DrivenLapEnergy, Mode};
use crate::line::{ON_ROAD_M, PointMass};
use crate::report::{CornerLap, HtmlReport, LapLine, LapView, Road, Table, write_whole};
use crate::study::framework::{Head, tyre_view, with_tyres};
use crate::study::raceline::best_gears;
use crate::track::Circuit;
use crate::vehicle::wheels::{Moment, moments_under};
use crate::vehicle::{Car, CarState};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Rows of the traces, from the top.
const PANELS: [(&str, &str); 5] = [
    ("speed", "m/s"),
    ("off the line", "m"),
    ("steering", "rad"),
    ("yaw rate", "rad/s"),
    ("lateral speed", "m/s"),
];

/// What pages call the lap beside the driven one.
const IDEAL: &str = "quasi-steady-state lap";

/// The figures of one line alone; `--json` prints this.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct LineSummary {
    /// The study: the drive is in `f64`, candidates are laps, and no random numbers are drawn.
    #[serde(flatten)]
    pub head: Head,
    /// The greatest share of the envelope's grip that was held on the whole lap.
    pub grip_share: f64,
    /// The driven lap (s).
    pub lap_time_s: f64,
    /// The quasi-steady-state lap on the same line with the shares of the grip that were held (s).
    pub point_mass_lap_time_s: f64,
    /// How far the driven lap is off that (%).
    pub disagreement_percent: f64,
    /// Whether that is within what is asked for.
    pub agrees: bool,
    /// By what the lap was chosen among those with other shares of the grip.
    pub rule: String,
    /// Least room between the car's side and an edge (m).
    pub margin_m: f64,
    /// Greatest distance of the car from the line (m).
    pub greatest_offset_m: f64,
    /// How much the driver steers against an angle to the path (rad per rad): that with which the lap is fastest.
    pub heading_gain: f64,
    /// What became of the car at the least share that failed.
    pub beyond: Option<String>,
    /// What limits the result, in words.
    pub warnings: Vec<String>,
    /// The share that was held in each corner, and the time there.
    pub corners: Vec<CornerGrip>,
    /// The quasi-steady-state lap on the same line with all of the grip (s).
    pub full_grip_lap_time_s: Option<f64>,
    /// How far the driven lap is behind that (%).
    pub behind_full_grip_percent: Option<f64>,
    /// The accounts of a hybrid's lap.
    #[serde(default)]
    pub energy: Option<EnergyFigures>,
}

impl LineSummary {
    pub(super) fn of(head: Head, outcome: &DrivenLine, energy: Option<EnergyFigures>) -> Self {
        let agrees = keeps_up(outcome.disagreement());
        let rule = if agrees {
            "the greatest share of the grip at which the driven lap is half a percent behind the quasi-steady-state lap at most"
        } else {
            "the fastest driven lap, for with every share of the grip it is more than half a percent behind the quasi-steady-state lap"
        };
        Self {
            head,
            grip_share: outcome.grip_share,
            lap_time_s: outcome.lap_time_s,
            point_mass_lap_time_s: outcome.point_mass.lap_time_s().unwrap_or(f64::NAN),
            disagreement_percent: 100.0 * outcome.disagreement(),
            agrees,
            rule: rule.to_owned(),
            margin_m: outcome.margin_m,
            greatest_offset_m: outcome.drive.offset_m.iter().fold(0.0, |a, b| a.max(b.abs())),
            heading_gain: outcome.driver.heading_gain,
            beyond: outcome.failures.last().map(|(_, why)| why.clone()),
            warnings: off_road(&outcome.line).into_iter().collect(),
            corners: outcome.corners.clone(),
            full_grip_lap_time_s: outcome.full_grip_s,
            behind_full_grip_percent: outcome
                .full_grip_s
                .map(|full| 100.0 * (outcome.lap_time_s / full - 1.0)),
            energy,
        }
    }

    /// The figures in words.
    pub fn to_text(&self) -> String {
        let beyond = self.beyond.as_ref().map_or(String::new(), |why| {
            format!("With more on the whole lap {why}.\n")
        });
        let shares = self.corners.iter().map(|corner| 100.0 * corner.grip_share);
        let [least, most] = shares.fold([f64::INFINITY, 0.0f64], |[a, b], share| {
            [a.min(share), b.max(share)]
        });
        let by_corner = if least < most {
            format!(" on the whole lap, and {least:.0} to {most:.0}% corner by corner")
        } else {
            String::new()
        };
        let all = self.full_grip_lap_time_s.zip(self.behind_full_grip_percent);
        let all = all.map_or(String::new(), |(full_s, behind)| {
            format!("With all of the grip it takes {full_s:.3} s: the car is {behind:.2}% behind.\n")
        });
        format!(
            "{} drives the line in {:.3} s, with {:.0}% of the envelope's grip{by_corner}; the quasi-steady-state lap with as much takes \
             {:.3} s ({:+.2}%{}).\n{all}{beyond}Chosen: {}.\nAt most {:.2} m off the line; {:.2} m left between the car's side and the edge.\n\
             The driver steers {:.1} rad against each rad off the path.\n",
            self.head.subject.car,
            self.lap_time_s,
            100.0 * self.grip_share,
            self.point_mass_lap_time_s,
            self.disagreement_percent,
            if self.agrees {
                ""
            } else {
                ", more than the half percent asked for"
            },
            self.rule,
            self.greatest_offset_m,
            self.margin_m,
            self.heading_gain
        ) + &self.energy.as_ref().map_or(String::new(), EnergyFigures::to_text)
            + &self
                .warnings
                .iter()
                .map(|warning| format!("Note: {warning}.\n"))
                .collect::<String>()
    }
}

/// A word on a line that is itself off the road: the driver follows it as far as the edges allow.
fn off_road(line: &Circuit) -> Option<String> {
    let rooms = line
        .width_left_m
        .iter()
        .zip(&line.width_right_m)
        .map(|(left, right)| left.min(*right));
    let (at, least) = rooms.enumerate().min_by(|a, b| a.1.total_cmp(&b.1))?;
    (least < -ON_ROAD_M).then(|| {
        format!(
            "the line itself leaves the car's side {:.2} m beyond an edge at station {:.0} m: the car has to leave the line there",
            -least, line.station_m[at]
        )
    })
}

/// The corners as a table.
fn corners(summary: &LineSummary) -> Table<'_> {
    Table::rows(summary.corners.iter().enumerate())
        .number("corner", "", |(k, _)| (k + 1) as f64)
        .number("from", "m", |(_, c)| c.start_m)
        .number("to", "m", |(_, c)| c.end_m)
        .number("least speed", "m/s", |(_, c)| c.least_speed_mps)
        .number("grip held", "%", |(_, c)| 100.0 * c.grip_share)
        .number("driven", "s", |(_, c)| c.driven_s)
        .number("lost to all of the grip", "s", |(_, c)| {
            c.driven_s - c.full_grip_s
        })
        .table()
}

/// Writes `drive.csv`, `corners.csv`, `envelope_driven.csv`, `speeds.svg`, `map.svg`, `energy.svg` of a hybrid, and `report.html`.
///
/// # Errors
/// [`crate::Error::Io`] if a file cannot be written.
pub(super) fn report(
    folder: &Path,
    (car, limits): (&Car, &PointMass),
    outcome: &DrivenLine,
    summary: &LineSummary,
) -> Result<()> {
    let envelope = outcome.envelope.to_csv();
    write_whole(folder.join("envelope_driven.csv"), envelope.as_bytes())?;
    if !summary.corners.is_empty() {
        corners(summary).write_csv(folder.join("corners.csv"))?;
    }
    let drive = &outcome.drive;
    let state = |k: usize| -> Vec<f64> { drive.states.iter().map(|s| s[k]).collect() };
    let driven_m = drive.points_m(&outcome.line);
    let (x, y): (Vec<f64>, Vec<f64>) = driven_m.iter().map(|p| (p.x, p.y)).unzip();
    let steer: Vec<f64> = drive.inputs.iter().map(|input| input.steer).collect();
    let time = (0..drive.states.len()).map(|i| i as f64 * INTERVAL_S);
    let moments = moments(car, drive);
    let driven = accounts(outcome, &moments);
    let table = Table::new()
        .numbers("time", "s", time.collect::<Vec<f64>>())
        .numbers("station", "m", &drive.station_m)
        .numbers("offset", "m", &drive.offset_m)
        .numbers("x", "m", x)
        .numbers("y", "m", y)
        .numbers("vx", "m/s", state(0))
        .numbers("vy", "m/s", state(1))
        .numbers("yaw_rate", "rad/s", state(2))
        .numbers("roll", "rad", state(3))
        .numbers("steering", "rad", steer)
        .numbers("grip_used", "-", grip_used(limits, drive, &moments));
    let table = match gears(car, &state(0)) {
        Some(gear) => table.numbers("gear", "-", gear),
        None => table,
    };
    let table = match driven.as_ref().zip(outcome.ideal.as_ref()) {
        Some((driven, ideal)) => energy::with_accounts(table, ideal, driven),
        None => table,
    };
    let moments: Vec<_> = moments.into_iter().map(Some).collect();
    with_tyres(table, &moments).write_csv(folder.join("drive.csv"))?;
    write_page(
        folder,
        (car, limits),
        outcome,
        summary,
        (&moments, driven.as_ref()),
    )
}

/// The accounts of a hybrid's lap; nothing of another car's.
fn accounts(outcome: &DrivenLine, moments: &[Moment]) -> Option<DrivenLapEnergy> {
    let ideal = outcome.ideal.as_ref()?;
    Some(ideal.accounts(&outcome.drive, moments, &outcome.point_mass))
}

/// The figures of the accounts of a hybrid's lap.
pub(super) fn energy_of(car: &Car, mode: Mode, outcome: &DrivenLine) -> Option<EnergyFigures> {
    let ideal = outcome.ideal.as_ref()?;
    let driven = accounts(outcome, &moments(car, &outcome.drive))?;
    Some(EnergyFigures::of(mode, ideal, &driven))
}

/// What each wheel of the car does at each sample of a drive.
pub(super) fn moments(car: &Car, drive: &Drive) -> Vec<Moment> {
    let driven = drive.states.iter().zip(&drive.inputs);
    let driven = driven.map(|(state, input)| (CarState::from_array(*state), *input));
    moments_under(car, &driven.collect::<Vec<_>>(), &drive.loads_mps2)
}

/// A drive of a line: its traces on a page, and its rows in tables by corner.
pub(super) fn lap_of<'a>(
    name: &'a str,
    (car, limits): (&Car, &PointMass),
    drive: &Drive,
    line: &Circuit,
) -> (LapLine, Option<CornerLap<'a>>) {
    let state = |k: usize| drive.states.iter().map(|s| s[k]).collect::<Vec<f64>>();
    let steer = drive.inputs.iter().map(|input| input.steer);
    let traces = LapLine::new(name, &drive.station_m[..])
        .trace(0, state(0))
        .trace(1, &drive.offset_m[..])
        .trace(2, steer.collect::<Vec<f64>>())
        .trace(3, state(2))
        .trace(4, state(1))
        .at(drive.points_m(line));
    let moments = moments(car, drive);
    let ay: Vec<f64> = moments.iter().map(|moment| moment.ay_mps2).collect();
    let corners = CornerLap::new(name, &drive.station_m, &state(0), &ay, 1.0);
    let corners = corners.map(|corners| {
        let used = grip_used(limits, drive, &moments);
        with_gears(corners.grip_used(&used), car, &state(0))
    });
    (traces, corners)
}

fn with_gears<'a>(corners: CornerLap<'a>, car: &Car, v_mps: &[f64]) -> CornerLap<'a> {
    match gears(car, v_mps) {
        Some(gear) => corners.gears(&gear),
        None => corners,
    }
}

/// Places laps of one line on a page: traces and a map, which go into `speeds.svg` and `map.svg` too, and a table by corner.
pub(super) fn place_laps(
    page: &mut HtmlReport,
    folder: &Path,
    (title, map): (&str, String),
    line: &Circuit,
    (traces, corners): (Vec<LapLine>, Vec<CornerLap<'_>>),
) -> Result<()> {
    let view = LapView::new(title)
        .note("Of the road, the map shows what the middle of the car may use. Positive is to the left.")
        .x("distance along the line", "m")
        .panels(PANELS)
        .lines(traces)
        .road(Road {
            left_edge_m: line.left_edge(),
            right_edge_m: line.right_edge(),
            closed: true,
            names: Vec::new(),
        });
    page.figure(folder.join("speeds.svg"), &view)?;
    if let Some(map) = view.track_map(map) {
        map.write_svg(folder.join("map.svg"))?;
    }
    page.corners(&corners, &[])
}

/// The gear that gives most (from 1) at each speed (m/s), of a car with a gearbox.
fn gears(car: &Car, v_mps: &[f64]) -> Option<Vec<f64>> {
    let powertrain = car.powertrain.as_ref()?;
    Some(best_gears(powertrain, car.chassis.radius_rear, v_mps))
}

/// The share of all of the grip that the driven lap uses at each sample.
fn grip_used(limits: &PointMass, drive: &Drive, moments: &[Moment]) -> Vec<f64> {
    let places = drive.states.iter().zip(moments).enumerate();
    let used = places.map(|(i, (state, moment))| match drive.loads_mps2.get(i) {
        Some(load) => {
            let friction = drive.inputs[i].friction.unwrap_or(1.0);
            limits.grip_used_under(state[0], [moment.ax_mps2, moment.ay_mps2, *load, friction])
        }
        None => limits.grip_used(state[0], [moment.ax_mps2, moment.ay_mps2]),
    });
    used.collect()
}

fn write_page(
    folder: &Path,
    (driver_car, limits): (&Car, &PointMass),
    outcome: &DrivenLine,
    summary: &LineSummary,
    (moments, accounts): (&[Option<Moment>], Option<&DrivenLapEnergy>),
) -> Result<()> {
    let car = &summary.head.subject.car;
    let mut page = HtmlReport::new(&summary.head.study, &format!("A line driven by the {car}"));
    for sentence in summary.to_text().lines() {
        page.sentence(sentence);
    }
    page.tile("Driven lap", format!("{:.3}", summary.lap_time_s), "s");
    let point_mass_s = format!("{:.3}", summary.point_mass_lap_time_s);
    page.tile("Quasi-steady-state lap", point_mass_s, "s");
    page.tile("Grip held", format!("{:.0}", 100.0 * summary.grip_share), "%");
    page.tile("Least room", format!("{:.2}", summary.margin_m), "m");
    for warning in &summary.warnings {
        page.warning(warning);
    }
    if !summary.agrees {
        page.warning("The driven lap is behind by more than half a percent.");
    }
    let drive = &outcome.drive;
    let (driven, by_corner) = lap_of("4DOF car and driver", (driver_car, limits), drive, &outcome.line);
    let ideal = outcome.point_mass.lap.as_ref();
    let ideal_line = ideal.map(|lap| {
        LapLine::new(IDEAL, &lap.station_m[..])
            .trace(0, &lap.v_mps[..])
            .at(&outcome.point_mass.points_m[..])
    });
    let ideal_by_corner = ideal.and_then(|lap| {
        let length = lap.station_m.len().min(lap.v_mps.len());
        let corners = CornerLap::new(IDEAL, &lap.station_m[..length], &lap.v_mps, &lap.ay_mps2, 1.0)?;
        Some(with_gears(
            corners.grip_used(&lap.grip_used(limits)),
            driver_car,
            &lap.v_mps,
        ))
    });
    page.section("Lap", "");
    let laps = (
        [driven].into_iter().chain(ideal_line).collect(),
        by_corner.into_iter().chain(ideal_by_corner).collect(),
    );
    let titles = (
        "The line, driven",
        format!("Driven in {:.2} s", outcome.lap_time_s),
    );
    place_laps(&mut page, folder, titles, &outcome.line, laps)?;
    if !summary.corners.is_empty() {
        let note = "Each from one greatest speed to the next, or to where the lap turns over to the other side. Lost is the time to the quasi-steady-state lap with all of the grip.";
        page.table("Grip by corner", note, &corners(summary))?;
    }
    if let (Some(figures), Some(driven), Some(ideal)) = (&summary.energy, accounts, &outcome.ideal) {
        let note = "The motor works at the same places of both laps. The driven car's wheels slip, and its tyres drag in bends.";
        page.section("Energy", "");
        let view = energy::view(ideal, driven, drive);
        page.figure(folder.join("energy.svg"), &view)?;
        page.table("Accounts", note, &figures.table())?;
    }
    page.section("Tyres", "");
    page.place(&tyre_view(&drive.station_m, moments))?;
    page.provenance("car", car);
    summary.head.record.provenance(&mut page, "laps driven");
    page.write(folder.join("report.html"))
}
