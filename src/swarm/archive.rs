//! The archive of solutions that nothing found so far dominates.

/// A bounded set of non-dominated solutions; all objectives are minimised.
#[derive(Clone, Debug)]
pub struct Archive {
    capacity: usize,
    /// Positions in the unit cube, one row per member.
    pub positions: Vec<Vec<f64>>,
    /// Objectives, one row per member.
    pub objectives: Vec<Vec<f64>>,
}

/// Whether `a` is at least as good as `b` in every objective and better in one.
pub fn dominates(a: &[f64], b: &[f64]) -> bool {
    a.iter().zip(b).all(|(x, y)| x <= y) && a.iter().zip(b).any(|(x, y)| x < y)
}

impl Archive {
    /// An empty archive of at most `capacity` members.
    pub fn new(capacity: usize) -> Self {
        Self {
            capacity,
            positions: Vec::new(),
            objectives: Vec::new(),
        }
    }

    /// Number of members.
    pub fn len(&self) -> usize {
        self.objectives.len()
    }

    /// Whether there are no members.
    pub fn is_empty(&self) -> bool {
        self.objectives.is_empty()
    }

    /// Takes a solution in unless a member dominates or equals it; members that it dominates leave. Returns
    /// whether it came in. [`Archive::truncate`] bounds the size afterwards.
    pub fn insert(&mut self, position: &[f64], objectives: &[f64]) -> bool {
        if self
            .objectives
            .iter()
            .any(|m| m == objectives || dominates(m, objectives))
        {
            return false;
        }
        let mut kept = 0;
        for i in 0..self.len() {
            if !dominates(objectives, &self.objectives[i]) {
                self.objectives.swap(kept, i);
                self.positions.swap(kept, i);
                kept += 1;
            }
        }
        self.objectives.truncate(kept);
        self.positions.truncate(kept);
        self.objectives.push(objectives.to_vec());
        self.positions.push(position.to_vec());
        true
    }

    /// Removes the most crowded member, one at a time, until the archive is within its capacity.
    pub fn truncate(&mut self) {
        while self.len() > self.capacity {
            let crowding = self.crowding();
            let most = (0..self.len())
                .min_by(|&a, &b| crowding[a].total_cmp(&crowding[b]))
                .unwrap_or(0);
            self.objectives.swap_remove(most);
            self.positions.swap_remove(most);
        }
    }

    /// Crowding distance of each member (Deb et al. 2002): the sum over objectives of the gap between its
    /// neighbours, as a share of the range; infinite for the extremes.
    pub fn crowding(&self) -> Vec<f64> {
        let mut distance = vec![0.0; self.len()];
        let width = self.objectives.first().map_or(0, Vec::len);
        for k in 0..width {
            let mut order: Vec<usize> = (0..self.len()).collect();
            order.sort_by(|&a, &b| self.objectives[a][k].total_cmp(&self.objectives[b][k]));
            let (Some(&first), Some(&last)) = (order.first(), order.last()) else {
                continue;
            };
            let range = self.objectives[last][k] - self.objectives[first][k];
            distance[first] = f64::INFINITY;
            distance[last] = f64::INFINITY;
            if range > 0.0 {
                for w in order.windows(3) {
                    distance[w[1]] += (self.objectives[w[2]][k] - self.objectives[w[0]][k]) / range;
                }
            }
        }
        distance
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    #[test]
    fn keeps_exactly_the_non_dominated_without_truncation() {
        let random = Random::new(3);
        let points: Vec<Vec<f64>> = (0..300)
            .map(|i| (0..3).map(|k| random.uniform(1, 0, i, k)).collect())
            .collect();
        let mut archive = Archive::new(1000);
        for p in &points {
            archive.insert(p, p);
        }
        let mut front: Vec<_> = points
            .iter()
            .filter(|p| !points.iter().any(|q| dominates(q, p)))
            .cloned()
            .collect();
        let mut kept = archive.objectives.clone();
        let key = |a: &Vec<f64>, b: &Vec<f64>| a[0].total_cmp(&b[0]);
        front.sort_by(key);
        kept.sort_by(key);
        assert_eq!(front, kept);
    }

    #[test]
    fn truncation_keeps_extremes_and_bound() {
        let mut archive = Archive::new(10);
        for i in 0..100 {
            let x = f64::from(i) / 99.0;
            archive.insert(&[x], &[x, 1.0 - x]);
        }
        archive.truncate();
        assert_eq!(archive.len(), 10);
        assert!(archive.objectives.contains(&vec![0.0, 1.0]) && archive.objectives.contains(&vec![1.0, 0.0]));
        assert!(!archive.insert(&[0.0], &[0.0, 1.0]), "no duplicates");
    }
}
