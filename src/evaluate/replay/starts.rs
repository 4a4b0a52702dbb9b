//! Where windows start: in the state in which a car itself comes there, sideslip and roll with it, which no log has.

use super::kernel::{CHANNELS, drive_window};
use super::plan::{Window, initial_state};
use super::problem::ReplayProblem;
use crate::vehicle::tyre::Tyre;
use crate::vehicle::{CarModel, LinearTyre, MagicFormula, TyreModel};
use rayon::prelude::*;

/// How far ahead of a window a car is driven to find the state in which it comes there, s.
const RUN_AHEAD_S: f64 = 6.0;
/// A car is believed that comes to a window with its speed off by this share at most, and its yaw rate by this much (rad/s) and
/// this share.
const SPEED_OFF: f64 = 0.1;
const YAW_RATE_OFF: [f64; 2] = [0.1, 0.3];

impl ReplayProblem {
    /// Starts every window in the state in which the car of this flat form comes there from six seconds ahead. A window starts at
    /// the logged speed and yaw rate, with nothing else moving, where the log has nothing ahead of it or the car goes elsewhere.
    pub fn start_as_driven_by(&mut self, flat: &[f64]) {
        let starts = match self.tyre_model() {
            TyreModel::MagicFormula => starts::<MagicFormula<f64>>(self, flat),
            TyreModel::Linear => starts::<LinearTyre<f64>>(self, flat),
        };
        for (window, start) in self.plan.windows.iter_mut().zip(starts) {
            window.initial = start;
        }
    }
}

fn starts<T: Tyre<f64>>(replay: &ReplayProblem, flat: &[f64]) -> Vec<[f64; 6]> {
    let plan = &replay.plan;
    let car = CarModel::<f64, T>::from_parameters(flat);
    let reach = (RUN_AHEAD_S / replay.interval_s).round() as usize;
    let start = |window: &Window<f64>| {
        let logged = initial_state(&plan.samples[window.start]);
        let mut ahead = plan.samples[..window.start].iter().rev().take(reach);
        let slow = ahead.position(|s| s.measured[0] < replay.slowest_mps);
        let run_up = slow.unwrap_or(window.start.min(reach));
        if run_up == 0 {
            return logged;
        }
        let begin = window.start - run_up;
        let before = Window {
            start: begin,
            end: window.start + 1,
            scored_from: 0,
            initial: initial_state(&plan.samples[begin]),
        };
        let (drives, state) = drive_window(&car, plan, &before, |_: usize, _: [f64; CHANNELS]| {});
        let own = state.to_array();
        let with_the_log = (own[0] - logged[0]).abs() <= SPEED_OFF * logged[0]
            && (own[2] - logged[2]).abs() <= YAW_RATE_OFF[0] + YAW_RATE_OFF[1] * logged[2].abs();
        if drives && with_the_log { own } else { logged }
    };
    plan.windows.par_iter().map(start).collect()
}
