//! Evidence for and against the pose, against sums in which the weight of each scan is written out.

use agv_core::integrity::{InnovationMonitor, InnovationMonitorParameters};

use super::falko::scene::Random;

#[derive(Clone, Copy)]
struct Scan {
    expected: usize,
    accepted: usize,
    used: usize,
    square_sum: f64,
}

fn consistency(parameters: InnovationMonitorParameters, scans: &[Scan]) -> InnovationMonitor {
    let mut consistency = InnovationMonitor::new(parameters);
    for scan in scans {
        consistency.add(scan.expected, scan.accepted, scan.used, scan.square_sum);
    }
    consistency
}

/// Sum over the scans of a number, weighted by what the later scans have left of it.
fn sum(scans: &[Scan], number: impl Fn(&Scan) -> f64, remaining: impl Fn(&Scan) -> f64) -> f64 {
    let weight = |index: usize| scans.iter().skip(index + 1).map(&remaining).product::<f64>();
    scans.iter().enumerate().map(|(index, scan)| weight(index) * number(scan)).sum()
}

#[test]
fn verdicts_are_those_of_weighted_means() {
    let mut random = Random::new(1);
    let mut verdicts = [0; 6];
    for _ in 0..400 {
        let parameters = InnovationMonitorParameters {
            memory: random.uniform(3.0, 20.0),
            least_remaining: random.uniform(0.3, 0.9),
            ..InnovationMonitorParameters::default()
        };
        let share = random.unit();
        let square = random.uniform(1.0, 9.0);
        let scans: Vec<_> = (0..40)
            .map(|_| {
                let expected = (random.unit() * 7.0) as usize;
                let accepted = (0..expected).filter(|_| random.unit() < share).count();
                let used = accepted + (random.unit() * 3.0) as usize;
                Scan { expected, accepted, used, square_sum: square * used as f64 * random.unit() }
            })
            .collect();
        for count in 1..=scans.len() {
            let scans = &scans[..count];
            let told = consistency(parameters, scans);
            let remaining = |observations: usize| {
                (1.0 - 1.0 / parameters.memory).powi(observations as i32).max(parameters.least_remaining)
            };
            let expected = sum(scans, |scan| scan.expected as f64, |scan| remaining(scan.expected));
            let accepted = sum(scans, |scan| scan.accepted as f64, |scan| remaining(scan.expected));
            let used = sum(scans, |scan| scan.used as f64, |scan| remaining(scan.used));
            let squares = sum(scans, |scan| scan.square_sum, |scan| remaining(scan.used));
            let acceptance = if expected > 0.0 { accepted / expected } else { 1.0 };
            let mean = if used > 0.0 { squares / used } else { 2.0 };
            assert!((told.acceptance() - acceptance).abs() < 1e-9, "{} {acceptance}", told.acceptance());
            assert!((told.mean_normalised_square() - mean).abs() < 1e-9);
            let is_rejecting = expected >= parameters.least_observations && acceptance < parameters.least_acceptance;
            let has_large_innovations =
                used >= parameters.least_observations && mean > parameters.largest_normalised_square;
            assert_eq!(told.is_rejecting(), is_rejecting);
            assert_eq!(told.has_large_innovations(), has_large_innovations);
            // The longer memory: a twelfth is forgotten with each scan that tells something.
            let telling: Vec<_> = scans.iter().copied().filter(|scan| scan.expected > 0).collect();
            let long = |number: fn(&Scan) -> f64| sum(&telling, number, |_| 11.0 / 12.0);
            let steady = match long(|scan| scan.expected as f64) {
                0.0 => 1.0,
                all => long(|scan| scan.accepted as f64) / all,
            };
            let probation = 0.13 * (1.0 - telling.len().min(24) as f64 / 24.0);
            let misses = long(|scan| (scan.expected - scan.accepted) as f64);
            let is_doubtful = telling.len() > 1 && misses > 1.25 && acceptance.min(steady) < 0.75 + probation;
            assert_eq!(told.is_doubtful(), is_doubtful, "{acceptance} {steady} {probation}");
            for (count, verdict) in verdicts.iter_mut().zip([
                is_rejecting,
                !is_rejecting,
                has_large_innovations,
                !has_large_innovations,
                is_doubtful,
                !is_doubtful,
            ]) {
                *count += usize::from(verdict);
            }
        }
    }
    assert!(verdicts.iter().all(|count| *count > 100), "{verdicts:?}");
}

#[test]
fn without_evidence_nothing_is_wrong() {
    let told = consistency(InnovationMonitorParameters::default(), &[]);
    assert_eq!((told.acceptance(), told.mean_normalised_square()), (1.0, 2.0));
    assert!(!told.is_rejecting() && !told.has_large_innovations() && !told.is_doubtful());
    // Nor does a scan that tells nothing, or a memory of less than one observation, divide by zero.
    let parameters =
        InnovationMonitorParameters { memory: 0.0, least_remaining: 0.0, ..InnovationMonitorParameters::default() };
    let scan = |accepted: usize| Scan { expected: 4, accepted, used: 0, square_sum: 0.0 };
    let told = consistency(parameters, &[scan(4), Scan { expected: 0, ..scan(0) }, scan(1)]);
    assert_eq!((told.acceptance(), told.mean_normalised_square()), (0.25, 2.0));
}

/// The first revolution of a new pose shows six reflectors and some that are none: only more of that makes a doubt.
#[test]
fn one_scan_or_one_observation_alone_makes_no_doubt() {
    let told = |scans: &[Scan]| consistency(InnovationMonitorParameters::default(), scans).is_doubtful();
    let scan = |expected: usize, accepted: usize| Scan { expected, accepted, used: 0, square_sum: 0.0 };
    assert!(!told(&[scan(7, 6)]) && !told(&[scan(3, 2)]) && !told(&[scan(7, 6), scan(6, 6)]));
    assert!(!told(&[scan(7, 4)]) && !told(&[scan(14, 12), scan(14, 14)]));
    assert!(told(&[scan(7, 4), scan(7, 7)]) && told(&[scan(7, 6), scan(7, 6)]));
}

#[test]
fn the_limits_themselves_are_allowed() {
    let parameters = InnovationMonitorParameters {
        memory: 1.0,
        least_remaining: 0.0,
        least_observations: 8.0,
        least_acceptance: 0.5,
        largest_normalised_square: 4.0,
    };
    let told = |expected, accepted, square: f64| {
        let scan = Scan { expected, accepted, used: expected, square_sum: square * expected as f64 };
        let told = consistency(parameters, &[scan]);
        (told.is_rejecting(), told.has_large_innovations())
    };
    assert_eq!(told(8, 4, 4.0), (false, false));
    assert_eq!(told(8, 3, 4.5), (true, true));
    assert_eq!(told(7, 0, 9.0), (false, false), "too few observations");
    // A pose on probation must do better than one that has stood the test.
    let doubt = |scans: usize, accepted| {
        let scan = Scan { expected: 100, accepted, used: 0, square_sum: 0.0 };
        consistency(parameters, &vec![scan; scans]).is_doubtful()
    };
    assert_eq!([86, 87].map(|accepted| doubt(2, accepted)), [true, false]);
    assert_eq!([81, 82].map(|accepted| doubt(12, accepted)), [true, false]);
    assert_eq!([74, 75].map(|accepted| doubt(24, accepted)), [true, false]);
    assert_eq!([74, 75].map(|accepted| doubt(48, accepted)), [true, false]);
}
