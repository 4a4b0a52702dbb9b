//! A line that leaves the road between its cross-sections, moved in by the least bending that brings it back.

use super::conic::{Affine, ConicProgram, Status};
use crate::error::Result;
use crate::line::{Clearance, FineLine};
use crate::track::CrossSections;

/// Room that a mended line has where it was short of it (m).
const TARGET_M: f64 = 0.001;
/// Rounds at most: the first leaves what the bending of the spline adds, and each later one a small share of it.
const ROUNDS: usize = 12;
/// Clearance up to which an edge is kept in sight (m).
const NEAR_M: f64 = 1.0;
/// Distance over which a move dies away (m), and how many cross-sections it takes in at least.
const REACH_M: f64 = 30.0;
const REACH_CROSS_SECTIONS: f64 = 2.0;
/// Moves are looked for as far from the places that need them as so many of these distances.
const ZONE: f64 = 4.0;

/// `alpha` of a line near the given one on which no clearance is negative; nothing where none is found. `measure` gives a line's
/// fine spline, and the clearances on the right and on the left (m) at each of its points; `found` is what it gave for this one.
///
/// The move is the one of least `sum of (l^2 d'')^2 + d^2` with `d` the distance along the cross-sections: it changes the
/// curvature least, and dies away at the distance `l`.
///
/// # Errors
/// Those of `measure`; [`crate::Error::Study`] if the solver refuses.
pub fn mended(
    cross_sections: &CrossSections,
    alpha: &[f64],
    found: (FineLine, Vec<[f64; 2]>),
    measure: impl Fn(&[f64]) -> Result<(FineLine, Vec<[f64; 2]>)>,
) -> Result<Option<Vec<f64>>> {
    let n = cross_sections.len();
    let spacing_m = cross_sections.length_m / n as f64;
    let reach = (REACH_M / spacing_m).max(REACH_CROSS_SECTIONS);
    let zone = (ZONE * reach).ceil() as isize;
    let ends = cross_sections.right_m.iter().zip(&cross_sections.left_m);
    let across: Vec<_> = ends.map(|(right, left)| *left - *right).collect();
    let widths: Vec<f64> = across.iter().map(|a| a.length()).collect();
    let closed = cross_sections.closed;
    let index = |i: isize| {
        if closed {
            Some(i.rem_euclid(n as isize) as usize)
        } else {
            usize::try_from(i).ok().filter(|i| *i < n)
        }
    };
    let mut moved_m = vec![0.0; n];
    let mut variable = vec![None; n];
    let mut found = Some(found);
    for _ in 0..ROUNDS {
        let moved = alpha.iter().zip(&moved_m).zip(&widths);
        let line: Vec<f64> = moved
            .map(|((alpha, moved), width)| (alpha + moved / width).clamp(0.0, 1.0))
            .collect();
        let (fine, clearances) = found.take().map_or_else(|| measure(&line), Ok)?;
        if Clearance::least(&fine, &clearances).margin_m >= 0.0 {
            return Ok(Some(line));
        }
        // Cross-sections about the places that are short of room move.
        for ((section, _), margins) in fine.section.iter().zip(&clearances) {
            if margins[0].min(margins[1]) < 0.0 {
                for i in *section as isize - zone..=*section as isize + 1 + zone {
                    if let Some(i) = index(i) {
                        variable[i] = Some(0);
                    }
                }
            }
        }
        let mut free = Vec::new();
        for (i, variable) in variable.iter_mut().enumerate() {
            if variable.is_some() {
                *variable = Some(free.len());
                free.push(i);
            }
        }
        let mut program = ConicProgram::new(
            free.iter().map(|&i| -alpha[i] * widths[i]).collect(),
            free.iter().map(|&i| (1.0 - alpha[i]) * widths[i]).collect(),
        );
        let moves = |terms: &[(isize, f64)]| -> Vec<(usize, f64)> {
            let free = terms.iter().filter_map(|(i, weight)| {
                let variable = variable[index(*i)?]?;
                Some((variable, *weight))
            });
            free.collect()
        };
        for i in 0..n as isize {
            let own = moves(&[(i, 1.0)]);
            if !own.is_empty() {
                program.add_square(Affine::change(own));
            }
            let bend = reach * reach;
            let bend = moves(&[(i - 1, bend), (i, -2.0 * bend), (i + 1, bend)]);
            if !bend.is_empty() {
                program.add_square(Affine::change(bend));
            }
        }
        for (place, margins) in clearances.iter().enumerate() {
            let (section, t) = fine.section[place];
            let section = section as isize;
            let ahead = fine.points_m[(place + 1) % fine.points_m.len()] - fine.points_m[place];
            let left = ahead.perp().normalize_or_zero();
            // How the moves of four neighbours move a spline between the middle two, nearly.
            let shares = [
                -0.5 * t * (1.0 - t) * (1.0 - t),
                1.0 + t * t * (1.5 * t - 2.5),
                0.5 * t * (1.0 + t * (4.0 - 3.0 * t)),
                -0.5 * t * t * (1.0 - t),
            ];
            let reaches = shares.iter().zip(section - 1..).map(|(share, i)| {
                let facing = index(i).map_or(0.0, |i| across[i].dot(left) / widths[i]);
                (i, share * facing)
            });
            let terms = moves(&reaches.collect::<Vec<_>>());
            if terms.is_empty() || (!closed && place + 1 == clearances.len()) {
                continue;
            }
            let before: f64 = terms.iter().map(|(k, weight)| weight * moved_m[free[*k]]).sum();
            for (margin, side) in margins.iter().zip([1.0, -1.0]) {
                if *margin < NEAR_M {
                    program.add_nonnegative(Affine {
                        constant: margin - TARGET_M - side * before,
                        terms: terms.iter().map(|(k, weight)| (*k, side * weight)).collect(),
                    });
                }
            }
        }
        let solution = program.solve()?;
        if matches!(solution.status, Status::Failed(_)) {
            return Ok(None);
        }
        for (k, &i) in free.iter().enumerate() {
            moved_m[i] = solution.x[k];
        }
    }
    Ok(None)
}
