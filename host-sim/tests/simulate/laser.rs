use agv_core::measurement::Time;
use agv_host_sim::recording::RecordedScan;
use agv_host_sim::simulate::scenario::{PersonOptions, PoseOptions, Scenario};
use agv_host_sim::simulate::{Simulation, simulate};

use super::support::{assert_unit_mean_square, hall_scenario, mean_square, range_to_hall, scans, true_pose};

/// Measured less true range of every beam, with the laser where it was at the time that `time_of(scan, beam)` gives.
fn range_errors(simulation: &Simulation, time_of: impl Fn(&RecordedScan, usize) -> Time) -> Vec<f64> {
    let mut errors = Vec::new();
    for scan in scans(&simulation.recording) {
        for (beam, &range) in scan.ranges.iter().enumerate() {
            let pose = true_pose(&simulation.recording.truth, time_of(scan, beam));
            let sensor = pose.compose(&simulation.true_laser);
            errors.push(f64::from(range) - range_to_hall(&sensor, scan.view().bearing(beam)));
        }
    }
    errors
}

#[test]
fn every_beam_of_a_moving_laser_ends_on_the_wall_at_its_own_time() {
    let mut scenario = hall_scenario();
    scenario.laser.range_noise = 0.0;
    scenario.laser.bearing_noise_deg = 0.0;
    scenario.laser.mounting = PoseOptions { x: 0.9, y: 0.1, heading_deg: 30.0 };
    scenario.vehicle.truth.laser_error = PoseOptions { x: 0.01, y: -0.02, heading_deg: 0.3 };
    let simulation = simulate(&scenario).unwrap();
    let own_time = range_errors(&simulation, |scan, beam| scan.view().beam_time(beam));
    let worst = own_time.iter().fold(0.0_f64, |worst, error| worst.max(error.abs()));
    // Times are rounded to a microsecond, ranges to single precision, arcs of 8 mm are taken as straight.
    assert!(worst < 2e-5, "{worst}");
    let one_time = range_errors(&simulation, |scan, _| scan.start);
    assert!(mean_square(&one_time).sqrt() > 0.02);
}

#[test]
fn ranges_have_the_stated_noise() {
    let mut scenario = hall_scenario();
    scenario.laser.bearing_noise_deg = 0.0;
    let mut errors = range_errors(&simulate(&scenario).unwrap(), |scan, beam| scan.view().beam_time(beam));
    errors.iter_mut().for_each(|error| *error /= 0.010);
    let count = errors.len() as f64;
    assert!(count > 1e5);
    assert_unit_mean_square(&errors, "range noise");
    let mean = errors.iter().sum::<f64>() / count;
    assert!(mean.abs() < 4.0 / count.sqrt(), "{mean}");
    // Successive beams are independent.
    let product = errors.windows(2).map(|pair| pair[0] * pair[1]).sum::<f64>() / count;
    assert!(product.abs() < 4.0 / count.sqrt(), "{product}");
}

#[test]
fn far_ranges_have_their_own_noise() {
    let scenario = Scenario::parse(
        "[world]\nkind = \"shapes\"\nwalls = [[40, -500, 40, 500]]\n[path]\nkind = \"legs\"\n\
         legs = [{ segments = [{ length = 0.1 }] }]\n[laser]\nbearing_noise_deg = 0.0",
    )
    .unwrap();
    let simulation = simulate(&scenario).unwrap();
    let mut errors = Vec::new();
    for scan in scans(&simulation.recording) {
        for (beam, &range) in scan.ranges.iter().enumerate().filter(|(_, range)| (1.0..65.0).contains(*range)) {
            let sensor =
                true_pose(&simulation.recording.truth, scan.view().beam_time(beam)).compose(&simulation.true_laser);
            let cosine = (sensor.theta + scan.view().bearing(beam)).cos();
            errors.push((f64::from(range) - (40.0 - sensor.x) / cosine) / 0.025);
        }
        // The wall beyond 70 m and the empty half of the circle give no return.
        assert!(scan.ranges.iter().filter(|range| **range == 0.0).count() > 900);
    }
    assert!(errors.len() > 2000);
    assert_unit_mean_square(&errors, "far range noise");
}

#[test]
fn bearings_have_the_stated_noise() {
    let mut scenario = hall_scenario();
    scenario.laser.range_noise = 0.0;
    let simulation = simulate(&scenario).unwrap();
    let deviation = 0.02_f64.to_radians();
    let mut errors = Vec::new();
    for scan in scans(&simulation.recording) {
        for (beam, &range) in scan.ranges.iter().enumerate() {
            let sensor =
                true_pose(&simulation.recording.truth, scan.view().beam_time(beam)).compose(&simulation.true_laser);
            let bearing = scan.view().bearing(beam);
            let [left, middle, right] = [-1e-3, 0.0, 1e-3].map(|turn| range_to_hall(&sensor, bearing + turn));
            let slope = (right - left) / 2e-3;
            // Beside a corner of the hall the range has no slope.
            let is_one_wall = (left + right - 2.0 * middle).abs() < 1e-3;
            if is_one_wall && slope.abs() > 2.0 {
                errors.push((f64::from(range) - middle) / (slope * deviation));
            }
        }
    }
    assert!(errors.len() > 5000);
    assert_unit_mean_square(&errors, "bearing noise");
}

#[test]
fn lost_beams_and_dirty_sectors_are_absent_returns() {
    let faulty = Scenario::parse(
        "[laser]\nlost_share = 0.1\ndirty_sectors = [{ from_deg = 170.0, to_deg = -170.0, lost_share = 1.0 }]",
    )
    .unwrap();
    let simulation = simulate(&Scenario { laser: faulty.laser, ..hall_scenario() }).unwrap();
    let clean = simulate(&hall_scenario()).unwrap();
    let (mut lost, mut clear) = (0.0, 0.0_f64);
    for (scan, clean) in scans(&simulation.recording).zip(scans(&clean.recording)) {
        for (beam, (&range, &clean)) in scan.ranges.iter().zip(&clean.ranges).enumerate() {
            let bearing = scan.view().bearing(beam).to_degrees().abs();
            if bearing > 170.1 {
                assert_eq!(range, 0.0);
            } else if bearing < 169.9 {
                clear += 1.0;
                lost += f64::from(u8::from(range == 0.0));
                assert!(range == 0.0 || range == clean, "faults changed the noise of another beam");
            }
        }
    }
    let share = lost / clear;
    assert!((share - 0.1).abs() < 4.0 * (0.09 / clear).sqrt(), "{share}");
}

#[test]
fn mixed_pixels_lie_between_the_two_surfaces() {
    let scenario = |mixed: &str| {
        let text = format!(
            "[world]\nkind = \"shapes\"\nwalls = [[10, -12, 10, 12]]\n\
             rectangles = [{{ x = 6, y = 0, length = 1, width = 2 }}]\n[path]\nkind = \"legs\"\n\
             legs = [{{ segments = [{{ length = 0.01 }}] }}]\n\
             [laser]\nrange_noise = 0.0\nbearing_noise_deg = 0.0\n{mixed}"
        );
        simulate(&Scenario::parse(&text).unwrap()).unwrap()
    };
    let (mixed, clean) = (scenario("mixed_share = 1.0"), scenario(""));
    let mut changed = 0;
    for (mixed, clean) in scans(&mixed.recording).zip(scans(&clean.recording)) {
        for (beam, (a, b)) in mixed.ranges.iter().zip(&clean.ranges).enumerate() {
            if a != b {
                changed += 1;
                assert!((4.5..10.0).contains(a), "{a} at beam {beam}");
            }
        }
    }
    // The two edges of the box, in each scan.
    let edges = 2 * scans(&mixed.recording).count();
    assert!(changed >= edges && changed <= 3 * edges, "{changed} of {edges}");
}

#[test]
fn somebody_in_the_way_hides_the_wall() {
    let person: PersonOptions = toml::from_str("way = [[1.0, 4.0], [4.0, 4.0], [4.0, 1.0]]\nphase = 0.0").unwrap();
    let scenario = Scenario { people: vec![person], ..hall_scenario() };
    let (with, without) = (simulate(&scenario).unwrap(), simulate(&hall_scenario()).unwrap());
    let mut hidden = 0;
    for (with, without) in scans(&with.recording).zip(scans(&without.recording)) {
        for (a, b) in with.ranges.iter().zip(&without.ranges) {
            assert!(*a <= *b + 0.1);
            hidden += usize::from(*a < *b - 0.5);
        }
    }
    assert!(hidden > 1000, "{hidden}");
}
