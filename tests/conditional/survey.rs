//! The surveyed Silverstone: how it is cut, how near the bundled circuit comes to it, and the lap of its centreline.

use crate::common::harness::survey;
use glam::DVec2;
use lapswarm::line::{FineLine, PointMass};
use lapswarm::track::{Circuit, CrossSections, ReferenceLine, Smoothing, Survey, SurveyOptions};
use lapswarm::vehicle::{Envelope, EnvelopeRow};
use std::path::PathBuf;

tests! {
    silverstone_follows_the_survey: survey,
    the_surveyed_silverstone_is_cut_as_others_cut_it: survey,
    the_surveyed_centreline_takes_what_others_found: survey,
}

fn survey_file() -> PathBuf {
    survey().expect("the harness has looked")
}

/// The centreline's points (m).
fn centreline() -> Vec<DVec2> {
    Survey::read(survey_file(), &SurveyOptions::default())
        .unwrap()
        .centre_m
}

/// 1245 kg, 330 kW, CdA 0.9 m^2, at 25 and 65 m/s 15 and 18 m/s^2 sideways and 14 and 18 lengthways, 70 m/s.
fn gt_car() -> PointMass {
    let rows = (1..=280).map(|i| {
        let v_mps = 0.25 * f64::from(i);
        let share = (v_mps * v_mps - 625.0) / (4225.0 - 625.0);
        EnvelopeRow {
            v_mps,
            ay_mps2: 15.0 + 3.0 * share,
            ax_grip_mps2: 14.0 + 4.0 * share,
            ax_drive_mps2: 330e3 / (1245.0 * v_mps),
            drag_mps2: 0.5 * 1.2 * 0.9 / 1245.0 * v_mps * v_mps,
        }
    });
    PointMass::new(Envelope::new("a GT car", rows.collect()).unwrap(), 2.6)
}

/// The length of the polygon that is this share of the road's width from the right (m).
fn line_length(cross_sections: &CrossSections, alpha: f64) -> f64 {
    let points = cross_sections.points(&vec![alpha; cross_sections.len()]);
    let next = points.iter().cycle().skip(1);
    points.iter().zip(next).map(|(a, b)| a.distance(*b)).sum()
}

/// Distance from the surveyed centreline after the best shift: how good the map's figures are.
fn silverstone_follows_the_survey() {
    let survey = centreline();
    let c = Circuit::silverstone_gp().unwrap();
    let mut shift = survey[0];
    let mut rms = f64::INFINITY;
    let mut worst = 0.0;
    let mut stations: Vec<f64> = survey
        .iter()
        .map(|&p| c.project_anywhere(p - shift).station_m)
        .collect();
    for _ in 0..50 {
        let misses: Vec<DVec2> = survey
            .iter()
            .zip(&mut stations)
            .map(|(&p, station)| {
                *station = c.project(p - shift, *station).station_m;
                p - shift - c.position_at(*station)
            })
            .collect();
        let n = misses.len() as f64;
        rms = (misses.iter().map(|m| m.length_squared()).sum::<f64>() / n).sqrt();
        worst = misses.iter().map(|m| m.length()).fold(0.0, f64::max);
        shift += misses.iter().sum::<DVec2>() / n;
    }
    println!(
        "rms {rms:.3} m, worst {worst:.3} m from {} surveyed points",
        survey.len()
    );
    assert!(rms < 1.2 && worst < 4.0, "rms {rms} m, worst {worst} m");
}

fn the_surveyed_silverstone_is_cut_as_others_cut_it() {
    let survey = Survey::read(survey_file(), &SurveyOptions::default()).unwrap();
    assert!(survey.closed && survey.centre_m.len() == 1178);
    let raw = survey.as_surveyed().unwrap();
    let cross_sections = raw.cross_sections(360).unwrap();
    // Figures of the same construction in Python (SciPy's CubicSpline with periodic ends over chord lengths). On these
    // cross-sections Clarabel gives a shortest path of 5710.944 m, and 5734.241 m for a car 2 m wide.
    assert!((raw.length_m() - 5887.369016).abs() < 1e-5, "{}", raw.length_m());
    for (alpha, wanted) in [(0.0, 5839.944606), (0.5, 5883.661769), (1.0, 5927.850141)] {
        assert!(
            (line_length(&cross_sections, alpha) - wanted).abs() < 2e-5,
            "{alpha}"
        );
    }
    let smooth = survey.smoothed(&Smoothing::default()).unwrap();
    for deviation in [
        smooth.line_deviation,
        smooth.left_deviation,
        smooth.right_deviation,
    ] {
        assert!(
            deviation.greatest_m <= 0.25 + 1e-9 && deviation.rms_m < 0.06,
            "{deviation:?}"
        );
    }
    // The edges lie where they lay, and bend less on their way.
    let edges = |line: &ReferenceLine| line.cross_sections(1962).unwrap();
    let (rough, even) = (edges(&raw), edges(&smooth));
    let bending = |p: &[DVec2]| -> f64 {
        (0..p.len())
            .map(|i| p[i] + p[(i + 2) % p.len()] - 2.0 * p[(i + 1) % p.len()])
            .map(|z| z.length_squared())
            .sum()
    };
    let gamma = [&rough.right_m, &even.right_m, &rough.left_m, &even.left_m].map(|p| bending(p));
    println!("squared second differences of the edges: {gamma:?}");
    assert!(gamma[1] < gamma[0] && gamma[3] < gamma[2]);
    for point in even.left_m.iter().step_by(10) {
        let near = rough
            .left_m
            .iter()
            .map(|p| p.distance(*point))
            .fold(f64::INFINITY, f64::min);
        assert!(near < 1.6, "{near}");
    }
    let (circuit, closure) = smooth.circuit().unwrap();
    assert!(closure.gap_m < 0.01, "{closure:?}");
    for &s in &circuit.station_m {
        assert!(circuit.position_at(s).distance(smooth.position_at(s)) < 0.03);
    }
    let most = |line: &ReferenceLine| {
        (0..5886)
            .map(|s| line.curvature_at(f64::from(s)).abs())
            .fold(0.0, f64::max)
    };
    println!(
        "greatest curvature {:.4} 1/m as surveyed, {:.4} smoothed",
        most(&raw),
        most(&smooth)
    );
    assert!(most(&smooth) < most(&raw));
}

/// The surveyed centreline, as far as the public database has it.
fn the_surveyed_centreline_takes_what_others_found() {
    let line = FineLine::new(&centreline(), true, 1.0, Some((&gt_car(), &[])), 0.0).unwrap();
    let time = line.lap_time_s().unwrap();
    println!("{time} s, {} m", line.length_m);
    // A published minimum-time solution for this car has 146 s for the centreline.
    assert!((time - 146.0).abs() < 1.5, "{time}");
}
