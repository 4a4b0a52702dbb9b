//! Layer one: our own functions, bit for bit where the subject rounds as the processor does.

use crate::device::subjects;
use lapswarm::parity::elementary::{FUNCTIONS, compare};

tests! {
    every_backend_has_the_bits_of_the_scalar_or_nearly: also_device,
}

fn every_backend_has_the_bits_of_the_scalar_or_nearly() {
    for subject in subjects() {
        let found = compare(&subject).expect("the kernel runs");
        assert_eq!(found.len(), FUNCTIONS.len());
        for found in found {
            assert!(found.pass, "{}: {}", found.key(), found.worst);
            assert_eq!(
                found.bits_as_scalar,
                Some(true)
                    .filter(|_| subject.rounds_like_the_processor())
                    .or(found.bits_as_scalar)
            );
        }
    }
}
