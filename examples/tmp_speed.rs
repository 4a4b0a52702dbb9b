#[path = "../tests/common/mod.rs"]
mod common;
use common::*;
use lapswarm::evaluate::{Evaluator, replay::*, simd::InstructionSet};
use std::time::Instant;
fn main() {
    let lap = Lap { samples: 5000, ..Lap::default() };
    let p = problem(bundled_car(), &UNKNOWNS, lap);
    let mut r = Random(7);
    let n = 256;
    let pop = candidates(&p, n, 0.15, &mut r);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    for set in InstructionSet::available() {
        let mut e = SimdEvaluator::new(&p, set);
        pool.install(|| {
            let mut best = f64::INFINITY;
            let mut ev = Default::default();
            for _ in 0..3 {
                let t = Instant::now();
                ev = e.evaluate(&pop).unwrap();
                best = best.min(t.elapsed().as_secs_f64());
            }
            println!("{:?}: {:.3} M steps/core-s, failures {}, {:?}", set, (n * 5000) as f64 / best / 1e6, ev.failures.iter().filter(|f| f.is_some()).count(), &ev.objectives[..4]);
        });
    }
    let mut e = CpuEvaluator::new(&p);
    pool.install(|| {
        let t = Instant::now();
        let ev = e.evaluate(&pop[..22 * 16]).unwrap();
        println!("cpu: {:.3} M steps/core-s {:?}", (16 * 5000) as f64 / t.elapsed().as_secs_f64() / 1e6, &ev.objectives[..4]);
    });
}
