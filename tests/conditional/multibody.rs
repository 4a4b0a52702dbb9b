//! The 4DOF car against a multi-body model: vehicle 2 of the CommonRoad vehicle models (29 states; a BMW 320i), in a
//! step steer and a sine steer at 25 m/s. Ours is fed the multi-body model's wheel speeds and steering angle.

use crate::common::harness::{Case, outside};
use crate::support::{car_model, car_step, chassis_from, tyre_from};
use lapswarm::vehicle::{CarInput, CarModel, CarState, MagicFormula};
use std::path::PathBuf;

pub fn tests() -> Vec<Case> {
    let case = |name, run| {
        Case::new(module_path!(), name, run).needing(|| recorded("step").and(recorded("sine")).map(drop))
    };
    vec![
        case(
            "yaw_rate_follows_the_multi_body_model",
            yaw_rate_follows_the_multi_body_model,
        ),
        case("the_step_is_small_enough", the_step_is_small_enough),
    ]
}

/// The published figures of that vehicle, turned from pounds and feet into SI.
///
/// The multi-body model rolls on its springs (30.4 kNm/rad in front, 20.9 behind, bars included) and on its tyres
/// (0.5 T^2 times 158 kN/m: 152.2 and 147.2) in series, which makes 25.4 and 18.3: 43,657 Nm/rad, 58 % in front.
/// Damping is 0.5 T^2 times 1786 and 1649 N s/m; roll inertia that of body (207.3) and axles (30.7 and 29.7).
const CHASSIS: &str = "
    mass_kg=1093.295 cg_to_front_axle_m=1.156196 cg_to_rear_axle_m=1.422717 front_half_track_m=0.69342
    rear_half_track_m=0.68199 cg_height_m=0.574869 roll_inertia_kgm2=267.6 pitch_inertia_kgm2=1565.8
    yaw_inertia_kgm2=1791.6 roll_stiffness_nm_per_rad=43657 roll_damping_nms_per_rad=3252
    front_roll_moment_share=0.5807 front_camber_deg=0 rear_camber_deg=0
    front_rolling_radius_m=0.344 rear_rolling_radius_m=0.344 drag_area_m2=0 downforce_area_m2=0 gravity_mps2=9.81";

/// Its tyres: those coefficients of set B that its model has, made to mean the same in ours.
///
/// Its side stiffness is `pKy1 Fz`, which is `pKy1 (pKy2/2) F0 sin(2 atan(Fz/(pKy2 F0)))` for a great pKy2 (here 50,
/// to 0.01 %). It adds `SVx = pVx1 Fz` inside the sine of the longitudinal formula, not to the force: at small slips
/// that is a force of `pDx1 pVx1 Fz^2`, in our terms pVx1 = pVx2 = pDx1 pVx1 F0. Its y axis points right, which turns
/// rBy3 and rVy1 round; its slip has the opposite sign in the combined side force, which turns rHy1 and rVy6.
/// Its camber shifts (pHy1, pHy3, pVy1, pVy3) follow roll and vanish without; a car of fixed camber has none.
const TYRE: &str = "UNLOADED_RADIUS=0.344 FNOMIN=4850
    PCX1=1.6411 PDX1=1.1739 PEX1=0.46403 PKX1=22.303 PHX1=0.0012297 PVX1=-0.05016 PVX2=-0.05016
    RBX1=13.276 RBX2=-13.778 RCX1=1.2568 REX1=0.65225 RHX1=-0.0050722
    PCY1=1.3507 PDY1=1.0489 PDY3=-2.8821 PEY1=-0.0074722 PKY2=50
    RBY1=7.1433 RBY2=9.1916 RBY3=0.027856 RCY1=1.0719 REY1=-0.27572 RHY1=-5.7448e-06
    RVY1=0.027825 RVY4=12.12 RVY5=1.9 RVY6=10.704";
/// pKy1 pKy2/2.
const STIFFNESS: f64 = -548.0;
/// How much stiffer the front tyres count for the camber that they gain in roll. The multi-body model's front wheels
/// lean by 0.77 of the roll angle and its rear ones by 0.46, which turns the car in a little more; our cambers are
/// fixed. This one figure is fitted to the step steer, all others are as published.
const CAMBER_GAIN: f64 = 1.01;

/// The greatest root-mean-square differences of yaw rate, rad/s: those the same comparison gave elsewhere.
const STEP_LIMIT: f64 = 0.0035;
const SINE_LIMIT: f64 = 0.0023;

/// A manoeuvre of vehicle 2 of the CommonRoad models, as their multi-body model drives it.
fn recorded(name: &str) -> Result<PathBuf, String> {
    let file = format!("commonroad_mb_veh2_{name}_ISO.csv");
    outside(&file, "the CommonRoad multi-body model, columns in ISO axes")
}

/// Rows of a manoeuvre's file, a hundredth of a second apart, with the columns by name.
struct Manoeuvre {
    names: Vec<String>,
    rows: Vec<Vec<f64>>,
}

impl Manoeuvre {
    fn read(name: &str) -> Self {
        let path = recorded(name).expect("the harness has looked");
        let text = std::fs::read_to_string(path).unwrap();
        let mut lines = text.lines();
        Self {
            names: lines.next().unwrap().split(',').map(str::to_owned).collect(),
            rows: lines
                .map(|line| line.split(',').map(|x| x.parse().unwrap()).collect())
                .collect(),
        }
    }

    fn column(&self, name: &str) -> usize {
        self.names.iter().position(|n| n == name).unwrap()
    }

    /// The inputs a share of a sample after the `i`-th.
    fn input(&self, i: usize, share: f64) -> CarInput<f64> {
        let [w0, w1, w2, w3, steer] = ["w_FL", "w_FR", "w_RL", "w_RR", "delta_rad"].map(|name| {
            let column = self.column(name);
            self.rows[i][column] + share * (self.rows[i + 1][column] - self.rows[i][column])
        });
        CarInput {
            wheel_speed: [w0, w1, w2, w3],
            steer,
            flap: 0.0,
            friction: None,
        }
    }

    /// Root-mean-square differences in yaw rate (rad/s), roll (rad) and forward speed (m/s) of our car in steps of
    /// `0.01 s / substeps`.
    fn differences(&self, change: &str, camber_gain: f64, substeps: usize) -> [f64; 3] {
        let tyre = |gain: f64| tyre_from(&format!("{TYRE} PKY1={}", STIFFNESS * gain)).to_flat();
        let model: CarModel<f64, MagicFormula<f64>> = car_model(
            &chassis_from(&format!("{CHASSIS} {change}")),
            &tyre(camber_gain),
            &tyre(1.0),
        );
        let columns = ["vx_mps", "vy_mps", "r_radps", "phi_rad", "p_radps"].map(|name| self.column(name));
        let [vx, vy, r, phi, p] = columns.map(|column| self.rows[0][column]);
        let mut state = CarState::from_array([vx, vy, r, phi, p, 0.0]);
        let mut sums = [0.0; 3];
        for (i, row) in self.rows.iter().enumerate() {
            let body = &state.body;
            for (sum, (ours, column)) in
                sums.iter_mut()
                    .zip([(body.yaw_rate, 2), (body.roll, 3), (body.vx, 0)])
            {
                *sum += (ours - row[columns[column]]).powi(2);
            }
            if i + 1 < self.rows.len() {
                for substep in 0..substeps {
                    let at = |share: f64| self.input(i, (substep as f64 + share) / substeps as f64);
                    state = car_step(&model, &state, at, 0.01 / substeps as f64);
                }
            }
        }
        sums.map(|sum| (sum / self.rows.len() as f64).sqrt())
    }
}

fn yaw_rate_follows_the_multi_body_model() {
    let [step, sine] = ["step", "sine"].map(Manoeuvre::read);
    assert_eq!((step.rows.len(), sine.rows.len()), (601, 601));
    let both = |change: &str, gain: f64| {
        [
            step.differences(change, gain, 5),
            sine.differences(change, gain, 5),
        ]
    };
    let report = |what: &str, [step, sine]: [[f64; 3]; 2]| {
        println!(
            "{what}: yaw rate rms {:.5} rad/s in the step, {:.5} in the sine; roll {:.4} and {:.4} rad; speed {:.4} and {:.4} m/s",
            step[0], sine[0], step[1], sine[1], step[2], sine[2]
        );
    };
    let fitted = both("", CAMBER_GAIN);
    report("as fitted", fitted);
    for lag in ["0.005", "0.01", "0.1", "0.2", "0.3", "0.5", "1"] {
        report(
            &format!("load-transfer lag {lag} s"),
            both(&format!("load_transfer_lag_s={lag}"), CAMBER_GAIN),
        );
    }
    let off = both("longitudinal_load_transfer=0", CAMBER_GAIN);
    report("no longitudinal load transfer", off);
    let published = both("", 1.0);
    report("as published", published);
    report(
        "as published, no longitudinal load transfer",
        both("longitudinal_load_transfer=0", 1.0),
    );

    assert!(fitted[0][0] <= STEP_LIMIT, "{fitted:?}");
    assert!(fitted[1][0] <= SINE_LIMIT, "{fitted:?}");
    assert!(
        off[0][0] > 1.5 * fitted[0][0],
        "longitudinal load transfer is worth having: {off:?}"
    );
    // Nothing fitted at all still comes within 2 % of the 0.29 rad/s of the step and 1 % of the sine's amplitude.
    assert!(
        published[0][0] < 0.02 * 0.29 && published[1][0] < 0.01 * 0.27,
        "{published:?}"
    );
    // Roll of 0.118 and 0.095 rad to 5 % and 15 % (the sine's is a matter of damping), speed to 0.1 % of 25 m/s.
    assert!(
        fitted[0][1] < 0.05 * 0.118 && fitted[1][1] < 0.15 * 0.095,
        "{fitted:?}"
    );
    assert!(fitted[0][2] < 0.025 && fitted[1][2] < 0.025, "{fitted:?}");
}

/// The step is no part of the answer: at 5 ms and 1 ms the figures agree to 1e-6 rad/s, a thousandth of them. At 24 m/s
/// RK4 may take 36 ms so its error at 5 ms is of the order (5/36)^4/120 = 3e-6 of the state.
fn the_step_is_small_enough() {
    let step = Manoeuvre::read("step");
    let [coarse, fine] = [2, 10].map(|substeps| step.differences("", CAMBER_GAIN, substeps)[0]);
    assert!((coarse - fine).abs() < 1e-6, "{coarse} {fine}");
}
