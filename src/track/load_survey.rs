//! TOML files that name a survey and add what the survey's file lacks.

use std::path::Path;

use serde::Deserialize;
use toml::Spanned;

use super::checker::{Checker, DrsZoneEntry, SectionEntry, parse_toml};
use super::circuit::Corner;
use super::friction::{FRICTION_PLACES, FRICTIONS};
use super::friction_map::FrictionMap;
use super::reference::Smoothing;
use super::survey::{Survey, SurveyOptions};
use crate::Result;
use crate::config::folder_of;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct SurveyFile {
    survey: String,
    name: Option<Spanned<String>>,
    closed: Option<bool>,
    width_m: Option<Spanned<f64>>,
    lap: Option<u32>,
    #[serde(default)]
    bridges: u16,
    #[serde(default)]
    flat: bool,
    smoothing_line_m: Option<Spanned<f64>>,
    smoothing_edges_m: Option<Spanned<f64>>,
    smoothing_height_m: Option<Spanned<f64>>,
    smoothing_bank_deg: Option<Spanned<f64>>,
    friction: Option<Spanned<f64>>,
    friction_map: Option<String>,
    #[serde(default)]
    sections: Vec<SectionEntry>,
    #[serde(default)]
    corners: Vec<CornerEntry>,
    #[serde(default)]
    drs_zones: Vec<DrsZoneEntry>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct CornerEntry {
    name: Spanned<String>,
    station_m: Spanned<f64>,
}

/// Whether a TOML file names a survey.
pub(super) fn is_survey(text: &str) -> bool {
    text.parse::<toml::Table>()
        .is_ok_and(|table| table.contains_key("survey"))
}

/// Reads the survey that a TOML file names; it lies beside it.
pub(super) fn read(path: &Path, text: &str) -> Result<(Survey, Smoothing)> {
    let name = path.display().to_string();
    let file: SurveyFile = parse_toml(&name, text, "a circuit with survey")?;
    let check = Checker { file: &name, text };
    let within = |value: &Option<Spanned<f64>>, field: &str, low: f64, high: f64| {
        let checked = value.as_ref().map(|v| check.within(v, field, low, high));
        checked.transpose()
    };
    let options = SurveyOptions {
        closed: file.closed,
        width_m: within(&file.width_m, "width_m", 0.1, 400.0)?,
        lap: file.lap,
        bridges: usize::from(file.bridges),
        flat: file.flat,
    };
    let usual = Smoothing::default();
    let smoothing = Smoothing {
        line_m: within(&file.smoothing_line_m, "smoothing_line_m", 0.0, 10.0)?.unwrap_or(usual.line_m),
        edges_m: within(&file.smoothing_edges_m, "smoothing_edges_m", 0.0, 10.0)?.unwrap_or(usual.edges_m),
        height_m: within(&file.smoothing_height_m, "smoothing_height_m", 0.0, 10.0)?
            .unwrap_or(usual.height_m),
        bank_deg: within(&file.smoothing_bank_deg, "smoothing_bank_deg", 0.0, 10.0)?
            .unwrap_or(usual.bank_deg),
    };
    let beside = folder_of(path).join(&file.survey);
    let mut survey = Survey::read(beside, &options)?;
    if let Some(name) = &file.name {
        survey.name = check.name(name, "name")?;
    }
    let friction = within(&file.friction, "friction", FRICTIONS.0, FRICTIONS.1)?;
    match (&file.friction_map, friction) {
        _ if file.flat => {}
        (Some(map), elsewhere) => {
            let map = FrictionMap::load(&folder_of(path).join(map))?;
            survey.friction = map.beside(&survey, elsewhere.unwrap_or(1.0))?;
        }
        (None, Some(friction)) if survey.friction.is_empty() => {
            survey.friction = vec![[friction; FRICTION_PLACES]; survey.centre_m.len()];
        }
        _ => {}
    }
    if !(file.sections.is_empty() && file.corners.is_empty() && file.drs_zones.is_empty()) {
        let length_m = survey.smoothed(&smoothing)?.length_m();
        survey.sections = check.sections(&file.sections, length_m)?;
        survey.drs_zones_m = check.drs_zones(&file.drs_zones, length_m, survey.closed)?;
        for corner in &file.corners {
            survey.corners.push(Corner {
                name: check.name(&corner.name, "name")?,
                station_m: check.within(&corner.station_m, "station_m", 0.0, length_m)?,
            });
        }
    }
    Ok((survey, smoothing))
}
