#![no_main]
libfuzzer_sys::fuzz_target!(
    // The reader catches panics of the crate that it reads by, which the fuzzer's own hook would make an end of; without
    // that hook only what gets through is a finding.
    init: drop(std::panic::take_hook()),
    |data: &[u8]| lapswarm_fuzz::readers::motec_ld(data)
);
