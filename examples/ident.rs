use lapswarm::evaluate::{replay::*, simd::InstructionSet, *};
use lapswarm::simulate::*;
use lapswarm::study::identify::polish;
use lapswarm::swarm::*;
use lapswarm::track::Circuit;
use lapswarm::vehicle::Car;
use std::ops::ControlFlow;
pub const NAMES: [&str; 22] = [
    "rBx1", "rBx2", "rCx1", "rEx1", "rEx2", "rHx1", "rBy1", "rBy2", "rBy3", "rCy1", "rEy1", "rEy2", "rHy1",
    "rHy2", "rVy1", "rVy2", "rVy3", "rVy4", "rVy5", "rVy6", "K", "C",
];
pub const B: [(f64, f64); 22] = [
    (5.0, 25.0),
    (2.0, 25.0),
    (0.8, 1.5),
    (-2.0, 1.0),
    (-1.0, 1.0),
    (-0.05, 0.05),
    (5.0, 25.0),
    (2.0, 25.0),
    (-0.1, 0.1),
    (0.8, 1.5),
    (-2.0, 1.0),
    (-1.0, 1.0),
    (-0.05, 0.05),
    (-0.05, 0.05),
    (-0.2, 0.2),
    (-0.2, 0.2),
    (-2.0, 2.0),
    (2.0, 30.0),
    (0.5, 3.0),
    (2.0, 30.0),
    (3e4, 3e5),
    (3e3, 5e4),
];
fn main() {
    let a: Vec<String> = std::env::args().collect();
    let pace: f64 = a[1].parse().unwrap();
    let rate: f64 = a[2].parse().unwrap();
    let pop: usize = a[3].parse().unwrap();
    let iters: usize = a[4].parse().unwrap();
    let seeds: u64 = a[5].parse().unwrap();
    let ds: f64 = a[6].parse().unwrap();
    let stride: usize = a.get(7).map_or(1, |s| s.parse().unwrap());
    let car = Car::bundled().unwrap();
    let c = Circuit::silverstone_gp().unwrap();
    let d = drive(
        &car,
        &c,
        &DriverSettings {
            pace,
            ..Default::default()
        },
        1.0 / rate,
    )
    .unwrap();
    let n = d.inputs.len();
    let mut samples: Vec<_> = d
        .inputs
        .iter()
        .map(|(w, s)| Sample {
            wheel_speed: *w,
            steer: *s,
            measured: [0.0; 4],
        })
        .collect();
    let flat = car.to_flat();
    let s0 = d.states[0];
    let init = [s0[0], 0.0, s0[2], 0.0, 0.0, 0.0];
    let w = Window {
        start: 0,
        end: n,
        scored_from: 0,
        initial: init,
    };
    let plan = Plan {
        samples: samples.clone(),
        windows: vec![w],
        step: 1.0 / rate,
        fractions: vec![[0.0, 0.5, 1.0]],
        norm: Norm::Two,
    };
    let (o, ok) = trace(&flat, car.tyre_model(), &plan, &w);
    assert!(ok);
    for (s, o) in samples.iter_mut().zip(&o) {
        s.measured = *o;
    }
    let free = || -> Vec<_> {
        NAMES
            .iter()
            .zip(B)
            .map(|(n, b)| (car.parameter(n).unwrap(), b.0, b.1))
            .collect()
    };
    let truth: Vec<f64> = free().iter().map(|f| flat[f.0.slots[0]]).collect();
    let rms: Vec<f64> = (0..4)
        .map(|k| {
            let m = o.iter().map(|x| x[k]).sum::<f64>() / n as f64;
            (o.iter().map(|x| (x[k] - m).powi(2)).sum::<f64>() / n as f64).sqrt()
        })
        .collect();
    let wts: [f64; 4] = std::array::from_fn(|k| 1.0 / rms[k] / (n as f64 / rate).sqrt());
    let obj = || ChannelWeights {
        objective: Objective {
            name: "all".into(),
            unit: "-".into(),
        },
        weights: wts,
    };
    let mk = |ws: Vec<Window<f64>>| {
        ReplayProblem::new(
            car.clone(),
            free(),
            samples.clone(),
            ws,
            (1.0 / rate, 1),
            Norm::Two,
            vec![obj()],
        )
        .unwrap()
    };
    let rp = mk(vec![w]);
    // JtJ analysis at truth
    let r = rp.residuals(&truth).unwrap();
    let mut info = String::new();
    let m = nalgebra::DMatrix::from_fn(r.errors.len(), 22, |i, k| r.columns[k][i] / rms[i % 4] * truth[k]);
    let svd = (m.transpose() * &m).symmetric_eigen();
    let mut ev: Vec<f64> = svd.eigenvalues.iter().map(|x| x.sqrt()).collect();
    ev.sort_by(f64::total_cmp);
    info += &format!(
        "sv {:?}\n",
        ev.iter().map(|x| format!("{x:.2e}")).collect::<Vec<_>>()
    );
    // CRB with noise
    let noise = [0.05, 0.3, 0.3, 0.005];
    let m2 = nalgebra::DMatrix::from_fn(r.errors.len(), 22, |i, k| {
        r.columns[k][i] / noise[i % 4] * truth[k]
    });
    let cov = (m2.transpose() * &m2).try_inverse().unwrap();
    for k in 0..22 {
        info += &format!("{}:{:.3} ", NAMES[k], cov[(k, k)].sqrt());
    }
    println!("n {n} lap {:.1} {info}", n as f64 / rate);
    if pop == 0 {
        return;
    }
    let ppe = |x: &[f64]| {
        x.iter()
            .zip(&truth)
            .map(|(a, b)| ((a - b) / b).abs())
            .sum::<f64>()
    };
    // windows subset with stride
    let rps = if stride > 1 {
        let seg = 400;
        let mut ws = vec![];
        let mut s = 0;
        let mut i = 0;
        while s + seg <= n {
            if i % stride == 0 {
                let st = d.states[s];
                ws.push(Window {
                    start: s,
                    end: s + seg,
                    scored_from: 10,
                    initial: st,
                });
            }
            s += seg;
            i += 1;
        }
        mk(ws)
    } else {
        rp.clone()
    };
    for seed in 0..seeds {
        let t = std::time::Instant::now();
        let mut pso = Pso::new(
            &rps.problem,
            PsoSettings {
                population: pop,
                iterations: iters,
                seed: seed + 1,
                difference_share: ds,
                ..Default::default()
            },
        )
        .unwrap();
        let mut ev = SimdEvaluator::new(&rps, InstructionSet::best());
        run(&mut pso, &mut ev, |p| {
            if p.iteration % (iters / 10).max(1) == 0 || p.iteration == 1 {
                eprint!("[{} {:.2e} f{}] ", p.iteration, p.best[0], p.failed);
            }
            ControlFlow::Continue(())
        })
        .unwrap();
        eprintln!();
        let (x, cst) = pso.best_candidate();
        let g: usize = std::env::var("GEN").map_or(0, |s| s.parse().unwrap());
        let lam: usize = std::env::var("LAM").map_or(64, |s| s.parse().unwrap());
        let spread: f64 = std::env::var("SPREAD").map_or(0.1, |s| s.parse().unwrap());
        let (x, cst) = if g > 0 {
            eprintln!(
                "pso {cst:.3e} err {:.2} {:.1}s",
                ppe(&x),
                t.elapsed().as_secs_f64()
            );
            let mut cm = CovarianceSwarm::new(
                &rp.problem,
                &x,
                CovarianceSettings {
                    population: lam,
                    iterations: g,
                    seed: seed + 1,
                    spread,
                },
            )
            .unwrap();
            let mut ev = SimdEvaluator::new(&rp, InstructionSet::best());
            run(&mut cm, &mut ev, |p| {
                if p.iteration % (g / 10).max(1) == 0 || p.iteration == 1 {
                    eprint!("[{} {:.2e} f{}] ", p.iteration, p.best[0], p.failed);
                }
                ControlFlow::Continue(())
            })
            .unwrap();
            eprintln!();
            cm.best_candidate()
        } else {
            (x, cst)
        };
        let ts = t.elapsed().as_secs_f64();
        let t = std::time::Instant::now();
        let pol = polish(&rp, &x, std::array::from_fn(|k| 1.0 / rms[k]));
        println!(
            "seed {seed} swarm cost {cst:.3e} err {:.3} {ts:.1}s; polish {:?} {:.1}s",
            ppe(&x),
            pol.as_ref()
                .map(|p| (p.cost, ppe(&p.candidate), p.evaluations, p.converged)),
            t.elapsed().as_secs_f64()
        );
        if seed == 0 {
            println!(
                "  {:?}",
                NAMES
                    .iter()
                    .zip(x.iter().zip(&truth))
                    .map(|(n, (a, b))| format!("{n} {:.2}", (a - b) / b))
                    .collect::<Vec<_>>()
            );
        }
    }
}
