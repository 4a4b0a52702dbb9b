//! Even shares of one among several.

/// All ways to share `steps` among `m`, 1 or more, as shares of one (Das, Dennis, *Normal-boundary intersection*, SIAM J.
/// Optimization 8, 1998).
pub fn lattice(m: usize, steps: u32) -> Vec<Vec<f64>> {
    if m == 1 {
        return vec![vec![1.0]];
    }
    let mut rows: Vec<Vec<u32>> = vec![Vec::new()];
    for _ in 1..m {
        rows = rows
            .into_iter()
            .flat_map(|row| {
                let left = steps - row.iter().sum::<u32>();
                (0..=left).map(move |k| {
                    let mut next = row.clone();
                    next.push(k);
                    next
                })
            })
            .collect();
    }
    rows.into_iter()
        .map(|mut row| {
            row.push(steps - row.iter().sum::<u32>());
            row.into_iter().map(|k| f64::from(k) / f64::from(steps)).collect()
        })
        .collect()
}

/// Directions of length one in so many objectives: at most `most` of them, but one for each objective at least.
pub(super) fn directions(objectives: usize, most: usize) -> Vec<Vec<f64>> {
    let finest = |room: usize| {
        (1..=room)
            .take_while(move |&parts| count(objectives, parts) <= room)
            .last()
    };
    if objectives == 1 {
        return vec![vec![1.0]];
    }
    let outer = finest(most).unwrap_or(1);
    let mut all = lattice(objectives, outer as u32);
    if outer < objectives
        && let Some(inner) = finest(most.saturating_sub(all.len()))
    {
        let middle = 1.0 / objectives as f64;
        let nearer = |row: Vec<f64>| -> Vec<f64> { row.into_iter().map(|x| 0.5 * (x + middle)).collect() };
        all.extend(
            lattice(objectives, inner.min(outer) as u32)
                .into_iter()
                .map(nearer),
        );
    }
    for row in &mut all {
        let length = row.iter().map(|x| x * x).sum::<f64>().sqrt();
        row.iter_mut().for_each(|x| *x /= length);
    }
    all
}

/// How many points [`lattice`] has.
fn count(objectives: usize, parts: usize) -> usize {
    (1..objectives).fold(1_usize, |found, k| found.saturating_mul(parts + k) / k)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lattice_covers_the_simplex_evenly() {
        let rows = lattice(3, 4);
        assert_eq!(rows.len(), 15);
        assert!(rows.iter().all(|r| (r.iter().sum::<f64>() - 1.0).abs() < 1e-15));
        assert!(rows.contains(&vec![0.0, 0.25, 0.75]));
    }

    /// The paper's table of populations: 3, 5, 8, 10 and 15 objectives.
    #[test]
    fn directions_of_the_paper() {
        for (objectives, population, found) in [
            (3, 92, 91),
            (5, 212, 210),
            (8, 156, 156),
            (10, 276, 275),
            (15, 136, 135),
            (2, 100, 100),
            (1, 10, 1),
            (6, 4, 6),
        ] {
            let all = directions(objectives, population);
            assert_eq!(all.len(), found, "{objectives} objectives");
            for (i, row) in all.iter().enumerate() {
                let square: f64 = row.iter().map(|x| x * x).sum();
                assert!((square - 1.0).abs() < 1e-14 && row.iter().all(|x| *x >= 0.0));
                let apart = |other: &Vec<f64>| other.iter().zip(row).any(|(a, b)| (a - b).abs() > 1e-6);
                assert!(all[..i].iter().all(apart), "{row:?}");
            }
        }
    }
}
