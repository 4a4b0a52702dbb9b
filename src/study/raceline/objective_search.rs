//! The searches that an objective takes: one for most, several for the fastest line.

use super::settings::{LineAlgorithm, RacelineSettings};
use super::setup::Setup;
use super::state::Running;
use super::whole_line_search::search_whole_lines;
use super::window_search::{FoundLine, LevelRow, LineSearch, LineSearchSettings, search_line};
use crate::error::Result;
use crate::evaluate::line::LineObjective;
use crate::line::{Spread, cross_sections_about, shares_across};
use crate::optimum::within_road;
use crate::study::framework::Progress;

/// Rounds of a search that starts from a reference optimum, and iterations of its turns: it looks whether anything near the optimum
/// is better. Longer searches from coarse to fine came to the same lines on the surveyed Silverstone and on a circuit of 7 km.
const WARM_ROUNDS: usize = 1;
const WARM_TURN: usize = 4;
/// Rounds of the search for the minimum-curvature line that a fast line starts from.
const CURVED_ROUNDS: usize = 2;

/// Distance between a fast line's control points (m) on a circuit with room for [`LEAST_CONTROLS`]: half of the shortest
/// bend that a road has.
const CONTROL_M: f64 = 24.5;
const LEAST_CONTROLS: f64 = 120.0;
/// Sections for each of them: at 4 m a lap's time is that on a fine spline to a few parts in ten thousand, so that nothing
/// is gained by what lies between sections.
const SECTIONS_PER_CONTROL: usize = 6;

/// A stage of the search for a fast line, about what the stage before has found.
struct Stage {
    /// Distance between control points, in those of the last stage.
    coarseness: usize,
    /// Waves that are left out of the line before, in the same distances: what this stage's control points cannot mend.
    wave: f64,
    /// Rounds of the windows' turns.
    rounds: usize,
    /// Standard deviation at the start, as a share of the control points' range.
    spread: f64,
}

impl Stage {
    const fn new(coarseness: usize, wave: f64, rounds: usize, spread: f64) -> Self {
        Self {
            coarseness,
            wave,
            rounds,
            spread,
        }
    }
}

const STAGES: [Stage; 4] = [
    Stage::new(4, 4.0, 2, 0.02),
    Stage::new(2, 3.0, 2, 0.02),
    Stage::new(1, 2.0, 2, 0.01),
    Stage::new(1, 2.0, 3, 0.005),
];
/// The one stage about a reference optimum: wider and longer searches found none better by a ten thousandth of a lap.
const WARM_STAGE: [Stage; 1] = [Stage::new(1, 2.0, WARM_ROUNDS, 0.005)];

/// The swarm's line for one objective.
pub(super) fn search_objective(
    settings: &RacelineSettings,
    setup: &Setup,
    objective: LineObjective,
    start: Option<&[f64]>,
    work: &mut Running<'_>,
) -> Result<FoundLine> {
    if matches!(
        settings.algorithm,
        LineAlgorithm::Cooperative | LineAlgorithm::Thesis
    ) {
        return search_whole_lines(settings, setup, objective, work);
    }
    let cold = LineSearchSettings::default();
    let plain = match start {
        Some(_) => LineSearchSettings {
            seed: settings.seed,
            rounds: WARM_ROUNDS,
            turn: WARM_TURN,
            first_controls: setup.cross_sections.len().max(cold.first_controls),
            ..cold
        },
        None => LineSearchSettings {
            seed: settings.seed,
            ..cold
        },
    };
    let search = LineSearch {
        cross_sections: &setup.cross_sections,
        objective,
        car: Some(&setup.car),
        entry_mps: settings.entry_mps,
        start,
        backend: settings.backend,
        adapter: settings.adapter.as_deref(),
        known_faults: &[],
    };
    if objective != LineObjective::LapTime {
        return search_step(&search, &plain, objective, (0, 0), work);
    }
    // Open roads, and what folds over itself, cannot be cut square to lines on it.
    let road = &setup.cross_sections;
    if cross_sections_about(road, &road.points(&road.reference), Spread::Even(road.len())).is_ok() {
        search_about(settings, setup, &search, &plain, work)
    } else {
        search_across(settings, setup, &search, &plain, work)
    }
}

/// The fastest line of a closed circuit, in stages from coarse to fine about a line that becomes better and better.
///
/// The first line is the minimum-curvature line of few control points, or the given one. Each stage leaves out of the line before
/// what its control points could not mend, cuts the road square to what is left (so that neither the jitter of the cross-sections
/// nor the bends of a far-off reference line come into it), and lays a spline on top, which is held inside by its control points.
/// The line therefore has no ripples that a lap time at few points would not feel, and no kinks at the edges.
fn search_about(
    settings: &RacelineSettings,
    setup: &Setup,
    search: &LineSearch<'_>,
    across: &LineSearchSettings,
    work: &mut Running<'_>,
) -> Result<FoundLine> {
    let (road, objective) = (&setup.cross_sections, search.objective);
    let plain = LineSearchSettings {
        seed: settings.seed,
        strides: vec![16, 8, 4, 2, 1],
        rounds: CURVED_ROUNDS,
        inside: true,
        ..LineSearchSettings::default()
    };
    let room = (road.length_m / CONTROL_M).max(LEAST_CONTROLS);
    let controls = (room as usize).min(road.len() / 2).max(8);
    let stages = match search.start {
        Some(_) => &WARM_STAGE[..],
        None => &STAGES[..],
    };
    let mut found = match search.start {
        // Nothing has been evaluated yet.
        Some(start) => FoundLine::given(start.to_vec(), f64::INFINITY),
        None => {
            let curved = LineSearch {
                objective: LineObjective::Kappa2,
                ..*search
            };
            let few = LineSearchSettings {
                sections_per_control: 3.0,
                ..plain.clone()
            };
            search_step(&curved, &few, objective, (0, 0), work)?
        }
    };
    let mut best = setup.report("fastest", &found.alpha, settings)?;
    let mut cross_sections = road.clone();
    let mut line = found.alpha.clone();
    found.history.clear();
    let mut searched = false;
    for (number, stage) in stages.iter().enumerate() {
        // The state is that of the search that was interrupted, and no other may go on from it.
        if work.interrupted {
            break;
        }
        let count = (controls / stage.coarseness).max(8);
        let wave_m = stage.wave * road.length_m / controls as f64;
        let smooth = cross_sections.points(&cross_sections.smoothed(&line, wave_m));
        // Where the line has come to fold the cross-sections, what has been found so far is the answer.
        let Ok(about) = cross_sections_about(road, &smooth, Spread::Even(controls * SECTIONS_PER_CONTROL))
        else {
            break;
        };
        cross_sections = about;
        let level = LineSearch {
            cross_sections: &cross_sections,
            start: None,
            ..*search
        };
        let few = LineSearchSettings {
            // Stages draw from seeds of their own.
            seed: settings.seed.wrapping_add((number as u64 + 1) << 48),
            rounds: stage.rounds,
            spread: stage.spread,
            sections_per_control: cross_sections.len() as f64 / count as f64,
            first_controls: count,
            ..plain.clone()
        };
        let before = (usize::from(search.start.is_none()) + number, found.evaluations);
        let step = search_step(&level, &few, objective, before, work)?;
        found.evaluations += step.evaluations;
        found.losses.add(&step.losses);
        found.backend = step.backend;
        found.history.extend(step.history.into_iter().map(|row| LevelRow {
            evaluations: before.1 + row.evaluations,
            ..row
        }));
        searched = true;
        line = step.alpha;
        let Ok(shares) = shares_across(road, &cross_sections.points(&line)) else {
            break;
        };
        let told = setup.report("fastest", &within_road(shares), settings)?;
        if told.betters(&best, objective) {
            best = told;
        }
    }
    if !searched && !work.interrupted {
        // Cross-sections so far apart that lines on them cannot be cut square to.
        return search_across(settings, setup, search, across, work);
    }
    found.cost = best.objective(objective);
    found.alpha = best.alpha;
    Ok(found)
}

/// Cross-sections for each control point where lines go across the road's own cross-sections: with fewer, ripples between the
/// cross-sections would pay; with more, a swarm cannot follow the edges.
const CROSS_SECTIONS_PER_CONTROL: f64 = 2.0;
/// Waves of the minimum-curvature line that are shorter than this (m) are left out where fast lines are measured from it.
const BASE_M: f64 = 40.0;
/// Waves (m) left out of a fast line, one after the other, to see whether a fine spline through it is faster without.
const RIPPLES_M: [f64; 4] = [15.0, 20.0, 25.0, 30.0];

/// The fastest line of any road, across its own cross-sections.
///
/// It is looked for about the swarm's own minimum-curvature line, smoothed: about the reference line, a few control
/// points could not say it. What is found has ripples between the cross-sections that its lap time through them does not feel; of
/// the line and smoother ones like it, the one is kept that is fastest on a fine spline.
fn search_across(
    settings: &RacelineSettings,
    setup: &Setup,
    search: &LineSearch<'_>,
    plain: &LineSearchSettings,
    work: &mut Running<'_>,
) -> Result<FoundLine> {
    let objective = search.objective;
    let curved = LineSearch {
        objective: LineObjective::Kappa2,
        ..*search
    };
    let curved = search_step(&curved, plain, objective, (0, 0), work)?;
    if work.interrupted {
        return Ok(curved);
    }
    let mut cross_sections = setup.cross_sections.clone();
    cross_sections.reference.clone_from(&curved.alpha);
    let smooth = cross_sections.with_smooth_reference(BASE_M);
    let fast = LineSearch {
        cross_sections: &smooth,
        start: None,
        ..*search
    };
    let fast_settings = LineSearchSettings {
        sections_per_control: CROSS_SECTIONS_PER_CONTROL,
        overshoot: 0.0,
        ..plain.clone()
    };
    let before = (1, curved.evaluations);
    let mut found = search_step(&fast, &fast_settings, objective, before, work)?;
    found.evaluations += curved.evaluations;
    let before = std::mem::replace(&mut found.losses, curved.losses);
    found.losses.add(&before);
    let mut fastest = setup.report("fastest", &found.alpha, settings)?;
    cross_sections.reference.clone_from(&found.alpha);
    for wavelength in RIPPLES_M {
        let smooth = cross_sections.with_smooth_reference(wavelength).reference;
        let line = setup.report("fastest", &smooth, settings)?;
        if line.betters(&fastest, objective) {
            fastest = line;
        }
    }
    found.cost = fastest.objective(objective);
    found.alpha = fastest.alpha;
    Ok(found)
}

/// One search of an objective's, or what it came to in an earlier run. `before` says how many searches came before it, and how many
/// lines these evaluated.
fn search_step(
    search: &LineSearch<'_>,
    settings: &LineSearchSettings,
    objective: LineObjective,
    (place, before): (usize, u64),
    work: &mut Running<'_>,
) -> Result<FoundLine> {
    if let Some(found) = work.state.steps.get(place) {
        return Ok(found.clone());
    }
    let state = work.state.search.take().map(|state| *state);
    let known_faults = work.state.device_faults();
    let search = LineSearch {
        known_faults: &known_faults,
        ..*search
    };
    let found = search_line(&search, settings, state, |evaluations, best, state| {
        let best = format!("best {best:.4} {}", search.objective.unit());
        let told = Progress::reached(objective.line_name(), before + evaluations, best);
        work.told(&told, |kept| kept.search = Some(Box::new(state.clone())))
    })?;
    work.finished(|state| {
        state.steps.push(found.clone());
        state.search = None;
    });
    Ok(found)
}
