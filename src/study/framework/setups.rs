//! Set-ups of a car: some of its parameters, each moved by a share of its value.

use crate::error::{Error, Result};
use crate::vehicle::{Car, CarParameter};

/// The most set-ups of a population.
pub const MOST_SETUPS: usize = 1 << 16;
/// The most parameters that set-ups move: those of the Sobol sequence.
pub const MOST_PARAMETERS: usize = 256;

/// A parameter that set-ups move, with its least and its greatest value.
pub type FreeParameter = (CarParameter, f64, f64);

/// Refuses set-ups that move nothing, and more parameters than there may be.
///
/// # Errors
/// [`Error::Input`] naming the setting.
pub fn check_parameters(setups: Option<usize>, parameters: &[String]) -> Result<()> {
    let count = parameters.len();
    if setups.is_some_and(|n| n > 0) && count == 0 || count > MOST_PARAMETERS {
        let found = format!("{count} of them");
        return Err(Error::input("the study", "parameters", found, "1 to 256"));
    }
    Ok(())
}

/// These parameters of `car`, each free within `share` of its value either way. A share of zero is zero: a parameter of that value is
/// refused.
///
/// # Errors
/// [`Error::Input`] naming the parameter.
pub fn free_parameters(car: &Car, parameters: &[String], share: f64) -> Result<Vec<FreeParameter>> {
    let flat = car.to_flat();
    parameters
        .iter()
        .map(|name| {
            let parameter = car.known_parameter(&car.name, "parameters", name)?;
            let value = flat[parameter.slots[0]];
            if parameter.slots.iter().any(|slot| flat[*slot] != value) {
                let expected = format!("front.{name} or rear.{name}, whose values differ");
                let found = format!("`{name}`");
                return Err(Error::input(&car.name, "parameters", found, expected));
            }
            if value == 0.0 {
                let expected = "one that is not zero, which no share of itself moves";
                return Err(Error::input(&car.name, name, "0", expected));
            }
            let reach = share * value.abs();
            let within = |x: f64| x.clamp(parameter.info.minimum, parameter.info.maximum);
            let (lower, upper) = (within(value - reach), within(value + reach));
            Ok((parameter, lower, upper))
        })
        .collect()
}

/// Values of the parameters of the car as it is, then of `count` set-ups by a Sobol sequence.
pub fn setups_of(car: &Car, free: &[FreeParameter], count: usize, seed: u64) -> Vec<Vec<f64>> {
    let flat = car.to_flat();
    let seed = (seed ^ (seed >> 32)) as u32;
    let value = |setup: usize, dimension: u32, (parameter, lower, upper): &FreeParameter| match setup {
        0 => flat[parameter.slots[0]],
        _ => {
            let point = sobol_burley::sample(setup as u32 - 1, dimension, seed);
            lower + f64::from(point) * (upper - lower)
        }
    };
    (0..=count)
        .map(|setup| {
            free.iter()
                .zip(0..)
                .map(|(free, k)| value(setup, k, free))
                .collect()
        })
        .collect()
}

/// The car with these values of the parameters.
pub fn car_of<'a>(car: &Car, parameters: impl IntoIterator<Item = &'a CarParameter>, values: &[f64]) -> Car {
    let mut flat = car.to_flat();
    for (parameter, value) in parameters.into_iter().zip(values) {
        for slot in &parameter.slots {
            flat[*slot] = *value;
        }
    }
    car.with_flat(&flat)
}
