//! Unit names as loggers write them, and what they are in SI.

use std::f64::consts::{PI, TAU};

/// What loggers mean by one G, m/s^2.
pub(super) use crate::vehicle::powertrain::GRAVITY_MPS2 as G;

/// What a unit measures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// SI unit s.
    Time,
    /// SI unit m.
    Distance,
    /// SI unit m/s.
    Speed,
    /// SI unit m/s^2.
    Acceleration,
    /// SI unit rad.
    Angle,
    /// SI unit rad/s.
    AngularSpeed,
    /// SI unit Pa.
    Pressure,
    /// A share of one.
    Ratio,
}

impl Quantity {
    /// The quantity's name with the units that are understood, for messages.
    pub fn described(self) -> &'static str {
        match self {
            Self::Time => "a time (s, ms, us, ns, min)",
            Self::Distance => "a distance (m, km, mm, ft, mi)",
            Self::Speed => "a speed (m/s, km/h, mph, ft/s, kn)",
            Self::Acceleration => "an acceleration (m/s^2, G)",
            Self::Angle => "an angle (rad, deg)",
            Self::AngularSpeed => "an angular speed (rad/s, deg/s, rpm)",
            Self::Pressure => "a pressure (Pa, kPa, bar, psi)",
            Self::Ratio => "a share (%, or 1)",
        }
    }
}

/// A unit: `value_si = value * factor`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Unit {
    /// What it measures.
    pub quantity: Quantity,
    /// One of this unit in SI.
    pub factor: f64,
}

impl Unit {
    /// The unit a logger calls `text`, without regard to case, spaces or brackets; `None` for one that is not known.
    pub fn parse(text: &str) -> Option<Self> {
        let key: String = text
            .chars()
            .filter(|c| !c.is_whitespace() && !matches!(c, '[' | ']' | '(' | ')' | '.'))
            .flat_map(char::to_lowercase)
            .collect();
        use Quantity::{Acceleration, Angle, AngularSpeed, Distance, Pressure, Ratio, Speed, Time};
        let (quantity, factor) = match key.as_str() {
            "s" | "sec" | "secs" | "second" | "seconds" => (Time, 1.0),
            "ms" | "msec" => (Time, 1e-3),
            "us" | "µs" | "μs" => (Time, 1e-6),
            "ns" => (Time, 1e-9),
            "min" => (Time, 60.0),
            "m" | "metre" | "meter" | "metres" | "meters" => (Distance, 1.0),
            "km" => (Distance, 1e3),
            "cm" => (Distance, 1e-2),
            "mm" => (Distance, 1e-3),
            "ft" | "feet" => (Distance, 0.3048),
            "in" | "inch" => (Distance, 0.0254),
            "mi" | "mile" | "miles" => (Distance, 1609.344),
            "m/s" | "mps" | "m/sec" => (Speed, 1.0),
            "km/h" | "kmh" | "kph" | "km/hr" => (Speed, 1.0 / 3.6),
            "mph" | "mi/h" | "mile/h" | "miles/h" => (Speed, 0.44704),
            "ft/s" | "fps" => (Speed, 0.3048),
            "kn" | "kt" | "kts" | "knot" | "knots" => (Speed, 1852.0 / 3600.0),
            "m/s^2" | "m/s2" | "m/s²" | "m/s/s" | "mps2" | "m/s**2" | "m/sec^2" => (Acceleration, 1.0),
            "g" | "gee" => (Acceleration, G),
            "mg" => (Acceleration, G * 1e-3),
            "rad" | "radians" => (Angle, 1.0),
            "mrad" => (Angle, 1e-3),
            "deg" | "°" | "º" | "degree" | "degrees" => (Angle, PI / 180.0),
            "rad/s" | "radps" | "rad/sec" => (AngularSpeed, 1.0),
            "deg/s" | "°/s" | "º/s" | "deg/sec" | "dps" | "degps" | "degrees/s" | "d/s" => {
                (AngularSpeed, PI / 180.0)
            }
            "rpm" | "1/min" | "rev/min" => (AngularSpeed, TAU / 60.0),
            "rps" | "rev/s" => (AngularSpeed, TAU),
            "pa" => (Pressure, 1.0),
            "mbar" | "hpa" => (Pressure, 1e2),
            "kpa" => (Pressure, 1e3),
            "bar" => (Pressure, 1e5),
            "mpa" => (Pressure, 1e6),
            "psi" => (Pressure, 6_894.757_293_168),
            "%" | "percent" | "pct" => (Ratio, 1e-2),
            "1" | "ratio" => (Ratio, 1.0),
            _ => return None,
        };
        Some(Self { quantity, factor })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_as_loggers_write_them() {
        for (text, quantity, factor) in [
            ("km/h", Quantity::Speed, 0.277_777_777_777_777_8),
            ("MPH", Quantity::Speed, 0.44704),
            ("G", Quantity::Acceleration, 9.80665),
            ("[m/s/s]", Quantity::Acceleration, 1.0),
            ("°/s", Quantity::AngularSpeed, 0.017_453_292_519_943_295),
            (" rpm ", Quantity::AngularSpeed, 0.104_719_755_119_659_77),
            ("ms", Quantity::Time, 1e-3),
            ("kPa", Quantity::Pressure, 1e3),
            ("ft", Quantity::Distance, 0.3048),
            ("%", Quantity::Ratio, 0.01),
        ] {
            let unit = Unit::parse(text).unwrap();
            assert_eq!(unit.quantity, quantity, "{text}");
            assert!((unit.factor - factor).abs() <= 1e-15 * factor, "{text}");
        }
        assert_eq!(Unit::parse("furlong"), None);
        assert_eq!(Unit::parse(""), None);
    }
}
