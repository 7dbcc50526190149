//! What a controller was given in a simulated drive, to give it to another one: so its time is measured without that of its
//! sensors and of the lines.

use agv_controller::Controller;
use agv_core::localizer::PoseFix;
use agv_core::measurement::Time;
use agv_host_sim::recording::Recording;
use agv_wire::can::frame::Frame;

use super::rig::{Given, RigError, RigOptions, drive_listening, new_controller};

/// A drive without faults, as the controller hears it.
#[derive(Clone, Debug)]
pub struct Tape {
    given: Vec<(Time, Kept)>,
}

/// What was given, kept.
#[derive(Clone, Debug)]
enum Kept {
    Told(PoseFix),
    LaserBytes(Vec<u8>),
    LaserPolled,
    Connected,
    BusFrame(Frame),
    BusPolled,
    Searched,
}

impl From<Given<'_>> for Kept {
    fn from(given: Given) -> Self {
        match given {
            Given::Told(fix) => Self::Told(fix),
            Given::LaserBytes(bytes) => Self::LaserBytes(bytes.to_vec()),
            Given::LaserPolled => Self::LaserPolled,
            Given::Connected => Self::Connected,
            Given::BusFrame(frame) => Self::BusFrame(*frame),
            Given::BusPolled => Self::BusPolled,
            Given::Searched => Self::Searched,
        }
    }
}

impl Tape {
    /// Drives a recorded drive, and keeps what the controller was given.
    ///
    /// # Errors
    /// See [`RigError`].
    pub fn record(recording: &Recording, options: &RigOptions) -> Result<Self, RigError> {
        let mut given = Vec::new();
        drive_listening(recording, &[], options, |_| (), |now, one| given.push((now, Kept::from(one))))?;
        Ok(Self { given })
    }

    /// Gives it to a new controller with the recording's map, which is returned as it is at the end. What it sends and logs is
    /// made, and dropped.
    ///
    /// # Errors
    /// See [`RigError`].
    pub fn play(&self, recording: &Recording) -> Result<Box<Controller>, RigError> {
        let mut controller = new_controller(recording, None, Time::default())?;
        for (now, given) in &self.given {
            let now = *now;
            match given {
                Kept::Told(fix) => controller.tell(*fix, |_| ()),
                Kept::LaserBytes(bytes) => controller.hear_laser(bytes, now, |_| (), |_| ()),
                Kept::LaserPolled => controller.poll_laser(now, |_| (), |_| ()),
                Kept::Connected => controller.connected(now),
                Kept::BusFrame(frame) => controller.hear_bus(frame, now, |_| (), |_| ()),
                Kept::BusPolled => controller.poll_bus(now, |_| (), |_| ()),
                Kept::Searched => controller.search(|_| ()),
            }
        }
        Ok(controller)
    }
}
