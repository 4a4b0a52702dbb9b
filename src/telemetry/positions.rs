//! What the positions of a car make of a log of steering that lacks it: speed and heading, as channels.

use std::sync::Arc;

use super::channel_map::{Axle, ChannelMap};
use super::path::Path;
use super::recording::{Channel, Clock, Recording};
use super::role::Role;
use crate::Result;

/// The name of the channel that positions make for a role.
pub(super) fn channel_name(role: Role) -> Option<&'static str> {
    match role {
        Role::Vx => Some("speed of the positions"),
        Role::Heading => Some("heading of the positions"),
        _ => None,
    }
}

/// Whether a recording has channels of positions.
pub(super) fn are_logged(map: &ChannelMap, recording: &Recording) -> bool {
    let both = |roles: [Role; 2]| {
        let mut found = roles.into_iter().map(|role| map.find(role, recording));
        found.all(|found| found.is_ok_and(|found| found.is_some()))
    };
    both([Role::Latitude, Role::Longitude]) || both([Role::X, Role::Y])
}

/// The heading, where a log of steering has neither it nor a yaw rate, and the speed, where it has none.
///
/// # Errors
/// As [`Path::of`].
pub(super) fn channels(map: &ChannelMap, recording: &Recording) -> Result<Vec<Channel>> {
    // What is wrong with a channel is told where it is used.
    let lacks = |role| matches!(map.find(role, recording), Ok(None));
    let undriven = match map.speed_axle {
        Axle::Front => [Role::WheelSpeedFl, Role::WheelSpeedFr],
        Axle::Rear => [Role::WheelSpeedRl, Role::WheelSpeedRr],
    };
    let heading = lacks(Role::YawRate) && lacks(Role::Heading);
    let speed = lacks(Role::Vx) && undriven.into_iter().any(lacks);
    if !(heading || speed) || lacks(Role::Steer) || !are_logged(map, recording) {
        return Ok(Vec::new());
    }
    let Some(path) = Path::of(recording, map)? else {
        return Ok(Vec::new());
    };
    let motion = path.motion();
    let made = [
        (heading, Role::Heading, motion.headings_rad),
        (speed, Role::Vx, motion.speeds_mps),
    ];
    let channel = |(lacking, role, values): (bool, Role, Vec<f64>)| {
        let name = channel_name(role).filter(|_| lacking)?;
        Some(Channel {
            name: name.to_owned(),
            unit: role.si_unit().to_owned(),
            clock: Clock::Times(Arc::clone(&motion.times_s)),
            values,
            unreadable: None,
            lines: None,
        })
    };
    Ok(made.into_iter().filter_map(channel).collect())
}
