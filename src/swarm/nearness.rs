//! How near rows of objectives lie to one another.

/// The least and the greatest value of an objective.
pub(super) fn range(rows: &[Vec<f64>], k: usize) -> (f64, f64) {
    let ends = (f64::INFINITY, f64::NEG_INFINITY);
    rows.iter()
        .map(|row| row[k])
        .fold(ends, |(low, high), x| (low.min(x), high.max(x)))
}

/// Crowding distance of each row among all (Deb et al. 2002): the sum over objectives of the gap between its neighbours, as a share of
/// the range; infinite for the extremes.
pub(super) fn crowding(rows: &[&[f64]]) -> Vec<f64> {
    let mut distance = vec![0.0; rows.len()];
    let width = rows.first().map_or(0, |r| r.len());
    let mut order: Vec<usize> = (0..rows.len()).collect();
    for k in 0..width {
        let column: Vec<f64> = rows.iter().map(|r| r[k]).collect();
        let value = |i: usize| column[i];
        order.sort_by(|&a, &b| value(a).total_cmp(&value(b)).then(a.cmp(&b)));
        let (Some(&first), Some(&last)) = (order.first(), order.last()) else {
            continue;
        };
        let range = value(last) - value(first);
        distance[first] = f64::INFINITY;
        distance[last] = f64::INFINITY;
        if range > 0.0 {
            for w in order.windows(3) {
                distance[w[1]] += (value(w[2]) - value(w[0])) / range;
            }
        }
    }
    distance
}

/// Distance of each row to its nearest neighbour, each objective as a share of its range; ties, which
/// every nearest pair is, by the next neighbours. As ranks, from zero.
pub(super) fn remoteness(rows: &[Vec<f64>]) -> Vec<f64> {
    let n = rows.len();
    let width = rows.first().map_or(0, Vec::len);
    let ranges: Vec<(f64, f64)> = (0..width).map(|k| range(rows, k)).collect();
    let scale = |k: usize| {
        let (low, high) = ranges[k];
        if high > low { 1.0 / (high - low) } else { 0.0 }
    };
    let square = |i: usize, j: usize| -> f64 {
        let gap = |k: usize| (rows[i][k] - rows[j][k]) * scale(k);
        (0..width).map(|k| gap(k).powi(2)).sum()
    };
    let nearest = |i: usize| {
        let mut two = [f64::INFINITY; 2];
        for j in (0..n).filter(|&j| j != i) {
            let d = square(i, j);
            if d < two[0] {
                two = [d, two[0]];
            } else if d < two[1] {
                two[1] = d;
            }
        }
        two
    };
    let neighbours: Vec<[f64; 2]> = (0..n).map(nearest).collect();
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by(|&a, &b| {
        let (p, q) = (neighbours[a], neighbours[b]);
        p[0].total_cmp(&q[0]).then(p[1].total_cmp(&q[1]))
    });
    // Ranks, which keep the order with its ties broken.
    let mut worth = vec![0.0; n];
    for (rank, &i) in order.iter().enumerate() {
        worth[i] = rank as f64;
    }
    worth
}
