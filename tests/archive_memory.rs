//! What the archive of a large swarm takes at the most. A process has one peak: one test.
#![cfg(target_os = "linux")]

use lapswarm::evaluate::{Evaluation, Objective, Problem, Variable};
use lapswarm::random::Random;
use lapswarm::study::framework::memory::Size;
use lapswarm::swarm::{Mopso, MopsoSettings, Optimiser, PsoSettings};

/// The most memory that this process has had (bytes).
fn peak() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").expect("its status");
    let line = status
        .lines()
        .find(|l| l.starts_with("VmHWM:"))
        .expect("its peak");
    let kib = line.split_whitespace().nth(1).and_then(|n| n.parse::<u64>().ok());
    1024 * kib.expect("a number")
}

/// Three objectives that are nearly a curve, on which no particle dominates another.
fn curve(particles: usize, when: u32) -> Evaluation {
    let random = Random::new(2);
    let mut evaluation = Evaluation::default();
    for i in 0..particles as u32 {
        let t = random.uniform(1, when, i, 0);
        let beside = 1e-9 * random.uniform(1, when, i, 1);
        evaluation.objectives.extend([t, t + beside, 1.0 - t]);
        evaluation.failures.push(None);
    }
    evaluation
}

#[test]
fn the_archive_takes_what_is_reckoned() {
    const PARTICLES: usize = 12_000;
    const VARIABLES: usize = 12;
    const MEMBERS: usize = 2000;
    let problem = Problem {
        variables: (0..VARIABLES)
            .map(|k| Variable::new(format!("x{k}"), "-", 0.0, 1.0))
            .collect(),
        objectives: (0..3).map(|k| Objective::new(format!("f{k}"), "-")).collect(),
    };
    let default = MopsoSettings::default();
    let settings = MopsoSettings {
        motion: PsoSettings {
            population: PARTICLES,
            ..default.motion
        },
        archive: MEMBERS,
        ..default
    };
    let mut swarm = Mopso::new(&problem, settings).expect("sound settings");
    drop(swarm.ask());
    let told = [0, 1].map(|when| curve(PARTICLES, when));
    let before = peak();
    for evaluation in told {
        swarm.tell(&evaluation).unwrap();
        assert_eq!(swarm.front().objectives.len(), MEMBERS);
    }
    let taken = peak() - before;
    let size = Size {
        population: PARTICLES,
        variables: VARIABLES,
        archive: MEMBERS,
        ..Size::default()
    };
    let kept = size.memory_items();
    let archive = kept
        .iter()
        .find(|kept| kept.name == "archive")
        .expect("it is kept");
    let reckoned = archive.count * archive.each;
    // The swarm's candidates for the archive stand there twice while they are sorted; those are reckoned with its particles.
    let candidates = 2 * 32 * PARTICLES as u64;
    assert!(
        taken < reckoned + candidates,
        "{taken} bytes, {reckoned} reckoned"
    );
    // No more than the copies of a checkpoint above what is taken.
    assert!(reckoned < 4 * taken, "{taken} bytes, {reckoned} reckoned");
}
