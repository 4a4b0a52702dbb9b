//! Identification from the library: how stiffly and how strongly damped did the car that drove the bundled lap roll?
//!
//! Four unknowns, a short search and a least-squares polish. The bundled lap is simulated, so the truth is known. Ends with
//! an error if the parameters found are not those of the car that drove.
//!
//! `cargo run --release --example identify`

use lapswarm::study::framework::{Study, solve_unobserved};
use lapswarm::study::identify::{FreeParameter, Identify, IdentifySettings};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let free = |name: &str, lower, upper| FreeParameter {
        name: name.to_owned(),
        lower,
        upper,
    };
    let settings = IdentifySettings {
        free: vec![
            free("rBy1", 5.0, 25.0),
            free("rCy1", 0.8, 1.5),
            free("roll_stiffness_nm_per_rad", 3e4, 3e5),
            free("roll_damping_nms_per_rad", 3e3, 5e4),
        ]
        .into(),
        population: Some(32),
        iterations: Some(20),
        ..IdentifySettings::default()
    };
    let setup = Identify::prepare(&settings)?;
    let outcome = solve_unobserved::<Identify>(&settings, &setup)?;
    let truth = setup.truth.as_deref().ok_or("the bundled lap has no truth")?;

    let mut worst: f64 = 0.0;
    let unknowns = setup.replay.problem.variables.iter();
    for ((unknown, found), true_value) in unknowns.zip(&outcome.candidate).zip(truth) {
        println!(
            "{:28} {found:14.6} {:10} (truth {true_value})",
            unknown.name, unknown.unit
        );
        worst = worst.max((found / true_value - 1.0).abs());
    }
    println!("worst relative error: {worst:.1e}");
    if worst > 1e-6 {
        return Err("the car found is not the one that drove".into());
    }
    Ok(())
}
