use lapswarm::evaluate::{replay::*, simd::InstructionSet, *};
use lapswarm::simulate::*;
use lapswarm::track::Circuit;
use lapswarm::vehicle::Car;
fn main() {
    let rate = 100.0;
    let car = Car::bundled().unwrap();
    let c = Circuit::silverstone_gp().unwrap();
    let d = drive(&car, &c, &DriverSettings::default(), 1.0 / rate).unwrap();
    let n = 12500;
    let samples: Vec<_> = d
        .inputs
        .iter()
        .take(n)
        .map(|(w, s)| Sample {
            wheel_speed: *w,
            steer: *s,
            measured: [0.0; 4],
        })
        .collect();
    let names = [
        "rBx1", "rBx2", "rCx1", "rEx1", "rEx2", "rHx1", "rBy1", "rBy2", "rBy3", "rCy1", "rEy1", "rEy2",
        "rHy1", "rHy2", "rVy1", "rVy2", "rVy3", "rVy4", "rVy5", "rVy6", "K", "C",
    ];
    let flat = car.to_flat();
    let free: Vec<_> = names
        .iter()
        .map(|n| {
            let p = car.parameter(n).unwrap();
            let t = flat[p.slots[0]];
            (p, t - 0.05 * t.abs(), t + 0.05 * t.abs())
        })
        .collect();
    let truth: Vec<f64> = free.iter().map(|f| flat[f.0.slots[0]]).collect();
    let s0 = d.states[0];
    let w = Window {
        start: 0,
        end: n,
        scored_from: 0,
        initial: s0,
    };
    let obj = ChannelWeights {
        objective: Objective {
            name: "all".into(),
            unit: "-".into(),
        },
        weights: [1.0; 4],
    };
    let rp = ReplayProblem::new(car, free, samples, vec![w], (1.0 / rate, 1), Norm::Two, vec![obj]).unwrap();
    let pop = 256usize;
    let r = lapswarm::random::Random::new(1);
    let x: Vec<f64> = (0..pop * 22)
        .map(|i| truth[i % 22] * (0.97 + 0.06 * r.uniform(0, 0, i as u32, 0)))
        .collect();
    for set in InstructionSet::available() {
        let mut e = SimdEvaluator::new(&rp, set);
        e.evaluate(&x[..16 * 22]).unwrap();
        let t = cpu();
        let out = e.evaluate(&x).unwrap();
        let s = cpu() - t;
        println!(
            "{:?} {:.3} M particle-steps/core-s; failures {} cost0 {}",
            set,
            (pop * n) as f64 / s / 1e6,
            out.failures.iter().filter(|f| f.is_some()).count(),
            out.objectives[0]
        );
    }
    let mut e = CpuEvaluator::new(&rp);
    let t = cpu();
    let out = e.evaluate(&x[..16 * 22]).unwrap();
    let s = cpu() - t;
    println!(
        "cpu {:.3} M particle-steps/core-s; cost0 {}",
        (16 * n) as f64 / s / 1e6,
        out.objectives[0]
    );
}

fn cpu() -> f64 {
    let s = std::fs::read_to_string("/proc/self/schedstat").unwrap();
    let _ = s;
    let st = std::fs::read_to_string("/proc/self/stat").unwrap();
    let f: Vec<&str> = st.rsplit(')').next().unwrap().split_whitespace().collect();
    (f[11].parse::<f64>().unwrap() + f[12].parse::<f64>().unwrap()) / 100.0
}
