//! The localiser with the search for its pose, and the log of both.

use core::hint::black_box;

use agv_controller::{BusEvent, Progress, SentPose, Told};
use agv_core::geometry::Pose;
use agv_core::localizer::{self, Event, PoseFix};
use agv_core::maps::{Landmark, LandmarkKind};
use agv_core::measurement::{
    EncoderFaults, EncoderSample, GyroSample, LaserId, PoseIncrement, ReflectorObservation, Reflectors, Scan,
    SpeedSample, Time, WheelSample,
};
use agv_core::record::{MAX_FRAME, Output, Record, encode};
use agv_firmware::board::{Board, Current};
use agv_settings::Settings;

use super::any;

static RANGES: [f32; 1500] = [0.0; 1500];
static BYTES: [u8; 4000] = [0; 4000];
static INTENSITIES: [u16; 1500] = [0; 1500];
static OBSERVATIONS: [ReflectorObservation; 300] =
    [ReflectorObservation { time: Time::from_micros(0), range: 0.0, bearing: 0.0 }; 300];
static LANDMARKS: [Landmark; 100] =
    [Landmark { id: 0, kind: LandmarkKind::Reflector, x: 0.0, y: 0.0, deviation: 0.0 }; 100];

/// The localiser of the largest board.
type Localizer = localizer::Localizer<<Current as Board>::Capacities>;
/// That of a board without room for landmarks in the state.
type SmallLocalizer = localizer::Localizer<localizer::VehicleCapacities>;
/// That of a replay, which has room for contours, too.
type WholeLocalizer = localizer::Localizer;

/// All localisers, and what is around the first.
pub struct Localization {
    localization: agv_controller::Localization<Localizer>,
    small: SmallLocalizer,
    whole: WholeLocalizer,
    frame: [u8; MAX_FRAME],
}

/// Some part of a list, or all of it.
fn part<T>(list: &'static [T]) -> &'static [T] {
    any(list)
}

fn event() -> Event<'static> {
    let time = any(Time::default());
    let pose = any(Pose::default());
    match any(0_u8) {
        0 => Event::Encoders(EncoderSample { time, drive: any(0), steering: any(0) }),
        1 => Event::EncoderFaults(any(EncoderFaults::default())),
        2 => Event::Speed(SpeedSample { time, speed: any(0.0), steering: any(0.0) }),
        3 => Event::Increment(PoseIncrement { time, displacement: pose }),
        4 => Event::Reflectors(Reflectors::of_first(part(&OBSERVATIONS))),
        5 => Event::Scan(Scan {
            laser: LaserId::FIRST,
            start: time,
            beam_interval: any(0.0),
            first_bearing: any(0.0),
            bearing_step: any(0.0),
            ranges: part(&RANGES),
            intensities: part(&INTENSITIES),
        }),
        7 => Event::Gyro(GyroSample { time, rate: any(0.0) }),
        6 => Event::Wheels(any(WheelSample { time, wheels: Default::default() })),
        _ => Event::SetPose(PoseFix { time, pose, position_deviation: any(0.0), heading_deviation: any(0.0) }),
    }
}

impl Localization {
    #[inline(always)]
    pub fn new() -> Self {
        let settings: Settings = any(Settings::default());
        let parameters = settings.parameters;
        Self {
            localization: agv_controller::Localization::new(Localizer::new(parameters), &settings),
            small: SmallLocalizer::new(parameters),
            whole: WholeLocalizer::new(parameters),
            frame: [0; MAX_FRAME],
        }
    }

    /// One event, logged, handled and searched with, and a slice of the search.
    pub fn step(&mut self) {
        let event = event();
        let Self { localization, small, frame, .. } = self;
        let _ = black_box(localization.localizer_mut().lend_landmarks(part(&LANDMARKS)));
        let _ = black_box(small.add_landmarks(part(&LANDMARKS)));
        let _ = black_box(localization.localizer_mut().lend_contours(part(&BYTES)));
        localization.handle(&event, |record| log(frame, record));
        localization.hear(
            &any(Told::from(BusEvent::Encoders(EncoderSample { time: Time::default(), drive: 0, steering: 0 }))),
            |record| log(frame, record),
        );
        localization.published(
            &any(SentPose { pose: localization.estimate().pose, progress: Progress::default() }),
            |record| {
                log(frame, record);
            },
        );
        black_box(localization.told());
        black_box(localization.search(|record| log(frame, record)));
        black_box(localization.estimate());
        log(&mut self.frame, &Record::Output(Output::from(self.small.handle(&event))));
        log(&mut self.frame, &Record::Output(Output::from(self.whole.handle(&event))));
    }
}

fn log(frame: &mut [u8], record: &Record) {
    let _ = black_box(encode(record, any(0), frame));
    if let Record::Output(output) = record {
        black_box(output.pose.level);
    }
}
