//! A racing line on every backend that is present: the shortest line round an ellipse, beside the exact optimum.
//!
//! The same search runs on the f64 reference, in f32 lanes on the processor and, where there is a driver, in WGSL kernels.
//! Ends with an error if a backend's line is more than a ten-thousandth longer than the exact one.
//!
//! `cargo run --release --example raceline`

use lapswarm::Error;
use lapswarm::evaluate::BackendChoice;
use lapswarm::evaluate::line::LineObjective;
use lapswarm::optimum::{Bounds, LineMap, shortest};
use lapswarm::study::raceline::{LineSearch, LineSearchSettings, search_line};
use lapswarm::track::Track;
use std::ops::ControlFlow;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let track = Track::load("ellipse:400:250:12")?;
    // The middle of a car of 2 m may use what its sides leave of the road.
    let sections = track.cross_sections(120, true)?.narrowed(2.0)?;
    let exact = shortest(
        &LineMap::at_every_cross_section(&sections),
        &Bounds::road(sections.len()),
    )?;
    println!("exact   {:.4} m", exact.value);

    for backend in [BackendChoice::Cpu, BackendChoice::Simd, BackendChoice::Gpu] {
        let search = LineSearch {
            cross_sections: &sections,
            objective: LineObjective::Length,
            car: None,
            entry_mps: 0.0,
            start: None,
            backend,
            adapter: None,
            known_faults: &[],
        };
        let settings = LineSearchSettings::default();
        match search_line(&search, &settings, None, |_, _, _| Ok(ControlFlow::Continue(()))) {
            Ok(found) => {
                let device = found.backend.map_or(String::new(), |info| info.device);
                println!(
                    "{backend:?}: {:.4} m from {} lines, {device}",
                    found.cost, found.evaluations
                );
                if found.cost / exact.value - 1.0 > 1e-4 {
                    return Err(format!("{backend:?} ended too far from the optimum").into());
                }
            }
            Err(Error::NoDevice(_)) => println!("{backend:?}: no device here"),
            Err(error) => return Err(error.into()),
        }
    }
    Ok(())
}
