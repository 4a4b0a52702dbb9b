//! What each tyre does over a lap, as columns of tables and as traces of pages.

use crate::report::{LapLine, LapView, Table};
use crate::vehicle::wheels::{Moment, WHEELS, Wheel};

/// A channel that every tyre has.
struct TyreChannel {
    /// In files.
    name: &'static str,
    /// On pages.
    label: &'static str,
    unit: &'static str,
    of: fn(&Wheel) -> f64,
}

const fn channel(
    name: &'static str,
    label: &'static str,
    unit: &'static str,
    of: fn(&Wheel) -> f64,
) -> TyreChannel {
    TyreChannel {
        name,
        label,
        unit,
        of,
    }
}

const CHANNELS: [TyreChannel; 6] = [
    channel("load", "load", "N", |w| w.load_n),
    channel("slip_ratio", "slip ratio", "", |w| w.slip_ratio),
    channel("slip_angle", "slip angle", "rad", |w| w.slip_angle_rad),
    channel("longitudinal_force", "longitudinal force", "N", |w| {
        w.longitudinal_n
    }),
    channel("lateral_force", "lateral force", "N", |w| w.lateral_n),
    channel("friction_used", "friction used", "", Wheel::friction),
];

impl TyreChannel {
    /// The values of the wheel `k`: not a number where nothing is known of the car.
    fn values(&self, moments: &[Option<Moment>], k: usize) -> Vec<f64> {
        let of = |moment: &Option<Moment>| moment.map_or(f64::NAN, |m| (self.of)(&m.wheels[k]));
        moments.iter().map(of).collect()
    }
}

/// A table with the channels of every tyre behind its columns, such as `load_fl` (N); as many rows as `moments`.
pub fn with_tyres<'a>(table: Table<'a>, moments: &[Option<Moment>]) -> Table<'a> {
    let columns = CHANNELS
        .iter()
        .flat_map(|channel| (0..WHEELS.len()).map(move |k| (channel, k)));
    columns.fold(table, |table, (channel, k)| {
        let name = format!("{}_{}", channel.name, WHEELS[k]);
        table.numbers(name, channel.unit, channel.values(moments, k))
    })
}

/// The channels of every tyre over distances (m), one to each moment.
pub fn tyre_view(distance_m: &[f64], moments: &[Option<Moment>]) -> LapView {
    let lines = WHEELS.iter().enumerate().map(|(k, name)| {
        let line = LapLine::new(name.to_uppercase(), distance_m);
        let channels = CHANNELS.iter().enumerate();
        channels.fold(line, |line, (panel, channel)| {
            line.trace(panel, channel.values(moments, k))
        })
    });
    LapView::new("Tyres")
        .note("Friction used is force over load. Forces are along and across each wheel, positive forwards and to the left.")
        .x("distance along the line", "m")
        .panels(CHANNELS.iter().map(|channel| (channel.label, channel.unit)))
        .lines(lines)
}
