//! Runs that are interrupted and resumed end as if nothing had happened, to the last bit.

use crate::solve;
use lapswarm::Error;
use lapswarm::evaluate::line::LineObjective;
use lapswarm::evaluate::{BackendChoice, BackendInfo, Evaluation, Evaluator, FAILED_COST, Failure, Problem};
use lapswarm::files::run_folder::STATE;
use lapswarm::study::framework::state_file::StateFile;
use lapswarm::study::framework::{Progress, Solved, Study, solve_unobserved, write_results};
use lapswarm::study::identify::{
    self, Algorithm, Identify, IdentifySettings, ObjectiveChoice, SearchState, Setup, search_with,
};
use lapswarm::study::raceline::{self, LineAlgorithm, LinesState, Raceline, RacelineSettings};
use lapswarm::swarm::checkpoint;
use serde_json::Value;
use std::ops::ControlFlow;
use std::time::Duration;

/// A short piece of the bundled lap, and short searches.
fn small(objectives: &[ObjectiveChoice]) -> IdentifySettings {
    IdentifySettings {
        section: Some("Abbey".to_owned()),
        objectives: objectives.to_vec(),
        population: Some(16),
        iterations: Some(50),
        // A function of the candidate alone; killed runs polish.
        polish: false,
        backend: BackendChoice::Simd,
        ..IdentifySettings::default()
    }
}

/// All of an outcome but its times.
fn told(settings: &IdentifySettings, setup: &Setup, outcome: &identify::Outcome) -> String {
    let history: Vec<_> = outcome
        .history
        .iter()
        .map(|r| (r.iteration, r.evaluations, r.best.clone(), r.median, r.failed))
        .collect();
    let summary = Identify::summarise(&Solved {
        settings,
        prepared: setup,
        outcome,
    });
    let summary = timeless(serde_json::to_value(&summary).unwrap());
    let mut front = outcome.front.clone();
    let reached = front.iter_mut().flat_map(|front| &mut front.reached);
    reached.for_each(|reached| reached.elapsed_s = 0.0);
    format!(
        "{:?} {:?} {front:?} {history:?} {summary}",
        outcome.candidate, outcome.swarm_candidate
    )
}

/// A summary without its times and rates.
fn timeless(mut summary: Value) -> Value {
    let times = [
        "elapsed_s",
        "swarm_elapsed_s",
        "search_elapsed_s",
        "exact_elapsed_s",
        "evaluations_per_s",
        "particle_steps_per_s",
    ];
    for key in times {
        summary.as_object_mut().unwrap().remove(key);
    }
    summary
}

/// Interrupts at these observations, one after the other, and resumes each time.
fn identify_in_pieces(settings: &IdentifySettings, setup: &Setup, breaks: &[usize]) -> identify::Outcome {
    let folder = tempfile::tempdir().unwrap();
    let mut seen = 0;
    let mut state: Option<SearchState> = None;
    for at in breaks.iter().copied().chain([usize::MAX]) {
        let mut state_file = StateFile::new(folder.path()).every(Duration::ZERO);
        let outcome = solve::<Identify>(settings, setup, (state.take(), &mut state_file), |_| {
            seen += 1;
            if seen == at {
                ControlFlow::Break(())
            } else {
                ControlFlow::Continue(())
            }
        })
        .unwrap()
        .unwrap();
        assert_eq!(outcome.record.interrupted, at != usize::MAX);
        if !outcome.record.interrupted {
            return outcome;
        }
        state = Some(checkpoint::load(&folder.path().join(STATE)).unwrap());
    }
    unreachable!("the last piece is not broken off")
}

/// Cars of which none drives.
struct NothingDrives(Problem);

impl Evaluator for NothingDrives {
    fn problem(&self) -> &Problem {
        &self.0
    }

    fn backend(&self) -> BackendInfo {
        BackendInfo {
            backend: "simd",
            device: "none".to_owned(),
            driver: String::new(),
        }
    }

    fn evaluate(&mut self, population: &[f64]) -> lapswarm::Result<Evaluation> {
        let cars = population.len() / self.0.variables.len();
        Ok(Evaluation {
            objectives: vec![FAILED_COST; cars * self.0.objectives.len()],
            failures: vec![Some(Failure::Spun); cars],
            violations: Vec::new(),
        })
    }
}

#[test]
fn a_search_that_is_broken_off_before_anything_drives_hands_on_the_starting_car() {
    for objectives in [
        &[ObjectiveChoice::All][..],
        &[ObjectiveChoice::Channel(0), ObjectiveChoice::Channel(3)],
    ] {
        let settings = small(objectives);
        let setup = identify::set_up(&settings).unwrap();
        let mut evaluator = NothingDrives(setup.replay.problem.clone());
        let folder = tempfile::tempdir().unwrap();
        let mut go = |state: Option<SearchState>, at: usize| {
            let mut seen = 0;
            let mut state_file = StateFile::new(folder.path());
            search_with(
                &settings,
                &setup,
                &mut evaluator,
                (state, &mut state_file),
                &mut |_| {
                    seen += 1;
                    if seen == at {
                        ControlFlow::Break(())
                    } else {
                        ControlFlow::Continue(())
                    }
                },
            )
        };
        let interrupted = go(None, 3).expect("the starting car drives the log");
        assert!(interrupted.record.interrupted);
        let free = &setup.replay.free;
        assert_eq!(interrupted.candidate, free.values_in(free.base()));
        // It is resumed, and ends with nothing that drives.
        let state: SearchState = checkpoint::load(&folder.path().join(STATE)).unwrap();
        let ended = go(Some(state), usize::MAX).err();
        assert_eq!(ended.map(|error| error.exit_code()), Some(1));
    }
}

#[test]
#[ignore = "full tier: nine searches"]
fn an_identification_is_resumed_bit_for_bit() {
    let settings = small(&[ObjectiveChoice::All]);
    let setup = identify::set_up(&settings).unwrap();
    let mut observations = 0;
    let whole = solve::<Identify>(&settings, &setup, (None, &mut StateFile::idle()), |_| {
        observations += 1;
        ControlFlow::Continue(())
    })
    .unwrap()
    .unwrap();
    let wanted = told(&settings, &setup, &whole);
    // 50 iterations explore, 50 gather.
    assert_eq!(observations, 100);
    for breaks in [
        &[1][..],
        &[17],
        &[49],
        &[50],
        &[51],
        &[66],
        &[80],
        &[3, 4, 50, 51, 79],
    ] {
        let outcome = identify_in_pieces(&settings, &setup, breaks);
        assert_eq!(
            told(&settings, &setup, &outcome),
            wanted,
            "broken off at {breaks:?}"
        );
    }
}

#[test]
fn a_front_is_resumed_bit_for_bit() {
    let settings = small(&[ObjectiveChoice::Channel(0), ObjectiveChoice::Channel(3)]);
    let setup = identify::set_up(&settings).unwrap();
    let whole = solve_unobserved::<Identify>(&settings, &setup).unwrap();
    assert!(!whole.record.failures.is_empty(), "some of these particles spin");
    let wanted = told(&settings, &setup, &whole);
    for breaks in [&[1][..], &[13], &[29], &[30], &[2, 7, 11]] {
        let outcome = identify_in_pieces(&settings, &setup, breaks);
        assert_eq!(
            told(&settings, &setup, &outcome),
            wanted,
            "broken off at {breaks:?}"
        );
    }
}

/// Islands and NSGA-II too: each with as many evaluations as it was asked for, and with a front of its own.
#[test]
fn fronts_of_islands_and_of_nsga2_are_resumed_bit_for_bit() {
    let alone = IdentifySettings {
        iterations: Some(24),
        ..small(&[ObjectiveChoice::Channel(0), ObjectiveChoice::Channel(3)])
    };
    let setup = identify::set_up(&alone).unwrap();
    let genetic = IdentifySettings {
        algorithm: Algorithm::Nsga2,
        ..alone.clone()
    };
    let islands = IdentifySettings {
        islands: 2,
        ..alone.clone()
    };
    // Memory goes with the particles of all islands.
    let many = IdentifySettings {
        population: Some(1000),
        islands: 3,
        ..alone.clone()
    };
    assert_eq!(many.size().population, 3000);
    let mut fronts = Vec::new();
    for (settings, evaluations) in [(alone, 16 * 24), (genetic, 16 * 24), (islands, 2 * 16 * 24)] {
        assert_eq!(settings.evaluations(), evaluations);
        let whole = solve_unobserved::<Identify>(&settings, &setup).unwrap();
        assert_eq!(whole.record.evaluations, evaluations);
        let wanted = told(&settings, &setup, &whole);
        // Solutions move after ten iterations.
        let outcome = identify_in_pieces(&settings, &setup, &[3, 10, 17]);
        assert_eq!(told(&settings, &setup, &outcome), wanted);
        fronts.push(whole.front.expect("a front").candidates);
    }
    assert!(fronts[0] != fronts[1] && fronts[0] != fronts[2]);
}

fn lines() -> RacelineSettings {
    RacelineSettings {
        track: "stadium:300:80:12".to_owned(),
        sections: Some(120),
        population: 16,
        iterations: 12,
        archive: 12,
        objectives: vec![LineObjective::Length, LineObjective::LapTime],
        backend: BackendChoice::Simd,
        ..RacelineSettings::default()
    }
}

fn lines_told(settings: &RacelineSettings, setup: &raceline::Setup, outcome: &raceline::Outcome) -> String {
    let summary = Raceline::summarise(&Solved {
        settings,
        prepared: setup,
        outcome,
    });
    let each = outcome.objectives.iter();
    let reached = |o: &raceline::ObjectiveOutcome| -> Vec<(u64, Option<f64>)> {
        o.history.iter().map(|row| (row.evaluations, row.best)).collect()
    };
    let best: Vec<_> = each.map(|o| (&o.best.alpha, reached(o))).collect();
    format!(
        "{best:?} {:?} {}",
        outcome
            .front
            .as_ref()
            .map(|f| (&f.alpha, &f.objectives, f.evaluations)),
        timeless(serde_json::to_value(&summary).unwrap())
    )
}

/// Tells the steps of a search from the questions whether to go on while a solver works, which go by the clock.
#[derive(Default)]
struct Steps(Option<Progress>);

impl Steps {
    fn is_next(&mut self, told: &Progress) -> bool {
        told.done > 0 && self.0.replace(told.clone()).as_ref() != Some(told)
    }
}

/// A search for lines that nothing breaks off, and the stage of each of its steps.
fn lines_at_once(settings: &RacelineSettings, setup: &raceline::Setup) -> (raceline::Outcome, Vec<String>) {
    let mut stages = Vec::new();
    let mut steps = Steps::default();
    let outcome = solve::<Raceline>(settings, setup, (None, &mut StateFile::idle()), |p| {
        if steps.is_next(p) {
            stages.push(p.stage.clone());
        }
        ControlFlow::Continue(())
    });
    (outcome.unwrap().unwrap(), stages)
}

/// Breaks a search for lines off at each of these observations in turn, goes on each time, and holds the end against `wanted`.
fn lines_in_pieces(
    (settings, setup): (&RacelineSettings, &raceline::Setup),
    breaks: &[usize],
    (wanted, all): (&str, usize),
) {
    let folder = tempfile::tempdir().unwrap();
    let (mut seen, mut state): (usize, Option<LinesState>) = (0, None);
    let mut steps = Steps::default();
    for at in breaks.iter().copied().chain([usize::MAX]) {
        let mut state_file = StateFile::new(folder.path());
        let outcome = solve::<Raceline>(settings, setup, (state.take(), &mut state_file), |p| {
            let step = steps.is_next(p);
            seen += usize::from(step);
            if step && seen == at {
                ControlFlow::Break(())
            } else {
                ControlFlow::Continue(())
            }
        })
        .unwrap()
        .unwrap();
        assert_eq!(outcome.record.interrupted, at != usize::MAX, "at {at} of {all}");
        if outcome.record.interrupted {
            state = Some(checkpoint::load(&folder.path().join(STATE)).unwrap());
        } else {
            assert_eq!(seen, all, "nothing is done twice");
            let told = lines_told(settings, setup, &outcome);
            assert!(
                told == wanted,
                "broken off at {breaks:?} of {all}:\n{told}\nnot\n{wanted}"
            );
        }
    }
}

#[test]
#[ignore = "full tier: four searches in pieces"]
fn lines_are_resumed_bit_for_bit_from_every_stage() {
    let settings = lines();
    let setup = raceline::set_up(&settings).unwrap();
    let (whole, stages) = lines_at_once(&settings, &setup);
    let wanted = lines_told(&settings, &setup, &whole);
    // A resumed run writes over what it had written when it was interrupted.
    let folder = tempfile::tempdir().unwrap();
    for _ in 0..2 {
        write_results::<Raceline>(folder.path(), &settings, &setup, &whole).unwrap();
    }
    let all = stages.len();
    let first = |stage: &str| 1 + stages.iter().position(|s| s == stage).unwrap();
    let last = first("front") - 1;
    for breaks in [
        vec![1, first("fastest") - 1, last],
        vec![
            first("fastest"),
            (first("fastest") + last) / 2,
            first("front") + 4,
        ],
        vec![7, first("fastest") + 9, last - 3, all],
    ] {
        lines_in_pieces((&settings, &setup), &breaks, (&wanted, all));
    }
}

/// Searches with no line to start from, whose stages have control points of different numbers, round a circuit and along a
/// section of it.
#[test]
#[ignore = "full tier: two searches in pieces"]
fn cold_searches_are_resumed_bit_for_bit_from_every_stage() {
    let abbey = RacelineSettings {
        track: "silverstone_gp".to_owned(),
        section: Some("Abbey".to_owned()),
        sections: Some(480),
        ..lines()
    };
    for base in [lines(), abbey] {
        let settings = RacelineSettings {
            objectives: vec![LineObjective::LapTime],
            warm_start: Some(false),
            local_search: Some(false),
            ..base
        };
        let setup = raceline::set_up(&settings).unwrap();
        let (whole, stages) = lines_at_once(&settings, &setup);
        let all = stages.len();
        let wanted = lines_told(&settings, &setup, &whole);
        let breaks: Vec<usize> = (1..8).map(|k| 1 + k * (all - 1) / 8).collect();
        lines_in_pieces((&settings, &setup), &breaks, (&wanted, all));
    }
}

/// Four sectors of thirty cross-sections: the line is one line, and its length is that within the sectors and of the links.
#[test]
fn sectors_are_joined_and_resumed_bit_for_bit() {
    let settings = RacelineSettings {
        algorithm: LineAlgorithm::Thesis,
        sectors: 4,
        objectives: vec![LineObjective::Length],
        iterations: 40,
        ..lines()
    };
    let setup = raceline::set_up(&settings).unwrap();
    let (whole, stages) = lines_at_once(&settings, &setup);
    let seen = stages.len();
    assert_eq!(seen, 4 * 40);
    // Its mutants are evaluated beside the particles.
    assert!(whole.record.evaluations > 4 * 40 * 16);
    let wanted = lines_told(&settings, &setup, &whole);
    lines_in_pieces((&settings, &setup), &[1, 39, 40, 41, 97, 160], (&wanted, seen));

    let summary = Raceline::summarise(&Solved {
        settings: &settings,
        prepared: &setup,
        outcome: &whole,
    });
    let sectors = &summary.sectors;
    assert!(sectors.len() == 4 && sectors.iter().all(|s| s.sections == 30));
    let within_m: f64 = sectors.iter().map(|s| s.length_m).sum();
    let links_m: f64 = sectors.iter().map(|s| s.link_m).sum();
    let length_m = summary.best["length"].length_m;
    assert!(
        (within_m + links_m - length_m).abs() < 1e-6,
        "{within_m} {links_m} {length_m}"
    );
    // Each sector has 29 steps of its own and one to the next: no link but the last leads across the road.
    let step_m = length_m / 120.0;
    assert!(
        sectors[..3].iter().all(|s| s.link_m < 1.2 * step_m),
        "{sectors:?}"
    );
    assert!(length_m < summary.reference.length_m);
}

#[test]
#[ignore = "full tier: searches in pieces"]
fn particle_swarms_are_resumed_bit_for_bit() {
    for (algorithm, islands) in [
        (LineAlgorithm::Cooperative, 1),
        (LineAlgorithm::Thesis, 1),
        (LineAlgorithm::Thesis, 2),
        (LineAlgorithm::Nsga2, 1),
    ] {
        let settings = RacelineSettings {
            algorithm,
            islands,
            groups: 4,
            local_search: Some(false),
            ..lines()
        };
        let setup = raceline::set_up(&settings).unwrap();
        let (whole, stages) = lines_at_once(&settings, &setup);
        let wanted = lines_told(&settings, &setup, &whole);
        let all = stages.len();
        let fastest = 1 + stages.iter().position(|s| s == "fastest").unwrap();
        let front = 1 + stages.iter().position(|s| s == "front").unwrap();
        for breaks in [
            vec![1, fastest - 1, fastest],
            vec![5, fastest + 6, front + 10, all],
        ] {
            lines_in_pieces((&settings, &setup), &breaks, (&wanted, all));
        }
    }
}

#[test]
fn a_state_of_other_inputs_is_refused() {
    let settings = small(&[ObjectiveChoice::All]);
    let setup = identify::set_up(&settings).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let stop = |_: &Progress| ControlFlow::Break(());
    let mut state_file = StateFile::new(folder.path());
    solve::<Identify>(&settings, &setup, (None, &mut state_file), stop).unwrap();
    let path = folder.path().join(STATE);
    let state = || checkpoint::load::<SearchState>(&path).unwrap();
    let other = IdentifySettings {
        section: Some("Luffield".to_owned()),
        ..settings.clone()
    };
    let other = identify::set_up(&other).unwrap();
    let refused = solve::<Identify>(&settings, &other, (Some(state()), &mut state_file), stop)
        .err()
        .unwrap();
    assert!(refused.to_string().contains("inputs of the study"), "{refused}");
    let on_cpu = IdentifySettings {
        backend: BackendChoice::Cpu,
        ..settings
    };
    let refused = solve::<Identify>(&on_cpu, &setup, (Some(state()), &mut state_file), stop)
        .err()
        .unwrap();
    assert_eq!(refused.exit_code(), 2);
    assert!(refused.to_string().contains("where the run began"), "{refused}");
    // A study of another kind.
    let wrong = checkpoint::load::<LinesState>(&path).err().unwrap();
    assert!(matches!(wrong, Error::Input { .. }), "{wrong}");
}
