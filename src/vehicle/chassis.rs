//! The 4DOF body with roll: longitudinal, lateral, yaw and roll (the book, chapter Model,
//! section 2).

use super::parameters::parameters;
use super::powertrain::GRAVITY_MPS2;
use crate::scalar::Real;

parameters! {
    /// Everything about the car but its tyres. Twin of `Chassis` in `shaders/chassis.wgsl`.
    ///
    /// Scale factors such as `steer_scale` and `environment` figures (air density, headwind) live here too, so
    /// that any of them can be freed in an identification.
    pub struct Chassis {
        mass: "mass_kg" ["kg"] 50.0..=50000.0, None, "mass with driver and fuel";
        cg_to_front: "cg_to_front_axle_m" ["m"] 0.1..=10.0, None, "front axle to centre of gravity, a";
        cg_to_rear: "cg_to_rear_axle_m" ["m"] 0.1..=10.0, None, "rear axle to centre of gravity, b";
        half_track_front: "front_half_track_m" ["m"] 0.1..=3.0, None, "half the front track";
        half_track_rear: "rear_half_track_m" ["m"] 0.1..=3.0, None, "half the rear track";
        cg_height: "cg_height_m" ["m"] 0.01..=3.0, None, "height of the centre of gravity above the roll axis in the ground plane";
        inertia_roll: "roll_inertia_kgm2" ["kg m2"] 1.0..=100000.0, None, "roll inertia about the centre of gravity, Ixx";
        inertia_pitch: "pitch_inertia_kgm2" ["kg m2"] 1.0..=100000.0, None, "pitch inertia about the centre of gravity, Iyy";
        inertia_yaw: "yaw_inertia_kgm2" ["kg m2"] 1.0..=100000.0, None, "yaw inertia about the centre of gravity, Izz";
        roll_stiffness: "roll_stiffness_nm_per_rad" ["N m/rad"] 1000.0..=10000000.0, None, "roll stiffness of the whole car, K";
        roll_damping: "roll_damping_nms_per_rad" ["N m s/rad"] 0.0..=1000000.0, None, "roll damping of the whole car, C";
        roll_share_front: "front_roll_moment_share" ["-"] 0.0..=1.0, Some(0.5), "share of the roll moment that the front axle carries";
        pitch_transfer: "longitudinal_load_transfer" ["-"] 0.0..=1.0, Some(1.0), "longitudinal load transfer: 1 on, 0 off";
        pitch_lag: "load_transfer_lag_s" ["s"] 0.005..=1.0, Some(0.03), "time constant with which longitudinal load transfer follows the acceleration";
        left_share_front: "front_left_load_share" ["-"] 0.0..=1.0, Some(0.5), "share of the static front load on the left wheel";
        left_share_rear: "rear_left_load_share" ["-"] 0.0..=1.0, Some(0.5), "share of the static rear load on the left wheel";
        camber_front: "front_camber_deg" ["deg"] -15.0..=15.0, Some(0.0), "static front camber, negative with the tops leaning inwards";
        camber_rear: "rear_camber_deg" ["deg"] -15.0..=15.0, Some(0.0), "static rear camber, negative with the tops leaning inwards";
        radius_front: "front_rolling_radius_m" ["m"] 0.05..=2.0, None, "rolling radius of the front wheels";
        radius_rear: "rear_rolling_radius_m" ["m"] 0.05..=2.0, None, "rolling radius of the rear wheels";
        steer_scale: "steer_scale" ["-"] 0.1..=10.0, Some(1.0), "factor on the logged road-wheel angle";
        steer_offset: "steer_offset_rad" ["rad"] -0.5..=0.5, Some(0.0), "added to the logged road-wheel angle";
        air_density: "air_density_kgpm3" ["kg/m3"] 0.0..=5.0, Some(1.2), "density of the air";
        drag_area: "drag_area_m2" ["m2"] 0.0..=10.0, Some(0.0), "drag coefficient times frontal area, CdA";
        lift_area: "downforce_area_m2" ["m2"] -10.0..=20.0, Some(0.0), "downforce coefficient times frontal area, ClA";
        pressure_centre: "aero_balance_front" ["-"] 0.0..=1.0, Some(0.45), "centre of pressure: its distance from the rear axle as a share of the wheelbase";
        drag_height: "drag_height_m" ["m"] 0.0..=3.0, Some(0.4), "height at which the drag acts, for its load transfer";
        headwind: "headwind_mps" ["m/s"] -60.0..=60.0, Some(0.0), "headwind along the car";
        drs_drag: "drs_drag_percent" ["%"] 0.0..=100.0, Some(0.0), "share of the whole car's drag that an open DRS sheds";
        drs_lift: "drs_downforce_percent" ["%"] 0.0..=100.0, Some(0.0), "share of the whole car's downforce that an open DRS sheds, all from the rear";
        slip_speed_floor: "slip_speed_floor_mps" ["m/s"] 0.5..=5.0, Some(1.0), "speed under which slip is reckoned as at this speed";
        gravity: "gravity_mps2" ["m/s2"] 1.0..=30.0, Some(GRAVITY_MPS2), "gravitational acceleration";
    }
}

/// The state of the body; speeds are of the point on the roll axis under the centre of gravity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BodyState<R> {
    /// Forward speed, m/s.
    pub vx: R,
    /// Speed to the left, m/s.
    pub vy: R,
    /// Yaw rate, anticlockwise positive, rad/s.
    pub yaw_rate: R,
    /// Roll angle, right side down positive, rad.
    pub roll: R,
    /// Roll rate, rad/s.
    pub roll_rate: R,
}

/// The planar forces and the yaw moment on the whole car.
#[derive(Clone, Copy, Debug)]
pub struct BodyForces<R> {
    /// Forward force, drag included, N.
    pub x: R,
    /// Force to the left, N.
    pub y: R,
    /// Yaw moment about the point under the centre of gravity, N m.
    pub yaw_moment: R,
}

/// Time derivatives of [`BodyState`] in its order (the book, chapter Model, section 2). The thesis misprints some of these
/// equations (the book, chapter Model, section 9).
///
/// `roll`'s derivative is `roll_rate` itself.
#[inline(always)]
pub fn body_derivative<R: Real>(
    chassis: &Chassis<R>,
    state: &BodyState<R>,
    forces: &BodyForces<R>,
) -> BodyState<R> {
    let (m, h) = (chassis.mass, chassis.cg_height);
    let (ixx, iyy, izz) = (chassis.inertia_roll, chassis.inertia_pitch, chassis.inertia_yaw);
    let (r, p) = (state.yaw_rate, state.roll_rate);
    let s = state.roll.sin();
    let c = state.roll.cos();
    let hs = h * s;
    let hc = h * c;
    let sc = s * c;
    let inertia_difference = iyy - izz;

    let yaw_acceleration =
        (forces.yaw_moment - hs * forces.x - R::lit(2.0) * (inertia_difference * sc * (p * r)))
            / (iyy * (s * s) + izz * (c * c));
    let roll_acceleration = (hc * forces.y + m * chassis.gravity * hs
        - chassis.roll_stiffness * state.roll
        - chassis.roll_damping * p
        + inertia_difference * sc * (r * r)
        - m * (h * h) * (sc * (p * p)))
        / (ixx + m * (hs * hs));
    BodyState {
        vx: forces.x / m + state.vy * r - hs * yaw_acceleration - R::lit(2.0) * (hc * (p * r)),
        vy: forces.y / m - state.vx * r + hc * roll_acceleration - hs * (p * p + r * r),
        yaw_rate: yaw_acceleration,
        roll: p,
        roll_rate: roll_acceleration,
    }
}
