use lapswarm::evaluate::replay::*;
use lapswarm::simulate::*;
use lapswarm::track::Circuit;
use lapswarm::vehicle::Car;
fn main() {
    let pace: f64 = std::env::args().nth(1).map_or(0.88, |s| s.parse().unwrap());
    let rate: f64 = std::env::args().nth(2).map_or(50.0, |s| s.parse().unwrap());
    let car = Car::bundled().unwrap();
    let c = Circuit::silverstone_gp().unwrap();
    let d = match drive(
        &car,
        &c,
        &DriverSettings {
            pace,
            ..Default::default()
        },
        1.0 / rate,
    ) {
        Ok(d) => d,
        Err(e) => {
            println!("{e}");
            return;
        }
    };
    let n = d.inputs.len();
    println!("lap {:.2} s, n {n}", n as f64 / rate);
    let st = |f: &dyn Fn(usize) -> f64| {
        let v: Vec<f64> = (0..n).map(f).collect();
        (
            v.iter().cloned().fold(f64::MAX, f64::min),
            v.iter().cloned().fold(f64::MIN, f64::max),
        )
    };
    println!(
        "vx {:?} vy {:?} r {:?} roll {:?} off {:?} steer {:?}",
        st(&|i| d.states[i][0]),
        st(&|i| d.states[i][1]),
        st(&|i| d.states[i][2]),
        st(&|i| d.states[i][3]),
        st(&|i| d.offset_m[i]),
        st(&|i| d.inputs[i].1)
    );
    for sub in [1, 2, (1000.0 / rate) as usize] {
        let samples: Vec<_> = d
            .inputs
            .iter()
            .map(|(w, s)| Sample {
                wheel_speed: *w,
                steer: *s,
                measured: [0.0; 4],
            })
            .collect();
        let n_s = sub as f64;
        let plan = Plan {
            samples,
            windows: vec![],
            step: 1.0 / rate / n_s,
            fractions: (0..sub)
                .map(|i| [i as f64 / n_s, (i as f64 + 0.5) / n_s, (i as f64 + 1.0) / n_s])
                .collect(),
            norm: Norm::Two,
        };
        let s0 = d.states[0];
        let w = Window {
            start: 0,
            end: n,
            scored_from: 0,
            initial: [s0[0], s0[1], s0[2], s0[3], s0[4], s0[5]],
        };
        let (o, ok) = trace(&car.to_flat(), car.tyre_model(), &plan, &w);
        let rms = |k: usize, j: usize| {
            ((0..n).map(|i| (o[i][k] - d.states[i][j]).powi(2)).sum::<f64>() / n as f64).sqrt()
        };
        println!(
            "sub {sub} ok {ok} rms vx {:.4} r {:.5}; max ay {:?} ax {:?}",
            rms(0, 0),
            rms(3, 2),
            st(&|i| o[i][2]),
            st(&|i| o[i][1])
        );
    }
}
