//! The deployment of a motor's energy that saves most time on a fixed line.
//!
//! Speeds squared and what the motors add to the acceleration of each segment are the unknowns: the energy is linear in the latter,
//! and what the tyres still transmit bounds it. The lap time is a convex function of the speeds squared, and braking bounds them from
//! above whatever the motors do. The MGU-H's motor has its own price: it is used after the MGU-K, so that the energy stays convex. Only
//! the acceleration by engine, tyres and motors is not linear. It is linearised about the last lap in a sequence of cone programs, which
//! leads to the optimum; after each program the full lap is computed. After S. Ebbesen, M. Salazar, P. Elbert, C. Bussi and C. H. Onder, *Time-optimal control strategies for a
//! hybrid electric race car*, IEEE Trans. Control Syst. Technol. 26, 2018.

use super::conic::{Affine, ConicProgram, Status};
use crate::error::{Error, Result};
use crate::evaluate::energy::{HybridObjective, HybridProblem, Strategy};
use crate::line::energy::kernel::motors_step;
use crate::line::energy::{EnergyCar, EnergyLap, EnergyPlan, Gates, Mode};
use crate::line::ground::{Grounds, LevelRoad, SlopedRoad};
use crate::line::kernel::{Course, may_open};
use crate::scalar::bisected;
use crate::track::Surface;
use glam::DVec2;
use rayon::prelude::*;
use std::time::Instant;

/// The best deployment of an energy.
#[derive(Clone, Debug)]
pub struct Deployment {
    /// The motor's share of its force in each segment.
    pub shares: Vec<f64>,
    /// The lap.
    pub lap: EnergyLap<f64>,
    /// How the search ended: solved if a step over the whole range of the shares promises no more from here.
    pub status: Status,
    /// Programs solved.
    pub programs: usize,
    /// The last program's bound on the time (s): to first order about the previous lap no lap is faster. `None` if no program was
    /// solved well enough.
    pub bound_s: Option<f64>,
    /// Elapsed time (s).
    pub seconds: f64,
}

/// The line and the car of a search for deployments.
pub struct DeploymentSearch<'a> {
    /// The car.
    pub car: &'a EnergyCar,
    /// Points of the line (m).
    pub points_m: &'a [DVec2],
    /// Whether the line is closed.
    pub closed: bool,
    /// Whether the DRS may be open from each point to the next; nowhere if empty.
    pub drs: &'a [bool],
    /// The surface at each point; empty on a level and dry road.
    pub surface: &'a [Surface],
    /// A slow section late in the lap.
    pub run_in: usize,
    /// Greatest speed at the start of an open line (m/s).
    pub entry_mps: f64,
}

/// Programs at most.
const PROGRAMS: usize = 30;
/// Gain of time below which the search ends (s), well below the resolution of lap times.
const GAIN_S: f64 = 2e-5;
/// Time (s) that a step may still promise where the search counts as solved: the resolution of lap times.
const SOLVED_S: f64 = 1e-3;
/// Greatest change of the motor's part in the first program, as a share of the most it can be.
const FIRST_MOVE: f64 = 1.0;
/// Unit of speeds squared in the programs (m^2/s^2), so that all unknowns are about one.
const SQUARE: f64 = 1000.0;
/// Step of the derivatives by the speed squared, as a share of it.
const DERIVATIVE: f64 = 1e-4;
/// Least speed squared about which that share is taken (m^2/s^2): a car may start from a standstill.
const LEAST_SQUARE: f64 = 1.0;
/// Motor's part of the acceleration (m/s^2) below which a segment has no use for it.
const LEAST_MOTOR: f64 = 1e-9;
/// A move below which a small gain settles nothing.
const SMALL_MOVE: f64 = 0.05;
/// Energy of a lap that may deploy as much as it wants to (J).
const UNBOUND_J: f64 = 1e12;
/// How near a lap comes to the energy that it is to spend, as a share of it,
const SPENT: f64 = 1e-6;
/// and in how many rounds at the most.
const ROUNDS: usize = 6;

/// A segment about the last lap.
struct Linear {
    /// Speed squared at the end at the last speed and motor's part, and its derivatives by both.
    reached: f64,
    by_square: f64,
    by_motor: f64,
    /// The motor's part of the acceleration (m/s^2).
    motor: f64,
    /// The most that it can be, and its derivative by the speed squared.
    most: f64,
    most_by_square: f64,
    /// The most of it by the MGU-K, and its derivative by the speed squared.
    own: f64,
    own_by_square: f64,
    /// Energy for each m/s^2 of it (J), and what each costs more that the MGU-H adds.
    cost: f64,
    extra: f64,
}

impl DeploymentSearch<'_> {
    /// The lap with these shares of the motor's force, segment by segment, within a budget (J), without harvest.
    fn problem(&self, energy_j: f64) -> Result<HybridProblem> {
        let n = self.points_m.len();
        let gates = Gates {
            ax_mps2: -1e3,
            soc: -1e6,
            energy_mj: energy_j / 1e6,
            ..Gates::OPEN
        };
        HybridProblem::new(
            crate::evaluate::energy::HybridLine::Fixed {
                points_m: self.points_m.to_vec(),
                closed: self.closed,
                drs: self.drs.to_vec(),
                surface: self.surface.to_vec(),
            },
            self.car.clone(),
            EnergyPlan::single(n, self.run_in, Mode::Additional),
            Strategy {
                free: (0..n).map(crate::evaluate::energy::Free::Zone).collect(),
                ..Strategy::fixed(gates, n)
            },
            &[HybridObjective::LapTime],
            self.entry_mps,
        )
    }

    /// The fastest lap with no more than `energy_j` out of the store, started from `shares`.
    ///
    /// # Errors
    /// [`Error::Input`] for a line, energy or start out of range; [`Error::Study`] if the solver refuses.
    pub fn best(&self, energy_j: f64, start: Option<&[f64]>) -> Result<Deployment> {
        let began = Instant::now();
        if !(0.0..=1e12).contains(&energy_j) {
            return Err(Error::input(
                "deployment",
                "energy",
                format!("{energy_j} J"),
                "0 or more",
            ));
        }
        let (problem, unbound) = (self.problem(energy_j)?, self.problem(UNBOUND_J)?);
        let n = self.points_m.len();
        let mut shares = start.map_or_else(|| vec![0.0; n], <[f64]>::to_vec);
        if shares.len() != n || !shares.iter().all(|share| (0.0..=1.0).contains(share)) {
            let found = format!("{} shares", shares.len());
            let expected = format!("{n} shares from 0 to 1, one for each point of the line");
            return Err(Error::input("deployment", "start", found, expected));
        }
        let (mut lap, mut segments, mut course) = problem.lap(&shares);
        let mut status = Status::Solved;
        let mut bound_s = None;
        let (mut programs, mut reach) = (0, FIRST_MOVE);
        let mut settled = false;
        // Without energy there is nothing to share out.
        let mut judged = energy_j <= 0.0;
        while !judged {
            settled |= programs == PROGRAMS;
            if settled {
                // Small steps promise little: the last one judges, over the whole range of the shares.
                reach = FIRST_MOVE;
            }
            let squares: Vec<f64> = segments.iter().map(|s| s.start).collect();
            let linear: Vec<Linear> = (0..segments.len())
                .into_par_iter()
                .map(|i| self.linear(&course, i, squares[i], shares[i]))
                .collect();
            let program = Program {
                closed: self.closed,
                length: &course.length,
                most: &course.speed_squared,
                squares: &squares,
                end: segments.last().map_or(0.0, |s| s.end),
                linear: &linear,
                assists: self.car.table.assists,
                energy_j,
                reach,
            };
            let (found, bound, ended) = program.solve()?;
            programs += 1;
            let failed = matches!(ended, Status::Failed(_));
            if settled {
                let promised_s = lap.time - bound;
                status = if failed || promised_s <= SOLVED_S {
                    ended
                } else {
                    Status::Almost(format!("a step that promises {promised_s:.4} s does not keep it"))
                };
                judged = true;
                continue;
            }
            let asked = self.spending(energy_j, &unbound, &course, &linear, &found, &shares);
            let tried = problem.lap(&asked);
            let gain = lap.time - tried.0.time;
            if !failed && gain > 0.0 {
                shares = asked;
                (lap, segments, course) = tried;
                bound_s = Some(bound).filter(|b| b.is_finite());
                settled = gain < GAIN_S && reach > SMALL_MOVE;
                reach = (2.0 * reach).min(FIRST_MOVE);
            } else {
                // The linear model holds near the last lap only.
                reach *= 0.4;
                settled = reach < 1e-3;
            }
        }
        Ok(Deployment {
            shares,
            lap,
            status,
            programs,
            bound_s,
            seconds: began.elapsed().as_secs_f64(),
        })
    }

    /// The speed squared at the end of segment `i`, the part of the acceleration there (m/s^2) by the motors, and the MGU-H's part of
    /// it.
    fn step(&self, course: &Course<f64>, i: usize, square: f64, share: f64) -> [f64; 3] {
        if course.relief.is_empty() {
            self.step_on::<LevelRoad>(course, i, square, share)
        } else {
            self.step_on::<SlopedRoad>(course, i, square, share)
        }
    }

    /// [`Self::step`] on one kind of road.
    fn step_on<G: Grounds<f64>>(&self, course: &Course<f64>, i: usize, square: f64, share: f64) -> [f64; 3] {
        let next = (i + 1) % course.curvature.len();
        let bends = [i, next].map(|section| G::at(course, section, i));
        motors_step(
            &self.car.envelope_table,
            &self.car.table,
            square,
            course.length[i],
            (bends, may_open(self.drs, i)),
            share,
        )
    }

    fn linear(&self, course: &Course<f64>, i: usize, square: f64, share: f64) -> Linear {
        let step = |square: f64, share: f64| self.step(course, i, square, share);
        let [reached, motor, _] = step(square, share);
        let around = DERIVATIVE * square.max(LEAST_SQUARE);
        let (below, above) = ((square - around).max(0.0), square + around);
        let slopes = |share: f64| {
            let (low, high) = (step(below, share), step(above, share));
            [0, 1, 2].map(|k| (high[k] - low[k]) / (above - below))
        };
        let (none, all) = (step(square, 0.0), step(square, 1.0));
        let by_motor = if all[1] > LEAST_MOTOR {
            (all[0] - none[0]) / all[1]
        } else {
            0.0
        };
        let [reached_by_square, motor_by_square, _] = slopes(share);
        let [_, most_by_square, assist_by_square] = slopes(1.0);
        let table = &self.car.table;
        Linear {
            reached,
            // A greater speed at the start never gives a smaller one at the end. At the limit of grip a finite step may suggest
            // so; a program would then slow down, and the next lap would not.
            by_square: (reached_by_square - by_motor * motor_by_square).max(0.0),
            by_motor,
            motor,
            most: all[1],
            most_by_square,
            own: all[1] - all[2],
            own_by_square: most_by_square - assist_by_square,
            cost: table.mass * table.deploy_cost * course.length[i],
            extra: table.mass * table.assist_extra * course.length[i],
        }
    }

    /// The shares of the motor's force for what a program asks. All that is asked is scaled until the lap spends the energy that the
    /// program counted on: a lap whose store runs out loses time at its end.
    fn spending(
        &self,
        energy_j: f64,
        unbound: &HybridProblem,
        course: &Course<f64>,
        linear: &[Linear],
        asked: &[Asked],
        shares: &[f64],
    ) -> Vec<f64> {
        let counted_on_j: f64 = asked
            .iter()
            .zip(linear)
            .map(|(asked, of)| of.cost * asked.motor + of.extra * asked.assist)
            .sum();
        let all_of_it = counted_on_j > (1.0 - SPENT) * energy_j;
        let (mut shares, mut scale) = (shares.to_vec(), 1.0);
        for _ in 0..ROUNDS {
            shares.par_iter_mut().zip(asked).enumerate().for_each(
                |(i, (share, Asked { square, motor, .. }))| {
                    *share = self.share(course, i, *square, scale * motor);
                },
            );
            let spent = unbound.lap(&shares).0.deployed / energy_j;
            if (spent - 1.0).abs() < SPENT || spent < 1.0 && !all_of_it {
                break;
            }
            scale /= spent.max(1e-3);
        }
        shares
    }

    /// The share of its force with which the motor adds `motor` (m/s^2) to segment `i`.
    fn share(&self, course: &Course<f64>, i: usize, square: f64, motor: f64) -> f64 {
        if motor <= LEAST_MOTOR {
            return 0.0;
        }
        let added = |share: f64| self.step(course, i, square, share)[1];
        if added(1.0) <= motor {
            return 1.0;
        }
        bisected([0.0, 1.0], f64::EPSILON, |share| added(share) < motor)[1]
    }
}

/// What a program asks of a segment.
struct Asked {
    /// Speed squared at its start (m^2/s^2).
    square: f64,
    /// The motors' part of the acceleration (m/s^2),
    motor: f64,
    /// and the MGU-H's of that.
    assist: f64,
}

/// The cone program about a lap.
struct Program<'a> {
    closed: bool,
    length: &'a [f64],
    most: &'a [f64],
    squares: &'a [f64],
    /// Speed squared at the end of the last segment.
    end: f64,
    linear: &'a [Linear],
    /// Whether the MGU-H drives beside the MGU-K, at its own price.
    assists: bool,
    energy_j: f64,
    reach: f64,
}

impl Program<'_> {
    /// What is asked of each segment, the bound on the time (s) and how the solver ended.
    fn solve(&self) -> Result<(Vec<Asked>, f64, Status)> {
        let segments = self.linear.len();
        let n = self.most.len();
        let points = if self.closed { segments } else { segments + 1 };
        let old = |i: usize| self.squares.get(i).copied().unwrap_or(self.end);
        // Speeds squared, roots, inverse means, the motor's parts.
        let mut lower: Vec<f64> = (0..points).map(|i| 0.5 * old(i) / SQUARE).collect();
        let mut upper: Vec<f64> = (0..points)
            .map(|i| self.most[i % n].max(old(i)) / SQUARE)
            .collect();
        if !self.closed {
            upper[0] = old(0) / SQUARE;
        }
        lower.extend(vec![f64::NEG_INFINITY; points + segments]);
        upper.extend(vec![f64::INFINITY; points + segments]);
        for linear in self.linear {
            let reach = self.reach * linear.most;
            lower.push((linear.motor - reach).max(0.0));
            upper.push(linear.motor + reach);
        }
        let (root, inverse, motor) = (points, 2 * points, 2 * points + segments);
        let assist = motor + segments;
        if self.assists {
            lower.extend(vec![0.0; segments]);
            upper.extend(vec![f64::INFINITY; segments]);
        }
        let mut program = ConicProgram::new(lower, upper).for_step(1e-8, 1e-8);
        let affine = |constant: f64, terms: Vec<(usize, f64)>| Affine { constant, terms }.merged();
        for i in 0..points {
            // root^2 <= square
            program.add_cone([
                affine(1.0, vec![(i, 1.0)]),
                affine(0.0, vec![(root + i, 2.0)]),
                affine(-1.0, vec![(i, 1.0)]),
            ]);
        }
        let mut budget = affine(self.energy_j, Vec::new());
        let per_second = SQUARE.sqrt();
        for (i, linear) in self.linear.iter().enumerate() {
            let next = (i + 1) % points;
            // 1 <= inverse * (root + next root); time is twice the length times the inverse.
            let sum = [(root + i, 1.0), (root + next, 1.0)];
            let with = |sign: f64| {
                sum.iter()
                    .map(|&(k, a)| (k, sign * a))
                    .chain([(inverse + i, 1.0)])
                    .collect()
            };
            program.add_cone([
                affine(0.0, with(1.0)),
                affine(2.0, Vec::new()),
                affine(0.0, with(-1.0)),
            ]);
            program.add_linear(inverse + i, 2.0 * self.length[i] / per_second);
            // The speed at the end is no greater than what the segment leads to.
            let constant =
                linear.reached - linear.by_square * self.squares[i] - linear.by_motor * linear.motor;
            program.add_nonnegative(affine(
                constant / SQUARE,
                vec![
                    (i, linear.by_square),
                    (motor + i, linear.by_motor / SQUARE),
                    (next, -1.0),
                ],
            ));
            program.add_nonnegative(affine(
                linear.most - linear.most_by_square * self.squares[i],
                vec![(i, linear.most_by_square * SQUARE), (motor + i, -1.0)],
            ));
            budget.terms.push((motor + i, -linear.cost));
            if self.assists {
                // What the MGU-K does not give.
                program.add_nonnegative(affine(
                    linear.own - linear.own_by_square * self.squares[i],
                    vec![
                        (i, linear.own_by_square * SQUARE),
                        (motor + i, -1.0),
                        (assist + i, 1.0),
                    ],
                ));
                budget.terms.push((assist + i, -linear.extra));
            }
        }
        let scale = self.energy_j.max(1e3).recip();
        budget.constant *= scale;
        for term in &mut budget.terms {
            term.1 *= scale;
        }
        program.add_nonnegative(budget.merged());
        let solution = program.solve()?;
        let asked = (0..segments).map(|i| Asked {
            square: SQUARE * solution.x[i],
            motor: solution.x[motor + i].max(0.0),
            assist: solution.x.get(assist + i).map_or(0.0, |assist| assist.max(0.0)),
        });
        Ok((asked.collect(), solution.lower_bound, solution.status))
    }
}
