//! Vertical wheel loads: static, aerodynamic, roll and longitudinal transfer (the book, chapter
//! Model, section 2; the thesis's (3.20)-(3.23) without longitudinal transfer).

#![deny(clippy::disallowed_methods)]

use super::aero::AeroForces;
use super::chassis::{BodyState, Chassis};
use crate::scalar::Real;

/// Vertical loads of the four wheels, FL FR RL RR, N. The load of a lifted wheel is negative.
///
/// `longitudinal_acceleration` (m/s^2) is the lagged acceleration, which stands for the pitch of the body. The right wheels gain
/// and the left lose `share (K phi + C p) / (2 w)`; the front pair shares `-(m ax h + D hD)/L`, the rear the opposite.
#[inline(always)]
pub fn wheel_loads<R: Real>(
    chassis: &Chassis<R>,
    state: &BodyState<R>,
    longitudinal_acceleration: R,
    aero: &AeroForces<R>,
) -> [R; 4] {
    let one = R::lit(1.0);
    let half = R::lit(0.5);
    let wheelbase = chassis.cg_to_front + chassis.cg_to_rear;
    let weight = chassis.mass * chassis.gravity;
    let pitch = chassis.pitch_transfer
        * (chassis.mass * longitudinal_acceleration * chassis.cg_height + aero.drag * chassis.drag_height)
        / wheelbase;
    let front_static = weight * chassis.cg_to_rear / wheelbase;
    let rear_static = weight * chassis.cg_to_front / wheelbase;
    let front_even = half * (aero.downforce_front - pitch);
    let rear_even = half * (aero.downforce_rear + pitch);

    let roll_moment = chassis.roll_stiffness * state.roll + chassis.roll_damping * state.roll_rate;
    let front_roll = half * (chassis.roll_share_front * roll_moment) / chassis.half_track_front;
    let rear_roll = half * ((one - chassis.roll_share_front) * roll_moment) / chassis.half_track_rear;

    [
        front_static * chassis.left_share_front + front_even - front_roll,
        front_static * (one - chassis.left_share_front) + front_even + front_roll,
        rear_static * chassis.left_share_rear + rear_even - rear_roll,
        rear_static * (one - chassis.left_share_rear) + rear_even + rear_roll,
    ]
}
