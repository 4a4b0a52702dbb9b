use lapswarm::simulate::*;
use lapswarm::telemetry::*;
use lapswarm::track::Circuit;
use lapswarm::vehicle::Car;
fn main() {
    let car = Car::bundled().unwrap();
    let c = Circuit::silverstone_gp().unwrap();
    for (sub, name) in [(1, "gt_silverstone.csv"), (20, "gt_silverstone_1ms.csv")] {
        let log = simulate_lap(
            &car,
            &c,
            &SimulateSettings {
                substeps: sub,
                ..Default::default()
            },
        )
        .unwrap();
        let f = ["vx_mps", "ax_mps2", "ay_mps2", "yaw_rate_radps"]
            .into_iter()
            .fold(NativeFormat::exact(), |f, c| f.decimals(c, 11))
            .decimals("time_s", 4)
            .decimals("distance_m", 3);
        write_native(&log, format!("data/laps/{name}"), &f.comment("x")).unwrap();
    }
}
