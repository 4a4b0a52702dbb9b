//! Figures of studies in words with their units. Files have their names.

use crate::evaluate::replay::{CHANNEL_LABELS, CHANNEL_NAMES, CHANNEL_UNITS};

/// How names end that have a unit, and the unit. Longer endings come before those that they end with.
const UNITS: [(&str, &str); 22] = [
    ("_mps2", "m/s^2"),
    ("_radps", "rad/s"),
    ("_s_per_mj", "s/MJ"),
    ("_percent", "%"),
    ("_1pm", "1/m"),
    ("_mps", "m/s"),
    ("_rad", "rad"),
    ("_kmh", "km/h"),
    ("_deg", "°"),
    ("_mib", "MiB"),
    ("_kg", "kg"),
    ("_kw", "kW"),
    ("_mj", "MJ"),
    ("_nm", "N m"),
    ("_m2", "m^2"),
    ("_ms", "ms"),
    ("_km", "km"),
    ("_s", "s"),
    ("_m", "m"),
    ("_l", "l"),
    ("_j", "J"),
    ("_n", "N"),
];
/// What names begin with that are of a channel or of a parameter.
const BEGINNINGS: [(&str, &str); 6] = [
    ("cost_", "cost"),
    ("rms_error_", "root mean square error"),
    ("mse_", "mean square error"),
    ("value_", "value"),
    ("relative_error_", "relative error"),
    ("swarm_", "by the swarm"),
];
/// Whether a figure is one of many of its kind, which tables of their own have.
pub(super) fn is_detail(figure: &str) -> bool {
    ["value_", "relative_error_", "mse_"]
        .iter()
        .any(|beginning| figure.starts_with(beginning))
}

/// The name of a figure in words, and its unit.
pub(super) fn words(figure: &str) -> (String, &'static str) {
    for (beginning, what) in BEGINNINGS {
        let Some(rest) = figure.strip_prefix(beginning) else {
            continue;
        };
        let channel = CHANNEL_NAMES.iter().position(|name| *name == rest);
        let channel = channel.map(|k| (CHANNEL_LABELS[k], CHANNEL_UNITS[k]));
        return match (beginning, channel) {
            // Names of parameters are their own words, and their units are the parameters'.
            ("value_" | "relative_error_", _) => (format!("{what} of {rest}"), ""),
            // Costs count in spreads of the channel, by the norm.
            ("cost_", Some((words, _))) => (format!("{what} of {words}"), ""),
            ("mse_", Some((words, unit))) => (format!("{what} of {words}"), squared(unit)),
            (_, Some((words, unit))) => (format!("{what} of {words}"), unit),
            _ => {
                let (rest, unit) = spelled(rest);
                (format!("{rest}, {what}"), unit)
            }
        };
    }
    spelled(figure)
}

fn squared(unit: &str) -> &'static str {
    match unit {
        "m/s^2" => "m^2/s^4",
        "m/s" => "m^2/s^2",
        _ => "rad^2/s^2",
    }
}

fn spelled(figure: &str) -> (String, &'static str) {
    let ended = UNITS.iter().find_map(|(ending, unit)| {
        let name = figure.strip_suffix(ending)?;
        Some((name, *unit))
    });
    let (name, unit) = ended.unwrap_or((figure, ""));
    (name.replace('.', ", ").replace('_', " "), unit)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_are_told_in_words_with_units() {
        for (figure, wanted, unit) in [
            ("best_lap_time_s", "best lap time", "s"),
            ("swarm_length_m", "length, by the swarm", "m"),
            ("cost_yaw_rate", "cost of yaw rate", ""),
            ("mse_ay", "mean square error of lateral acceleration", "m^2/s^4"),
            ("rms_error_vx", "root mean square error of speed", "m/s"),
            ("relative_error_lKy", "relative error of lKy", ""),
            ("total_parameter_error", "total parameter error", ""),
            ("deployment.exact_lap_time_s", "deployment, exact lap time", "s"),
            ("best_gamma_1pm", "best gamma", "1/m"),
        ] {
            assert_eq!(words(figure), (wanted.to_owned(), unit), "{figure}");
        }
    }
}
