//! A car some of whose parameters are decision variables.

use super::{Failure, Variable, are_numbers};
use crate::error::{Error, Result};
use crate::vehicle::car::CarParameter;
use crate::vehicle::{Car, TyreCoefficients, TyreModel};

/// A car, and which of its parameters the first variables of a problem set.
#[derive(Clone, Debug)]
pub struct FreeCar {
    /// The car that fixed parameters come from.
    pub car: Car,
    /// The free parameters, one per variable.
    pub parameters: Vec<CarParameter>,
    base: Vec<f64>,
    sources: Vec<Option<usize>>,
}

impl FreeCar {
    /// `car` with `free` parameters between their bounds, and the variables that these are.
    ///
    /// # Errors
    /// [`Error::Input`] if a bound is not finite or out of order, or two parameters set the same thing.
    pub fn new(car: Car, free: Vec<(CarParameter, f64, f64)>) -> Result<(Self, Vec<Variable>)> {
        let wrong =
            |place: &str, found: String, expected: &str| Error::input("the study", place, found, expected);
        let base = car.to_flat();
        let mut sources = vec![None; base.len()];
        let mut variables = Vec::new();
        let mut parameters = Vec::new();
        for (index, (parameter, lower, upper)) in free.into_iter().enumerate() {
            let name = parameter.name.clone();
            if !(lower.is_finite() && upper.is_finite() && lower <= upper) {
                return Err(wrong(
                    &format!("bounds of {name}"),
                    format!("{lower} to {upper}"),
                    "finite bounds in order",
                ));
            }
            for &slot in &parameter.slots {
                if sources[slot].replace(index).is_some() {
                    return Err(wrong(
                        &format!("free parameter {name}"),
                        "a parameter freed twice".into(),
                        "each once",
                    ));
                }
            }
            variables.push(Variable {
                name,
                unit: parameter.info.unit.to_owned(),
                lower,
                upper,
                whole: false,
            });
            parameters.push(parameter);
        }
        let free = Self {
            car,
            parameters,
            base,
            sources,
        };
        Ok((free, variables))
    }

    /// The tyre model that the kernels must run.
    pub fn tyre_model(&self) -> TyreModel {
        self.car.tyre_model()
    }

    /// The fixed car in flat form.
    pub fn base(&self) -> &[f64] {
        &self.base
    }

    /// The values that the free parameters have in a car in flat form.
    pub fn values_in(&self, flat: &[f64]) -> Vec<f64> {
        self.parameters.iter().map(|p| flat[p.slots[0]]).collect()
    }

    /// For each place of the flat form, the variable that sets it, if any.
    pub fn sources(&self) -> &[Option<usize>] {
        &self.sources
    }

    /// A candidate's car in flat form. Variables behind the free parameters do not belong to the car.
    pub fn flat(&self, candidate: &[f64]) -> Vec<f64> {
        self.base
            .iter()
            .zip(&self.sources)
            .map(|(base, source)| source.map_or(*base, |variable| candidate[variable]))
            .collect()
    }

    /// A candidate's car.
    pub fn candidate_car(&self, candidate: &[f64]) -> Car {
        self.car.with_flat(&self.flat(candidate))
    }

    /// Why a candidate need not be driven, if so: a variable is not a finite number, or the coefficients make no tyre.
    pub fn preliminary_failure(&self, candidate: &[f64]) -> Option<Failure> {
        if !are_numbers(candidate) {
            return Some(Failure::NotFinite);
        }
        if self.tyre_model() == TyreModel::Linear {
            return None;
        }
        let flat = self.flat(candidate);
        let tyre_count = TyreCoefficients::<f64>::PARAMETERS.len();
        let front = flat.len() - 2 * tyre_count;
        let at = |offset: usize| TyreCoefficients::from_flat(&flat[offset..]).well_formed();
        let rear = front + tyre_count;
        let one_tyre = flat[front..rear] == flat[rear..];
        at(front)
            .and_then(|()| if one_tyre { Ok(()) } else { at(rear) })
            .err()
            .map(Failure::IllFormedTyre)
    }
}
