//! What the encoders said on a bus whose master is another.

use agv_core::measurement::{EncoderFaults, Time};
use agv_wire::can::encoder::{EncoderSettings, Profile, Reporting};
use agv_wire::can::encoder_group::{ChannelSettings, Counts, EncoderGroup};
use agv_wire::can::frame::Frame;
use agv_wire::can::plausibility::PlausibilityLimits;

/// Listens to encoders of which nobody can tell any more how they were set up: the profile's default PDO, and the ranges
/// in the settings. A node that boots again is its master's business, and goes on reporting.
#[derive(Clone, Debug)]
pub struct EncoderListener {
    group: EncoderGroup,
    /// Before all were heard, silence is no fault.
    is_complete: bool,
}

impl EncoderListener {
    /// A listener from `start` on, to encoders that report every `period` seconds; as often as the controller's own if None.
    #[must_use]
    pub fn new(channels: &[ChannelSettings], start: Time, period: Option<f64>) -> Self {
        let channels: Vec<ChannelSettings> = channels.iter().map(|channel| overheard(channel, period)).collect();
        Self { group: EncoderGroup::new(&channels, 1.0, start), is_complete: false }
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

/// The same encoder with another master. How often that lets it say that it is there, and whether it keeps a timer, is not
/// known: times are those of its frames.
fn overheard(channel: &ChannelSettings, period: Option<f64>) -> ChannelSettings {
    let settings = channel.encoder;
    let reporting = match (settings.profile, settings.reporting) {
        (Profile::Encoder, Reporting::Timer { period }) => Reporting::Polled { period },
        (_, reporting) => reporting,
    };
    let limits = channel.limits;
    ChannelSettings {
        encoder: EncoderSettings { is_managed: false, heartbeat: 0, reporting, ..settings },
        limits: period.map_or(limits, |period| {
            PlausibilityLimits::every(period.max(limits.period), limits.fastest, limits.hardest_braking)
        }),
        ..*channel
    }
}
