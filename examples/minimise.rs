//! One call to minimise a function: a single objective, an equality constraint, and a front of two objectives.
//!
//! The answers are known: a bent cigar is least at its middle, the sheet metal of a closed can that holds a litre is least where it
//! is as high as it is wide, and the trade between being near one point and near another is the line between them. Ends with an
//! error if one of them is not found.
//!
//! `cargo run --release --example minimise`

use lapswarm::evaluate::point::Constraint;
use lapswarm::{minimise, minimise_several};
use std::f64::consts::PI;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // A closure may keep a state. Here it counts its calls.
    let mut calls = 0;
    let cigar = minimise(&[(-100.0, 100.0); 10], |x| {
        calls += 1;
        let rest: f64 = x[1..].iter().map(|x| x * x).sum();
        x[0] * x[0] + 1e6 * rest
    })
    .seed(3)
    .target(1e-10)
    .run()?;
    let (_, cost) = cigar.best().ok_or("every candidate failed")?;
    println!(
        "bent cigar: {cost:.1e} after {calls} calls, stopped by {:?}",
        cigar.stopped
    );

    // Figures of constraints stand behind the objectives: here the volume of a can, less the litre that it must
    // hold to a millilitre.
    let can = minimise_several(&[(0.01, 0.2), (0.01, 0.4)], 1, |x, f| {
        let (radius, height) = (x[0], x[1]);
        f[0] = 2.0 * PI * radius * (radius + height);
        f[1] = PI * radius * radius * height - 1e-3;
    })
    .constraints(vec![Constraint::zero_within(1e-6).in_units_of(1e-3)])
    .run()?;
    let (x, sheet_m2) = can.best().ok_or("every candidate failed")?;
    println!(
        "can: radius {:.4} m, height {:.4} m, {sheet_m2:.5} m^2 of sheet",
        x[0], x[1]
    );

    // Two objectives: the squared distances to (0, 0) and to (1, 1). It stops when 2,000 evaluations gain less than a thousandth.
    let front = minimise_several(&[(-2.0, 3.0); 2], 2, |x, f| {
        f[0] = x[0] * x[0] + x[1] * x[1];
        f[1] = (x[0] - 1.0).powi(2) + (x[1] - 1.0).powi(2);
    })
    .reference(vec![2.2, 2.2])
    .stagnation(2_000, 1e-3)
    .run()?;
    let members = front.front.objectives.len();
    let volume = front
        .history
        .last()
        .and_then(|last| last.hypervolume)
        .unwrap_or(0.0);
    println!(
        "front: {members} members, hypervolume {volume:.4} after {} evaluations",
        front.evaluations
    );

    let off = front
        .front
        .objectives
        .iter()
        .map(|f| (f[0].sqrt() + f[1].sqrt() - 2f64.sqrt()).abs());
    if cost > 1e-10 {
        return Err("the middle of the cigar was not found".into());
    }
    if !can.is_feasible() || (x[1] / x[0] - 2.0).abs() > 1e-2 {
        return Err("the best can was not found".into());
    }
    if members < 50 || off.fold(0.0, f64::max) > 0.05 {
        return Err("the front was not found".into());
    }
    Ok(())
}
