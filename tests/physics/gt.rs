//! The bundled GT car corners as such a car should, and stays with its driver at the limit.

use crate::support::{car_model, car_step, forces_at};
use lapswarm::vehicle::model::wheel_slip;
use lapswarm::vehicle::{Car, CarInput, CarModel, CarState, MagicFormula, TyreCoefficients, Tyres};

type GtModel = CarModel<f64, MagicFormula<f64>>;

fn gt() -> (GtModel, TyreCoefficients<f64>) {
    let car = Car::bundled().unwrap();
    let Tyres::MagicFormula { front, rear } = car.tyres else {
        panic!("the bundled car has Magic Formula tyres");
    };
    assert_eq!(front.coefficients.well_formed(), Ok(()));
    (
        car_model(
            &car.chassis,
            &front.coefficients.to_flat(),
            &rear.coefficients.to_flat(),
        ),
        front.coefficients,
    )
}

/// Front wheels that roll along, rear wheels driven with the slip ratio `drive`, under a car in `state`.
fn inputs(model: &GtModel, state: &CarState<f64>, steer: f64, drive: f64) -> CarInput<f64> {
    let c = &model.chassis;
    let body = &state.body;
    let (sin, cos) = steer.sin_cos();
    let front = |y: f64| {
        let (x, y) = (
            body.vx - body.yaw_rate * y,
            body.vy + body.yaw_rate * c.cg_to_front,
        );
        (cos * x + sin * y) / c.radius_front
    };
    let rear = |y: f64| (body.vx - body.yaw_rate * y) * (1.0 + drive) / c.radius_rear;
    let (wf, wr) = (c.half_track_front, c.half_track_rear);
    CarInput {
        wheel_speed: [front(wf), front(-wf), rear(wr), rear(-wr)],
        steer,
        flap: 0.0,
        friction: None,
    }
}

/// One moment of a steering sweep.
#[derive(Clone, Copy, Debug)]
struct Moment {
    steer: f64,
    ay: f64,
    /// Slip angles of the outer wheels, front and rear, degrees, positive where they push into the turn.
    slip: [f64; 2],
    state: CarState<f64>,
}

/// Steering wound on to the left by 0.005 rad/s to its stop, slow enough that the car is in equilibrium throughout
/// (its slowest mode settles in a second, meanwhile the steering adds 3 % of its range); drive holds the speed.
fn sweep(model: &GtModel, speed: f64) -> Vec<Moment> {
    const STEP: f64 = 2e-3;
    let mut state = CarState::straight(speed);
    let mut integral = 0.0;
    let mut moments = Vec::new();
    for i in 0..(0.1745 / (0.005 * STEP)) as usize {
        let steer = 0.005 * STEP * i as f64;
        let error = speed - state.body.vx;
        integral += error * STEP;
        let drive = (0.01 * (error + integral)).clamp(-0.02, 0.08);
        let input = inputs(model, &state, steer, drive);
        let rate = model.rate(&state, &input);
        let c = &model.chassis;
        let angle = |x: f64, w: f64, direction: (f64, f64)| {
            -wheel_slip(&state.body, (x, -w), direction, 0.0, 1.0)
                .tangent
                .atan()
                .to_degrees()
        };
        moments.push(Moment {
            steer,
            ay: rate.ay,
            slip: [
                angle(c.cg_to_front, c.half_track_front, (steer.cos(), steer.sin())),
                angle(-c.cg_to_rear, c.half_track_rear, (1.0, 0.0)),
            ],
            state,
        });
        state = car_step(model, &state, |_| input, STEP);
        assert!(state.drives(), "lost at {speed} m/s, steer {steer}: {state:?}");
    }
    moments
}

fn greatest(moments: &[Moment]) -> Moment {
    *moments.iter().max_by(|a, b| a.ay.total_cmp(&b.ay)).unwrap()
}

#[test]
fn corners_as_hard_as_a_gt_car() {
    let (model, _) = gt();
    // What a GT car does, to 6 %: 15 m/s^2 where the tyres do it alone, 18 with the air's help.
    for (speed, least, most) in [(25.0, 14.1, 15.9), (65.0, 17.0, 19.1)] {
        let limit = greatest(&sweep(&model, speed));
        println!(
            "{speed} m/s: {:.2} m/s^2 at {:.3} rad, slip angles {:.1} and {:.1} degrees, roll {:.3} rad",
            limit.ay, limit.steer, limit.slip[0], limit.slip[1], limit.state.body.roll
        );
        assert!(limit.ay > least && limit.ay < most, "{limit:?}");
    }
}

/// At the limit the front tyres slide first and the car runs wide: it neither spins (`sweep` sees to that) nor
/// loses more than a tenth of its grip by steering too much, and the front always slips at least as much as the rear.
#[test]
fn understeers_mildly_at_the_limit() {
    let (model, _) = gt();
    for speed in [25.0, 45.0, 65.0, 70.0] {
        let moments = sweep(&model, speed);
        let limit = greatest(&moments);
        let [front, rear] = limit.slip;
        assert!(front > rear + 0.5 && front < rear + 4.0, "{speed} m/s: {limit:?}");
        for moment in moments.iter().filter(|m| m.ay > 8.0) {
            assert!(moment.slip[0] > moment.slip[1] - 0.1, "{speed} m/s: {moment:?}");
            assert!(moment.state.body.yaw_rate > 0.0 && moment.state.body.roll > 0.0);
        }
        let last = moments.last().unwrap();
        assert!(last.ay > 0.85 * limit.ay, "{speed} m/s: {last:?}");
        assert!(
            (last.state.body.vx - speed).abs() < 0.02 * speed,
            "{speed} m/s: {last:?}"
        );
    }
}

/// Steering at a walk turns the car as its geometry says: `V tan(steer)/L` of yaw rate. At 0.35 m/s^2 the tyres slip by
/// under 0.1 of the 5.7 degrees steered, and front and rear nearly alike, which leaves less than 1 %.
#[test]
fn follows_its_wheels_at_walking_pace() {
    let (model, _) = gt();
    let moments = sweep(&model, 3.0);
    let moment = moments.iter().find(|m| m.steer >= 0.1).unwrap();
    let wheelbase = model.chassis.cg_to_front + model.chassis.cg_to_rear;
    let expected = moment.state.body.vx * moment.steer.tan() / wheelbase;
    let yaw_rate = moment.state.body.yaw_rate;
    assert!(
        (yaw_rate / expected - 1.0).abs() < 0.01,
        "{yaw_rate} for {expected}"
    );
}

/// Load, friction at the peak, and the slip angle (degrees) at the peak.
fn lateral_peak(tyre: &TyreCoefficients<f64>, load: f64) -> (f64, f64) {
    (1..2000)
        .map(|i| f64::from(i) * 1e-4)
        .map(|slip| {
            (
                -forces_at(tyre, load, 0.0, slip, 0.0).y / load,
                slip.atan().to_degrees(),
            )
        })
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .unwrap()
}

#[test]
fn the_slick_peaks_where_slicks_do() {
    let (_, tyre) = gt();
    let (friction, angle) = lateral_peak(&tyre, 4000.0);
    // The grid of slips is a thousandth of the peak's width: friction is off by less than 1e-5.
    assert!((friction - 1.55).abs() < 1e-4, "{friction}");
    assert!((5.0..=7.0).contains(&angle), "{angle}");
    let (heavier, _) = lateral_peak(&tyre, 8000.0);
    assert!(
        (friction - heavier - 0.1).abs() < 1e-4,
        "{friction} and {heavier}"
    );
    assert!((5.0..=7.0).contains(&lateral_peak(&tyre, 2000.0).1));
}

/// Sixth gear reaches 70 m/s at 8500 rpm, and there is power for it: 70 m/s wants `D V`, rolling and induced drag
/// aside.
#[test]
fn top_gear_reaches_seventy() {
    let car = Car::bundled().unwrap();
    let powertrain = car.powertrain.unwrap();
    let top = powertrain.gear_ratios.last().unwrap() * powertrain.final_drive;
    let speed = 8500.0 * 2.0 * std::f64::consts::PI / 60.0 / top * car.chassis.radius_rear;
    assert!((speed - 70.0).abs() < 0.05, "{speed}");
    let drag = 0.5 * car.chassis.air_density * car.chassis.drag_area * 70.0 * 70.0;
    assert!(powertrain.wheel_force(69.9, car.chassis.radius_rear) > drag);
}
