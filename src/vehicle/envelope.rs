//! The g-g-v envelope of a car: the greatest accelerations at each speed, within which a point mass laps.
//!
//! The acceleration by the tyres stays inside a friction ellipse. Its half axes are the greatest lateral and longitudinal
//! acceleration, which depend on speed. A car that is driven on one axle has less of it for driving: the envelope may have a table
//! of its traction over speed and share of the lateral limit. The engine limits driving too. Drag is not a force of the tyres, so
//! it stays outside the ellipse. (D. L. Brayshaw and M. F. Harrison, *A quasi steady state approach to race car lap simulation*, Proc. IMechE D 219,
//! 2005, for the g-g-speed surface.)

mod file;

use crate::error::{Error, Place, Result};
use serde::{Deserialize, Serialize};

/// The g-g-v envelope at one speed.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct EnvelopeRow {
    /// Speed (m/s).
    pub v_mps: f64,
    /// Greatest lateral acceleration (m/s^2).
    pub ay_mps2: f64,
    /// Greatest longitudinal acceleration by the tyres' grip, driving or braking (m/s^2).
    pub ax_grip_mps2: f64,
    /// Greatest acceleration that the engine can give, before drag (m/s^2).
    pub ax_drive_mps2: f64,
    /// Deceleration by drag and rolling resistance (m/s^2).
    pub drag_mps2: f64,
}

impl EnvelopeRow {
    fn to_array(self) -> [f64; 5] {
        [
            self.v_mps,
            self.ay_mps2,
            self.ax_grip_mps2,
            self.ax_drive_mps2,
            self.drag_mps2,
        ]
    }

    fn from_array([v_mps, ay_mps2, ax_grip_mps2, ax_drive_mps2, drag_mps2]: [f64; 5]) -> Self {
        Self {
            v_mps,
            ay_mps2,
            ax_grip_mps2,
            ax_drive_mps2,
            drag_mps2,
        }
    }
}

/// The traction in bends: greatest acceleration by the driven tyres over speed and share of the lateral limit.
#[derive(Clone, Debug, PartialEq)]
pub struct BendTraction {
    /// Shares of the lateral limit, rising from 0 to 1.
    pub shares: Vec<f64>,
    /// The accelerations (m/s^2) at these shares, for each speed of the envelope.
    pub rows: Vec<Vec<f64>>,
    /// What slip and the drag of tyres in bends take from the engine's acceleration (m/s^2), likewise; zeros where a table says
    /// nothing of it.
    pub lost: Vec<Vec<f64>>,
}

impl BendTraction {
    /// A table that says nothing of losses.
    pub fn without_losses(shares: Vec<f64>, rows: Vec<Vec<f64>>) -> Self {
        let lost = vec![vec![0.0; shares.len()]; rows.len()];
        Self { shares, rows, lost }
    }
}

/// What a share of the lateral limit leaves of a friction ellipse's other half axis.
pub fn root_left(share: f64) -> f64 {
    (1.0 - share * share).max(0.0).sqrt()
}

/// The traction (m/s^2) at a root of what the lateral share leaves, and its derivative by that root.
///
/// What is left of the traction near the limit falls with that root, so it is linear in it between the shares.
pub fn traction_at_root(shares: &[f64], figures: &[f64], root: f64) -> (f64, f64) {
    let after = shares
        .partition_point(|share| root_left(*share) >= root)
        .clamp(1, shares.len() - 1);
    let (more, less) = (root_left(shares[after - 1]), root_left(shares[after]));
    let slope = (figures[after - 1] - figures[after]) / (more - less);
    (figures[after] + (root - less) * slope, slope)
}

/// A g-g-v envelope: greatest accelerations over speed.
///
/// Between rows the figures are linear in speed; below the first row they are those of the first row. There is no drive at or
/// above the last speed, which is therefore the top speed of the car.
#[derive(Clone, Debug, PartialEq)]
pub struct Envelope {
    name: String,
    rows: Vec<EnvelopeRow>,
    in_bends: Option<BendTraction>,
    open: Option<Box<Self>>,
    loads: Vec<(f64, Self)>,
}

/// The columns of an envelope's table, in the order that [`Envelope::to_csv`] writes them.
pub const ENVELOPE_COLUMNS: [&str; 5] = ["v_mps", "ay_mps2", "ax_grip_mps2", "ax_drive_mps2", "drag_mps2"];

/// Columns that a table may have besides: the traction at a share of the lateral limit, which the name ends with.
pub const TRACTION_COLUMN: &str = "ax_traction_mps2_at_";

/// Columns that go with these: what the tyres take there of the engine's acceleration.
pub const LOST_COLUMN: &str = "ax_lost_mps2_at_";

/// What the names of columns begin with that hold the figures with the DRS open.
pub const OPEN_COLUMN: &str = "open_";

/// Range of each column: the least value, whether that value itself is allowed, and the greatest.
const RANGES: [(f64, bool, f64); 5] = [
    (0.0, true, 200.0),
    (0.0, false, 200.0),
    (0.0, false, 200.0),
    // At constant power, acceleration grows without bounds towards standstill.
    (0.0, true, 1e5),
    (0.0, true, 200.0),
];

impl Envelope {
    /// An envelope of these rows; `name` is what errors and titles call it.
    ///
    /// # Errors
    /// [`Error::Input`] if there are fewer than two rows, if speeds do not rise, or if a figure is out of range.
    pub fn new(name: impl Into<String>, rows: Vec<EnvelopeRow>) -> Result<Self> {
        let name = name.into();
        for (index, row) in rows.iter().enumerate() {
            check_row(&name, Place::row(index + 1), row, rows[..index].last())?;
        }
        check_count(&name, rows.len())?;
        Ok(Self {
            name,
            rows,
            in_bends: None,
            open: None,
            loads: Vec::new(),
        })
    }

    /// The envelope with a table of its traction in bends.
    ///
    /// # Errors
    /// [`Error::Input`] if shares do not rise from 0 to 1, if a row is missing, or if a figure is out of range or a traction rises
    /// with the share.
    pub fn with_bend_traction(mut self, in_bends: BendTraction) -> Result<Self> {
        let BendTraction { shares, rows, lost } = &in_bends;
        check_shares(&self.name, Place::from("shares of the lateral limit"), shares)?;
        for (name, rows) in [("rows of traction", rows), ("rows of losses", lost)] {
            if rows.len() != self.rows.len() {
                let expected = format!("{}, one for each speed", self.rows.len());
                return Err(Error::input(&self.name, name, rows.len().to_string(), expected));
            }
        }
        for (index, (figures, lost)) in rows.iter().zip(lost).enumerate() {
            check_traction(&self.name, Place::row(index + 1), shares, figures)?;
            check_losses(&self.name, Place::row(index + 1), shares, lost)?;
        }
        self.in_bends = Some(in_bends);
        Ok(self)
    }

    /// The envelope of a car with a DRS; `open` is that with the flap open.
    ///
    /// # Errors
    /// [`Error::Input`] if the speeds of both differ, or if one has traction in bends and the other does not.
    pub fn with_open(mut self, open: Self) -> Result<Self> {
        let speeds = |limits: &Self| -> Vec<f64> { limits.rows.iter().map(|row| row.v_mps).collect() };
        if speeds(&self) != speeds(&open) || self.in_bends.is_some() != open.in_bends.is_some() {
            let found = format!("{} speeds with the flap open", open.rows.len());
            let expected = "the columns and the speeds that it has with the flap shut";
            return Err(Error::input(&self.name, "DRS", found, expected));
        }
        self.open = Some(Box::new(open));
        Ok(self)
    }

    /// The envelope with those of the car under other loads: shares of its weight in even steps, each with its envelope.
    ///
    /// # Errors
    /// [`Error::Input`] if there are fewer than two, if their steps are not even, or if one lacks what this one has.
    pub fn with_loads(mut self, loads: Vec<(f64, Self)>) -> Result<Self> {
        let steps: Vec<f64> = loads.windows(2).map(|pair| pair[1].0 - pair[0].0).collect();
        let even = steps
            .iter()
            .all(|step| *step > 0.0 && (step - steps[0]).abs() < 1e-9);
        let has = |limits: &Self| (limits.in_bends.is_some(), limits.open.is_some());
        if steps.is_empty() || !even || loads.iter().any(|(_, limits)| has(limits) != has(&self)) {
            let shares: Vec<String> = loads.iter().map(|(share, _)| share.to_string()).collect();
            let expected = "two or more in even steps, each with the columns of this envelope";
            return Err(Error::input(&self.name, "loads", shares.join(", "), expected));
        }
        if let Some(open) = &mut self.open {
            let opened = loads.iter().filter_map(|(share, limits)| {
                let limits = limits.open.as_deref()?;
                Some((*share, limits.clone()))
            });
            open.loads = opened.collect();
        }
        self.loads = loads;
        Ok(self)
    }

    /// The envelopes of the car under other loads, each with the share of its weight; none where they were not looked for.
    pub fn loads(&self) -> &[(f64, Self)] {
        &self.loads
    }

    /// The envelope with the DRS open, of a car that has one.
    pub fn open(&self) -> Option<&Self> {
        self.open.as_deref()
    }

    /// The envelope with other figures at the same speeds: `other` gives them from an envelope, this one or that with the DRS open,
    /// and one of its rows. The traction in bends stays.
    ///
    /// # Errors
    /// As [`Envelope::new`] and [`Envelope::with_bend_traction`].
    pub fn with_rows(&self, name: &str, other: &dyn Fn(&Self, &EnvelopeRow) -> EnvelopeRow) -> Result<Self> {
        let mut changed = Self::new(name, self.rows.iter().map(|row| other(self, row)).collect())?;
        if let Some(in_bends) = &self.in_bends {
            changed = changed.with_bend_traction(in_bends.clone())?;
        }
        if let Some(open) = &self.open {
            changed = changed.with_open(open.with_rows(name, other)?)?;
        }
        changed.with_loads_of(self, &|limits| limits.with_rows(name, other))
    }

    /// This envelope with what `changed` makes of another's under loads, if that has them.
    ///
    /// # Errors
    /// As [`Envelope::with_loads`].
    pub(super) fn with_loads_of(self, other: &Self, changed: &dyn Fn(&Self) -> Result<Self>) -> Result<Self> {
        // Those with the flap open have theirs through those with it shut.
        if other.loads.is_empty() || self.in_bends.is_some() != other.loads[0].1.in_bends.is_some() {
            return Ok(self);
        }
        let loads = other
            .loads
            .iter()
            .map(|(share, limits)| Ok((*share, changed(limits)?)));
        self.with_loads(loads.collect::<Result<_>>()?)
    }

    /// The traction in bends, where the envelope has a table of it.
    pub fn bend_traction(&self) -> Option<&BendTraction> {
        self.in_bends.as_ref()
    }

    /// The traction (m/s^2) at a speed (m/s) and a share of the lateral limit, where the envelope has a table of it.
    pub fn traction_at(&self, v_mps: f64, lateral_share: f64) -> Option<f64> {
        let in_bends = self.in_bends.as_ref()?;
        Some(self.in_bend(in_bends, &in_bends.rows, v_mps, lateral_share))
    }

    /// What the tyres take of the engine's acceleration (m/s^2) at a speed (m/s) and a share of the lateral limit.
    pub fn lost_at(&self, v_mps: f64, lateral_share: f64) -> f64 {
        let lost = |in_bends: &BendTraction| self.in_bend(in_bends, &in_bends.lost, v_mps, lateral_share);
        self.in_bends.as_ref().map_or(0.0, lost)
    }

    fn in_bend(&self, table: &BendTraction, rows: &[Vec<f64>], v_mps: f64, lateral_share: f64) -> f64 {
        let after = self.after(v_mps);
        let [low, high] = [after - 1, after];
        let share = self.between(v_mps, low, high);
        let at = |row: usize| traction_at_root(&table.shares, &rows[row], root_left(lateral_share)).0;
        at(low) + share * (at(high) - at(low))
    }

    /// The row that ends the span that a speed (m/s) lies in.
    fn after(&self, v_mps: f64) -> usize {
        let after = self.rows.partition_point(|r| r.v_mps <= v_mps);
        after.clamp(1, self.rows.len() - 1)
    }

    /// How far a speed (m/s) is on its way from one row to another.
    fn between(&self, v_mps: f64, low: usize, high: usize) -> f64 {
        let (low, high) = (self.rows[low].v_mps, self.rows[high].v_mps);
        ((v_mps - low) / (high - low)).clamp(0.0, 1.0)
    }

    /// What errors and titles call it.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// All its figures, with the DRS shut and, of a car that has one, open, and under loads: what laps within it depend on, whatever it is called.
    pub fn figures(&self) -> Vec<(&[EnvelopeRow], Option<&BendTraction>)> {
        let loads = self.loads.iter().map(|(_, limits)| limits);
        let states = std::iter::once(self)
            .chain(loads)
            .flat_map(|limits| [Some(limits), limits.open()]);
        states
            .flatten()
            .map(|state| (state.rows(), state.bend_traction()))
            .collect()
    }

    /// The rows, by rising speed.
    pub fn rows(&self) -> &[EnvelopeRow] {
        &self.rows
    }

    /// The greatest speed (m/s).
    pub fn top_speed_mps(&self) -> f64 {
        self.rows[self.rows.len() - 1].v_mps
    }

    /// The envelope at a speed (m/s). At the top speed and above there is no drive.
    pub fn at(&self, v_mps: f64) -> EnvelopeRow {
        let after = self.after(v_mps);
        let share = self.between(v_mps, after - 1, after);
        let (low, high) = (self.rows[after - 1].to_array(), self.rows[after].to_array());
        let mut figures: [f64; 5] = std::array::from_fn(|i| low[i] + share * (high[i] - low[i]));
        figures[0] = v_mps;
        if v_mps >= self.top_speed_mps() {
            figures[3] = 0.0;
        }
        EnvelopeRow::from_array(figures)
    }
}

fn check_shares(file: &str, place: Place, shares: &[f64]) -> Result<()> {
    let rise = shares.windows(2).all(|pair| pair[0] < pair[1]);
    if !(rise && shares.first() == Some(&0.0) && shares.last() == Some(&1.0)) {
        return Err(Error::input(
            file,
            place,
            in_list(shares),
            "shares that rise from 0 to 1, each once",
        ));
    }
    Ok(())
}

fn in_list(shares: &[f64]) -> String {
    let shares: Vec<String> = shares.iter().map(f64::to_string).collect();
    shares.join(", ")
}

fn check_losses(file: &str, place: Place, shares: &[f64], figures: &[f64]) -> Result<()> {
    let mut each = shares.iter().zip(figures);
    if figures.len() != shares.len() {
        let (found, expected) = (figures.len(), shares.len());
        return Err(Error::input(
            file,
            place,
            format!("{found} losses"),
            format!("{expected}, one for each share"),
        ));
    }
    match each.find(|(_, figure)| !(0.0..=200.0).contains(*figure)) {
        Some((share, figure)) => {
            let place = place.field(format!("{LOST_COLUMN}{share}"));
            Err(Error::input(file, place, figure.to_string(), "0 to 200"))
        }
        None => Ok(()),
    }
}

fn check_traction(file: &str, place: Place, shares: &[f64], figures: &[f64]) -> Result<()> {
    if figures.len() != shares.len() {
        let expected = format!("{}, one for each share", shares.len());
        return Err(Error::input(
            file,
            place,
            format!("{} figures", figures.len()),
            expected,
        ));
    }
    let mut most = 200.0;
    for (figure, share) in figures.iter().zip(shares) {
        if !(*figure >= 0.0 && *figure <= most) {
            let place = place.field(format!("{TRACTION_COLUMN}{share}"));
            let expected = format!("0 to {most}: a car that corners more has no more traction");
            return Err(Error::input(file, place, figure.to_string(), expected));
        }
        most = *figure;
    }
    Ok(())
}

fn check_count(file: &str, rows: usize) -> Result<()> {
    if rows < 2 {
        return Err(Error::input(
            file,
            "rows",
            rows.to_string(),
            "at least two speeds with their limits",
        ));
    }
    Ok(())
}

fn check_row(file: &str, place: Place, row: &EnvelopeRow, before: Option<&EnvelopeRow>) -> Result<()> {
    for ((x, name), (least, allowed, most)) in row.to_array().into_iter().zip(ENVELOPE_COLUMNS).zip(RANGES) {
        if !(x > least && x <= most || allowed && x == least) {
            return Err(Error::input(
                file,
                place.field(name),
                x.to_string(),
                if allowed {
                    format!("{least} to {most}")
                } else {
                    format!("more than {least}, at most {most}")
                },
            ));
        }
    }
    let rises = before.is_none_or(|b| row.v_mps > b.v_mps);
    if !rises {
        return Err(Error::input(
            file,
            place.field(ENVELOPE_COLUMNS[0]),
            row.v_mps.to_string(),
            "a speed beyond that of the row before",
        ));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "# a car\ndrag_mps2,v_mps,ay_mps2,ax_grip_mps2,ax_drive_mps2\n0.5,20,15,14,9\n\n# more\n4,70,18,18,4\n";

    #[test]
    fn a_table_is_read_looked_up_and_written() {
        let envelope = Envelope::from_csv("own.csv", TEXT).unwrap();
        let half = envelope.at(45.0);
        assert_eq!(half.to_array(), [45.0, 16.5, 16.0, 6.5, 2.25]);
        assert_eq!(envelope.at(5.0).to_array(), [5.0, 15.0, 14.0, 9.0, 0.5]);
        assert_eq!(envelope.at(70.0).to_array(), [70.0, 18.0, 18.0, 0.0, 4.0]);
        assert_eq!(envelope.at(90.0).ax_drive_mps2, 0.0);
        assert_eq!(
            Envelope::from_csv("own.csv", &envelope.to_csv()).unwrap(),
            envelope
        );
    }

    const IN_BENDS: &str = "v_mps,ax_traction_mps2_at_1,ay_mps2,ax_grip_mps2,ax_drive_mps2,drag_mps2,ax_traction_mps2_at_0,\
                            ax_traction_mps2_at_0.8\n20,1,15,14,9,0.5,10,7\n70,0,18,18,4,4,12,9\n";

    /// Half-way in speed the figures are their means. Between shares they go with the root of what is left: 0.9 leaves 0.436, which
    /// is 0.436 / 0.6 of the way from 1 to 0.8.
    #[test]
    fn traction_in_bends_is_read_looked_up_and_written() {
        let envelope = Envelope::from_csv("own.csv", IN_BENDS).unwrap();
        assert_eq!(envelope.bend_traction().unwrap().shares, [0.0, 0.8, 1.0]);
        let at = |v: f64, share: f64| envelope.traction_at(v, share).unwrap();
        for (found, wanted) in [
            (at(20.0, 0.0), 10.0),
            (at(45.0, 0.8), 8.0),
            (at(5.0, 1.0), 1.0),
            (at(90.0, 0.8), 9.0),
            (at(20.0, 0.9), 1.0 + 6.0 * 0.19f64.sqrt() / 0.6),
        ] {
            assert!((found - wanted).abs() < 1e-12, "{found} {wanted}");
        }
        let again = Envelope::from_csv("own.csv", &envelope.to_csv()).unwrap();
        assert_eq!(again, envelope);
        let plain = Envelope::from_csv("own.csv", TEXT).unwrap();
        assert_eq!(plain.traction_at(30.0, 0.5), None);
        let same = |_: &Envelope, row: &EnvelopeRow| *row;
        assert_eq!(envelope.with_rows("own.csv", &same).unwrap(), envelope);
        let less = |limits: &Envelope, row: &EnvelopeRow| EnvelopeRow {
            drag_mps2: row.drag_mps2 * if std::ptr::eq(limits, &envelope) { 0.8 } else { 1.0 },
            ..*row
        };
        let open = envelope.with_rows("own.csv", &less).unwrap();
        let both = envelope.clone().with_open(open.clone()).unwrap();
        let again = Envelope::from_csv("own.csv", &both.to_csv()).unwrap();
        assert_eq!((again.open(), &again), (Some(&open), &both));
        // A flap that is open at speeds of its own belongs to another car.
        assert!(plain.with_open(open).is_err());
    }

    #[test]
    fn mistakes_are_named_by_line_and_field() {
        for (text, wanted) in [
            (
                IN_BENDS.replace("at_0.8", "at_limit"),
                "line 1, column ax_traction_mps2_at_limit: found `limit`",
            ),
            (
                IN_BENDS.replace("at_0.8", "at_1"),
                "line 1, column ax_traction_mps2_at_*: found 0, 1, 1",
            ),
            (
                IN_BENDS.replace(",12,9", ",12,13"),
                "line 3, field ax_traction_mps2_at_0.8: found 13, expected 0 to 12",
            ),
            (
                TEXT.replace("70,18", "70,fast"),
                "own.csv: line 6, field ay_mps2: found `fast`",
            ),
            (
                TEXT.replace("70,18", "70,0"),
                "line 6, field ay_mps2: found 0, expected more than 0",
            ),
            (TEXT.replace("70,18", "70,NaN"), "field ay_mps2: found NaN"),
            (
                TEXT.replace("4,70", "4,20"),
                "line 6, field v_mps: found 20, expected a speed beyond",
            ),
            (
                TEXT.replace("4,70", "-4,70"),
                "field drag_mps2: found -4, expected 0 to",
            ),
            (
                TEXT.replace("drag_mps2", "drag"),
                "line 2, column drag_mps2: found only",
            ),
            (
                TEXT.replace("drag_mps2", "v_mps"),
                "line 2, column v_mps: found it twice",
            ),
            (TEXT.replace("4,70,18,18,4", "4,70"), "line 6: found 2 fields"),
            (TEXT.replace("4,70,18,18,4", ""), "rows: found 1"),
            (String::new(), "column v_mps"),
        ] {
            let error = Envelope::from_csv("own.csv", &text).unwrap_err();
            assert!(error.to_string().contains(wanted), "{error} should say {wanted}");
        }
    }
}
