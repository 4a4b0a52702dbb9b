use super::*;
use crate::track::{Shape, Track};
use std::f64::consts::PI;

fn found(
    cross_sections: &CrossSections,
    objective: LineObjective,
    settings: &LineSearchSettings,
) -> FoundLine {
    let search = LineSearch {
        cross_sections,
        objective,
        car: None,
        entry_mps: 0.0,
        start: None,
        backend: BackendChoice::Simd,
        adapter: None,
        known_faults: &[],
    };
    search_line(&search, settings, None, |_, _, _| Ok(ControlFlow::Continue(()))).unwrap()
}

/// A ring of 590 and 600 m with as many sections as corners: the inner polygon is the shortest line.
#[test]
fn the_ring_is_driven_along_the_inside() {
    let ring = Shape::parse("circle:590:600").unwrap().unwrap();
    let cross_sections = ring.cross_sections(361).unwrap();
    let exact = 361.0 * 2.0 * 590.0 * (PI / 361.0).sin();
    for seed in 1..=3 {
        let settings = LineSearchSettings {
            seed,
            ..LineSearchSettings::default()
        };
        let line = found(&cross_sections, LineObjective::Length, &settings);
        let short = line.cost / exact - 1.0;
        assert!((-1e-9..1e-4).contains(&short), "seed {seed}: {short:e}");
    }
}

/// The bundled circuit.
fn circuit(sections: usize) -> CrossSections {
    let track = Track::load("silverstone_gp").unwrap();
    track.cross_sections(sections, false).unwrap()
}

/// The line found is within 0.05 % of the exact shortest one.
fn is_shortest(cross_sections: &CrossSections) {
    let map = crate::optimum::LineMap::at_every_cross_section(cross_sections);
    let bounds = crate::optimum::Bounds::road(cross_sections.len());
    let exact = crate::optimum::shortest(&map, &bounds).unwrap().value;
    let line = found(
        cross_sections,
        LineObjective::Length,
        &LineSearchSettings::default(),
    );
    let short = line.cost / exact - 1.0;
    assert!((-1e-6..5e-4).contains(&short), "{short:e}");
}

/// A third of the bundled circuit as an open road, whose ends are free.
#[test]
fn an_open_road_is_searched_to_its_ends() {
    let part: Vec<usize> = (0..120).collect();
    let mut cross_sections = thinned(&circuit(360), &part);
    cross_sections.closed = false;
    is_shortest(&cross_sections);
}

#[test]
fn the_same_seed_finds_the_same_line() {
    let cross_sections = circuit(120);
    let quick = LineSearchSettings {
        rounds: 1,
        first_controls: 30,
        ..LineSearchSettings::default()
    };
    let bits = |settings: &LineSearchSettings| -> Vec<u64> {
        let line = found(&cross_sections, LineObjective::Gamma, settings);
        line.alpha.iter().map(|a| a.to_bits()).collect()
    };
    assert_eq!(bits(&quick), bits(&quick));
    let other = LineSearchSettings {
        seed: 2,
        ..quick.clone()
    };
    assert_ne!(bits(&quick), bits(&other));
}

/// From the reference line on.
#[test]
fn the_shortest_line_of_the_bundled_circuit() {
    is_shortest(&circuit(360));
}

#[test]
fn settings_that_cannot_be_are_named() {
    let settings = LineSearchSettings {
        sections_per_control: 0.5,
        ..LineSearchSettings::default()
    };
    let message = settings.validate().unwrap_err().to_string();
    assert!(message.contains("sections_per_control"), "{message}");
}
