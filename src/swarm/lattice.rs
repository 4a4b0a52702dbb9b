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
}
