//! What a stream of packets is, before any of it is decoded.

use std::path::Path;

use agv_core::measurement::Time;
use agv_lidar3d::calibration::Calibration;
use agv_lidar3d::packet::{Packet, Sensor, Tail, calibration_from_stream, counts_between};

use crate::import::velodyne::{self, VelodyneError};

/// What a stream says about itself.
#[derive(Clone, Debug, Default)]
pub struct Survey {
    /// Packets of a sensor.
    pub packets: usize,
    /// Packets to its port that are none.
    pub refused: usize,
    /// Other packets.
    pub other: usize,
    /// Whether the file ends in the middle of a packet.
    pub is_cut: bool,
    /// Kind of sensor.
    pub sensor: Option<Sensor>,
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
    /// See [`VelodyneError`].
    pub fn of_capture(path: &Path) -> Result<Self, VelodyneError> {
        let mut surveyor = Surveyor::default();
        let seen = velodyne::for_each(path, |time, packet| surveyor.packet(time, packet))?;
        let mut survey = surveyor.finish();
        (survey.refused, survey.other, survey.is_cut) = (seen.refused, seen.other, seen.is_cut);
        Ok(survey)
    }

    /// Time between the first packet and the last, s.
    #[must_use]
    pub fn duration(&self) -> f64 {
        self.span.map_or(0.0, |(first, last)| last.since(first))
    }
}

/// Takes note of packets one after the other.
#[derive(Default)]
pub struct Surveyor {
    survey: Survey,
    tails: Vec<Tail>,
    last_azimuth: Option<u16>,
    counts: u64,
}

impl Surveyor {
    /// One packet.
    pub fn packet(&mut self, time: Time, packet: &Packet<'_>) {
        let survey = &mut self.survey;
        survey.packets += 1;
        survey.span = Some((survey.span.map_or(time, |(first, _)| first), time));
        // One packet of lower lasers tells an HDL-64E, even among others that state nothing.
        if survey.sensor != Some(Sensor::Hdl64e) {
            survey.sensor = Sensor::of_packet(packet).or(survey.sensor);
        }
        let tail = packet.tail();
        if let (None, Some((_, text))) = (&survey.version, tail.early()) {
            survey.version = Some(text.iter().map(|byte| char::from(*byte)).collect());
        }
        self.tails.push(tail);
        for block in packet.blocks() {
            let azimuth = block.azimuth();
            if let Some(last) = self.last_azimuth {
                self.counts += u64::from(counts_between(last, azimuth));
            }
            self.last_azimuth = Some(azimuth);
        }
    }

    /// The kind of sensor, as far as it is known.
    #[must_use]
    pub fn sensor(&self) -> Option<Sensor> {
        self.survey.sensor
    }

    /// What was found.
    #[must_use]
    pub fn finish(self) -> Survey {
        let mut survey = self.survey;
        survey.turns = self.counts as f64 / 36_000.0;
        if survey.sensor == Some(Sensor::Hdl64e) {
            survey.calibration = calibration_from_stream(self.tails);
        } else {
            survey.version = None;
        }
        survey
    }
}
