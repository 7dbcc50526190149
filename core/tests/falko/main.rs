//! The detector in a synthetic storage whose true corners are known, and its invariances.

mod scene;

use agv_core::features::falko::{Detector, Parameters};
use agv_core::features::{Keypoint, KeypointKind, PointScan};
use agv_core::measurement::{Scan, Time};
use scene::{Random, Scene};

const BEAMS: usize = 1440;

fn detect(ranges: &[f32], first_bearing: f64, bearing_step: f64, parameters: Parameters) -> Vec<Keypoint> {
    let scan =
        Scan { start: Time::default(), beam_interval: 0.0, first_bearing, bearing_step, ranges, intensities: &[] };
    let mut points = Box::new(PointScan::<BEAMS>::new());
    points.set(&scan, 0.05, 80.0);
    let mut keypoints = heapless::Vec::<Keypoint, 256>::new();
    Box::new(Detector::<BEAMS>::new(parameters)).detect(&points, &mut keypoints);
    keypoints.to_vec()
}

/// A keypoint seen from inside the lane, and how far it is off.
struct Seen {
    kind: KeypointKind,
    error: [f64; 2],
    covariance: [f64; 3],
    local: [f64; 2],
    cosine: f64,
    beam: u16,
}

impl Seen {
    fn distance(&self) -> f64 {
        self.error[0].hypot(self.error[1])
    }

    /// Squared Mahalanobis distance over its two degrees of freedom.
    fn normalised(&self) -> f64 {
        let [xx, xy, yy] = self.covariance;
        let [x, y] = self.error;
        (yy * x * x - 2.0 * xy * x * y + xx * y * y) / (xx * yy - xy * xy) / 2.0
    }
}

fn look_around(parameters: Parameters, worlds: u64, scans: usize) -> (Vec<Seen>, usize) {
    let mut seen = Vec::new();
    for seed in 0..worlds {
        let mut random = Random::new(seed);
        let scene = Scene::block_storage(&mut random);
        for _ in 0..scans {
            let pose = [random.uniform(1.0, 8.0), random.uniform(-0.15, 0.15), random.uniform(-0.1, 0.1)];
            let step = std::f64::consts::TAU / BEAMS as f64;
            let ranges = scene.scan(pose, BEAMS, -std::f64::consts::PI, 0.01, &mut random);
            for keypoint in detect(&ranges, -std::f64::consts::PI, step, parameters) {
                let (sine, cosine) = pose[2].sin_cos();
                let (x, y) = (f64::from(keypoint.position.x), f64::from(keypoint.position.y));
                let world = [pose[0] + cosine * x - sine * y, pose[1] + sine * x + cosine * y];
                let is_inside = world[0] > -0.3 && world[0] < 10.7 && world[1].abs() < 2.5;
                if !is_inside {
                    continue;
                }
                let offset = scene.offset_from_corner(world);
                let error = [cosine * offset[0] + sine * offset[1], cosine * offset[1] - sine * offset[0]];
                seen.push(Seen {
                    kind: keypoint.kind,
                    error,
                    covariance: keypoint.covariance.map(f64::from),
                    local: [x, y],
                    cosine: f64::from(keypoint.orientation).cos() * x + f64::from(keypoint.orientation).sin() * y,
                    beam: keypoint.beam,
                });
            }
        }
    }
    (seen, worlds as usize * scans)
}

#[derive(Debug)]
struct Figures {
    per_scan: f64,
    within_2_cm: f64,
    over_10_cm: f64,
    deviation: f64,
    normalised: f64,
    normalised_tail: f64,
}

fn figures(seen: &[Seen], kind: KeypointKind, scans: usize) -> Figures {
    let chosen: Vec<_> = seen.iter().filter(|seen| seen.kind == kind).collect();
    let count = chosen.len() as f64;
    let share = |test: &dyn Fn(&Seen) -> bool| chosen.iter().filter(|seen| test(seen)).count() as f64 / count;
    let near: Vec<_> = chosen.iter().filter(|seen| seen.distance() < 0.05).collect();
    let squares: f64 = near.iter().map(|seen| seen.distance().powi(2)).sum();
    Figures {
        per_scan: count / scans as f64,
        within_2_cm: share(&|seen| seen.distance() < 0.02),
        over_10_cm: share(&|seen| seen.distance() > 0.10),
        deviation: (squares / near.len() as f64 / 2.0).sqrt(),
        normalised: near.iter().map(|seen| seen.normalised()).sum::<f64>() / near.len() as f64,
        normalised_tail: near.iter().filter(|seen| seen.normalised() > 9.21 / 2.0).count() as f64 / near.len() as f64,
    }
}

#[test]
fn storage() {
    for (name, parameters) in [("thesis", Parameters::thesis()), ("mended", Parameters::mended())] {
        let (seen, scans) = look_around(parameters, 20, 10);
        for kind in [KeypointKind::Corner, KeypointKind::EndPoint] {
            println!("{name} {kind:?} {:?}", figures(&seen, kind, scans));
        }
    }
}

#[test]
fn dump() {
    let (seen, _) = look_around(Parameters::mended(), 20, 10);
    for s in seen.iter().filter(|s| s.kind == KeypointKind::Corner && (s.distance() > 0.03 || s.cosine < 0.0)) {
        println!(
            "BAD d {:.1} mm e {:.1} {:.1} sd {:.1} {:.1} nees {:.1} | at {:.2} {:.2} beam n {} cos {:.2}",
            s.distance() * 1e3,
            s.error[0] * 1e3,
            s.error[1] * 1e3,
            s.covariance[0].sqrt() * 1e3,
            s.covariance[2].sqrt() * 1e3,
            s.normalised(),
            s.local[0],
            s.local[1],
            s.beam,
            s.cosine
        );
    }
}
