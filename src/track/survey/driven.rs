//! The line of one lap in a telemetry log with GPS.

use super::geographic::{self, Fix};
use super::{Raw, SurveyOptions};
use crate::Result;
use crate::telemetry::{DrivenLap, Recording};
use std::path::Path;

/// Least distance between points of a driven line (m). GPS repeats positions between its own samples, and its relative error
/// grows as steps shrink.
const STEP_M: f64 = 2.0;

/// Whether a file is a log rather than a survey.
pub(super) fn is_log(bytes: &[u8], path: &Path) -> bool {
    Recording::looks_like_one(bytes, path)
}

/// Reads the lap asked for, or the first complete one.
pub(super) fn read(bytes: &[u8], path: &Path, options: &SurveyOptions) -> Result<Raw> {
    let recording = Recording::parse(bytes, path)?;
    let DrivenLap {
        latitude_deg,
        longitude_deg,
        lines,
        number,
        ..
    } = recording.driven_lap(options.lap)?;
    let fixes: Vec<Fix> = latitude_deg
        .iter()
        .zip(&longitude_deg)
        .map(|(&latitude_deg, &longitude_deg)| Fix {
            latitude_deg,
            longitude_deg,
        })
        .collect();
    let all = geographic::project(&fixes, path, &|i| super::place(&lines, i))?;
    let mut raw = Raw {
        name: number.map(|n| format!("{}, lap {n}", super::stem(path))),
        ..Raw::default()
    };
    for (i, &point) in all.iter().enumerate() {
        if raw
            .points
            .last()
            .is_none_or(|last| last.distance(point) >= STEP_M)
        {
            raw.points.push(point);
            if let Some(&line) = lines.get(i) {
                raw.lines.push(line);
            }
        }
    }
    // The last point of a lap may stand on the first one.
    while raw.points.len() > 2 && raw.points[0].distance(raw.points[raw.points.len() - 1]) < STEP_M {
        raw.points.pop();
        raw.lines.truncate(raw.points.len());
    }
    Ok(raw)
}
