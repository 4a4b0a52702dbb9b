//! Signs and sizes of every slip, load and force, against cases worked by hand.
//!
//! The hand-worked car: 1000 kg in a gravity of 10 m/s^2, axles 1.2 m ahead and 1.8 m behind, half-tracks 0.8 m and
//! 0.75 m, centre of gravity at 0.5 m; so 3000 N stand on each front wheel and 2000 N on each rear one.

use crate::support::{car_model, chassis_from, forces_at, ready_forces, set_b};
use lapswarm::vehicle::aero::aero_forces;
use lapswarm::vehicle::chassis::{BodyForces, BodyState, body_derivative};
use lapswarm::vehicle::loads::wheel_loads;
use lapswarm::vehicle::model::{WheelSlip, to_body_axes, wheel_slip};
use lapswarm::vehicle::tyre::{Tyre, TyreForces};
use lapswarm::vehicle::{
    Car, CarInput, CarModel, CarState, Chassis, LinearTyre, MagicFormula, TyreCoefficients, Tyres,
};

const HAND_CAR: &str = "
    mass_kg=1000 cg_to_front_axle_m=1.2 cg_to_rear_axle_m=1.8 front_half_track_m=0.8 rear_half_track_m=0.75
    cg_height_m=0.5 roll_inertia_kgm2=400 pitch_inertia_kgm2=800 yaw_inertia_kgm2=1600
    roll_stiffness_nm_per_rad=1e5 roll_damping_nms_per_rad=1e4 front_roll_moment_share=0.6
    front_camber_deg=0 rear_camber_deg=0 front_rolling_radius_m=0.3 rear_rolling_radius_m=0.3
    air_density_kgpm3=1.25 drag_area_m2=0 downforce_area_m2=0 drag_height_m=0.5 gravity_mps2=10";

const TYRE: LinearTyre<f64> = LinearTyre {
    nominal_load: 4000.0,
    slip_stiffness: 80_000.0,
    cornering_stiffness: 60_000.0,
    trail: 0.0,
};

fn hand_car(change: &str) -> Chassis<f64> {
    chassis_from(&format!("{HAND_CAR} {change}"))
}

/// A few dozen roundings of 1.1e-16 of the largest figure that enters.
#[track_caller]
fn close(got: f64, want: f64, size: f64) {
    assert!(
        (got - want).abs() <= 1e-14 * size,
        "{got} where {want} was worked out"
    );
}

fn still() -> BodyState<f64> {
    CarState::straight(20.0).body
}

fn loads(chassis: &Chassis<f64>, body: &BodyState<f64>, ax: f64) -> [f64; 4] {
    wheel_loads(chassis, body, ax, &aero_forces(chassis, body.vx, 0.0))
}

#[track_caller]
fn close_loads(got: [f64; 4], want: [f64; 4]) {
    for (got, want) in got.into_iter().zip(want) {
        close(got, want, 1e4);
    }
}

/// All wheels rolling along at `vx`, those in front along a path turned by `steer`.
fn rolling(vx: f64, steer: f64) -> CarInput<f64> {
    let front = vx * steer.cos() / 0.3;
    CarInput {
        wheel_speed: [front, front, vx / 0.3, vx / 0.3],
        steer,
        flap: 0.0,
        friction: None,
    }
}

fn on_linear_tyres(change: &str, tyre: LinearTyre<f64>) -> CarModel<f64, LinearTyre<f64>> {
    car_model(&hand_car(change), &tyre.to_flat(), &tyre.to_flat())
}

fn linear(change: &str) -> CarModel<f64, LinearTyre<f64>> {
    on_linear_tyres(change, TYRE)
}

// --- Loads -----------------------------------------------------------------------------------------------------

#[test]
fn static_loads_and_their_split() {
    close_loads(
        loads(&hand_car(""), &still(), 0.0),
        [3000.0, 3000.0, 2000.0, 2000.0],
    );
    let uneven = hand_car("front_left_load_share=0.55 rear_left_load_share=0.4");
    close_loads(loads(&uneven, &still(), 0.0), [3300.0, 2700.0, 1600.0, 2400.0]);
}

/// 6 m/s^2 of braking at 0.5 m over 3 m: 1000 N from the rear axle to the front.
#[test]
fn braking_loads_the_front_and_driving_the_rear() {
    close_loads(
        loads(&hand_car(""), &still(), -6.0),
        [3500.0, 3500.0, 1500.0, 1500.0],
    );
    close_loads(
        loads(&hand_car(""), &still(), 3.0),
        [2750.0, 2750.0, 2250.0, 2250.0],
    );
    let off = hand_car("longitudinal_load_transfer=0");
    close_loads(loads(&off, &still(), -6.0), [3000.0, 3000.0, 2000.0, 2000.0]);
}

/// 1.25/2 * 2.4 * 20^2 = 600 N of drag at 0.5 m over 3 m: 100 N to the rear axle.
#[test]
fn drag_loads_the_rear() {
    close_loads(
        loads(&hand_car("drag_area_m2=2.4"), &still(), 0.0),
        [2950.0, 2950.0, 2050.0, 2050.0],
    );
}

/// 0.02 rad on 1e5 Nm/rad and 0.05 rad/s on 1e4 Nms/rad: 2500 Nm, 1500 in front over 1.6 m, 1000 behind over 1.5 m.
#[test]
fn roll_to_the_right_loads_the_right() {
    let body = BodyState {
        roll: 0.02,
        roll_rate: 0.05,
        ..still()
    };
    let (front, rear) = (937.5, 2000.0 / 3.0);
    close_loads(
        loads(&hand_car(""), &body, 0.0),
        [3000.0 - front, 3000.0 + front, 2000.0 - rear, 2000.0 + rear],
    );
}

/// Loads only move about: whatever happens they sum to weight and downforce (1.25/2 * 4 * 400 = 1000 N).
#[test]
fn transfers_neither_make_nor_lose_load() {
    let chassis = hand_car("downforce_area_m2=4 drag_area_m2=2.4 front_left_load_share=0.6");
    let body = BodyState {
        roll: -0.03,
        roll_rate: 0.2,
        ..still()
    };
    close(loads(&chassis, &body, -8.0).iter().sum(), 11_000.0, 1e4);
}

// --- Air -------------------------------------------------------------------------------------------------------

#[test]
fn drag_and_downforce_by_the_centre_of_pressure() {
    let chassis = hand_car("drag_area_m2=1 downforce_area_m2=2 aero_balance_front=0.4");
    // 1.25/2 * 40^2 = 1000 Pa.
    let aero = aero_forces(&chassis, 40.0, 0.0);
    close(aero.drag, 1000.0, 1e3);
    close(aero.downforce_front, 800.0, 1e3);
    close(aero.downforce_rear, 1200.0, 1e3);
    // The load of each wheel: half its axle's share, and 1000 * 0.5/3 of the drag moved back.
    let body = CarState::straight(40.0).body;
    let moved = 1000.0 * 0.5 / 3.0 / 2.0;
    close_loads(
        loads(&chassis, &body, 0.0),
        [3400.0 - moved, 3400.0 - moved, 2600.0 + moved, 2600.0 + moved],
    );
}

#[test]
fn headwind_adds_to_speed_and_a_gale_from_behind_pushes() {
    let at = |wind: &str, vx: f64| {
        aero_forces(
            &hand_car(&format!("drag_area_m2=1 downforce_area_m2=1 headwind_mps={wind}")),
            vx,
            0.0,
        )
    };
    close(at("10", 30.0).drag, 1000.0, 1e3);
    close(at("-10", 50.0).drag, 1000.0, 1e3);
    // 20 m/s from behind at 12 m/s: 8 m/s of wind pushes the car with 40 N and still presses it down.
    let pushed = at("-20", 12.0);
    close(pushed.drag, -40.0, 1e3);
    assert!(pushed.downforce_front > 0.0);
}

/// Ten per cent of the car's 2000 N of downforce are 200 N, all from the rear's 1200 N; and 5 % of the drag.
#[test]
fn drs_sheds_its_share_of_the_whole_from_the_rear() {
    let chassis = hand_car(
        "drag_area_m2=1 downforce_area_m2=2 aero_balance_front=0.4 drs_downforce_percent=10 drs_drag_percent=5",
    );
    let aero = aero_forces(&chassis, 40.0, 1.0);
    close(aero.drag, 950.0, 1e3);
    close(aero.downforce_front, 800.0, 1e3);
    close(aero.downforce_rear, 1000.0, 1e3);
    let shut = aero_forces(&chassis, 40.0, 0.0);
    close(shut.drag, 1000.0, 1e3);
    close(shut.downforce_rear, 1200.0, 1e3);
}

// --- Slips -----------------------------------------------------------------------------------------------------

/// A hub moving 10 m/s ahead and 5 to the left under a wheel turned by the angle of the 3-4-5 triangle.
#[test]
fn slip_in_the_plane_of_a_turned_wheel() {
    let body = BodyState {
        vx: 10.0,
        vy: 5.0,
        ..still()
    };
    let slip = wheel_slip(&body, (0.0, 0.0), (0.8, 0.6), 12.1, 1.0);
    // Along the wheel 8 + 3 = 11, across it 4 - 6 = -2: it drifts to its right.
    close(slip.tangent, -2.0 / 11.0, 1.0);
    close(slip.ratio, 0.1, 1.0);
}

/// Yawing left, the right wheels run faster, the nose moves left and the tail right.
#[test]
fn slip_of_a_yawing_car() {
    let body = BodyState {
        yaw_rate: 0.5,
        ..still()
    };
    let slip = |x: f64, y: f64| wheel_slip(&body, (x, y), (1.0, 0.0), 20.0, 1.0);
    let expect = |got: WheelSlip<f64>, along: f64, across: f64| {
        close(got.tangent, across / along, 1.0);
        close(got.ratio, (20.0 - along) / along, 1.0);
    };
    expect(slip(1.2, 0.8), 19.6, 0.6);
    expect(slip(1.2, -0.8), 20.4, 0.6);
    expect(slip(-1.8, 0.75), 19.625, -0.9);
    expect(slip(-1.8, -0.75), 20.375, -0.9);
}

#[test]
fn slip_below_the_floor_and_in_reverse() {
    let slip = |vx: f64| {
        wheel_slip(
            &BodyState {
                vx,
                vy: 0.3,
                ..still()
            },
            (0.0, 0.0),
            (1.0, 0.0),
            0.5,
            2.0,
        )
    };
    assert_eq!(
        slip(0.0),
        WheelSlip {
            ratio: 0.25,
            tangent: 0.15
        }
    );
    // Rolling back at 10 m/s with the wheel turning ahead: drive, and the drift is still to the left.
    assert_eq!(
        slip(-10.0),
        WheelSlip {
            ratio: 1.05,
            tangent: 0.03
        }
    );
}

// --- Tyres -----------------------------------------------------------------------------------------------------

fn slick() -> TyreCoefficients<f64> {
    match Car::bundled().unwrap().tyres {
        Tyres::MagicFormula { front, .. } => front.coefficients,
        Tyres::Linear { .. } => panic!("the bundled car has Magic Formula tyres"),
    }
}

/// Drive pushes ahead, braking back, drift to the left gives force to the right and a moment that turns the wheel
/// left, into the drift; for every kind of tyre.
#[test]
fn tyres_oppose_their_slip() {
    fn check(tyre: &impl Tyre<f64>) {
        assert!(ready_forces(tyre, 3000.0, 0.05, 0.0).x > 1000.0);
        assert!(ready_forces(tyre, 3000.0, -0.05, 0.0).x < -1000.0);
        for drift in [0.02, 0.05, 0.1] {
            let left = ready_forces(tyre, 3000.0, 0.0, drift);
            assert!(left.y < -500.0 && left.aligning_moment > 0.0, "{left:?}");
            let right = ready_forces(tyre, 3000.0, 0.0, -drift);
            assert!(right.y > 500.0 && right.aligning_moment < 0.0, "{right:?}");
        }
    }
    check(&slick().prepare(0.0));
    check(&LinearTyre { trail: 0.03, ..TYRE });
}

/// A wheel that leans pushes to the side it leans to, like a motorcycle's.
#[test]
fn leaning_pushes_to_the_side_leant_to() {
    for tyre in [slick(), set_b()] {
        let upright = forces_at(&tyre, 4000.0, 0.0, 0.0, 0.0).y;
        assert!(
            forces_at(&tyre, 4000.0, 0.0, 0.0, 0.04).y < upright,
            "top to the right: force to the right"
        );
        assert!(
            forces_at(&tyre, 4000.0, 0.0, 0.0, -0.04).y > upright,
            "top to the left: force to the left"
        );
    }
}

/// A force of 100 N along and 50 N across a wheel turned by the angle of the 3-4-5 triangle.
#[test]
fn forces_turn_with_the_wheel() {
    let forces = TyreForces {
        x: 100.0,
        y: 50.0,
        aligning_moment: 0.0,
    };
    let (x, y) = to_body_axes(&forces, (0.8, 0.6));
    close(x, 80.0 - 30.0, 100.0);
    close(y, 60.0 + 40.0, 100.0);
}

// --- The car ---------------------------------------------------------------------------------------------------

/// Steering 0.1 rad to the left while still going straight: each front tyre drifts 0.1 rad to its right and pushes
/// 60000 * 0.1 * 3000/4000 = 4500 N to its left.
#[test]
fn steering_left_turns_left() {
    let (sin, cos) = 0.1f64.sin_cos();
    let rate = linear("").rate(&CarState::straight(20.0), &rolling(20.0, 0.1));
    let (force_x, force_y) = (-9000.0 * sin, 9000.0 * cos);
    close(rate.state.body.yaw_rate, 1.2 * force_y / 1600.0, 10.0);
    let roll_acceleration = 0.5 * force_y / 400.0;
    close(rate.state.body.roll_rate, roll_acceleration, 20.0);
    // The centre of gravity is pushed with FyT/m; the ground under it is also flung out by the beginning roll.
    close(rate.ay, force_y / 1000.0 + 0.5 * roll_acceleration, 20.0);
    close(rate.ax, force_x / 1000.0, 10.0);
    assert!(
        rate.state.body.yaw_rate > 0.0 && rate.state.body.roll_rate > 0.0,
        "nose left, body out to the right"
    );
    // Load transfer sets out to follow FxT/m.
    close(
        rate.state.pitch_acceleration,
        force_x / 1000.0 / linear("").chassis.pitch_lag,
        100.0,
    );
}

#[test]
fn a_mirrored_manoeuvre_is_a_mirrored_answer() {
    let model = linear(
        "front_camber_deg=-3 rear_camber_deg=-1 drag_area_m2=1 downforce_area_m2=2 drs_drag_percent=10 drs_downforce_percent=20",
    );
    let state = CarState::from_array([30.0, -0.4, 0.3, 0.02, -0.1, -2.0]);
    let mirror = |[vx, vy, r, phi, p, ax]: [f64; 6]| [vx, -vy, -r, -phi, -p, ax];
    let input = CarInput {
        wheel_speed: [99.0, 102.0, 98.0, 104.0],
        steer: 0.05,
        flap: 0.3,
        friction: None,
    };
    let mirrored = CarInput {
        wheel_speed: [102.0, 99.0, 104.0, 98.0],
        steer: -0.05,
        flap: 0.3,
        friction: None,
    };
    let rate = model.rate(&state, &input).state.to_array();
    let other = model
        .rate(&CarState::from_array(mirror(state.to_array())), &mirrored)
        .state
        .to_array();
    for (a, b) in mirror(rate).into_iter().zip(other) {
        close(a, b, 1e3);
    }
}

/// 0.02 of slip on the right rear wheel only: 80000 * 0.02 * 2000/4000 = 800 N, 0.75 m right of the middle.
#[test]
fn drive_on_the_right_turns_left() {
    let mut input = rolling(20.0, 0.0);
    input.wheel_speed[3] *= 1.02;
    let rate = linear("").rate(&CarState::straight(20.0), &input);
    close(rate.ax, 0.8, 10.0);
    close(rate.state.body.yaw_rate, 0.75 * 800.0 / 1600.0, 10.0);
    close(rate.ay, 0.0, 1.0);
}

#[test]
fn drag_slows_the_car() {
    let rate = linear("drag_area_m2=2.4").rate(&CarState::straight(20.0), &rolling(20.0, 0.0));
    close(rate.ax, -0.6, 1.0);
    close(
        rate.state.pitch_acceleration,
        -0.6 / linear("").chassis.pitch_lag,
        100.0,
    );
}

/// Yaw damping: a car that yaws left while pointing straight is turned back by both axles.
#[test]
fn yaw_is_damped() {
    let state = CarState {
        body: BodyState {
            yaw_rate: 0.1,
            ..still()
        },
        pitch_acceleration: 0.0,
    };
    let rate = linear("").rate(&state, &rolling(20.0, 0.0));
    assert!(rate.state.body.yaw_rate < 0.0);
}

/// The trail of the front tyres in a left turn: forces to the left act behind the wheels' centres, which turns the car
/// less. Two times 4500 N at 0.02 m.
#[test]
fn aligning_moments_turn_the_car_back() {
    let tyre = LinearTyre { trail: 0.02, ..TYRE };
    let model = on_linear_tyres("", tyre);
    let with = model
        .rate(&CarState::straight(20.0), &rolling(20.0, 0.1))
        .state
        .body
        .yaw_rate;
    let without = linear("")
        .rate(&CarState::straight(20.0), &rolling(20.0, 0.1))
        .state
        .body
        .yaw_rate;
    close(with - without, -180.0 / 1600.0, 10.0);
}

/// Rolled to the right by 0.07 rad, the front left wheel would carry 3000 - 0.6 * 7000/1.6 = 375 N and the rear left
/// 2000 - 0.4 * 7000/1.5 = 133 N; at 0.1 rad both are in the air, and the right ones do all the work.
#[test]
fn lifted_wheels_give_nothing() {
    let body = BodyState { roll: 0.1, ..still() };
    let [fl, fr, rl, rr] = loads(&hand_car(""), &body, 0.0);
    assert!(fl < 0.0 && rl < 0.0);
    let rate = linear("").rate(
        &CarState {
            body,
            pitch_acceleration: 0.0,
        },
        &rolling(20.0, 0.1),
    );
    let force = 60_000.0 * 0.1 * fr / 4000.0;
    let (sin, cos) = 0.1f64.sin_cos();
    let expected = body_derivative(
        &hand_car(""),
        &body,
        &BodyForces {
            x: -force * sin,
            y: force * cos,
            yaw_moment: 1.2 * force * cos + 0.8 * -force * sin,
        },
    );
    close(rate.state.body.yaw_rate, expected.yaw_rate, 10.0);
    close(rate.state.body.vy, expected.vy, 100.0);
    assert!(rr > 0.0);
}

/// Negative camber leans the tops inwards, so the wheels of a straight-going car push at each other and cancel; on
/// the loaded right wheels of a left turn they push into the turn.
#[test]
fn negative_camber_adds_cornering_force_on_the_loaded_side() {
    let model = |camber: &str| {
        let chassis = hand_car(&format!("front_camber_deg={camber} rear_camber_deg={camber}"));
        let tyre = slick().to_flat();
        car_model::<f64, MagicFormula<f64>>(&chassis, &tyre, &tyre)
    };
    let straight = model("-2.5").rate(&CarState::straight(20.0), &rolling(20.0, 0.0));
    close(straight.ay, 0.0, 100.0);
    // The aligning moments of the slick are not quite mirrored (qEz4), by 0.01 Nm a wheel.
    assert!(straight.state.body.yaw_rate.abs() < 4.0 * 0.02 / 1600.0);
    let leaning = CarState {
        body: BodyState {
            roll: 0.03,
            ..still()
        },
        pitch_acceleration: 0.0,
    };
    let ay = |camber: &str| model(camber).rate(&leaning, &rolling(20.0, 0.03)).ay;
    assert!(
        ay("-2.5") > ay("0"),
        "tops inwards: more force to the left on the loaded right wheels"
    );
    assert!(ay("2.5") < ay("0"));
}

/// The logged steering angle is scaled, then shifted.
#[test]
fn steering_scale_and_offset() {
    let rate = |model: CarModel<f64, LinearTyre<f64>>, steer: f64| {
        let input = CarInput {
            steer,
            ..rolling(20.0, 0.0)
        };
        model.rate(&CarState::straight(20.0), &input).state.body.yaw_rate
    };
    close(
        rate(linear("steer_scale=0.5 steer_offset_rad=0.02"), 0.06),
        rate(linear(""), 0.05),
        10.0,
    );
}

/// The body leans out of a turn, right side down in a left one, and the weight then helps it on: without tyre forces
/// the roll acceleration is (m g h s - K phi)/(Ixx + m h^2 s^2).
#[test]
fn roll_springs_back_against_the_weight() {
    let body = BodyState { roll: 0.1, ..still() };
    let (sin, _) = 0.1f64.sin_cos();
    let free = BodyForces {
        x: 0.0,
        y: 0.0,
        yaw_moment: 0.0,
    };
    let rate = body_derivative(&hand_car(""), &body, &free);
    close(
        rate.roll_rate,
        (5000.0 * sin - 10_000.0) / (400.0 + 250.0 * sin * sin),
        100.0,
    );
}
