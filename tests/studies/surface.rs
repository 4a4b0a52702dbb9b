//! The surface study end to end on the bundled lap.

use lapswarm::config::settings::Settings;
use lapswarm::study::OwnRange;
use lapswarm::study::framework::{Study, solve_unobserved, write_results};
use lapswarm::study::surface::{Surface, SurfaceSettings};

#[test]
fn the_least_cost_is_at_the_car_that_logged_the_lap() {
    let settings = SurfaceSettings {
        share: 0.05,
        grid: 5,
        ..SurfaceSettings::default()
    };
    let setup = Surface::prepare(&settings).expect("the bundled lap");
    let outcome = solve_unobserved::<Surface>(&settings, &setup).expect("it runs");
    let folder = tempfile::tempdir().expect("a temporary folder");
    let written = write_results::<Surface>(folder.path(), &settings, &setup, &outcome);
    let summary = written.expect("files are written");
    // The middle of an odd grid about the car is the car; the log is without noise.
    for (name, least) in &summary.least {
        let least = least.as_ref().expect("cars drive");
        for k in 0..2 {
            let off = (least.at[k] - outcome.base[k]).abs();
            assert!(
                off < 1e-9,
                "{name}: least at {:?}, the car is {:?}",
                least.at,
                outcome.base
            );
        }
    }
    for name in [
        "surface.csv",
        "surface_all.svg",
        "surface_yaw_rate.svg",
        "manifest.json",
        "study.toml",
    ] {
        assert!(folder.path().join(name).is_file(), "{name}");
    }
    let read = SurfaceSettings::read(&folder.path().join("study.toml")).expect("it reads back");
    assert_eq!((read.grid, read.share), (5, 0.05));
}

#[test]
fn axes_may_have_ranges_of_their_own() {
    let range = |name: &str, step: Option<f64>| OwnRange {
        name: name.to_owned(),
        lower: 12.0,
        upper: 13.0,
        step,
    };
    let settings = |ranges: Vec<OwnRange>| SurfaceSettings {
        ranges,
        grid: 3,
        ..SurfaceSettings::default()
    };
    let own = settings(vec![range("rBy1", None)]);
    let setup = Surface::prepare(&own).expect("the bundled lap");
    let [x, y] = &setup.replay.problem.variables[..] else {
        panic!("two variables")
    };
    assert_eq!((x.lower, x.upper), (12.0, 13.0));
    // The other one goes by its share.
    assert!((y.upper / y.lower - 1.5).abs() < 1e-9, "{y:?}");
    for wrong in [range("rBy1", Some(0.5)), range("K", None)] {
        let name = wrong.name.clone();
        let error = Surface::prepare(&settings(vec![wrong]))
            .err()
            .expect("no such range");
        assert!(error.to_string().contains(&format!("ranges.{name}")), "{error}");
    }
}

#[test]
fn one_parameter_makes_no_surface() {
    let settings = SurfaceSettings {
        parameters: ["K".to_owned(), "K".to_owned()],
        ..SurfaceSettings::default()
    };
    let error = settings.validate().expect_err("one parameter").to_string();
    assert!(error.contains("parameters"), "{error}");
}
