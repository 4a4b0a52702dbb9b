//! Random and damaged files: nothing panics, and every refusal names a place.

use super::tests::{edges, gpx, kml, latitudes, log, oval, racetrack, ring, wide};
use super::*;
use proptest::prelude::*;

/// A refusal names the file and a place in it.
fn names_its_place(result: Result<Survey>) -> std::result::Result<(), TestCaseError> {
    if let Err(error) = result {
        let Error::Input { file, place, .. } = &error else {
            return Err(TestCaseError::fail(error.to_string()));
        };
        prop_assert!(file.starts_with("f.") && !place.is_empty(), "{}", error);
    }
    Ok(())
}

proptest! {
    #[test]
    fn random_bytes_are_read_or_refused(bytes in prop::collection::vec(any::<u8>(), 0..400), kind in 0usize..5) {
        let name = ["f.csv", "f.gpx", "f.kml", "f.txt", "f.ld"][kind];
        names_its_place(Survey::parse(&bytes, name, &wide()))?;
        let start = [racetrack(), gpx(&oval(), "1.1"), kml(&oval()), latitudes(&oval()), log()];
        let mut after = start[kind].as_bytes()[..300].to_vec();
        after.extend(&bytes);
        names_its_place(Survey::parse(&after, name, &wide()))?;
    }

    #[test]
    fn damaged_files_are_read_or_refused(
        kind in 0usize..6,
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>(), 0u8..4), 1..6),
        closed in prop::option::of(any::<bool>()),
        whole_number in any::<bool>(),
    ) {
        let good = [
            racetrack(),
            gpx(&oval(), "1.0"),
            kml(&oval()),
            latitudes(&oval()),
            log(),
            edges(&ring(95.0, 60), &ring(105.0, 70)),
        ];
        let name = ["f.csv", "f.gpx", "f.kml", "f.csv", "f.csv", "f.csv"][kind];
        let mut bytes = good[kind].as_bytes().to_vec();
        for (at, byte, what) in changes {
            if bytes.is_empty() {
                break;
            }
            let at = at.index(bytes.len());
            // Digits keep a file readable and make its figures wild.
            let byte = if whole_number { b'0' + byte % 10 } else { byte };
            match what {
                0 => bytes[at] = byte,
                1 => bytes.insert(at, byte),
                2 => drop(bytes.remove(at)),
                _ => {
                    let end = (at + 40).min(bytes.len());
                    let piece: Vec<u8> = bytes[at..end].to_vec();
                    bytes.splice(at..at, piece);
                }
            }
        }
        let options = SurveyOptions { closed, ..wide() };
        let result = Survey::parse(&bytes, name, &options);
        if let Ok(survey) = &result {
            // What is taken for a road is a road: its spline and cross-sections are finite, or refused.
            if let Ok(line) = survey.smoothed(&crate::track::Smoothing::default())
                && let Ok(cross_sections) = line.cross_sections(50)
            {
                prop_assert!(cross_sections.right_m.iter().chain(&cross_sections.left_m).all(|p| p.is_finite()));
            }
        }
        names_its_place(result)?;
    }
}
