//! Descriptors against those that the reference program computed on the office logs.

use std::f32::consts::{PI, TAU};

use agv_core::sensing::falko::{Parameters, Sectors};
use agv_core::sensing::{Keypoint, PointScan};
use agv_lab::evaluate::falko::{BEAMS, RANGES, ReferenceKeypoint, Set, detect};
use agv_places::{BinaryShapeContext, CumulativeGaussianHistogram, Kernel};
use agv_tests::recordings;

/// Radius of the descriptors in the reference file, m.
const RADIUS: f32 = 0.5;

/// Calls `compare` with each keypoint that both programs found in the scans that the reference describes.
fn each_common(test: &str, mut compare: impl FnMut(&PointScan<BEAMS>, &Keypoint, &ReferenceKeypoint)) -> usize {
    let (Some(_), Some(_)) = (recordings(test, "scans2d"), recordings(test, "falko_reference")) else { return 0 };
    let mut common = 0;
    for set in [Set::Fr079, Set::Intel] {
        let scans = set.scans().unwrap();
        let reference = set.reference().unwrap();
        let described = reference.iter().filter(|keypoint| !keypoint.bsc_bits.is_empty());
        let last = described.clone().map(|keypoint| keypoint.scan).max().unwrap();
        let found: Vec<_> = detect(&scans[..=last], Parameters::reference()).collect();
        let mut points = Box::new(PointScan::<BEAMS>::new());
        for expected in described {
            points.set(&scans[expected.scan].scan.view(), RANGES.0, RANGES.1);
            if let Some(keypoint) = found[expected.scan].iter().find(|own| own.beam == expected.beam_index) {
                common += 1;
                compare(&points, keypoint, expected);
            }
        }
    }
    common
}

/// The reference program fills its grid in the laser's frame, turns it by the whole sectors of the orientation, and starts to
/// count half a turn away.
fn turned_by_whole_sectors(keypoint: &Keypoint) -> Keypoint {
    let sector = TAU / f32::from(BinaryShapeContext::SECTORS);
    Keypoint { orientation: (keypoint.orientation / sector).floor() * sector + PI, ..*keypoint }
}

#[test]
fn binary_shape_contexts_are_those_of_the_reference_program() {
    let sectors = Sectors::new(BinaryShapeContext::SECTORS, false);
    let mut same = 0;
    let common =
        each_common("binary_shape_contexts_are_those_of_the_reference_program", |points, keypoint, expected| {
            let keypoint = &turned_by_whole_sectors(keypoint);
            let own = BinaryShapeContext::describe(points, keypoint, RADIUS, &sectors);
            let bits = (0..BinaryShapeContext::RINGS)
                .flat_map(|ring| (0..BinaryShapeContext::SECTORS).map(move |sector| (ring, sector)))
                .map(|(ring, sector)| if own.is_occupied(ring, sector) { '1' } else { '0' });
            let bits: String = bits.collect();
            same += usize::from(bits == expected.bsc_bits);
        });
    println!("{same} of {common}");
    assert!(same as f64 >= 0.97 * common as f64);
}

#[test]
fn histograms_are_those_of_the_reference_program() {
    let sectors = Sectors::new(CumulativeGaussianHistogram::BINS, false);
    // The reference program spreads a point over three bins with weights 1, 5, 1.
    let kernel = Kernel::gaussian((1.0 / (2.0 * 5.0_f32.ln())).sqrt());
    let mut same = 0;
    let common = each_common("histograms_are_those_of_the_reference_program", |points, keypoint, expected| {
        let keypoint = &turned_by_whole_sectors(keypoint);
        let own = CumulativeGaussianHistogram::describe(points, keypoint, RADIUS, &sectors, &kernel);
        let bins = expected.histogram.as_ref().unwrap();
        same += usize::from(own.bins().iter().zip(bins).all(|(own, theirs)| (own - theirs).abs() < 2e-5));
    });
    println!("{same} of {common}");
    assert!(same as f64 >= 0.97 * common as f64);
}
