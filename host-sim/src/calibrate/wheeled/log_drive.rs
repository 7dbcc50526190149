//! The drive in a log.

use agv_core::measurement::{EncoderSample, MOST_WHEELS, Time, WheelReading, WheelSample};
use agv_core::odometry::{
    AngleEncoder, CounterRange, Vehicle, Wheel, WheelBased, WheelMotion, WheelVehicle, wheel_motion_between,
};

use super::super::log_input::LogInput;
use super::super::refusal::Refusal;
use super::drive::{WheelDrive, WheelStep};
use super::unknowns::{Kind, WheeledModel};

/// A drive with what its log believes of the vehicle and of where its first laser is.
#[derive(Clone, Debug, PartialEq)]
pub struct LogDrive {
    /// What the vehicle is.
    pub kind: Kind,
    /// What is believed of it.
    pub nominal: WheeledModel,
    /// The drive.
    pub drive: WheelDrive,
}

impl LogDrive {
    /// Takes the wheels of a log, and the poses that another instrument has measured; if there are none, those that were given from
    /// outside.
    ///
    /// # Errors
    /// If the vehicle has no wheels that are counted, or nothing says how it moved.
    pub fn new(input: &LogInput) -> Result<Self, Refusal> {
        let (kind, believed, samples) = match input.parameters.vehicle {
            Vehicle::Wheels(vehicle) => (kind(&vehicle), vehicle.wheels().as_ref().to_vec(), input.wheels.clone()),
            Vehicle::Tricycle(tricycle) => {
                (Kind::Tricycle, tricycle.wheels().to_vec(), input.encoders.iter().map(of_tricycle).collect())
            }
            _ => return Err(Refusal::OtherVehicle),
        };
        let (Some(first), poses) = (samples.first(), input.poses()) else { return Err(Refusal::NoEncoders) };
        if poses.is_empty() {
            return Err(Refusal::NoLaserMotion);
        }
        let start = first.time;
        let mut ordered: Vec<&WheelSample> = Vec::new();
        for sample in &samples {
            if ordered.last().is_none_or(|last| sample.time > last.time) {
                ordered.push(sample);
            }
        }
        let steps = ordered.windows(2).map(|pair| step(&believed, pair[0], pair[1], start)).collect();
        let poses = poses.iter().map(|pose| (pose.time.since(start), pose.pose));
        // Drives hold angles: what is fitted of a steering encoder is a ratio.
        let ratio = |wheel: Wheel| {
            let steering = wheel.steering.map(|_| AngleEncoder { scale: 1.0, range: CounterRange::BITS_32 });
            Wheel { steering, ..wheel }
        };
        let wheels = believed.into_iter().map(ratio).collect();
        let nominal = WheeledModel { wheels, sensor: *input.parameters.lasers.first() };
        Ok(Self { kind, nominal, drive: WheelDrive::new(steps, poses) })
    }
}

/// The counters of a tricycle as those of its driving wheel, and nothing of the one that carries.
fn of_tricycle(sample: &EncoderSample) -> WheelSample {
    let mut wheels = [WheelReading::default(); MOST_WHEELS];
    wheels[0] = WheelReading { count: sample.drive, steering: sample.steering };
    WheelSample { time: sample.time, wheels }
}

fn kind(vehicle: &WheelVehicle) -> Kind {
    match vehicle {
        WheelVehicle::Differential(_) => Kind::Differential,
        WheelVehicle::BiSteerable(_) => Kind::BiSteerable,
        WheelVehicle::Ackermann(_) => Kind::Ackermann,
        WheelVehicle::ThreeOmnidirectional(_) | WheelVehicle::FourOmnidirectional(_) | WheelVehicle::Mecanum(_) => {
            Kind::Omnidirectional
        }
    }
}

fn step(wheels: &[Wheel], from: &WheelSample, to: &WheelSample, start: Time) -> WheelStep {
    let readings = from.wheels.iter().zip(&to.wheels).take(MOST_WHEELS);
    let motion = |(wheel, (from, to)): (&Wheel, _)| -> WheelMotion { wheel_motion_between(wheel, from, to) };
    WheelStep { end: to.time.since(start), motions: wheels.iter().zip(readings).map(motion).collect() }
}
