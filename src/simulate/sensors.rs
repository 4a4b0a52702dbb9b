//! Noise and delay of sensors.

use crate::evaluate::replay::{CHANNEL_NAMES, Sample};
use crate::random::Random;

/// Purpose of the noise draws in the counter.
const NOISE: u32 = 0x5e5;

/// Noise and delay of the four output channels (vx, ax, ay, yaw rate).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SensorSettings {
    /// Standard deviation of white noise, in the channel's unit.
    pub noise: [f64; CHANNEL_NAMES.len()],
    /// Delay of each channel, s.
    pub delay_s: [f64; CHANNEL_NAMES.len()],
}

/// Delays and disturbs the measured channels of a uniform log in place; a delayed channel begins with its first value.
pub fn distort(samples: &mut [Sample<f64>], interval_s: f64, settings: &SensorSettings, seed: u64) {
    let random = Random::new(seed);
    for channel in 0..CHANNEL_NAMES.len() {
        let truth: Vec<f64> = samples.iter().map(|s| s.measured[channel]).collect();
        for (i, sample) in samples.iter_mut().enumerate() {
            let place = (i as f64 - settings.delay_s[channel] / interval_s).max(0.0);
            let before = (place as usize).min(truth.len() - 1);
            let after = (before + 1).min(truth.len() - 1);
            let delayed = truth[before] + (place - place.floor()) * (truth[after] - truth[before]);
            let noise = settings.noise[channel] * random.normal(NOISE, channel as u32, i as u32, 0);
            sample.measured[channel] = delayed + noise;
        }
    }
}
