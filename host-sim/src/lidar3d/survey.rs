//! What a stream of packets is, before any of it is decoded.

use std::net::IpAddr;
use std::ops::ControlFlow;
use std::path::Path;

use agv_core::measurement::Time;
use agv_lidar3d::calibration::Calibration;
use agv_lidar3d::calibration::calibration_from_stream;
use agv_lidar3d::packet::{Packet, Sensor, Tail, counts_between, hesai};

use super::capture::{self, CaptureError, Wanted};
use super::kind::{Datagram, Kind};
use super::setup_options::{SetupError, SetupOptions};
use crate::account::Account;

/// Why nothing is known of a capture.
#[derive(Debug, thiserror::Error)]
pub enum SurveyError {
    /// The capture.
    #[error(transparent)]
    Capture(#[from] CaptureError),
    /// What somebody states about the sensor.
    #[error(transparent)]
    Setup(#[from] SetupError),
}

/// What a stream says about itself.
#[derive(Clone, Debug, Default)]
pub struct Survey {
    /// Packets of a sensor.
    pub packets: usize,
    /// Packets that come near to being one.
    pub refused: usize,
    /// UDP port to which the sensor sends, in a capture.
    pub port: Option<u16>,
    /// Address from which it sends, in a capture.
    pub address: Option<IpAddr>,
    /// What is missing or doubtful.
    pub account: Account,
    /// Other packets.
    pub other: usize,
    /// Whether the file ends in the middle of a packet.
    pub is_cut: bool,
    /// Kind of sensor.
    pub kind: Option<Kind>,
    /// Which returns of a firing are sent, if the packets state it.
    pub return_mode: Option<String>,
    /// Text in the tails, if they are of the early dialect: the version of the firmware.
    pub version: Option<String>,
    /// Calibration that the packets carry.
    pub calibration: Option<Calibration>,
    /// Times of the first and of the last packet.
    pub span: Option<(Time, Time)>,
    /// Turns of the head, whole ones and parts of one.
    pub turns: f64,
}

impl Survey {
    /// Looks through a capture.
    ///
    /// # Errors
    /// See [`SurveyError`].
    pub fn of_capture(path: &Path, options: &SetupOptions) -> Result<Self, SurveyError> {
        let ouster = options.ouster()?;
        let mut surveyor = Surveyor::default();
        let wanted = Wanted { port: options.port, address: options.address, ouster: ouster.as_ref() };
        let seen = capture::for_each_until(path, wanted, |time, datagram| {
            surveyor.datagram(time, datagram);
            ControlFlow::Continue(())
        })?;
        let late = surveyor.late;
        let mut survey = surveyor.finish();
        seen.tell(&mut survey.account);
        if late > 0 {
            survey.account.warn(format!("{late} of {} packets came behind later ones", survey.packets));
        }
        (survey.refused, survey.other, survey.is_cut) = (seen.refused, seen.other, seen.is_cut);
        (survey.port, survey.address) = (seen.port, seen.address);
        if let Some(ouster) = ouster {
            let columns = survey.packets * ouster.columns_per_packet;
            survey.turns = columns as f64 / f64::from(ouster.columns_per_frame);
        }
        Ok(survey)
    }

    /// Time between the first packet and the last, s.
    #[must_use]
    pub fn duration(&self) -> f64 {
        self.span.map_or(0.0, |(first, last)| last.since(first))
    }
}

/// Hundredths of a degree in a turn of the head.
const TURN: i64 = 36_000;

/// Takes note of packets one after the other.
#[derive(Default)]
pub struct Surveyor {
    survey: Survey,
    tails: Vec<Tail>,
    last_azimuth: Option<u16>,
    counts: i64,
    /// Packets whose first angle lies behind the last one of the packet before.
    late: usize,
}

impl Surveyor {
    /// One packet.
    pub fn datagram(&mut self, time: Time, datagram: &Datagram<'_>) {
        let survey = &mut self.survey;
        survey.packets += 1;
        survey.span = Some((survey.span.map_or(time, |(first, _)| first), time));
        match datagram {
            Datagram::Velodyne(packet) => self.velodyne(packet),
            Datagram::Hesai(packet) => self.hesai(packet),
            Datagram::Ouster(_) => survey.kind = Some(Kind::Ouster),
        }
    }

    fn hesai(&mut self, packet: &hesai::Packet<'_>) {
        self.survey.kind = Some(Kind::Hesai(packet.sensor()));
        self.survey.return_mode.get_or_insert_with(|| match packet.kinds() {
            (first, None) => first.name().to_owned(),
            (first, Some(second)) => format!("{} and {}", first.name(), second.name()),
        });
        self.begin_at(packet.azimuth(0));
        for azimuth in (0..packet.blocks()).filter_map(|block| packet.azimuth(block)) {
            self.turn_to(azimuth);
        }
    }

    fn velodyne(&mut self, packet: &Packet<'_>) {
        let survey = &mut self.survey;
        // One packet of lower lasers tells an HDL-64E, even among others that state nothing.
        if survey.kind != Some(Kind::Velodyne(Sensor::Hdl64e)) {
            survey.kind = Sensor::of_packet(packet).map(Kind::Velodyne).or(survey.kind);
        }
        let tail = packet.tail();
        if survey.kind.is_some_and(|kind| kind != Kind::Velodyne(Sensor::Hdl64e)) {
            survey.return_mode = tail.return_mode().map(|mode| mode.name().to_owned());
        }
        if let (None, Some((_, text))) = (&survey.version, tail.early()) {
            survey.version = Some(text.iter().map(|byte| char::from(*byte)).collect());
        }
        self.tails.push(tail);
        self.begin_at(packet.blocks().next().map(|block| block.azimuth()));
        for block in packet.blocks() {
            self.turn_to(block.azimuth());
        }
    }

    /// The head turns on; an angle that lies behind is that of a packet that came late.
    fn turn_to(&mut self, azimuth: u16) {
        if let Some(last) = self.last_azimuth {
            let step = i64::from(counts_between(last, azimuth));
            self.counts += if step > TURN / 2 { step - TURN } else { step };
        }
        self.last_azimuth = Some(azimuth);
    }

    /// Takes note of a packet that begins at that angle.
    fn begin_at(&mut self, azimuth: Option<u16>) {
        let step = self.last_azimuth.zip(azimuth).map(|(last, azimuth)| i64::from(counts_between(last, azimuth)));
        self.late += usize::from(step.is_some_and(|step| step > TURN / 2));
    }

    /// The kind of sensor, as far as it is known.
    #[must_use]
    pub fn kind(&self) -> Option<Kind> {
        self.survey.kind
    }

    /// What was found.
    #[must_use]
    pub fn finish(self) -> Survey {
        let mut survey = self.survey;
        survey.turns = self.counts.max(0) as f64 / TURN as f64;
        if survey.kind == Some(Kind::Velodyne(Sensor::Hdl64e)) {
            survey.calibration = calibration_from_stream(self.tails);
        } else {
            survey.version = None;
        }
        survey
    }
}
