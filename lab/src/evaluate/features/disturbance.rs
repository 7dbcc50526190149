//! Scans made worse on purpose (K 3.3, tests 2 to 4).

use agv_core::geometry::Point;
use agv_core::measurement::LaserId;
use serde::Serialize;

use agv_host_sim::recording::RecordedScan;
use agv_host_sim::simulate::random::{Random, Stream};

/// What is done to a scan.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Disturbance {
    /// Normal noise of this standard deviation is added to each range, m.
    Noise(f64),
    /// So many returns are put between neighbouring ones, on the straight line between them.
    Oversampling(usize),
    /// So many returns are taken out between remaining ones.
    Subsampling(usize),
}

impl Disturbance {
    /// The disturbances that are looked at; at most four times as many beams.
    pub const ALL: [Self; 13] = [
        Self::Noise(0.01),
        Self::Noise(0.02),
        Self::Noise(0.05),
        Self::Noise(0.1),
        Self::Noise(0.2),
        Self::Noise(0.3),
        Self::Oversampling(1),
        Self::Oversampling(2),
        Self::Oversampling(3),
        Self::Subsampling(1),
        Self::Subsampling(2),
        Self::Subsampling(3),
        Self::Subsampling(4),
    ];

    /// Name of the test, and level of the disturbance.
    #[must_use]
    pub fn name(self) -> (&'static str, f64) {
        match self {
            Self::Noise(deviation) => ("noise", deviation),
            Self::Oversampling(added) => ("oversampling", added as f64),
            Self::Subsampling(removed) => ("subsampling", removed as f64),
        }
    }

    /// The disturbed scan; `seed` decides the noise.
    #[must_use]
    pub fn of(self, scan: &RecordedScan, seed: u64) -> RecordedScan {
        match self {
            Self::Noise(deviation) => {
                let mut random = Random::new(seed, Stream::Laser);
                let noisy = scan.ranges.iter().map(|range| range + (deviation * random.normal()) as f32);
                RecordedScan { ranges: noisy.collect(), ..scan.clone() }
            }
            Self::Oversampling(added) => oversampled(scan, added + 1),
            Self::Subsampling(removed) => {
                let every = removed + 1;
                RecordedScan {
                    laser: LaserId::FIRST,
                    ranges: scan.ranges.iter().copied().step_by(every).collect(),
                    intensities: Vec::new(),
                    bearing_step: scan.bearing_step * every as f64,
                    beam_interval: scan.beam_interval * every as f64,
                    ..scan.clone()
                }
            }
        }
    }
}

/// Beams between neighbouring ones meet the straight line between their returns.
fn oversampled(scan: &RecordedScan, times: usize) -> RecordedScan {
    let step = scan.bearing_step / times as f64;
    let direction = |beams: usize| {
        let (sine, cosine) = (step * beams as f64).sin_cos();
        Point::new(cosine, sine)
    };
    let mut ranges = Vec::with_capacity(scan.ranges.len() * times);
    for pair in scan.ranges.windows(2) {
        let (first, second) = (f64::from(pair[0]), f64::from(pair[1]));
        let (start, end) = (direction(0) * first, direction(times) * second);
        ranges.push(pair[0]);
        for beam in 1..times {
            let ray = direction(beam);
            let edge = end - start;
            let across = ray.x * edge.y - ray.y * edge.x;
            let met = (start.x * edge.y - start.y * edge.x) / across;
            // Next to a beam without return there is none.
            let range = if first > 0.0 && second > 0.0 && met.is_finite() { met } else { f64::NAN };
            ranges.push(range as f32);
        }
    }
    ranges.extend(scan.ranges.last());
    RecordedScan {
        laser: LaserId::FIRST,
        ranges,
        intensities: Vec::new(),
        bearing_step: step,
        beam_interval: scan.beam_interval / times as f64,
        ..scan.clone()
    }
}
