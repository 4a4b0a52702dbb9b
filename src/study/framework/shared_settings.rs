//! Settings that several studies have. The names of kinds in them are looked up where a study has the setting.

/// Declares settings for [`crate::config::settings::settings`]: `name [unit] = default, kind, meaning;`.
macro_rules! shared_settings {
    ($($name:ident [$unit:literal] = $default:expr, $kind:expr, $meaning:literal;)*) => {
        $(
            macro_rules! $name {
                (unit) => {
                    $unit
                };
                (default) => {
                    $default
                };
                (kind) => {
                    $kind
                };
                (meaning) => {
                    $meaning
                };
            }
            pub(crate) use $name;
        )*
    };
}

shared_settings! {
    channel_map ["-"] = None, optional(file()).example("\"channels.toml\""),
        "Channel names, units, signs and delays of the log, as TOML; without it they are guessed";
    envelope ["-"] = None, optional(file()).example("\"envelope.csv\""),
        "A g-g-v envelope (columns v_mps, ay_mps2, ax_grip_mps2, ax_drive_mps2, drag_mps2) instead of the car's own";
    steering_rate_deg_s ["deg/s"] = None, optional(number(0.1, 10_000.0)).example("40.0"),
        "Fastest turn of the front wheels, where a line would need a faster one the car is slower; without it the car's own";
    entry_mps ["m/s"] = 10.0, number(0.5, 150.0),
        "Greatest speed at the start of an open track";
    share ["-"] = 0.1, number(1e-6, 1.0),
        "How far each goes either way, as a share of its value";
    inertia ["-"] = None, of(Scheduled).search().example("[0.5, 0.1]"),
        "Inertia weight of an algorithm that has one, such as thesis: a number, or the first and the last of a linear schedule; without it the algorithm's own";
    cognitive ["-"] = None, of(Scheduled).search().example("1.5"),
        "Pull towards the particle's own best, as inertia is given";
    social ["-"] = None, of(Scheduled).search().example("2.5"),
        "Pull towards the leader, as inertia is given";
    mutation ["-"] = None, of(Mutated).search().example("0.3"),
        "Mutation with thesis: an exponent from 0 (none) to 10, random or polynomial; without it the algorithm's own";
    islands ["-"] = 1, count(1, 1000).search(),
        "Swarms for a front, each of the whole population; five members of each go to the next one every ten iterations";
    seed ["-"] = 1, count(0, u64::MAX).search(),
        "Seed of all random numbers";
    swarm ["-"] = SwarmPlace::Auto, choice().search(),
        "Where the particles of the front and of algorithm thesis live; auto: on the device from 4096 particles on, where a graphics processor evaluates";
    adapter ["-"] = None, optional(text()).place().example("\"llvmpipe\""),
        "Part of the name of the GPU to use, its place on the PCI bus, or all for several";
}
