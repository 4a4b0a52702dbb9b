//! The front between several objectives: a swarm of whole lines, then the local search along it.

use super::settings::{LineAlgorithm, RacelineSettings};
use super::setup::Setup;
use crate::error::Result;
use crate::evaluate::line::{LineProblem, open_line_evaluator};
use crate::evaluate::{BackendInfo, DeviceFaults, Evaluator, FailureCounts, Losses};
use crate::line::Parametrisation;
use crate::optimum::{DescentSettings, ReferenceSolvers, WeightedLine, interruptible};
use crate::random::Random;
use crate::swarm::metrics::{Scale, hypervolume};
use crate::swarm::{Archive, Optimiser, Progress, Reached, SwarmAtWork, SwarmState, Truncation, lattice};
use rayon::prelude::*;
use std::ops::ControlFlow;
use std::sync::atomic::Ordering;

/// Lines none of which another betters in every objective.
#[derive(Clone, Debug, Default)]
pub struct LineFront {
    /// Share of the usable width at every cross-section, one row per line.
    pub alpha: Vec<Vec<f64>>,
    /// Objectives, one row per line.
    pub objectives: Vec<Vec<f64>>,
    /// Volume between the front and the reference point, as a share of the box from the ideal to the reference point.
    pub hypervolume: f64,
    /// The point from which the volume is measured.
    pub reference: Vec<f64>,
    /// The least value of each objective on the front or by the solvers of reference optima.
    pub ideal: Vec<f64>,
    /// Lines evaluated.
    pub evaluations: u64,
    /// What its swarm had come to on its way.
    pub reached: Vec<Reached>,
    /// What went wrong.
    pub losses: Losses,
    /// What evaluated in the end.
    pub backend: Option<BackendInfo>,
}

/// Metres of the reference line for each control point of the front's lines.
const CONTROL_SPACING_M: f64 = 20.0;
/// Purpose of the draws of starting lines in the counter.
const BLEND: u32 = 0x11e5;
/// Standard deviation of the control points of starting lines about a blend of known ones, in widths of the road.
const BLEND_SPREAD: f64 = 0.01;
/// Steps from one known line to another among the lines between them that are offered to the front.
const BLENDS: u32 = 10;
/// Steps between the objectives of the local search: `LATTICE` and the number of objectives give its lines.
const LATTICE: u32 = 6;
/// Waves in which they are led downhill. Six programs for each line in one wave over five steps take 7 to 23 % more time on three
/// circuits, for a hypervolume that is 0.2 to 1.3 % less.
const WAVES: usize = 2;
/// How each line is led. Programs that promise less than this share of its cost gain a fraction of that.
const POLISH: DescentSettings = DescentSettings {
    programs: 3,
    least_gain: 4e-5,
    ..DescentSettings::USUAL
};

/// Looks for the front. `known` are lines to start from and to keep (`alpha` at every cross-section). `begun` is the swarm of the same
/// search that was interrupted, if one was, and what is known to go wrong with devices; `observe` is told of
/// each iteration and may ask for the swarm then.
///
/// # Errors
/// Those of the evaluator, of the solvers and of `observe`.
pub(super) fn search_front(
    setup: &Setup,
    settings: &RacelineSettings,
    solvers: &ReferenceSolvers,
    known: &[Vec<f64>],
    (state, known_faults): (Option<SwarmState>, &[String]),
    mut observe: impl FnMut(&Progress, &mut dyn FnMut() -> SwarmState) -> Result<ControlFlow<()>>,
) -> Result<LineFront> {
    let cross_sections = &setup.cross_sections;
    let problem = front_problem(setup, settings)?;
    let published = settings.algorithm == LineAlgorithm::Thesis;
    // The published swarm by itself knows nothing of the lines that other swarms found.
    let known = if published && !settings.starts_warm() {
        &[]
    } else {
        known
    };
    let on_device = settings.on_device(&problem.problem)?;
    let state = match state {
        Some(state) => state,
        None => {
            let search = settings.front_search();
            let mut swarm = search.begin(&problem.problem, settings.front_swarm(), settings.swarm)?;
            if !published || settings.starts_warm() {
                swarm.start_from(&starting_lines(&problem, settings, known)?)?;
            }
            let losses = Losses::default();
            SwarmState { swarm, losses }
        }
    };
    let place = (settings.backend, settings.adapter.as_deref());
    let mut at_work = SwarmAtWork::open(&problem, state, on_device, place, known_faults)?;
    // A search that is resumed may have no step left to tell of.
    let mut latest = Progress::default();
    while !at_work.done() {
        latest = at_work.step()?;
        if observe(&latest, &mut || at_work.state().clone())?.is_break() {
            solvers.flag().store(true, Ordering::Relaxed);
            break;
        }
    }
    let state = at_work.finish()?;
    let swarm = &state.swarm;

    let whole = setup.problem(Parametrisation::sections(), &settings.objectives, settings)?;
    let mut judge = open_line_evaluator(&whole, settings.backend, settings.adapter.as_deref())?;
    let mut judging = DeviceFaults::beyond(known_faults, judge.as_ref());
    let found = swarm.front().candidates;
    let mut lines: Vec<Vec<f64>> = found.iter().map(|c| problem.alpha(c)).collect();
    // The known lines, and what lies evenly between them.
    let blend = |shares: &[f64], i: usize| shares.iter().zip(known).map(|(s, line)| s * line[i]).sum::<f64>();
    if !known.is_empty() {
        let blends = lattice(known.len(), BLENDS).into_iter();
        lines.extend(blends.map(|shares| {
            (0..cross_sections.len())
                .map(|i| blend(&shares, i).clamp(0.0, 1.0))
                .collect()
        }));
    }
    let mut archive = Archive::new(settings.archive, Truncation::Contribution);
    let mut sought = archive.clone();
    let mut evaluations = swarm.evaluations();
    evaluations += insert_all([&mut sought], judge.as_mut(), &lines)?;
    if settings.searches_locally() && settings.objectives.iter().all(|o| solvers.solves(*o)) {
        // Lines between others start from what these came to.
        let mut weights = lattice(settings.objectives.len(), LATTICE);
        if !known.is_empty() {
            // The best by one objective alone is known.
            weights.retain(|shares| shares.iter().all(|share| *share < 1.0));
        }
        for wave in 0..WAVES {
            let starts = starts_along(&sought, weights.iter().skip(wave).step_by(WAVES), settings);
            let polished = std::thread::scope(|scope| {
                let led = scope.spawn(|| solvers.polish(starts, &POLISH));
                interruptible(led, solvers.flag(), || observe(&latest, &mut || state.clone()))
            })?;
            let polished = on_road(setup, settings, &polished)?;
            evaluations += insert_all([&mut sought, &mut archive], judge.as_mut(), &polished)?;
        }
    }
    let kept = on_road(setup, settings, known)?;
    evaluations += insert_all([&mut archive], judge.as_mut(), &kept)?;
    // Moving a line in costs it something, nearly always. Those that a line on the road dominates before are left out. The best come
    // first, so that more are.
    for pool in [sought.positions, lines] {
        let found = judge.evaluate(&pool.concat())?;
        let width = settings.objectives.len();
        let due = pool.into_iter().enumerate();
        let due = due.filter(|(i, _)| found.success(*i, width).is_some_and(|row| !archive.beats(row)));
        let due: Vec<Vec<f64>> = due.map(|(_, line)| line).collect();
        evaluations += found.failures.len() as u64;
        let kept = on_road(setup, settings, &due)?;
        evaluations += insert_all([&mut archive], judge.as_mut(), &kept)?;
    }

    // The point that the reference line and the edges of the archive do not exceed.
    let middle = judge.evaluate(&cross_sections.reference)?.objectives;
    let across = |k: usize| archive.objectives.iter().map(move |row| row[k]);
    let ideal: Vec<f64> = (0..middle.len())
        .map(|k| across(k).fold(f64::INFINITY, f64::min))
        .collect();
    let reference: Vec<f64> = (0..middle.len())
        .map(|k| across(k).fold(middle[k], f64::max))
        .collect();
    let shares = Scale::between(&ideal, &reference).apply(&archive.objectives);
    let volume = hypervolume(&shares, &vec![1.0; ideal.len()])?;
    let mut losses = state.losses;
    losses.note(&FailureCounts::new(), &mut judging, judge.as_ref());
    Ok(LineFront {
        losses,
        backend: Some(judge.backend()),
        alpha: archive.positions,
        objectives: archive.objectives,
        hypervolume: volume,
        reference,
        ideal,
        evaluations,
        reached: swarm.reached().to_vec(),
    })
}

/// The problem that the swarm of the front is given: lines through control points, and the published swarm's through every
/// cross-section.
///
/// # Errors
/// Those of [`LineProblem::new`].
pub fn front_problem(setup: &Setup, settings: &RacelineSettings) -> Result<LineProblem> {
    if settings.algorithm == LineAlgorithm::Thesis {
        return setup.problem(Parametrisation::sections(), &settings.objectives, settings);
    }
    let cross_sections = &setup.cross_sections;
    let controls = ((cross_sections.length_m / CONTROL_SPACING_M) as usize).clamp(4, cross_sections.len());
    setup.problem(
        Parametrisation::control_points(controls),
        &settings.objectives,
        settings,
    )
}

/// What that swarm starts from, a candidate to each of the settings' particles: the known lines (`alpha` at every cross-section),
/// the reference line and the edges, then blends of them with a little noise.
///
/// # Errors
/// Those of [`LineProblem::candidate`].
pub fn starting_lines(
    problem: &LineProblem,
    settings: &RacelineSettings,
    known: &[Vec<f64>],
) -> Result<Vec<Vec<f64>>> {
    let n = problem.cross_sections().len();
    let mut given = known.to_vec();
    given.push(problem.cross_sections().reference.clone());
    let mut lines = given.clone();
    lines.push(vec![0.0; n]);
    lines.push(vec![1.0; n]);
    let random = Random::new(settings.seed);
    let lines: Vec<&[f64]> = lines.iter().map(Vec::as_slice).collect();
    let mut candidates = problem.candidates(&lines)?;
    let all: Vec<Vec<f64>> = candidates[..given.len()].to_vec();
    let variables = &problem.problem.variables;
    for particle in candidates.len()..settings.population {
        // Exponential deviates over their sum are even over the simplex.
        let shares: Vec<f64> = (0..all.len())
            .map(|k| -(1.0 - random.uniform(BLEND, 0, particle as u32, k as u32)).ln())
            .collect();
        let sum: f64 = shares.iter().sum();
        let blend = |j: usize| {
            all.iter()
                .zip(&shares)
                .map(|(line, s)| s / sum * line[j])
                .sum::<f64>()
        };
        let noise = |j: usize| BLEND_SPREAD * random.normal(BLEND, 1, particle as u32, j as u32);
        let row = variables.iter().enumerate();
        candidates.push(
            row.map(|(j, v)| (blend(j) + noise(j)).clamp(v.lower, v.upper))
                .collect(),
        );
    }
    candidates.truncate(settings.population);
    Ok(candidates)
}

/// The lines that are on the road between the cross-sections as well, moved in where they have to be.
fn on_road(setup: &Setup, settings: &RacelineSettings, lines: &[Vec<f64>]) -> Result<Vec<Vec<f64>>> {
    let brought_in = lines.par_iter().map(|line| setup.brought_in(line, settings));
    let kept = brought_in.collect::<Result<Vec<_>>>()?;
    Ok(kept.into_iter().flatten().collect())
}

/// Scores lines and offers them to archives; returns how many.
fn insert_all<const N: usize>(
    mut archives: [&mut Archive; N],
    judge: &mut dyn Evaluator,
    lines: &[Vec<f64>],
) -> Result<u64> {
    let width = judge.problem().objectives.len();
    let found = judge.evaluate(&lines.concat())?;
    for (i, line) in lines.iter().enumerate() {
        if let Some(row) = found.success(i, width) {
            archives
                .iter_mut()
                .for_each(|archive| _ = archive.insert(line, row));
        }
    }
    Ok(lines.len() as u64)
}

/// The members of the archive that suit these weights best, to be led downhill by them.
fn starts_along<'a>(
    archive: &Archive,
    weights: impl Iterator<Item = &'a Vec<f64>>,
    settings: &RacelineSettings,
) -> Vec<WeightedLine> {
    let m = settings.objectives.len();
    let rows = &archive.objectives;
    if rows.is_empty() {
        return Vec::new();
    }
    let bound = |k: usize, f: fn(f64, f64) -> f64| rows.iter().map(|r| r[k]).reduce(f).unwrap_or(0.0);
    let ranges: Vec<f64> = (0..m)
        .map(|k| (bound(k, f64::max) - bound(k, f64::min)).max(1e-9 * bound(k, f64::max).abs()))
        .collect();
    let start = |shares: &Vec<f64>| {
        // A trace of every objective keeps the corners of the front from being weakly best only.
        let weight = |k: usize| (shares[k] + 0.002) / ranges[k];
        let sum = |row: &[f64]| (0..m).map(|k| weight(k) * row[k]).sum::<f64>();
        let best = (0..rows.len())
            .min_by(|&i, &j| sum(&rows[i]).total_cmp(&sum(&rows[j])))
            .unwrap_or(0);
        let terms = settings.objectives.iter().enumerate();
        (
            archive.positions[best].clone(),
            terms.map(|(k, o)| (*o, weight(k))).collect(),
        )
    };
    weights.map(start).collect()
}
