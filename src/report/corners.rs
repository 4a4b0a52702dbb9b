//! What laps do in each corner and sector: the table that an engineer reads first.

use super::Table;

/// A lap over a distance that it shares with others.
#[derive(Clone, Debug)]
pub struct CornerLap<'a> {
    name: &'a str,
    /// Shared distance (m), rising.
    at_m: Vec<f64>,
    /// Time since the first of them (s).
    time_s: Vec<f64>,
    v_mps: Vec<f64>,
    ay_mps2: Vec<f64>,
    /// Places of these among those that were given.
    kept: Vec<usize>,
    gear: Vec<f64>,
    grip: Vec<f64>,
}

/// A stretch of the shared distance, with its name.
#[derive(Clone, Debug, PartialEq)]
pub struct Stretch {
    /// What it is called.
    pub name: String,
    /// Where it begins (m).
    pub start_m: f64,
    /// Where it ends (m).
    pub end_m: f64,
}

/// A car corners where it holds this share of the lateral acceleration that it has for a twentieth of the lap.
const CORNERING: f64 = 0.35;
/// The share of a lap in which lateral acceleration is greater.
const GREATEST: f64 = 0.05;
/// What is shorter (m) is a kerb, not a corner; a gap that is shorter parts no corner.
const SHORTEST_M: f64 = 20.0;

impl<'a> CornerLap<'a> {
    /// A lap by its own stations (m), its speed and its lateral acceleration there. Its distances are multiplied by `stretch`, so
    /// that laps of different lengths share theirs; its time is of its own. Places that do not rise and those without a speed are
    /// left out; nothing without two that are left.
    pub fn new(
        name: &'a str,
        station_m: &[f64],
        v_mps: &[f64],
        ay_mps2: &[f64],
        stretch: f64,
    ) -> Option<Self> {
        let mut lap = Self {
            name,
            at_m: Vec::new(),
            time_s: Vec::new(),
            v_mps: Vec::new(),
            ay_mps2: Vec::new(),
            kept: Vec::new(),
            gear: Vec::new(),
            grip: Vec::new(),
        };
        let mut last: Option<(f64, f64)> = None;
        let mut time_s = 0.0;
        for (place, ((&station, &v), &ay)) in station_m.iter().zip(v_mps).zip(ay_mps2).enumerate() {
            let sound = station.is_finite() && ay.is_finite() && v > 0.0 && v.is_finite();
            if !sound || last.is_some_and(|(before, _)| station <= before) {
                continue;
            }
            if let Some((before, v_before)) = last {
                time_s += 2.0 * (station - before) / (v + v_before);
            }
            last = Some((station, v));
            lap.at_m.push(station * stretch);
            lap.time_s.push(time_s);
            lap.v_mps.push(v);
            lap.ay_mps2.push(ay);
            lap.kept.push(place);
        }
        (lap.at_m.len() > 1).then_some(lap)
    }

    /// The lap with the gear at each of its stations, from 1.
    #[must_use]
    pub fn gears(mut self, gear: &[f64]) -> Self {
        self.gear = self.kept_of(gear);
        self
    }

    /// The lap with the share of the grip that is used at each of its stations.
    #[must_use]
    pub fn grip_used(mut self, grip: &[f64]) -> Self {
        self.grip = self.kept_of(grip);
        self
    }

    /// What is kept of figures at all stations; nothing if there is not one for each.
    fn kept_of(&self, figures: &[f64]) -> Vec<f64> {
        let kept = self.kept.iter().map(|place| figures.get(*place).copied());
        kept.collect::<Option<_>>().unwrap_or_default()
    }

    /// The gear where the lap is slowest on a stretch.
    fn slowest_gear(&self, stretch: &Stretch) -> Option<f64> {
        let inside = |at: &f64| (stretch.start_m..=stretch.end_m).contains(at);
        let places = (0..self.gear.len()).filter(|i| inside(&self.at_m[*i]));
        let slowest = places.min_by(|a, b| self.v_mps[*a].total_cmp(&self.v_mps[*b]))?;
        Some(self.gear[slowest])
    }

    /// The mean over time (%) of the grip that is used on a stretch.
    fn mean_grip(&self, stretch: &Stretch) -> Option<f64> {
        if self.grip.is_empty() {
            return None;
        }
        let inside = |i: &usize| self.at_m[*i] >= stretch.start_m && self.at_m[*i + 1] <= stretch.end_m;
        let steps = (0..self.at_m.len() - 1).filter(inside);
        let sums = steps.fold([0.0; 2], |[grip, time], i| {
            let step_s = self.time_s[i + 1] - self.time_s[i];
            [
                grip + 0.5 * (self.grip[i] + self.grip[i + 1]) * step_s,
                time + step_s,
            ]
        });
        (sums[1] > 0.0).then(|| (1e3 * sums[0] / sums[1]).round() / 10.0)
    }

    /// The corners of the lap by number, and by the names of `sections` (start and end in metres) that their middles lie in.
    pub fn corners(&self, sections: &[(String, f64, f64)]) -> Vec<Stretch> {
        let mut sizes: Vec<f64> = self.ay_mps2.iter().map(|a| a.abs()).collect();
        sizes.sort_by(f64::total_cmp);
        let place = ((1.0 - GREATEST) * (sizes.len() - 1) as f64) as usize;
        let least = CORNERING * sizes[place];
        let mut found: Vec<(f64, f64, bool)> = Vec::new();
        for (&at, &ay) in self.at_m.iter().zip(&self.ay_mps2) {
            if ay.abs() < least || least == 0.0 {
                continue;
            }
            let left = ay > 0.0;
            match found.last_mut() {
                Some((_, end, side)) if *side == left && at - *end < SHORTEST_M => *end = at,
                _ => found.push((at, at, left)),
            }
        }
        let long = found
            .into_iter()
            .filter(|(start, end, _)| end - start >= SHORTEST_M);
        let named = long.enumerate().map(|(i, (start_m, end_m, left))| {
            let middle = 0.5 * (start_m + end_m);
            let section = sections
                .iter()
                .find(|(_, from, to)| (*from..=*to).contains(&middle));
            let side = if left { "left" } else { "right" };
            let name = match section {
                Some((section, ..)) => format!("{} {side}, {section}", i + 1),
                None => format!("{} {side}", i + 1),
            };
            Stretch { name, start_m, end_m }
        });
        named.collect()
    }

    /// Three sectors of one length.
    pub fn sectors(&self) -> Vec<Stretch> {
        let (first, last) = (self.at_m[0], self.at_m[self.at_m.len() - 1]);
        let at = |k: usize| first + (last - first) * k as f64 / 3.0;
        let sector = |k: usize| Stretch {
            name: format!("sector {}", k + 1),
            start_m: at(k),
            end_m: at(k + 1),
        };
        (0..3).map(sector).collect()
    }

    /// A quantity of the lap at a distance.
    fn at(&self, values: &[f64], at_m: f64) -> f64 {
        let after = self
            .at_m
            .partition_point(|at| *at <= at_m)
            .clamp(1, self.at_m.len() - 1);
        let (from, to) = (self.at_m[after - 1], self.at_m[after]);
        let share = ((at_m - from) / (to - from)).clamp(0.0, 1.0);
        values[after - 1] + share * (values[after] - values[after - 1])
    }

    /// What the lap has of a quantity on a stretch, its ends among it.
    fn on(&self, values: &[f64], stretch: &Stretch) -> Vec<f64> {
        let inside = self
            .at_m
            .iter()
            .zip(values)
            .filter(|(at, _)| (stretch.start_m..=stretch.end_m).contains(*at));
        let ends = [stretch.start_m, stretch.end_m].map(|at| self.at(values, at));
        inside.map(|(_, v)| *v).chain(ends).collect()
    }

    fn time_on_s(&self, stretch: &Stretch) -> f64 {
        self.at(&self.time_s, stretch.end_m) - self.at(&self.time_s, stretch.start_m)
    }
}

/// What each lap does on each stretch, the laps of one stretch one below the other. Times are against the first lap.
pub fn corner_table(laps: &[CornerLap<'_>], stretches: &[Stretch]) -> Table<'static> {
    let rows = stretches
        .iter()
        .flat_map(|stretch| laps.iter().enumerate().map(move |lap| (stretch, lap)));
    let table = Table::rows(rows)
        .text("where", |(s, _)| s.name.clone())
        .number("from", "m", |(s, _)| s.start_m.round())
        .text("lap", |(_, (_, lap))| lap.name)
        .number("entry speed", "m/s", |(s, (_, lap))| {
            lap.at(&lap.v_mps, s.start_m)
        })
        .number("least speed", "m/s", |(s, (_, lap))| {
            lap.on(&lap.v_mps, s).into_iter().fold(f64::INFINITY, f64::min)
        })
        .number("exit speed", "m/s", |(s, (_, lap))| lap.at(&lap.v_mps, s.end_m))
        .number("greatest lateral", "m/s^2", |(s, (_, lap))| {
            let ay = lap.on(&lap.ay_mps2, s).into_iter();
            ay.map(f64::abs).fold(0.0, f64::max)
        })
        .number("gear", "", |(s, (_, lap))| lap.slowest_gear(s))
        .number("grip used", "%", |(s, (_, lap))| lap.mean_grip(s))
        .number("time", "s", |(s, (_, lap))| milliseconds(lap.time_on_s(s)))
        .number("against the first lap", "s", |(s, (i, lap))| {
            (*i > 0).then(|| milliseconds(lap.time_on_s(s) - laps[0].time_on_s(s)))
        });
    table.table().without_empty()
}

fn milliseconds(time_s: f64) -> f64 {
    (1e3 * time_s).round() / 1e3
}

#[cfg(test)]
mod tests {
    use super::*;

    /// In the bend the car is in second gear where it is slowest, and uses 0.8 of its grip on one half of the time and all on the other.
    #[test]
    fn gear_and_grip_are_those_of_the_corner() {
        let station: Vec<f64> = (0..=400).map(f64::from).collect();
        let of = |inside: &dyn Fn(f64) -> f64, outside: f64| -> Vec<f64> {
            let bend = |s: &f64| {
                if (100.0..=160.0).contains(s) {
                    inside(*s)
                } else {
                    outside
                }
            };
            station.iter().map(bend).collect()
        };
        let gear = of(&|s| if s < 130.0 { 2.0 } else { 3.0 }, 6.0);
        let grip = of(&|s| if s <= 130.0 { 0.8 } else { 1.0 }, 0.1);
        let v = of(&|s| if s == 120.0 { 19.999 } else { 20.0 }, 40.0);
        let ay = of(&|_| 10.0, 0.0);
        let plain = CornerLap::new("a", &station, &v, &ay, 1.0).unwrap();
        let corner = &plain.corners(&[])[0];
        assert_eq!(
            (plain.slowest_gear(corner), plain.mean_grip(corner)),
            (None, None)
        );
        let lap = plain.clone().gears(&gear).grip_used(&grip);
        assert_eq!(lap.slowest_gear(corner), Some(2.0));
        // Thirty metres at 0.8, one between, 29 at 1.
        assert_eq!(lap.mean_grip(corner), Some(89.8));
        // Figures of other stations are none of this lap's.
        assert_eq!(plain.gears(&gear[1..]).slowest_gear(corner), None);
    }

    /// A straight of 100 m, a left bend of 60 m at 20 m/s and 10 m/s^2, a straight, a right bend of 60 m at 30 m/s.
    fn lap(name: &str, bend_mps: f64) -> CornerLap<'_> {
        let station: Vec<f64> = (0..=400).map(f64::from).collect();
        let of = |straight: f64, left: f64, right: f64| -> Vec<f64> {
            let at = |s: &f64| match *s {
                s if (100.0..=160.0).contains(&s) => left,
                s if (260.0..=320.0).contains(&s) => right,
                _ => straight,
            };
            station.iter().map(at).collect()
        };
        let (v, ay) = (of(40.0, bend_mps, 30.0), of(0.0, 10.0, -8.0));
        CornerLap::new(name, &station, &v, &ay, 1.0).unwrap()
    }

    #[test]
    fn corners_are_where_the_car_corners() {
        let sections = [("Hairpin".to_owned(), 90.0, 200.0)];
        let corners = lap("a", 20.0).corners(&sections);
        let found: Vec<_> = corners.iter().map(|c| (&*c.name, c.start_m, c.end_m)).collect();
        assert_eq!(
            found,
            [("1 left, Hairpin", 100.0, 160.0), ("2 right", 260.0, 320.0)]
        );
    }

    #[test]
    fn a_slower_bend_costs_its_time() {
        let laps = [lap("a", 20.0), lap("b", 15.0)];
        let corners = laps[0].corners(&[]);
        let lost = laps[1].time_on_s(&corners[0]) - laps[0].time_on_s(&corners[0]);
        assert!((lost - (60.0 / 15.0 - 60.0 / 20.0)).abs() < 1e-9, "{lost}");
        let text = corner_table(&laps, &corners).to_text();
        assert!(text.contains("against the first lap (s)"), "{text}");
        let b = text
            .lines()
            .find(|line| line.contains("1 left") && line.contains(" b "));
        assert!(
            b.is_some_and(|row| row.contains("15") && row.trim_end().ends_with(" 1")),
            "{text}"
        );
        // One lap alone is against none.
        assert!(!corner_table(&laps[..1], &corners).to_text().contains("against"));
        let whole: f64 = laps[0].sectors().iter().map(|s| laps[0].time_on_s(s)).sum();
        assert!((whole - laps[0].time_s[400]).abs() < 1e-9);
    }

    #[test]
    fn places_that_do_not_rise_are_left_out() {
        let lap = CornerLap::new("a", &[0.0, 1.0, 1.0, 2.0], &[1.0; 4], &[0.0; 4], 2.0).unwrap();
        assert_eq!((lap.at_m, lap.time_s), (vec![0.0, 2.0, 4.0], vec![0.0, 1.0, 2.0]));
        assert!(CornerLap::new("a", &[0.0, f64::NAN], &[1.0; 2], &[0.0; 2], 1.0).is_none());
        // A car that never turns has no corner.
        let straight = CornerLap::new("a", &[0.0, 50.0], &[1.0; 2], &[0.0; 2], 1.0).unwrap();
        assert!(straight.corners(&[]).is_empty());
    }
}
