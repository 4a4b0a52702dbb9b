//! The hybrid end to end.

use lapswarm::line::energy::{Gates, Mode};
use lapswarm::optimum::DeploymentSearch;
use lapswarm::study::hybrid::{HybridStudySettings, drive, published, set_up};

#[test]
#[ignore]
fn look() {
    let settings = HybridStudySettings::default();
    let setup = set_up(&settings).unwrap();
    println!(
        "points {} length {} run_in {}",
        setup.points_m.len(),
        setup.length_m,
        setup.run_in
    );
    let none = Gates {
        energy_mj: 0.0,
        ..Gates::OPEN
    };
    for mode in [Mode::Offset, Mode::Additional] {
        let l = drive(&setup, "ice", mode, none).unwrap();
        println!("{mode:?} none: {:?}", l.lap);
        let l = drive(
            &setup,
            "all",
            mode,
            Gates {
                soc: -10.0,
                ..Gates::OPEN
            },
        )
        .unwrap();
        println!("{mode:?} all: {:?}", l.lap);
        for s in published() {
            let l = drive(&setup, &s.name, mode, s.gates).unwrap();
            println!(
                "{:20} dep {:.3} K {:.3} H {:.3} soc {:.3} fuel {:.3} share {:.3} t {:.3} err {:.1e}",
                s.name,
                l.lap.deployed / 1e6,
                l.lap.harvested_k / 1e6,
                l.lap.harvested_h / 1e6,
                1.0 + l.lap.change / 5.3e6,
                l.lap.fuel / 0.748,
                l.lap.motor_time / l.lap.time,
                l.lap.time,
                l.balance_error_j()
            );
        }
    }
    let search = DeploymentSearch {
        car: &setup.car,
        points_m: &setup.points_m,
        closed: setup.closed,
        run_in: setup.run_in,
        entry_mps: 10.0,
    };
    for mj in [1.0, 2.1, 4.0, 5.3] {
        let d = search.best(mj * 1e6, None).unwrap();
        println!(
            "exact {mj} MJ: {:.4} s used {:.4} bound {:.4} programs {} {:.1} s {:?}",
            d.lap.time,
            d.lap.deployed / 1e6,
            d.bound_s,
            d.programs,
            d.seconds,
            d.status
        );
    }
}
