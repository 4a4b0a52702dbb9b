#![no_main]
libfuzzer_sys::fuzz_target!(|data: &[u8]| lapswarm_fuzz::readers::envelope(data));
