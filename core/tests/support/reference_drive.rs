//! A small drive that is the same everywhere, to hold one machine's results against another's.

use agv_core::calibration::{Calibration, Calibrator, MountingSide, Offsets, Problem, Unobservable};
use agv_core::geometry::{Point, Pose, Twist};
use agv_core::measurement::{EncoderSample, Time};
use agv_core::odometry::{CounterRange, Tricycle};

/// How many numbers [`reference_drive_bits`] gives.
const NUMBERS: usize = 16;
/// Samples of a segment.
const SAMPLES: u32 = 40;
/// Ticks between samples.
const TICKS: u32 = 600;

const NOMINAL: Tricycle = Tricycle {
    wheelbase: 1.5,
    drive_scale: 0.25e-3,
    drive_range: CounterRange::BITS_16,
    steering_scale: core::f64::consts::TAU / 65536.0,
    steering_range: CounterRange::BITS_16,
    steering_offset_forward: 0.0,
    steering_offset_backward: 0.0,
};

/// Standard and asymmetric calibration of twelve segments made of integers and of a few closed forms: the bits of both
/// results, offset forward, offset backward, drive scale, laser x, y and heading, wheelbase and condition each. Twelve
/// segments and both solutions pass through the same code as a real drive's.
///
/// # Errors
/// [`Unobservable`], which this drive is not.
pub fn reference_drive_bits() -> Result<[u64; NUMBERS], Unobservable> {
    let mut calibrator = Calibrator::<12>::new(NOMINAL);
    let laser = Pose::new(0.39, 0.01, 0.02);
    let (mut drive, mut time, mut noise) = (0_u32, 0_u64, 1_u32);
    for steering in [4000_u32, 6000, 8500, 61536, 59536, 57036] {
        for is_backward in [false, true] {
            let offset = if is_backward { -0.0135 } else { -0.0127 };
            let step = if is_backward { TICKS.wrapping_neg() } else { TICKS };
            for _ in 0..SAMPLES {
                calibrator.encoders(&EncoderSample { time: Time::from_micros(time), drive: drive & 0xFFFF, steering });
                drive = drive.wrapping_add(step);
                time += 10_000;
            }
            calibrator.encoders(&EncoderSample { time: Time::from_micros(time), drive: drive & 0xFFFF, steering });
            // Numerical Recipes' quick generator: a stir of a tenth of a millimetre.
            noise = noise.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            let stir = f64::from(noise >> 16) / 65536.0 - 0.5;
            let sign = if is_backward { -1.0 } else { 1.0 };
            let way = sign * 0.2498e-3 * f64::from(TICKS * SAMPLES) * (1.0 + 1e-4 * stir);
            let angle = CounterRange::BITS_16.signed(steering) as f64 * NOMINAL.steering_scale + offset;
            // By the elementary functions of the core, which are the same everywhere.
            let wheel = Pose { theta: angle, ..Pose::default() }.transform(&Point::new(way, 0.0));
            let moved = Pose::exp(&Twist { x: wheel.x, y: 0.0, theta: wheel.y / 1.5 });
            // The drive has room for its own segments.
            let _ = calibrator.stop(&laser.between(&moved.compose(&laser)));
        }
    }
    let problem = Problem {
        offsets: Offsets::Common,
        wheelbase: NOMINAL.wheelbase,
        is_wheelbase_free: false,
        side: Some(MountingSide::Front),
    };
    let standard = calibrator.solve(&problem)?;
    let asymmetric = calibrator.solve(&Problem { offsets: Offsets::ForEachSense, ..problem })?;
    let mut bits = [0; NUMBERS];
    let numbers = numbers(&standard).into_iter().chain(numbers(&asymmetric));
    for (place, number) in bits.iter_mut().zip(numbers) {
        *place = number.to_bits();
    }
    Ok(bits)
}

fn numbers(calibration: &Calibration) -> [f64; NUMBERS / 2] {
    let Calibration { intrinsic, extrinsic, conditioning, .. } = calibration;
    [
        intrinsic.offset_forward,
        intrinsic.offset_backward,
        calibration.drive_scale(),
        extrinsic.laser.x,
        extrinsic.laser.y,
        extrinsic.laser.theta,
        extrinsic.wheelbase,
        conditioning.equations,
    ]
}
