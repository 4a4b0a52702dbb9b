//! Simpler models than the car with roll, on a lap of that car.

use lapswarm::evaluate::replay::CHANNEL_NAMES;
use lapswarm::study::identify::{IdentifySettings, ModelChoice, judge_candidate, set_up};

/// The car that drove the lap fits it exactly with roll. Without roll and load transfer it does not, and less so as a bicycle.
#[test]
fn simpler_models_leave_errors_on_a_lap_of_the_car_with_roll() {
    let errors = |model: ModelChoice| {
        let settings = IdentifySettings {
            model,
            window_s: Some(1.5),
            settle_s: Some(0.5),
            ..IdentifySettings::default()
        };
        let setup = set_up(&settings).expect("the bundled lap");
        let free = &setup.replay.free;
        let own = free.values_in(free.base());
        let judged = judge_candidate(&setup.replay, &own);
        println!("{model:?} {:?} of {:?}", judged.rms_error, judged.rms_signal);
        (judged.rms_error, judged.rms_signal, free.car.chassis)
    };
    let yaw_rate = CHANNEL_NAMES
        .iter()
        .position(|name| *name == "yaw_rate")
        .expect("a channel");
    let (with_roll, signal, own) = errors(ModelChoice::Roll);
    let (no_roll, _, flat) = errors(ModelChoice::NoRoll);
    let (bicycle, _, narrow) = errors(ModelChoice::Bicycle);
    for simpler in [no_roll, bicycle] {
        for k in 0..CHANNEL_NAMES.len() {
            assert!(simpler[k] > with_roll[k], "{}: {simpler:?}", CHANNEL_NAMES[k]);
        }
    }
    assert!(no_roll[yaw_rate] < 0.5 * signal[yaw_rate], "{no_roll:?}");
    assert!(bicycle[yaw_rate] > no_roll[yaw_rate], "{bicycle:?}");
    assert!(flat.cg_height < 0.05 && flat.half_track_front == own.half_track_front);
    assert!(narrow.half_track_rear < 0.2 && narrow.mass == own.mass);
}
