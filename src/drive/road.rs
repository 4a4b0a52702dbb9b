//! Lines and their plans of speed as tables that every backend reads alike.

use super::plan::SpeedPlan;
use super::relief::row_of;
use super::settings::DriverSettings;
use crate::error::{Error, Result};
use crate::scalar::{Lookup, Real};
use crate::track::Circuit;
use crate::vehicle::model::GREATEST_SPEED;
use std::f64::consts::{PI, TAU};

/// How long before the start line the flying lap begins at the least, m.
const RUN_UP_M: f64 = 500.0;
/// The car does not turn yet where the run-up begins. So the plan may ask for no more than this lateral acceleration (m/s^2) there,
const CALM_MPS2: f64 = 3.0;
/// over this length, m.
const CALM_M: f64 = 30.0;
/// Least mean speed of a lap, m/s. Slower laps are not waited for.
const SLOWEST_MPS: f64 = 5.0;
/// Cells of a plan before its first cell, for the stretch just before the start line.
pub const FRONT_CELLS: usize = 2;
/// Half of the length over which a plan's acceleration is taken, m.
pub const PLAN_REACH_M: f64 = 2.0;
/// Whole numbers beyond this are not exact in `f32`.
const MOST_COUNTED: f64 = 16_777_216.0;
/// Least distance between samples of a path (m), so that no car passes two of them in one step.
const LEAST_SPACING_M: f64 = 0.25;

/// Figures of a row of the path's table.
pub const PATH_WIDTH: usize = 12;

/// Lines to drive, each with plans of speed of the same shares of grip.
///
/// The rows and cells after the end of a line repeat its beginning, as far as a driver looks ahead. Kernels therefore never wrap
/// an index.
#[derive(Clone, Debug, PartialEq)]
pub struct Road<S> {
    /// Rows of [`super::Row`] of all lines, one line after the other.
    pub path: Vec<S>,
    /// Rows of surfaces, one for each of the path; empty where all lines are level and dry.
    pub relief: Vec<S>,
    /// Planned speeds (m/s), line by line, share by share.
    pub plans: Vec<S>,
    /// A row of [`Course`] for each line.
    pub courses: Vec<S>,
    /// Plans of each line.
    pub plans_per_line: usize,
    /// The most rows that a driver looks ahead.
    pub rows_ahead: usize,
    /// The most cells that a driver looks ahead.
    pub cells_ahead: usize,
}

/// Where the run-up to a line begins (m): the last calm place that is far enough before the start line, or the calmest of all.
fn run_up_m(line: &Line<'_>) -> f64 {
    let circuit = line.circuit;
    let (count, spacing) = (circuit.station_m.len(), circuit.spacing_m());
    let latest_m = circuit.length_m - RUN_UP_M.min(0.4 * circuit.length_m);
    let latest = ((latest_m / spacing) as usize).min(count - 1);
    let across_mps2 = |row: usize| {
        let speed = |plan: &SpeedPlan| {
            let cell = (row as f64 * spacing / plan.spacing_m) as usize;
            plan.speed_mps[cell.min(plan.speed_mps.len() - 1)]
        };
        let fastest = line.plans.iter().map(speed).fold(0.0, f64::max);
        circuit.curvature_1pm[row].abs() * fastest * fastest
    };
    let mut calmest = (f64::INFINITY, latest);
    for row in (0..=latest).rev() {
        let along = row..=row + (CALM_M / spacing) as usize;
        let most = along.map(|i| across_mps2(i % count)).fold(0.0, f64::max);
        if most < calmest.0 {
            calmest = (most, row);
        }
        if most <= CALM_MPS2 {
            break;
        }
    }
    if calmest.1 == latest {
        latest_m
    } else {
        calmest.1 as f64 * spacing
    }
}

macro_rules! course {
    ($($(#[$doc:meta])* $field:ident),* $(,)?) => {
        /// Figures of a whole line. Twin of `Course` in `shaders/path.wgsl`.
        #[derive(Clone, Copy, Debug)]
        pub struct Course<R> {
            $($(#[$doc])* pub $field: R,)*
            /// The most rows that a driver looks ahead.
            pub rows_ahead: usize,
            /// The most cells that a driver looks ahead.
            pub cells_ahead: usize,
        }

        impl Course<f64> {
            /// Figures of a row, in order.
            pub const FIELDS: &'static [&'static str] = &[$(stringify!($field)),*];

            fn to_row(self) -> Vec<f64> {
                vec![$(self.$field),*]
            }
        }

        impl<R: Lookup> Course<R> {
            /// The course of this number, a whole one.
            #[inline(always)]
            pub fn at(road: &Road<R::Storage>, number: R) -> Self {
                let width = Course::FIELDS.len();
                let (place, _) = number.place(road.courses.len() / width, width);
                let mut column = 0;
                let mut next = || {
                    column += 1;
                    R::pick(&road.courses, place, column - 1)
                };
                Self {
                    $($field: next(),)*
                    rows_ahead: road.rows_ahead,
                    cells_ahead: road.cells_ahead,
                }
            }
        }
    };
}

course! {
    /// First row of the line in the table of paths. Like all counts here it is a whole number.
    path_at,
    /// Rows of the lap.
    rows,
    /// Distance between samples (m).
    spacing,
    /// One over the distance between samples (1/m).
    per_metre,
    /// The row in which the run-up begins.
    begin_row,
    /// Distance along the path from that row's sample to the start of the run-up (m).
    begin_along,
    /// Position of that start ahead of the row's sample (m).
    begin_x,
    /// Position of that start to the left of the sample (m).
    begin_y,
    /// The path's direction there (rad).
    begin_yaw,
    /// The first cell of the line's first plan.
    plan_at,
    /// Cells from one of its plans to the next.
    plan_stride,
    /// Cells per metre (1/m).
    cells_per_metre,
    /// Most steps of a lap; a lap that has not ended by then has taken too long.
    most_steps,
}

/// A line to drive: its path and edges, and plans of speed, one for each share of grip.
#[derive(Clone, Debug)]
pub struct Line<'a> {
    /// The path with its edges.
    pub circuit: &'a Circuit,
    /// The plans.
    pub plans: &'a [SpeedPlan],
}

impl Road<f64> {
    /// The tables of `lines` for steps of `step_s` by a driver with these settings.
    ///
    /// # Errors
    /// [`Error::Input`] for an open line, one whose samples are too close or that is too long to be counted, and for lines with
    /// different numbers of plans.
    pub fn new(lines: &[Line<'_>], driver: &DriverSettings, step_s: f64) -> Result<Self> {
        let refuse =
            |name: &str, found: String, expected: &str| Err(Error::input(name, "line", found, expected));
        let plans_per_line = lines.first().map_or(0, |l| l.plans.len());
        if plans_per_line == 0 {
            return refuse("the drive", "no line with a plan".to_owned(), "at least one");
        }
        let ahead_m = |seconds: f64| GREATEST_SPEED * seconds;
        let mut road = Self {
            path: Vec::new(),
            relief: Vec::new(),
            plans: Vec::new(),
            courses: Vec::new(),
            plans_per_line,
            rows_ahead: 0,
            cells_ahead: 0,
        };
        for line in lines {
            let circuit = line.circuit;
            let name = &circuit.name;
            if !circuit.closed {
                return refuse(
                    name,
                    "an open one".to_owned(),
                    "a closed one: the lap is a flying one",
                );
            }
            let spacing = circuit.spacing_m();
            if spacing < LEAST_SPACING_M {
                let found = format!("samples {spacing:.3} m apart");
                return refuse(name, found, "samples a quarter of a metre apart or more");
            }
            let shape = |plan: &SpeedPlan| (plan.speed_mps.len(), plan.spacing_m);
            let (cells, cell_m) = line.plans.first().map_or((0, 1.0), shape);
            let alike = line.plans.iter().all(|plan| shape(plan) == (cells, cell_m));
            if line.plans.len() != plans_per_line || !alike || cells < FRONT_CELLS || cell_m < LEAST_SPACING_M
            {
                let found = format!("{} plans, the first of {cells} cells", line.plans.len());
                return refuse(
                    name,
                    found,
                    "as many plans for each line, alike in length and spacing",
                );
            }
            let most_steps = 2.0 * circuit.length_m / SLOWEST_MPS / step_s;
            if most_steps > MOST_COUNTED {
                let found = format!("{:.0} m", circuit.length_m);
                let most_m = MOST_COUNTED * step_s * SLOWEST_MPS / 2.0;
                return refuse(
                    name,
                    found,
                    &format!("at most {most_m:.0} m in steps of {step_s} s"),
                );
            }
            road.rows_ahead = road
                .rows_ahead
                .max((ahead_m(driver.furthest_s()) / spacing) as usize + 2);
            road.cells_ahead = road.cells_ahead.max(
                ((ahead_m(driver.plan_ahead_s.max(driver.speed_ahead_s)) + PLAN_REACH_M) / cell_m) as usize
                    + FRONT_CELLS
                    + 2,
            );
        }
        let hilly = lines.iter().any(|line| line.circuit.relief.is_some());
        for line in lines {
            road.push(line, step_s, hilly);
        }
        let most = (road.path.len() / PATH_WIDTH).max(road.plans.len());
        if most as f64 > MOST_COUNTED {
            return refuse(
                "the drive",
                format!("{most} rows of plans"),
                "fewer lines and shares",
            );
        }
        Ok(road)
    }

    fn push(&mut self, line: &Line<'_>, step_s: f64, hilly: bool) {
        let circuit = line.circuit;
        let (count, spacing) = (circuit.station_m.len(), circuit.spacing_m());
        let cell_m = line.plans[0].spacing_m;
        let cells = line.plans[0].speed_mps.len();
        let path_at = self.path.len() / PATH_WIDTH;
        for i in 0..count + self.rows_ahead + 1 {
            let (here, next) = (i % count, (i + 1) % count);
            let away = circuit.centreline_m[next] - circuit.centreline_m[here];
            let (sin, cos) = circuit.heading_rad[here].sin_cos();
            let turn = (circuit.heading_rad[next] - circuit.heading_rad[here] + PI).rem_euclid(TAU) - PI;
            let curvature = &circuit.curvature_1pm;
            let (left, right) = (&circuit.width_left_m, &circuit.width_right_m);
            let cell = (here as f64 * spacing / cell_m).min(cells as f64);
            let row: [f64; PATH_WIDTH] = [
                curvature[here],
                (curvature[next] - curvature[here]) / spacing,
                away.x * cos + away.y * sin,
                away.y * cos - away.x * sin,
                turn,
                left[here],
                left[next] - left[here],
                right[here],
                right[next] - right[here],
                cell.floor(),
                cell - cell.floor(),
                f64::from(u8::from(circuit.drs_at((here as f64 + 0.5) * spacing))),
            ];
            self.path.extend(row);
            if hilly {
                self.relief.extend(row_of(circuit, here));
            }
        }
        let plan_at = self.plans.len();
        for plan in line.plans {
            let padded = FRONT_CELLS + cells + self.cells_ahead + 1;
            self.plans
                .extend((0..padded).map(|i| plan.speed_mps[(i + cells - FRONT_CELLS) % cells]));
        }
        let plan_stride = (self.plans.len() - plan_at) / line.plans.len();
        let begin = run_up_m(line);
        let begin_row = ((begin / spacing) as usize).min(count - 1);
        let origin = circuit.centreline_m[begin_row];
        let (sin, cos) = circuit.heading_rad[begin_row].sin_cos();
        let away = circuit.position_at(begin) - origin;
        let course = Course {
            path_at: path_at as f64,
            rows: count as f64,
            spacing,
            per_metre: 1.0 / spacing,
            begin_row: begin_row as f64,
            begin_along: begin - begin_row as f64 * spacing,
            begin_x: away.x * cos + away.y * sin,
            begin_y: away.y * cos - away.x * sin,
            begin_yaw: circuit.heading_at(begin) - circuit.heading_rad[begin_row],
            plan_at: plan_at as f64,
            plan_stride: plan_stride as f64,
            cells_per_metre: 1.0 / cell_m,
            most_steps: (2.0 * circuit.length_m / SLOWEST_MPS / step_s).floor(),
            rows_ahead: 0,
            cells_ahead: 0,
        };
        self.courses.extend(course.to_row());
    }

    /// The tables in the precision that the scalar `R` stores tables in.
    pub fn stored<R: Real>(&self) -> Road<R::Storage> {
        let all = |table: &[f64]| table.iter().map(|x| R::store(*x)).collect();
        Road {
            path: all(&self.path),
            relief: all(&self.relief),
            plans: all(&self.plans),
            courses: all(&self.courses),
            plans_per_line: self.plans_per_line,
            rows_ahead: self.rows_ahead,
            cells_ahead: self.cells_ahead,
        }
    }
}
