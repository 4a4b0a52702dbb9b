//! The Magic Formula against MFeval at thousands of points. Those that tell every coefficient are in the physics tests.

use crate::common::harness::{Case, outside};
use crate::support::{assert_agreement, set_b, worst_differences};
use lapswarm::vehicle::tyre::TyreFile;
use std::path::PathBuf;

pub fn tests() -> Vec<Case> {
    let name = "agrees_with_mfeval_at_every_point_of_the_table";
    let case = Case::new(
        module_path!(),
        name,
        agrees_with_mfeval_at_every_point_of_the_table,
    );
    vec![case.needing(|| FILES.iter().try_for_each(|name| figures(name).map(drop)))]
}

/// Set B, and what MFeval makes of it: load, slip ratio, slip angle, camber, forces and moment.
const FILES: [&str; 2] = ["setB_PAC2002_235_60R16.tir", "mfeval_B_121.csv"];

fn figures(name: &str) -> Result<PathBuf, String> {
    outside(name, "MFeval's set B")
}

fn agrees_with_mfeval_at_every_point_of_the_table() {
    let [tir, table] = FILES.map(|name| figures(name).unwrap());
    let tyre = TyreFile::read(&tir).unwrap().coefficients;
    assert_eq!(
        tyre,
        set_b(),
        "the figures of set B in this test are those of the file"
    );
    let text = std::fs::read_to_string(table).unwrap();
    let rows: Vec<[f64; 7]> = text
        .lines()
        .skip(1)
        .map(|line| {
            let figures: Vec<f64> = line.split(',').map(|x| x.parse().unwrap()).collect();
            figures[..7].try_into().unwrap()
        })
        .collect();
    assert_eq!(rows.len(), 5575);
    let worst = worst_differences(&tyre, rows.into_iter());
    println!(
        "greatest differences: Fx {:e} N, Fy {:e} N, Mz {:e} Nm",
        worst[0], worst[1], worst[2]
    );
    assert_agreement(worst);
}
