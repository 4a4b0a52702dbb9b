//! Names of ROS messages in the headers of tables: paths such as `/imu/angular_velocity/z` and `field.twist.twist.linear.x`. Units stand
//! nowhere in them. They are SI by convention (REP 103), with x forward and y to the left.

/// Fields of vectors with their units, by the last two parts of a path.
const VECTORS: [(&str, &str); 4] = [
    ("linear", "m/s"),
    ("angular", "rad/s"),
    ("linear_acceleration", "m/s^2"),
    ("angular_velocity", "rad/s"),
];
/// Other fields with their units, by the last part, and those of places by the last two.
const FIELDS: [(&str, &str); 9] = [
    ("position", "m"),
    ("steering_angle", "rad"),
    ("steering_tire_angle", "rad"),
    ("speed", "m/s"),
    ("longitudinal_velocity", "m/s"),
    ("yaw_rate", "rad/s"),
    ("heading_rate", "rad/s"),
    ("latitude", "deg"),
    ("longitude", "deg"),
];

/// The last part of a path, with the one before it where it is an axis; none for a name that is no path.
pub(super) fn tail(name: &str) -> Option<[&str; 2]> {
    let mut parts = name.split(['/', '.']).filter(|part| !part.is_empty()).rev();
    let last = parts.next()?;
    let before = parts.next();
    match before {
        Some(before) if ["x", "y", "z"].contains(&last) => Some([before, last]),
        Some(_) => Some([last, ""]),
        None => name.starts_with('/').then_some([last, ""]),
    }
}

/// Gives the columns without units those of ROS, if the names of a table are of its messages.
pub(super) fn add_units(heads: &mut [(String, String)]) {
    let unit_in = |fields: &[(&str, &'static str)], name: &str| {
        let [field, _] = tail(name)?;
        fields
            .iter()
            .find(|(known, _)| *known == field)
            .map(|(_, unit)| *unit)
    };
    let is_ros = heads
        .iter()
        .any(|(name, _)| name.starts_with('/') || name.starts_with('%') || unit_in(&VECTORS, name).is_some());
    if !is_ros {
        return;
    }
    for (name, unit) in heads.iter_mut().filter(|(_, unit)| unit.is_empty()) {
        let found = unit_in(&VECTORS, name).or_else(|| unit_in(&FIELDS, name));
        // `geometry_msgs/Accel` has a linear part, too.
        let found = match found {
            Some("m/s") if name.contains("accel") => Some("m/s^2"),
            Some("rad/s") if name.contains("accel") => None,
            found => found,
        };
        *unit = found.unwrap_or_default().to_owned();
    }
}
