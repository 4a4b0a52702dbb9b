//! Swarms that live on the device, in every study that has one: device faults, breaks and refusals.

use crate::common::kinds::alone;
use lapswarm::evaluate::BackendChoice;
use lapswarm::evaluate::energy::HybridObjective;
use lapswarm::evaluate::gpu::faults::{self, Fault};
use lapswarm::evaluate::line::LineObjective;
use lapswarm::files::run_folder::STATE;
use lapswarm::study::framework::state_file::StateFile;
use lapswarm::study::framework::{Study, Work};
use lapswarm::study::hybrid::{Hybrid, HybridAlgorithm, HybridStudySettings};
use lapswarm::study::identify::{Algorithm, FreeParameter, Identify, IdentifySettings, ObjectiveChoice};
use lapswarm::study::raceline::{LineAlgorithm, Raceline, RacelineSettings};
use lapswarm::swarm::{Mutation, SwarmPlace, checkpoint};
use std::ops::ControlFlow;
use std::path::Path;
use std::sync::Arc;

tests! {
    lines_on_the_device_lose_nothing_to_faults_and_breaks: device full,
    cars_on_the_device_lose_nothing_to_faults_and_breaks: device full,
    laps_on_the_device_lose_nothing_to_faults_and_breaks: device full,
    swarms_of_one_objective_on_the_device_lose_nothing_to_faults_and_breaks: device full,
}

/// Candidates, objectives and evaluations.
type Found = (Vec<Vec<f64>>, Vec<Vec<f64>>, u64);

/// A study whose front, or best by one objective, is looked for on the device.
struct Trial<'a, S: Study> {
    settings: &'a S::Settings,
    prepared: S::Prepared,
    /// What the study calls the work of that swarm.
    stage: &'a str,
    front: fn(&S::Outcome) -> Found,
}

const STEPS: usize = 8;

impl<S: Study> Trial<'_, S> {
    /// Solves it, does something at the fourth step of the swarm.
    fn solve(
        &self,
        state: Option<S::State>,
        state_file: &mut StateFile,
        act: &dyn Fn() -> ControlFlow<()>,
    ) -> S::Outcome {
        let mut steps = 0;
        let work = Work::<S> {
            settings: self.settings,
            prepared: &self.prepared,
            state,
            state_file,
            observe: &mut |p| {
                if p.stage != self.stage || p.done == 0 {
                    return ControlFlow::Continue(());
                }
                steps += 1;
                if steps == 4 {
                    act()
                } else {
                    ControlFlow::Continue(())
                }
            },
            stop: Arc::default(),
        };
        let ended = S::solve(work);
        faults::end();
        ended.unwrap().expect("an outcome")
    }

    /// A fault at any submission of a step, and a run that is broken off and resumed, lead to the same front bit for bit; a device
    /// that stays away leaves the swarm to lanes.
    fn loses_nothing(&self) {
        let go_on = || ControlFlow::Continue(());
        let clean = self.solve(None, &mut StateFile::idle(), &go_on);
        let told = |outcome: &S::Outcome| S::record(outcome).device_faults.clone();
        assert_eq!(told(&clean), [""; 0]);
        assert_eq!(S::record(&clean).backend, "gpu");
        let front = |outcome: &S::Outcome| (self.front)(outcome);
        assert!(!front(&clean).0.is_empty());
        for from in [0, 1, 2, 3, 4, 5, 6, 11] {
            let struck = self.solve(None, &mut StateFile::idle(), &|| {
                faults::inject(Fault::Lost, from, 1);
                ControlFlow::Continue(())
            });
            let told = told(&struck);
            assert_eq!(told.len(), 1, "a fault at {from}: {told:?}");
            assert_eq!(S::record(&struck).backend, "gpu", "a fault at {from}: {told:?}");
            assert_eq!(front(&struck), front(&clean), "a fault at {from}: {told:?}");
            assert_eq!(S::record(&struck).failures, S::record(&clean).failures);
        }

        let folder = tempfile::tempdir().unwrap();
        let stop = || ControlFlow::Break(());
        let broken = self.solve(None, &mut StateFile::new(folder.path()), &stop);
        assert!(S::record(&broken).interrupted);
        let state: S::State = checkpoint::load(&folder.path().join(STATE)).unwrap();
        let resumed = self.solve(Some(state), &mut StateFile::new(folder.path()), &go_on);
        assert_eq!(front(&resumed), front(&clean));
        assert_eq!(S::record(&resumed).failures, S::record(&clean).failures);
        assert_eq!(S::record(&resumed).evaluations, S::record(&clean).evaluations);

        let lost = self.solve(None, &mut StateFile::idle(), &|| {
            faults::inject(Fault::Lost, 0, u64::MAX);
            ControlFlow::Continue(())
        });
        let told = told(&lost);
        assert!(told.last().unwrap().contains("simd takes over"), "{told:?}");
        assert_eq!(S::record(&lost).backend, "simd");
        assert_eq!(front(&lost).2, front(&clean).2);
    }
}

/// What `prepare` says of settings that cannot be.
fn assert_refused<S: Study>(settings: &S::Settings, reason: &str) {
    let refusal = S::prepare(settings).map(drop).expect_err(reason);
    assert_eq!(refusal.exit_code(), 2);
    assert!(refusal.to_string().contains(reason), "{refusal}");
}

/// Lines of a stadium, on the device.
fn lines() -> RacelineSettings {
    RacelineSettings {
        track: "stadium:300:80:12".to_owned(),
        sections: Some(60),
        population: 70,
        iterations: STEPS,
        archive: 12,
        objectives: vec![LineObjective::Length, LineObjective::Gamma],
        warm_start: Some(false),
        local_search: Some(false),
        backend: BackendChoice::Gpu,
        swarm: SwarmPlace::Device,
        ..RacelineSettings::default()
    }
}

fn lines_on_the_device_lose_nothing_to_faults_and_breaks() {
    let _turn = alone();
    let settings = lines();
    Trial::<Raceline> {
        prepared: Raceline::prepare(&settings).unwrap(),
        settings: &settings,
        stage: "front",
        front: |outcome| {
            let front = outcome.front.as_ref().expect("a front");
            (front.alpha.clone(), front.objectives.clone(), front.evaluations)
        },
    }
    .loses_nothing();
    let host = RacelineSettings {
        backend: BackendChoice::Simd,
        ..settings.clone()
    };
    assert_refused::<Raceline>(&host, "the backend gpu");
    let islands = RacelineSettings {
        islands: 2,
        ..settings
    };
    assert_refused::<Raceline>(&islands, "islands");
}

fn trial(settings: &IdentifySettings) -> Trial<'_, Identify> {
    Trial {
        prepared: Identify::prepare(settings).unwrap(),
        settings,
        stage: "exploring",
        front: |outcome| {
            let front = outcome.front.as_ref().expect("a front");
            let rows = &outcome.history;
            assert!(rows.iter().map(|row| row.iteration).eq(1..=rows.len()));
            let evaluations = rows.last().expect("rows").evaluations;
            (front.candidates.clone(), front.objectives.clone(), evaluations)
        },
    }
}

/// Cars through a bend, on the device.
fn cars() -> IdentifySettings {
    let free = [("rBy1", 5.0, 25.0), ("rVy3", -40.0, 40.0), ("C", 3e3, 5e4)];
    let free = free.map(|(name, lower, upper)| FreeParameter {
        name: name.to_owned(),
        lower,
        upper,
    });
    IdentifySettings {
        section: Some("Abbey".to_owned()),
        free: free.into_iter().collect(),
        objectives: vec![ObjectiveChoice::Channel(1), ObjectiveChoice::Channel(2)],
        population: Some(70),
        iterations: Some(STEPS),
        archive: 12,
        polish: false,
        backend: BackendChoice::Gpu,
        place: SwarmPlace::Device,
        ..IdentifySettings::default()
    }
}

fn cars_on_the_device_lose_nothing_to_faults_and_breaks() {
    let _turn = alone();
    let settings = cars();
    trial(&settings).loses_nothing();
    // On the host, from the same cars on, as many fail, and for the same reasons.
    let record = |place, population| {
        let settings = IdentifySettings {
            place,
            population: Some(population),
            iterations: Some(1),
            ..settings.clone()
        };
        let go_on = || ControlFlow::Continue(());
        let ended = trial(&settings).solve(None, &mut StateFile::idle(), &go_on);
        Identify::record(&ended).clone()
    };
    let many = lapswarm::swarm::MANY;
    let (there, here) = (record(SwarmPlace::Device, many), record(SwarmPlace::Host, many));
    assert!(!there.failures.is_empty());
    assert_eq!(there.failures, here.failures);
    let host = IdentifySettings {
        backend: BackendChoice::Simd,
        ..settings.clone()
    };
    assert_refused::<Identify>(&host, "the backend gpu");
    let one = IdentifySettings {
        objectives: vec![ObjectiveChoice::All],
        ..settings.clone()
    };
    assert_refused::<Identify>(&one, "another algorithm than thesis");
}

/// A lap of an ellipse with a motor, on the device.
fn laps(folder: &Path) -> HybridStudySettings {
    let line = folder.join("ring.csv");
    let points = (0..400).map(|i| {
        let angle = std::f64::consts::TAU * f64::from(i) / 400.0;
        format!("{},{}\n", 300.0 * angle.cos(), 180.0 * angle.sin())
    });
    std::fs::write(&line, format!("x_m,y_m\n{}", points.collect::<String>())).unwrap();
    HybridStudySettings {
        track: "circle:294:306".to_owned(),
        line: Some(line),
        sections: Some(60),
        budgets_mj: vec![0.5],
        objectives: vec![HybridObjective::LapTime, HybridObjective::EnergyUsed],
        population: 70,
        iterations: STEPS,
        backend: BackendChoice::Gpu,
        swarm: SwarmPlace::Device,
        ..HybridStudySettings::default()
    }
}

fn laps_on_the_device_lose_nothing_to_faults_and_breaks() {
    let _turn = alone();
    let folder = tempfile::tempdir().unwrap();
    let settings = laps(folder.path());
    Trial::<Hybrid> {
        prepared: Hybrid::prepare(&settings).unwrap(),
        settings: &settings,
        stage: "swarm front",
        front: |outcome| {
            let optimised = outcome.optimised.as_ref().expect("a deployment");
            let front = optimised.swarm_front.as_ref().expect("a front");
            (
                front.candidates.clone(),
                front.objectives.clone(),
                front.evaluations,
            )
        },
    }
    .loses_nothing();
    let host = HybridStudySettings {
        backend: BackendChoice::Simd,
        ..settings.clone()
    };
    assert_refused::<Hybrid>(&host, "the backend gpu");
    let one = HybridStudySettings {
        objectives: vec![HybridObjective::LapTime],
        ..settings
    };
    assert_refused::<Hybrid>(&one, "another algorithm than thesis");
}

/// The published swarms.
fn swarms_of_one_objective_on_the_device_lose_nothing_to_faults_and_breaks() {
    let _turn = alone();
    let settings = RacelineSettings {
        algorithm: LineAlgorithm::Thesis,
        objectives: vec![LineObjective::Length],
        mutation: Some(Mutation::None),
        ..lines()
    };
    Trial::<Raceline> {
        prepared: Raceline::prepare(&settings).unwrap(),
        settings: &settings,
        stage: LineObjective::Length.line_name(),
        front: |outcome| {
            let found = &outcome.objectives[0];
            (
                vec![found.best.alpha.clone()],
                vec![vec![found.swarm_cost]],
                outcome.record.evaluations,
            )
        },
    }
    .loses_nothing();
    let published = RacelineSettings {
        mutation: None,
        ..settings
    };
    assert_refused::<Raceline>(&published, "trials are evaluated one by one");

    let settings = IdentifySettings {
        algorithm: Algorithm::Thesis,
        objectives: vec![ObjectiveChoice::All],
        ..cars()
    };
    Trial::<Identify> {
        front: |outcome| {
            assert!(outcome.front.is_none());
            let last = outcome.history.last().expect("rows");
            (
                vec![outcome.swarm_candidate.clone()],
                vec![last.best.clone()],
                last.evaluations,
            )
        },
        ..trial(&settings)
    }
    .loses_nothing();

    let folder = tempfile::tempdir().unwrap();
    let settings = HybridStudySettings {
        algorithm: HybridAlgorithm::Thesis,
        objectives: vec![HybridObjective::LapTime],
        ..laps(folder.path())
    };
    Trial::<Hybrid> {
        prepared: Hybrid::prepare(&settings).unwrap(),
        settings: &settings,
        stage: "swarm",
        front: |outcome| {
            let found = &outcome.optimised.as_ref().expect("a deployment").swarm;
            (
                vec![found.shares.clone()],
                vec![vec![found.lap.lap.time]],
                found.evaluations,
            )
        },
    }
    .loses_nothing();
}
