// Twin of `src/evaluate/replay/kernel.rs`: drive a candidate car by the logged inputs and score it.
//
// One lane per candidate (x) and window (y). A dispatch drives a stretch of every window, of a multiple of BLOCK samples, and
// leaves its state in a buffer for the next, so that no dispatch runs long enough for a watchdog to kill it. The sums are grouped
// as in the twin, whatever the stretches are.
//
// A car is given by the figures of `CarModel::to_table`: those that all candidates share from `base`, the others from `figures`,
// variable by variable. The loaders (`load_chassis`, `load_tyres`) and the constants NORM and WORKGROUP are generated.

struct Sample {
    wheel_speed: vec4<f32>,
    measured: vec4<f32>,
    steer: f32,
    flap: f32,
}

struct Window {
    start: u32,
    end: u32,
    scored_from: u32,
    initial: array<f32, 6>,
}

@group(0) @binding(1) var<uniform> base: array<vec4<f32>, BASE_VECTORS>;
@group(0) @binding(2) var<storage, read> samples: array<Sample>;
@group(0) @binding(3) var<storage, read> windows: array<Window>;
@group(0) @binding(4) var<storage, read> fractions: array<vec4<f32>>;
@group(0) @binding(5) var<storage, read> figures: array<f32>;
@group(0) @binding(6) var<storage, read_write> progress: array<f32>;

fn input_between(a: Sample, b: Sample, fraction: f32) -> CarInput {
    return CarInput(
        a.wheel_speed + fraction * (b.wheel_speed - a.wheel_speed),
        a.steer + fraction * (b.steer - a.steer),
        a.flap + fraction * (b.flap - a.flap),
        1.0,
    );
}

fn penalty(error: vec4<f32>) -> vec4<f32> {
    if NORM == NORM_TWO || NORM == NORM_MEAN_SQUARE {
        return error * error;
    }
    return error;
}

@compute @workgroup_size(WORKGROUP)
fn replay(@builtin(global_invocation_id) id: vec3<u32>) {
    let candidate = id.x;
    let row = id.y;
    if candidate >= stretch.candidates || row >= stretch.windows {
        return;
    }
    let window_start = windows[stretch.first_window + row].start;
    let scored_from = windows[stretch.first_window + row].scored_from;
    let last = windows[stretch.first_window + row].end - window_start - 1u;
    if stretch.first_sample > last {
        return;
    }

    var state: CarState;
    var total = vec4<f32>(0.0);
    var drives = true;
    if stretch.first_sample == 0u {
        let initial = windows[stretch.first_window + row].initial;
        state = CarState(BodyState(initial[0], initial[1], initial[2], initial[3], initial[4]), initial[5]);
    } else {
        state = CarState(
            BodyState(
                progress[place_of(0u, row, candidate)],
                progress[place_of(1u, row, candidate)],
                progress[place_of(2u, row, candidate)],
                progress[place_of(3u, row, candidate)],
                progress[place_of(4u, row, candidate)],
            ),
            progress[place_of(5u, row, candidate)],
        );
        total = vec4<f32>(
            progress[place_of(6u, row, candidate)],
            progress[place_of(7u, row, candidate)],
            progress[place_of(8u, row, candidate)],
            progress[place_of(9u, row, candidate)],
        );
        drives = progress[place_of(10u, row, candidate)] != 0.0;
    }

    let car = load_car(candidate);
    var block = vec4<f32>(0.0);
    let stop = min(stretch.first_sample + stretch.samples, last + 1u);
    for (var i = stretch.first_sample; i < stop; i++) {
        let at_last = i == last;
        let here = samples[window_start + i];
        let next_sample = samples[window_start + min(i + 1u, last)];
        // At the last sample only the outputs are wanted: one rate, and no step.
        let substeps = select(stretch.substeps, 1u, at_last);
        let stages = select(STAGES, 1u, at_last);
        for (var substep = 0u; substep < substeps; substep++) {
            let shares = fractions[substep];
            var reached = state;
            var sum = state;
            for (var stage = 0u; stage < stages; stage++) {
                let rate = car_rate(car, reached, input_between(here, next_sample, stage_input(shares, stage)));
                if stage == 0u && substep == 0u && i >= scored_from {
                    let outputs = vec4<f32>(state.body.vx, rate.ax, rate.ay, state.body.yaw_rate);
                    block = joined(block, penalty(abs(outputs - here.measured)));
                }
                sum = carried(sum, stretch.step * stage_weight(stage), rate.state);
                reached = carried(state, stretch.step * stage_reach(stage), rate.state);
            }
            if !at_last {
                drives = drives && still_drives(sum);
                if drives {
                    state = sum;
                }
            }
        }
        if (i + 1u) % BLOCK == 0u || at_last {
            total = joined(total, block);
            block = vec4<f32>(0.0);
        }
    }

    progress[place_of(0u, row, candidate)] = state.body.vx;
    progress[place_of(1u, row, candidate)] = state.body.vy;
    progress[place_of(2u, row, candidate)] = state.body.yaw_rate;
    progress[place_of(3u, row, candidate)] = state.body.roll;
    progress[place_of(4u, row, candidate)] = state.body.roll_rate;
    progress[place_of(5u, row, candidate)] = state.pitch_acceleration;
    progress[place_of(6u, row, candidate)] = total.x;
    progress[place_of(7u, row, candidate)] = total.y;
    progress[place_of(8u, row, candidate)] = total.z;
    progress[place_of(9u, row, candidate)] = total.w;
    progress[place_of(10u, row, candidate)] = select(0.0, 1.0, drives);
}
