//! Ranges of one's own for parameters of a car: the table `[ranges]` of studies that move them.

use crate::config::Table;
use crate::config::kinds::{Kind, quoted};
use crate::config::settings::{Flag, Written};
use crate::error::Result;
use crate::study::identify::FreeParameter;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// The most values of a parameter from the least to the greatest.
const MOST_VALUES: f64 = 1000.0;

/// The range of a parameter.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct OwnRange {
    /// Its name.
    pub name: String,
    /// Least value.
    pub lower: f64,
    /// Greatest value.
    pub upper: f64,
    /// From one value to the next.
    pub step: Option<f64>,
}

impl OwnRange {
    /// The range as that of a free parameter.
    pub(in crate::study) fn free(&self) -> FreeParameter {
        FreeParameter {
            name: self.name.clone(),
            lower: self.lower,
            upper: self.upper,
        }
    }

    /// The values from the least on in steps, with the greatest, whether or not a step ends there; both ends without a step.
    pub fn values(&self) -> Vec<f64> {
        let reach = self.upper - self.lower;
        let step = self.step.unwrap_or(reach);
        // A step that ends at the greatest value but for rounding is the last one.
        let steps = (reach / step - 1e-9).ceil().max(1.0) as usize;
        let value = |i: usize| {
            if i == steps {
                self.upper
            } else {
                self.lower + step * i as f64
            }
        };
        (0..=steps).map(value).collect()
    }
}

/// The table `[ranges]`: names with least and greatest value, and the step from one value to the next.
pub(in crate::study) struct Ranges;

impl Kind<Vec<OwnRange>> for Ranges {
    fn read(&self, table: &Table<'_>, key: &str, _: &str, _: &Path) -> Result<Option<Vec<OwnRange>>> {
        let Some(table) = table.table(key)? else {
            return Ok(None);
        };
        let range = |name: &str| {
            let numbers = table.numbers(name)?;
            let (lower, upper, step) = match numbers.as_deref() {
                Some(&[lower, upper]) => (lower, upper, None),
                Some(&[lower, upper, step]) => (lower, upper, Some(step)),
                _ => (1.0, 0.0, None),
            };
            let reach = upper - lower;
            let sound = reach > 0.0 && step.is_none_or(|s| s > 0.0 && reach / s <= MOST_VALUES);
            let expected =
                "[least, greatest] or [least, greatest, step], in ascending order with at most 1000 steps";
            if !sound {
                return Err(table.refuse(name, expected));
            }
            Ok(OwnRange {
                name: name.to_owned(),
                lower,
                upper,
                step,
            })
        };
        let found = table.keys().map(range).collect::<Result<Vec<_>>>()?;
        table.finish()?;
        Ok(Some(found))
    }

    fn write(&self, ranges: &Vec<OwnRange>) -> Option<Written> {
        if ranges.is_empty() {
            return None;
        }
        let row = |range: &OwnRange| {
            let key = if range.name.contains('.') {
                quoted(&range.name)
            } else {
                range.name.clone()
            };
            let step = range.step.map_or(String::new(), |step| format!(", {step:?}"));
            format!("{key} = [{:?}, {:?}{step}]\n", range.lower, range.upper)
        };
        let rows: String = ranges.iter().map(row).collect();
        Some(Written::Table(format!("[ranges]\n{rows}")))
    }

    fn parse(&self, _: &str, _: &Vec<OwnRange>) -> Result<Vec<OwnRange>, String> {
        Err("expected a table [ranges] in a study file".to_owned())
    }

    fn flag(&self, _: &'static str) -> Flag {
        Flag::None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn values(lower: f64, upper: f64, step: Option<f64>) -> Vec<f64> {
        let name = "K".to_owned();
        OwnRange {
            name,
            lower,
            upper,
            step,
        }
        .values()
    }

    #[test]
    fn a_range_has_both_ends_and_the_steps_between() {
        assert_eq!(values(1.0, 2.0, None), [1.0, 2.0]);
        assert_eq!(values(1.0, 2.0, Some(0.25)), [1.0, 1.25, 1.5, 1.75, 2.0]);
        // 0.1 is not exact, and three of it are no fourth step.
        assert_eq!(values(0.0, 0.3, Some(0.1)).len(), 4);
        assert_eq!(values(0.0, 1.0, Some(0.4)), [0.0, 0.4, 0.8, 1.0]);
    }
}
