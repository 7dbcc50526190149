//! Random numbers that a seed fixes on every machine.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

/// What the numbers are for. Every purpose has a sequence of its own, so a change in one does not shift another.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stream {
    /// Where things stand.
    World = 1,
    /// Which pallets were moved since, and where to.
    MovedPallets = 2,
    /// In what the true vehicle differs from the believed one.
    Vehicle = 3,
    /// Disturbances of the motion, and noise of the encoders.
    Odometry = 4,
    /// Noise of ranges and bearings.
    Laser = 5,
    /// Mixed, lost and dirty beams.
    LaserFaults = 6,
    /// Noise of reflector detections, missing and false ones.
    Reflectors = 7,
    /// Where people are on their ways.
    People = 8,
    /// Errors of the reflector survey.
    Survey = 9,
    /// Error of the start pose.
    Start = 10,
    /// Where a vehicle is switched on, and what it sees there.
    Kidnapping = 11,
    /// In what the believed parameters of a multi-beam lidar differ from the true ones.
    LaserParameters = 13,
    /// Noise of a multi-beam lidar's distances.
    MultiBeam = 12,
    /// What is made wrong of a drive.
    Faults = 14,
    /// What is made wrong of telegrams.
    Telegrams = 15,
    /// What is made wrong of frames on the bus.
    Frames = 16,
    /// Which faults come together.
    Pairs = 17,
    /// Bias and noise of a gyro.
    Gyro = 18,
    /// The height of the floor.
    Floor = 19,
    /// Errors of the reflector survey that near reflectors share.
    SurveyField = 20,
    /// Errors of a vehicle in order.
    Nominal = 21,
    /// Which hall, drive, noise and faults belong to a run.
    Scenes = 22,
}

/// One sequence of random numbers.
#[derive(Clone, Debug)]
pub struct Random {
    generator: ChaCha8Rng,
    spare: Option<f64>,
}

impl Random {
    /// The sequence of `stream` for `seed`.
    #[must_use]
    pub fn new(seed: u64, stream: Stream) -> Self {
        let mut key = [0; 32];
        key[..8].copy_from_slice(&seed.to_le_bytes());
        let mut generator = ChaCha8Rng::from_seed(key);
        generator.set_stream(stream as u64);
        Self { generator, spare: None }
    }

    /// A number in `[0, 1)`, all multiples of 2^-53 equally likely.
    pub fn uniform(&mut self) -> f64 {
        (self.generator.next_u64() >> 11) as f64 * (1.0 / (1_u64 << 53) as f64)
    }

    /// A number between `low` and `high`, uniform.
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.uniform()
    }

    /// Minus one or one.
    pub fn sign(&mut self) -> f64 {
        if self.uniform() < 0.5 { -1.0 } else { 1.0 }
    }

    /// True with the given probability.
    pub fn happens(&mut self, probability: f64) -> bool {
        self.uniform() < probability
    }

    /// A normal number with mean 0 and standard deviation 1 (polar method of Marsaglia).
    pub fn normal(&mut self) -> f64 {
        if let Some(spare) = self.spare.take() {
            return spare;
        }
        loop {
            let (u, v) = (2.0 * self.uniform() - 1.0, 2.0 * self.uniform() - 1.0);
            let square = u * u + v * v;
            if square > 0.0 && square < 1.0 {
                let factor = libm::sqrt(-2.0 * libm::log(square) / square);
                self.spare = Some(v * factor);
                return u * factor;
            }
        }
    }
}
