//! Scan Context (Kim and Kim, IROS 2018), written from the paper: the greatest height in each of 60 sectors and 20 rings up
//! to 80 m, and the mean cosine of the sectors that are not empty in both, at the best turn.

const SECTORS: usize = 60;
const RINGS: usize = 20;
const REACH: f32 = 80.0;
/// Above the sensor's own height, so that no height is negative, m (the authors' program).
const LIFT: f32 = 2.0;

pub struct ScanContext([[f32; RINGS]; SECTORS]);

impl ScanContext {
    pub fn new(points: &[Option<[f32; 3]>]) -> Self {
        let mut bins = [[0.0_f32; RINGS]; SECTORS];
        for [x, y, z] in points.iter().flatten().copied() {
            let far = x.hypot(y);
            if far < REACH {
                let turn = y.atan2(x).rem_euclid(std::f32::consts::TAU) / std::f32::consts::TAU;
                let sector = ((turn * SECTORS as f32) as usize).min(SECTORS - 1);
                let bin = &mut bins[sector][(far / REACH * RINGS as f32) as usize];
                *bin = bin.max(z + LIFT);
            }
        }
        Self(bins)
    }

    pub fn distance(&self, other: &Self) -> f64 {
        (0..SECTORS).map(|turn| self.at(other, turn)).fold(f64::MAX, f64::min)
    }

    fn at(&self, other: &Self, turn: usize) -> f64 {
        let norm = |bins: &[f32; RINGS]| bins.iter().map(|value| value * value).sum::<f32>().sqrt();
        let (mut sum, mut count) = (0.0, 0);
        for (sector, bins) in self.0.iter().enumerate() {
            let others = &other.0[(sector + turn) % SECTORS];
            let (a, b) = (norm(bins), norm(others));
            if a > 0.0 && b > 0.0 {
                sum += f64::from(bins.iter().zip(others).map(|(a, b)| a * b).sum::<f32>() / (a * b));
                count += 1;
            }
        }
        if count == 0 { f64::MAX } else { 1.0 - sum / f64::from(count) }
    }
}
