//! What the encoders said on a bus whose master is another.

use agv_core::measurement::{EncoderFaults, Time};
use agv_wire::can::canopen::Message;
use agv_wire::can::encoder_group::{ChannelSettings, Counts, EncoderGroup};
use agv_wire::can::frame::Frame;
use agv_wire::can::nmt::NmtState;
use agv_wire::can::sdo::{AbortCode, Request, Response};

/// Telegrams with which a group sets up its encoders, at most.
const SET_UP: usize = 200;

/// Listens to encoders of which nobody can tell any more how they were set up: the profile's default PDO, and the ranges
/// in the settings.
#[derive(Clone, Debug)]
pub struct EncoderListener {
    group: EncoderGroup,
    /// Before all were heard, silence is no fault.
    is_complete: bool,
}

impl EncoderListener {
    /// A listener from `start` on.
    #[must_use]
    pub fn new(channels: &[ChannelSettings], start: Time) -> Self {
        let mut group = EncoderGroup::new(channels, 1.0, start);
        for settings in channels {
            let boot_up = Message::Heartbeat { node: settings.encoder.node, state: NmtState::BootUp };
            group.handle(&boot_up.encode(), start);
        }
        // The group is refused everything that it asks for, and takes the defaults.
        for _ in 0..SET_UP {
            let Some(asked) = group.poll(start) else { continue };
            if let Ok(Message::SdoRequest { node, bytes }) = Message::decode(&asked)
                && let Ok(Request::Read(object) | Request::Write(object, _)) = Request::decode(bytes)
            {
                let refusal = Response::Abort(object, AbortCode::NoSuchObject).encode();
                group.handle(&Message::SdoResponse { node, bytes: refusal }.encode(), start);
            }
        }
        Self { group, is_complete: false }
    }

    /// Takes a frame that was seen at `time`; gives what it says of the faults, and the sample that it completes.
    pub fn hear(&mut self, frame: &Frame, time: Time) -> (Option<EncoderFaults>, Option<Counts>) {
        // Nobody is told to do anything.
        while self.group.poll(time).is_some() {}
        let faults = self.group.poll_faults(time).filter(|_| self.is_complete);
        let sample = self.group.handle(frame, time);
        self.is_complete |= sample.is_some();
        (faults, sample)
    }
}
