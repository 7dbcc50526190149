//! What the odometry of a recording says, event by event.

use agv_core::geometry::Pose;
use agv_core::odometry::VehicleOdometer;

use crate::recording::{RecordedEvent, Recording};

/// How R moves with each event, by the odometry, in the frame of R before it; none where the event tells no motion.
pub(crate) fn odometry_steps(recording: &Recording) -> impl Iterator<Item = Option<Pose>> + '_ {
    let parameters = &recording.parameters;
    let mut odometer = VehicleOdometer::new(&parameters.vehicle, &parameters.odometer());
    recording.events.iter().map(move |event| {
        let motion = match event {
            RecordedEvent::Encoders(sample) => odometer.encoders(sample),
            RecordedEvent::Speed(sample) => odometer.speed(sample),
            RecordedEvent::Increment(increment) => odometer.increment(increment),
            RecordedEvent::Wheels(sample) => odometer.wheels(sample),
            RecordedEvent::EncoderFaults(_) => {
                odometer.restart();
                return None;
            }
            RecordedEvent::Gyro(_)
            | RecordedEvent::Reflectors(_)
            | RecordedEvent::Scan(_)
            | RecordedEvent::SetPose(_) => return None,
        };
        motion.ok().map(|motion| motion.displacement)
    })
}
