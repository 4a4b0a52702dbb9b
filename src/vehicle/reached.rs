//! What a log reached that a car was fitted to. The car's limits are known up to there; beyond, its tyre model goes on alone.

use crate::config::Table;
use crate::error::Result;

/// Width of a band of speeds, m/s.
const BAND_MPS: f64 = 5.0;
/// What a car holds for less than this (s) is a spike of a sensor, or a kerb.
const HELD_S: f64 = 0.25;
/// Share of a limit from which on a log supports it.
const SUPPORTS: f64 = 0.95;

/// Greatest accelerations that a log holds in a band of speeds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReachedRow {
    /// The band's least speed (m/s).
    pub from_mps: f64,
    /// Greatest lateral acceleration to either side (m/s^2).
    pub ay_mps2: f64,
    /// Greatest deceleration (m/s^2), which drag has a part in.
    pub braking_mps2: f64,
}

/// Greatest accelerations that a log holds, by bands of speed.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Reached {
    rows: Vec<ReachedRow>,
}

/// Keys of the table `[reached]`, each a list with a figure for every band.
const KEYS: [&str; 3] = ["from_mps", "ay_mps2", "braking_mps2"];

impl Reached {
    /// From stretches of a log: speed (m/s), lateral and longitudinal acceleration (m/s^2) of each sample.
    pub fn of<'a>(stretches: impl Iterator<Item = &'a [[f64; 3]]>, dt_s: f64) -> Self {
        let mut reached = Self::default();
        let held = (HELD_S / dt_s).ceil().max(1.0) as usize;
        for window in stretches.flat_map(|stretch| stretch.windows(held)) {
            let least = |of: fn(&[f64; 3]) -> f64| window.iter().map(of).fold(f64::INFINITY, f64::min);
            let [v, ..] = window[held / 2];
            let row = reached.band((v / BAND_MPS).floor() * BAND_MPS);
            row.ay_mps2 = row.ay_mps2.max(least(|s| s[1])).max(least(|s| -s[1]));
            row.braking_mps2 = row.braking_mps2.max(least(|s| -s[2]));
        }
        reached
    }

    /// The row of a band, which is added if it is new.
    fn band(&mut self, from_mps: f64) -> &mut ReachedRow {
        let place = self.rows.partition_point(|row| row.from_mps < from_mps);
        if self.rows.get(place).is_none_or(|row| row.from_mps != from_mps) {
            let row = ReachedRow {
                from_mps,
                ay_mps2: 0.0,
                braking_mps2: 0.0,
            };
            self.rows.insert(place, row);
        }
        &mut self.rows[place]
    }

    /// What it reached about a speed (m/s), if it came to that speed.
    pub fn at(&self, v_mps: f64) -> Option<&ReachedRow> {
        self.rows
            .iter()
            .find(|row| (row.from_mps..row.from_mps + BAND_MPS).contains(&v_mps))
    }

    /// Whether a limit (m/s^2) is as far as the log goes, of which it reached so much, if it came to that speed.
    pub fn supports(reached_mps2: Option<f64>, limit_mps2: f64) -> bool {
        reached_mps2.is_some_and(|reached| reached >= SUPPORTS * limit_mps2)
    }

    /// From a car's table `[reached]`.
    pub(super) fn read(table: &Table<'_>) -> Result<Self> {
        let column = |key: &str| -> Result<Vec<f64>> {
            table
                .numbers(key)?
                .filter(|column| column.iter().all(|x| (0.0..=1e3).contains(x)))
                .ok_or_else(|| table.refuse(key, "a list of numbers from 0 to 1000"))
        };
        let [from, ay, braking] = [column(KEYS[0])?, column(KEYS[1])?, column(KEYS[2])?];
        for (key, column) in [(KEYS[1], &ay), (KEYS[2], &braking)] {
            if column.len() != from.len() {
                return Err(table.refuse(key, format!("{} numbers, as from_mps has", from.len())));
            }
        }
        if from.windows(2).any(|pair| pair[0] >= pair[1]) {
            return Err(table.refuse(KEYS[0], "speeds in ascending order"));
        }
        let rows = from.iter().zip(ay.iter().zip(&braking));
        Ok(Self {
            rows: rows
                .map(|(&from_mps, (&ay_mps2, &braking_mps2))| ReachedRow {
                    from_mps,
                    ay_mps2,
                    braking_mps2,
                })
                .collect(),
        })
    }

    /// As a table of a car's file.
    pub(super) fn to_toml(&self) -> String {
        let columns: [fn(&ReachedRow) -> f64; 3] = [|r| r.from_mps, |r| r.ay_mps2, |r| r.braking_mps2];
        let mut text =
            "# What the log reached, by bands of speed: limits beyond it are extrapolated.\n[reached]\n"
                .to_owned();
        for (key, of) in KEYS.into_iter().zip(columns) {
            let figures: Vec<String> = self.rows.iter().map(|row| format!("{:.3}", of(row))).collect();
            text.push_str(&format!("{key} = [{}]\n", figures.join(", ")));
        }
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vehicle::Car;

    /// Ten seconds at 50 Hz: a left turn at 22 m/s with a spike in it, then braking from 31 m/s.
    fn stretch() -> Vec<[f64; 3]> {
        let mut turn = vec![[22.0, 6.0, 0.5]; 250];
        turn[100][1] = 30.0;
        turn.extend(vec![[31.0, -1.0, -8.0]; 250]);
        turn
    }

    #[test]
    fn what_is_held_counts_and_spikes_do_not() {
        let reached = Reached::of([&stretch()[..]].into_iter(), 0.02);
        let slow = reached.at(23.0).unwrap();
        assert_eq!((slow.from_mps, slow.ay_mps2, slow.braking_mps2), (20.0, 6.0, 0.0));
        let fast = reached.at(30.0).unwrap();
        assert_eq!((fast.ay_mps2, fast.braking_mps2), (1.0, 8.0));
        assert!(reached.at(27.0).is_none() && reached.at(40.0).is_none());
        assert!(Reached::supports(Some(6.0), 6.1) && !Reached::supports(Some(6.0), 14.4));
        assert!(!Reached::supports(None, 1.0));
    }

    #[test]
    fn a_cars_file_keeps_it() {
        let folder = tempfile::tempdir().unwrap();
        let mut car = Car::bundled().unwrap();
        car.reached = Some(Reached::of([&stretch()[..]].into_iter(), 0.02));
        car.write(folder.path(), "car").unwrap();
        let path = folder.path().join("car.toml");
        let back = Car::load(&path.display().to_string()).unwrap();
        assert_eq!(back.reached, car.reached);
        let text = std::fs::read_to_string(&path).unwrap();
        for (there, not, said) in [
            ("ay_mps2 = [6.000, 1.000]", "ay_mps2 = [6.000]", "2 numbers"),
            (
                "from_mps = [20.000, 30.000]",
                "from_mps = [30.0, 20.0]",
                "ascending",
            ),
            ("from_mps = [20.000, 30.000]", "from_mps = \"20\"", "numbers"),
        ] {
            assert!(text.contains(there), "{text}");
            std::fs::write(&path, text.replace(there, not)).unwrap();
            let error = Car::load(&path.display().to_string()).unwrap_err().to_string();
            assert!(error.contains(said), "{error}");
        }
    }
}
