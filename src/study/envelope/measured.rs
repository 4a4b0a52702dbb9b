//! A log held against a car's limits: the measured g-g diagram over that of the model.

use super::results::around;
use crate::error::Result;
use crate::report::{Curves, Panel, Table};
use crate::telemetry::Log;
use crate::vehicle::Envelope;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// How much of the limits a log takes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Measured {
    /// The log.
    pub log: String,
    /// Samples at speeds that the limits are known for.
    pub samples: usize,
    /// Share of the limit that the tyres take: the median over the samples,
    pub used_median: f64,
    /// that of which a twentieth takes more,
    pub used_p95: f64,
    /// and the greatest.
    pub used_greatest: f64,
    /// Share of the samples that are beyond the limit.
    pub beyond_share: f64,
}

/// A sample of the log.
pub(super) struct Taken {
    time_s: f64,
    v_mps: f64,
    ay_mps2: f64,
    ax_mps2: f64,
    /// Share of the limit that the tyres take, on the friction ellipse.
    used: f64,
}

/// The samples at speeds that `limits` are known for.
pub(super) fn taken(log: &Log, limits: &Envelope) -> Vec<Taken> {
    let rows = limits.rows();
    let known = rows[0].v_mps..=rows[rows.len() - 1].v_mps;
    (0..log.samples())
        .filter(|i| known.contains(&log.vx_mps[*i]))
        .map(|i| {
            let (v_mps, ay_mps2, ax_mps2) = (log.vx_mps[i], log.ay_mps2[i], log.ax_mps2[i]);
            let row = limits.at(v_mps);
            // Drag is no force of the tyres.
            let along = (ax_mps2 + row.drag_mps2) / row.ax_grip_mps2;
            Taken {
                time_s: log.time_s[i],
                v_mps,
                ay_mps2,
                ax_mps2,
                used: along.hypot(ay_mps2 / row.ay_mps2),
            }
        })
        .collect()
}

impl Measured {
    /// The figures of these samples; nothing without any.
    pub(super) fn of(log: &Log, taken: &[Taken]) -> Option<Self> {
        let mut used: Vec<f64> = taken.iter().map(|t| t.used).collect();
        used.sort_by(f64::total_cmp);
        let beyond = used.iter().filter(|u| **u > 1.0).count();
        let at = |share: f64| Some(used[(share * (used.len().checked_sub(1)?) as f64).round() as usize]);
        Some(Self {
            log: log.source.clone(),
            samples: used.len(),
            used_median: at(0.5)?,
            used_p95: at(0.95)?,
            used_greatest: at(1.0)?,
            beyond_share: beyond as f64 / used.len() as f64,
        })
    }

    /// The figures in words.
    pub(super) fn to_text(&self) -> String {
        format!(
            "{}: of the limit the tyres take {:.0} % in half of {} samples, more than {:.0} % in a twentieth, and {:.0} % at most. \
             {:.1} % of the samples are beyond it.",
            self.log,
            100.0 * self.used_median,
            self.samples,
            100.0 * self.used_p95,
            100.0 * self.used_greatest,
            100.0 * self.beyond_share
        )
    }
}

/// Bands of speed, each with as many samples, that the diagram is drawn for.
const BANDS: usize = 4;
/// Samples that a band shows at most.
const DOTS: usize = 1500;

/// The g-g diagram of the log in bands of speed, with the limit in the middle of each.
pub(super) fn figure(taken: &[Taken], limits: &Envelope, car: &str) -> Curves {
    let mut by_speed: Vec<&Taken> = taken.iter().collect();
    by_speed.sort_by(|a, b| a.v_mps.total_cmp(&b.v_mps));
    let panels = by_speed
        .chunks(by_speed.len().div_ceil(BANDS).max(1))
        .map(|band| {
            let (slow, middle, fast) = (&band[0], &band[band.len() / 2], &band[band.len() - 1]);
            let (across, along) = around(&limits.at(middle.v_mps), limits);
            let shown = band.iter().step_by(band.len().div_ceil(DOTS));
            Panel::new(format!("{:.0} to {:.0} m/s", slow.v_mps, fast.v_mps))
                .x("lateral acceleration", "m/s\u{b2}")
                .y("longitudinal acceleration", "m/s\u{b2}")
                .dots("log", shown.map(|t| (t.ay_mps2, t.ax_mps2)))
                .curve(format!("limit at {:.0} m/s", middle.v_mps), &across, &along)
        });
    Curves::new(
        format!("A log over the limits of the {car}, drag included"),
        panels,
    )
}

/// Writes the samples with what they take of the limit.
///
/// # Errors
/// [`crate::Error::Io`] if the file cannot be written.
pub(super) fn write(path: &Path, taken: &[Taken]) -> Result<()> {
    Table::rows(taken)
        .number("time", "s", |t| t.time_s)
        .number("v", "m/s", |t| t.v_mps)
        .number("ay", "m/s^2", |t| t.ay_mps2)
        .number("ax", "m/s^2", |t| t.ax_mps2)
        .number("limit_used", "-", |t| t.used)
        .table()
        .write_csv(path)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vehicle::EnvelopeRow;

    #[test]
    fn the_tyres_take_what_drag_does_not() {
        let row = |v_mps: f64| EnvelopeRow {
            v_mps,
            ay_mps2: 15.0,
            ax_grip_mps2: 10.0,
            ax_drive_mps2: 4.0,
            drag_mps2: 1.0,
        };
        let limits = Envelope::new("limits", vec![row(10.0), row(60.0)]).unwrap();
        let mut log = crate::telemetry::Log::from_recording(
            &crate::telemetry::Recording::parse(
                include_bytes!("../../../data/laps/gt_silverstone.csv"),
                Path::new("lap.csv"),
            )
            .unwrap(),
            &crate::telemetry::ChannelMap::default(),
            &crate::telemetry::LogOptions::default(),
        )
        .unwrap()
        .slice(0..4)
        .unwrap();
        log.vx_mps = vec![5.0, 20.0, 20.0, 20.0];
        log.ay_mps2 = vec![0.0, 0.0, -12.0, 15.0];
        log.ax_mps2 = vec![0.0, -11.0, -7.0, 5.0];
        let taken = taken(&log, &limits);
        // Full braking; four fifths across and three along; and full cornering with more drive than that leaves.
        let used: Vec<f64> = taken.iter().map(|t| t.used).collect();
        assert!(
            (used[0] - 1.0).abs() < 1e-12 && (used[1] - 1.0).abs() < 1e-12,
            "{used:?}"
        );
        assert!((used[2] - 1.36f64.sqrt()).abs() < 1e-12, "{used:?}");
        let measured = Measured::of(&log, &taken).unwrap();
        assert_eq!((measured.samples, measured.used_greatest), (3, used[2]));
        assert!((measured.beyond_share - 1.0 / 3.0).abs() < 1e-12, "{measured:?}");
        assert_eq!(Measured::of(&log, &[]), None);
    }
}
