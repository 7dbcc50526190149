//! Frames and records: what is written is read, bit for bit, and damage stays where it is.
#![allow(clippy::unwrap_used, clippy::indexing_slicing, clippy::panic, reason = "a panic is how a test fails")]

use agv_core::geometry::Pose;
use agv_core::integrity::ProtectionLevel;
use agv_core::localizer::{
    CapacitiesOf, Event, LandmarkSource, LandmarkUse, Localizer, Mode, Parameters, PoseFix, PoseOutput, Reason,
    StatedCapacities,
};
use agv_core::maps::{Landmark, LandmarkKind, Verdict};
use agv_core::measurement::{
    EncoderFault, EncoderFaults, EncoderSample, GyroSample, LaserId, PoseIncrement, ReflectorObservation, Reflectors,
    Scan, SpeedSample, Time, WheelReading, WheelSample,
};
use agv_core::odometry::{Ackermann, CounterRange, GyroParameters, Tricycle, Vehicle};
use agv_core::record::{
    DamageReason, EncodeError, Header, Item, LogReader, MAX_FRAME, Output, Published, Raw, RawSource, Record,
    Reference, STATE_A_RECORD, Scratch, StateOwner, StatePiece, Step, Truth, encode,
};
use proptest::prelude::*;

/// Everything that a record can hold, with its own memory.
#[derive(Clone, Debug)]
enum Owned {
    Header(String, Box<Parameters>, StatedCapacities),
    Landmarks(Vec<Landmark>),
    Encoders(EncoderSample),
    Speed(SpeedSample),
    Wheels(WheelSample),
    Gyro(GyroSample),
    Increment(PoseIncrement),
    Reflectors(Vec<ReflectorObservation>),
    Scan(Time, [f64; 3], Vec<f32>, Vec<u16>),
    EncoderFaults(EncoderFaults),
    SetPose(PoseFix),
    Output(PoseOutput, Vec<LandmarkUse>),
    Behind(u32),
    Published(Published),
    Truth(Truth),
    Reference(Reference),
    Note(String),
    Raw(RawSource, Time, Vec<u8>),
    State(StateOwner, u32, u32, Vec<u8>),
    End,
}

impl Owned {
    fn with<T>(&self, use_record: impl FnOnce(Record) -> T) -> T {
        use_record(match self {
            Self::Header(software, parameters, capacities) => {
                Record::Header(Header { software, parameters, capacities: *capacities })
            }
            Self::Landmarks(landmarks) => Record::Landmarks(landmarks),
            Self::Encoders(sample) => Record::Event(Event::Encoders(*sample)),
            Self::EncoderFaults(faults) => Record::Event(Event::EncoderFaults(*faults)),
            Self::Speed(sample) => Record::Event(Event::Speed(*sample)),
            Self::Wheels(sample) => Record::Event(Event::Wheels(*sample)),
            Self::Gyro(sample) => Record::Event(Event::Gyro(*sample)),
            Self::Increment(increment) => Record::Event(Event::Increment(*increment)),
            Self::Reflectors(observations) => Record::Event(Event::Reflectors(Reflectors::of_first(observations))),
            Self::Scan(start, [beam_interval, first_bearing, bearing_step], ranges, intensities) => {
                Record::Event(Event::Scan(Scan {
                    laser: LaserId::FIRST,
                    start: *start,
                    beam_interval: *beam_interval,
                    first_bearing: *first_bearing,
                    bearing_step: *bearing_step,
                    ranges,
                    intensities,
                }))
            }
            Self::SetPose(fix) => Record::Event(Event::SetPose(*fix)),
            Self::Output(pose, uses) => Record::Output(Output { pose: *pose, uses }),
            Self::Behind(count) => Record::Behind(*count),
            Self::Published(published) => Record::Published(*published),
            Self::Truth(truth) => Record::Truth(*truth),
            Self::Reference(reference) => Record::Reference(*reference),
            Self::Note(text) => Record::Note(text),
            Self::State(owner, length, start, bytes) => {
                Record::State(StatePiece { owner: *owner, length: *length, start: *start, bytes })
            }
            Self::Raw(source, time, bytes) => Record::Raw(Raw { source: *source, time: *time, bytes }),
            Self::End => Record::End,
        })
    }

    fn frame(&self, sequence: u32) -> Vec<u8> {
        let mut buffer = vec![0; MAX_FRAME];
        let length = self.with(|record| encode(&record, sequence, &mut buffer)).unwrap();
        buffer.truncate(length);
        buffer
    }
}

fn time() -> impl Strategy<Value = Time> {
    any::<u64>().prop_map(Time::from_micros)
}

/// Any bit pattern but NaN, so that records can be compared by their values too.
fn number() -> impl Strategy<Value = f64> {
    any::<u64>().prop_map(f64::from_bits).prop_filter("comparable", |value| !value.is_nan())
}

fn single() -> impl Strategy<Value = f32> {
    any::<u32>().prop_map(f32::from_bits).prop_filter("comparable", |value| !value.is_nan())
}

fn pose() -> impl Strategy<Value = Pose> {
    (number(), number(), number()).prop_map(|(x, y, theta)| Pose { x, y, theta })
}

fn vehicle() -> impl Strategy<Value = Vehicle> {
    let range = || (2_u64..=1 << 32).prop_map(|values| CounterRange::new(values).unwrap());
    prop_oneof![
        Just(Vehicle::Increments),
        (number(), number())
            .prop_map(|(wheelbase, encoder_offset)| Vehicle::Ackermann(Ackermann { wheelbase, encoder_offset })),
        (prop::array::uniform5(number()), range(), range()).prop_map(|(numbers, drive_range, steering_range)| {
            let [wheelbase, drive_scale, steering_scale, steering_offset_forward, steering_offset_backward] = numbers;
            Vehicle::Tricycle(Tricycle {
                wheelbase,
                drive_scale,
                drive_range,
                steering_scale,
                steering_range,
                steering_offset_forward,
                steering_offset_backward,
            })
        }),
    ]
}

fn gyro() -> impl Strategy<Value = (GyroParameters, bool)> {
    let fitted = (prop::array::uniform7(number()), any::<bool>()).prop_map(|(numbers, is_fitted)| {
        let [factor, latency, noise, bias, drift, scale, range] = numbers;
        GyroParameters { is_fitted, factor, latency, noise, bias, drift, scale, range }
    });
    (prop_oneof![Just(GyroParameters::default()), fitted], any::<bool>())
}

fn landmark() -> impl Strategy<Value = Landmark> {
    (any::<u16>(), landmark_kind(), number(), number(), single()).prop_map(|(id, kind, x, y, deviation)| Landmark {
        id,
        kind,
        x,
        y,
        deviation,
    })
}

fn landmark_kind() -> impl Strategy<Value = LandmarkKind> {
    prop_oneof![Just(LandmarkKind::Reflector), Just(LandmarkKind::Corner), Just(LandmarkKind::EndPoint)]
}

fn pose_output() -> impl Strategy<Value = PoseOutput> {
    let mode =
        prop_oneof![Just(Mode::NotLocalised), Just(Mode::Mixed), Just(Mode::WithoutOdometry), Just(Mode::Degraded)];
    let reason = prop_oneof![Just(Reason::None), Just(Reason::OdometryImplausible), Just(Reason::SteeringEncoder)];
    let numbers = prop::array::uniform12(number());
    let counters = (any::<u8>(), single(), any::<u8>());
    (time(), [pose(), pose()], mode, reason, numbers, counters).prop_map(
        |(time, [pose, smooth], mode, reason, numbers, (resets, last_reset, overflows))| {
            let [a, b, c, d, e, f, g, h, i, correction, bound, heading_bound] = numbers;
            PoseOutput {
                time,
                pose,
                covariance: [a, b, c, d, e, f],
                mode,
                reason,
                dead_reckoning_distance: g,
                correction,
                smooth,
                level: ProtectionLevel { position: bound, heading: heading_bound },
                acceptance: h,
                normalised_square: i,
                resets,
                last_reset,
                overflows,
            }
        },
    )
}

fn landmark_use() -> impl Strategy<Value = LandmarkUse> {
    let source = prop_oneof![Just(LandmarkSource::Fixed), Just(LandmarkSource::Dynamic)];
    let verdict = prop_oneof![Just(Verdict::Accepted), Just(Verdict::OutOfTime)];
    let landmark = prop::option::of((source, any::<u16>()));
    let numbers = (prop::array::uniform2(single()), prop::array::uniform2(number()), number());
    (time(), landmark_kind(), landmark, verdict, numbers).prop_map(
        |(time, kind, landmark, verdict, (position, residual, test_ratio))| LandmarkUse {
            laser: LaserId::FIRST,
            located: [residual[1], residual[0]],
            residual_deviation: [test_ratio, residual[0]],
            time,
            kind,
            landmark,
            verdict,
            position,
            residual,
            test_ratio,
        },
    )
}

fn record() -> impl Strategy<Value = Owned> {
    let observation =
        (time(), single(), single()).prop_map(|(time, range, bearing)| ReflectorObservation { time, range, bearing });
    prop_oneof![
        (".{0,40}", vehicle(), pose(), any::<[u32; 4]>(), gyro()).prop_map(
            |(software, vehicle, laser, [a, b, c, d], gyro)| {
                let mut parameters = Parameters::new(vehicle, laser);
                (parameters.gyro, parameters.sources.gyro) = gyro;
                let stated = StatedCapacities { landmarks: a, beams: b, history: c, contours: d };
                Owned::Header(software, Box::new(parameters), stated)
            }
        ),
        prop::collection::vec(landmark(), 0..=50).prop_map(Owned::Landmarks),
        (time(), any::<u32>(), any::<u32>()).prop_map(|(time, drive, steering)| Owned::Encoders(EncoderSample {
            time,
            drive,
            steering
        })),
        (time(), any::<bool>()).prop_map(|(time, is_driving)| {
            let (jumped, out_of_range) = (Some(EncoderFault::Jumped), Some(EncoderFault::OutOfRange));
            let (drive, steering) = if is_driving { (jumped, None) } else { (None, out_of_range) };
            Owned::EncoderFaults(EncoderFaults { time, drive, steering })
        }),
        (time(), any::<[(u32, u32); 4]>()).prop_map(|(time, wheels)| Owned::Wheels(WheelSample {
            time,
            wheels: wheels.map(|(count, steering)| WheelReading { count, steering }),
        })),
        (time(), number()).prop_map(|(time, rate)| Owned::Gyro(GyroSample { time, rate })),
        (time(), number(), number()).prop_map(|(time, speed, steering)| Owned::Speed(SpeedSample {
            time,
            speed,
            steering
        })),
        (time(), pose()).prop_map(|(time, displacement)| Owned::Increment(PoseIncrement { time, displacement })),
        prop::collection::vec(observation, 0..200).prop_map(Owned::Reflectors),
        (
            time(),
            prop::array::uniform3(number()),
            prop::collection::vec(any::<u32>().prop_map(f32::from_bits), 0..500),
            prop::collection::vec(any::<u16>(), 0..500)
        )
            .prop_map(|(start, geometry, ranges, intensities)| Owned::Scan(
                start,
                geometry,
                ranges,
                intensities
            )),
        (time(), pose(), number(), number()).prop_map(|(time, pose, position_deviation, heading_deviation)| {
            Owned::SetPose(PoseFix { time, pose, position_deviation, heading_deviation })
        }),
        (pose_output(), prop::collection::vec(landmark_use(), 0..128))
            .prop_map(|(pose, uses)| Owned::Output(pose, uses)),
        any::<u32>().prop_map(Owned::Behind),
        (pose_output(), any::<u32>()).prop_map(|(pose, behind)| Owned::Published(Published { pose, behind })),
        (time(), pose()).prop_map(|(time, pose)| Owned::Truth(Truth { time, pose })),
        (time(), number(), number(), prop::option::of(number()))
            .prop_map(|(time, x, y, heading)| Owned::Reference(Reference { time, x, y, heading })),
        ".{0,100}".prop_map(Owned::Note),
        (any::<bool>(), time(), prop::collection::vec(any::<u8>(), 0..300)).prop_map(|(is_received, time, bytes)| {
            Owned::Raw(if is_received { RawSource::FromNav350 } else { RawSource::ToCan }, time, bytes)
        }),
        (any::<bool>(), any::<u32>(), any::<u32>(), prop::collection::vec(any::<u8>(), 0..300)).prop_map(
            |(is_predictor, length, start, bytes)| {
                let owner = if is_predictor { StateOwner::Predictor } else { StateOwner::Localizer };
                Owned::State(owner, length, start, bytes)
            }
        ),
        Just(Owned::End),
    ]
}

/// Reads a log that is handed over in pieces, and gives each item to `see`.
fn read(log: &[u8], piece: usize, mut see: impl FnMut(Item)) {
    let mut reader = LogReader::new();
    let mut scratch = Box::new(Scratch::<4096, 1024>::new());
    let (mut consumed, mut given) = (0, 0);
    loop {
        let (count, step) = reader.step(&log[consumed..given], given == log.len(), &mut scratch);
        consumed += count;
        assert_eq!(reader.offset(), consumed as u64);
        match step {
            Step::Item(item) => see(item),
            Step::NeedMore => {
                assert!(given < log.len(), "asked for more although it has all");
                given = (given + piece).min(log.len());
            }
            Step::End => break,
        }
    }
    assert_eq!(consumed, log.len());
}

/// Frames of all records that are whole, each encoded again, and all damage.
fn read_again(log: &[u8], piece: usize) -> (Vec<Vec<u8>>, Vec<agv_core::record::Damage>) {
    let (mut frames, mut damages) = (Vec::new(), Vec::new());
    read(log, piece, |item| match item {
        Item::Record { sequence, record, .. } => {
            let mut buffer = vec![0; MAX_FRAME];
            let length = encode(&record, sequence, &mut buffer).unwrap();
            buffer.truncate(length);
            frames.push(buffer);
        }
        Item::Damage(damage) => damages.push(damage),
    });
    (frames, damages)
}

#[test]
fn the_header_of_a_vehicle_without_a_gyro_is_what_it_was_before_there_were_gyros() {
    let parameters = Parameters::new(Vehicle::Increments, Pose::new(0.5, 0.1, 0.2));
    let capacities = StatedCapacities { landmarks: 1, beams: 2, history: 3, contours: 4 };
    let frame = Owned::Header("agv".to_owned(), Box::new(parameters), capacities).frame(0);
    let mut room = vec![0; MAX_FRAME];
    let payload = postcard::to_slice(&("agv", &parameters, capacities), &mut room).unwrap();
    assert_eq!(&frame[12..frame.len() - 4], payload);
    let mut with = parameters;
    with.gyro.is_fitted = true;
    let longer = Owned::Header("agv".to_owned(), Box::new(with), capacities).frame(0);
    // Seven numbers and two switches.
    assert_eq!(longer.len(), frame.len() + 7 * 8 + 2);
    read(&longer, usize::MAX >> 1, |item| {
        let Item::Record { record: Record::Header(header), .. } = item else { panic!("{item:?}") };
        assert_eq!(*header.parameters, with);
    });
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn a_record_is_read_as_it_was_written(record in record(), sequence: u32) {
        let frame = record.frame(sequence);
        let mut seen = 0;
        read(&frame, usize::MAX >> 1, |item| {
            let Item::Record { offset: 0, sequence: found, record: again } = item else { panic!("{item:?}") };
            assert_eq!(found, sequence);
            // NaN ranges are equal to nothing: those scans are compared by their bytes alone.
            let is_comparable = !matches!(again, Record::Event(Event::Scan(_)));
            record.with(|record| assert!(!is_comparable || record == again, "{record:?} became {again:?}"));
            let mut buffer = vec![0; MAX_FRAME];
            let length = encode(&again, sequence, &mut buffer).unwrap();
            assert_eq!(&buffer[..length], &frame[..]);
            seen += 1;
        });
        prop_assert_eq!(seen, 1);
    }

    #[test]
    fn ranges_keep_their_bits(bits in prop::collection::vec(any::<u32>(), 0..1440), intensities in prop::collection::vec(any::<u16>(), 0..1440)) {
        let frame = Owned::Scan(Time::from_micros(5), [0.1, 0.2, 0.3], bits.iter().map(|bits| f32::from_bits(*bits)).collect(), intensities.clone()).frame(0);
        read(&frame, usize::MAX >> 1, |item| {
            let Item::Record { record: Record::Event(Event::Scan(scan)), .. } = item else { panic!("{item:?}") };
            assert_eq!(scan.ranges.iter().map(|range| range.to_bits()).collect::<Vec<_>>(), bits);
            assert_eq!(scan.intensities, intensities);
            assert_eq!((scan.start, scan.beam_interval, scan.first_bearing, scan.bearing_step), (Time::from_micros(5), 0.1, 0.2, 0.3));
        });
    }

    #[test]
    fn the_size_of_the_pieces_does_not_matter(records in prop::collection::vec(record(), 0..8), piece in 1_usize..5000) {
        let frames: Vec<_> = records.iter().enumerate().map(|(index, record)| record.frame(index as u32)).collect();
        let (again, damages) = read_again(&frames.concat(), piece);
        prop_assert_eq!(again, frames);
        prop_assert!(damages.is_empty());
    }

    #[test]
    fn foreign_bytes_are_one_damage_and_hurt_nobody(before in record(), foreign in prop::collection::vec(any::<u8>(), 1..3000), after in record(), piece in 1_usize..5000) {
        let (before, after) = (before.frame(7), after.frame(9));
        let (again, damages) = read_again(&[&before[..], &foreign, &after].concat(), piece);
        prop_assert_eq!(again, vec![before.clone(), after]);
        prop_assert_eq!(damages.len(), 1);
        prop_assert_eq!((damages[0].offset, damages[0].skipped), (before.len() as u64, foreign.len() as u64));
    }

    #[test]
    fn untouched_records_survive_any_damage(records in prop::collection::vec(record(), 1..8), hits in prop::collection::vec((any::<prop::sample::Index>(), 1_u8..), 0..20), piece in 1_usize..5000) {
        let frames: Vec<_> = records.iter().enumerate().map(|(index, record)| record.frame(index as u32)).collect();
        let mut log = frames.concat();
        let mut flips = std::collections::BTreeMap::new();
        for (place, flip) in hits {
            flips.insert(place.index(log.len()), flip);
        }
        for (position, flip) in &flips {
            log[*position] ^= flip;
        }
        let mut start = 0;
        let mut survivors = Vec::new();
        for frame in frames {
            let end = start + frame.len();
            if flips.range(start..end).next().is_none() {
                survivors.push(frame);
            }
            start = end;
        }
        let (again, damages) = read_again(&log, piece);
        prop_assert_eq!(again, survivors);
        let skipped: u64 = damages.iter().map(|damage| damage.skipped).sum();
        prop_assert_eq!(flips.is_empty(), skipped == 0);
    }

    #[test]
    fn arbitrary_payloads_are_records_or_damage(kind in 0_u8..16, payload in prop::collection::vec(any::<u8>(), 0..200)) {
        // A frame with a good checksum around anything.
        let mut frame = vec![0xD6, 0x41, 0x47, 0x56, 2, kind, payload.len() as u8, 0, 3, 0, 0, 0];
        frame.extend(payload);
        frame.extend([0; 4]);
        let end = frame.len() - 4;
        let checksum = crc32(&frame[..end]);
        frame[end..].copy_from_slice(&checksum.to_le_bytes());
        let mut items = 0;
        read(&frame, usize::MAX >> 1, |_| items += 1);
        prop_assert_eq!(items, 1);
    }
}

/// CRC-32 bit by bit, as in the PNG specification, annex D.
fn crc32(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(u32::MAX, |state, byte| {
        (0..8).fold(
            state ^ u32::from(*byte),
            |state, _| if state & 1 == 1 { 0xEDB8_8320 ^ (state >> 1) } else { state >> 1 },
        )
    })
}

/// A small log with some records of every sort, and where each frame begins.
fn small_log() -> (Vec<Vec<u8>>, Vec<usize>) {
    let records = [
        Owned::Header(
            "test".into(),
            Box::new(Parameters::new(Vehicle::Increments, Pose::new(1.0, 0.0, 0.5))),
            StatedCapacities::default(),
        ),
        Owned::Landmarks(vec![Landmark { id: 1, kind: LandmarkKind::Corner, x: 1.0, y: -2.0, deviation: 0.01 }; 3]),
        Owned::Encoders(EncoderSample { time: Time::from_micros(1000), drive: 70_000, steering: 5 }),
        Owned::Scan(Time::from_micros(2000), [0.0, -1.0, 0.1], vec![f32::NAN, 1.0, 0.0, -3.0], vec![4, 5]),
        Owned::Scan(Time::from_micros(2300), [0.0; 3], vec![f32::from_le_bytes(agv_core::record::MAGIC)], vec![1, 2]),
        Owned::Truth(Truth { time: Time::from_micros(2500), pose: Pose::new(1.0, 2.0, 3.0) }),
        Owned::End,
    ];
    let frames: Vec<_> = records.iter().enumerate().map(|(index, record)| record.frame(index as u32)).collect();
    let starts = frames.iter().scan(0, |start, frame| Some(std::mem::replace(start, *start + frame.len()))).collect();
    (frames, starts)
}

#[test]
fn a_log_cut_anywhere_reads_up_to_the_cut() {
    let (frames, starts) = small_log();
    let log = frames.concat();
    for cut in 0..log.len() {
        let whole = frames.iter().zip(&starts).filter(|(frame, start)| **start + frame.len() <= cut).count();
        let (again, damages) = read_again(&log[..cut], 64);
        assert_eq!(again, frames[..whole], "cut at {cut}");
        if cut == starts[whole] {
            assert_eq!(damages, []);
        } else {
            assert_eq!(damages.len(), 1);
            assert_eq!(damages[0].reason, DamageReason::Cut);
            assert_eq!(damages[0].offset, starts[whole] as u64);
            assert_eq!(damages[0].skipped, (cut - starts[whole]) as u64);
        }
    }
}

#[test]
fn a_damaged_byte_costs_one_record() {
    let (frames, starts) = small_log();
    let log = frames.concat();
    for position in 0..log.len() {
        for flip in [0x01, 0x80, 0xFF] {
            let mut damaged = log.clone();
            damaged[position] ^= flip;
            let hit = starts.iter().rposition(|start| *start <= position).unwrap();
            let mut expected = frames.clone();
            let lost = expected.remove(hit);
            let (again, damages) = read_again(&damaged, 100);
            assert_eq!(again, expected, "byte {position}");
            assert_eq!(damages.len(), 1, "byte {position}: {damages:?}");
            assert_eq!(damages[0].offset, starts[hit] as u64);
            assert_eq!(damages[0].skipped, lost.len() as u64);
            assert!(!matches!(
                damages[0].reason,
                DamageReason::Version(_) | DamageReason::Kind(_) | DamageReason::Sequence { .. }
            ));
        }
    }
}

#[test]
fn missing_and_repeated_frames_are_reported() {
    let (frames, starts) = small_log();
    let missing = [&frames[..2], &frames[4..]].concat();
    let (again, damages) = read_again(&missing.concat(), 1000);
    assert_eq!(again, missing);
    let reason = DamageReason::Sequence { expected: 2, found: 4 };
    assert_eq!(damages, [agv_core::record::Damage { offset: starts[2] as u64, skipped: 0, reason }]);

    let repeated = [&frames[..3], &frames[2..]].concat();
    let (again, damages) = read_again(&repeated.concat(), 1000);
    assert_eq!(again, repeated);
    assert_eq!(damages.len(), 1);
    assert_eq!(damages[0].reason, DamageReason::Sequence { expected: 3, found: 2 });

    let restarted = [&frames[..], &frames[..]].concat();
    assert_eq!(read_again(&restarted.concat(), 1000), (restarted, vec![]));
}

#[test]
fn another_version_is_told_apart_from_damage() {
    let (frames, _) = small_log();
    for (version, is_read) in [(10, false), (11, true), (12, false)] {
        let mut frame = frames[2].clone();
        frame[4] = version;
        let end = frame.len() - 4;
        let checksum = crc32(&frame[..end]);
        frame[end..].copy_from_slice(&checksum.to_le_bytes());
        let (again, damages) = read_again(&frame, 1000);
        assert_eq!(again.len(), usize::from(is_read), "version {version}");
        if !is_read {
            assert_eq!(damages[0].reason, DamageReason::Version(version));
        }
    }
}

#[test]
fn the_header_of_a_localiser_s_log_states_its_room() {
    let parameters = Parameters::new(Vehicle::Increments, Pose::default());
    let mut buffer = vec![0; MAX_FRAME];
    let capacities = Localizer::<CapacitiesOf<360, 64, 32, 8>>::CAPACITIES;
    let header = Header { software: "test", parameters: &parameters, capacities };
    let length = encode(&Record::Header(header), 0, &mut buffer).unwrap();
    let mut scratch = Box::new(Scratch::<1, 1>::new());
    let (_, Step::Item(Item::Record { record: Record::Header(read), .. })) =
        LogReader::new().step(&buffer[..length], true, &mut scratch)
    else {
        panic!("no header")
    };
    // The past does not depend on the maps.
    assert_eq!(read.capacities, StatedCapacities { landmarks: 96, beams: 360, history: 128, contours: 0 });
}

#[test]
fn the_bytes_of_a_frame_are_as_documented() {
    let frame =
        Owned::Encoders(EncoderSample { time: Time::from_micros(300), drive: 1, steering: 0x80 }).frame(0x0102_0304);
    let body = [0xD6, 0x41, 0x47, 0x56, 11, 2, 5, 0, 4, 3, 2, 1, 0xAC, 0x02, 1, 0x80, 0x01];
    assert_eq!(frame[..17], body);
    assert_eq!(frame[17..], crc32(&body).to_le_bytes());
}

#[test]
fn what_does_not_fit_is_refused() {
    let note = "x".repeat(33_000);
    let mut buffer = vec![0; 100_000];
    assert_eq!(encode(&Record::Note(&note), 0, &mut buffer), Err(EncodeError::TooLong));
    assert_eq!(encode(&Record::Note("four"), 0, &mut buffer[..19]), Err(EncodeError::Buffer));
    assert_eq!(encode(&Record::Note("four"), 0, &mut buffer[..20]), Ok(20));
    assert_eq!(encode(&Record::End, 0, &mut []), Err(EncodeError::Buffer));
    let landmark = Landmark { id: 0, kind: LandmarkKind::Reflector, x: 0.0, y: 0.0, deviation: 0.0 };
    assert_eq!(encode(&Record::Landmarks(&[landmark; 51]), 0, &mut buffer), Err(EncodeError::TooLong));
    assert!(encode(&Record::Note(&note[..32_768]), 0, &mut buffer).is_ok());
    let mut raw = Raw { source: RawSource::FromNav350, time: Time::default(), bytes: &note.as_bytes()[..16_385] };
    assert_eq!(encode(&Record::Raw(raw), 0, &mut buffer), Err(EncodeError::TooLong));
    raw.bytes = &raw.bytes[..16_384];
    assert!(encode(&Record::Raw(raw), 0, &mut buffer).is_ok());

    let mut piece = StatePiece { owner: StateOwner::Localizer, length: 0, start: 0, bytes: &note.as_bytes()[..16_385] };
    assert_eq!(encode(&Record::State(piece), 0, &mut buffer), Err(EncodeError::TooLong));
    piece.bytes = &piece.bytes[..16_384];
    assert!(encode(&Record::State(piece), 0, &mut buffer).is_ok());

    let ranges = [1.0; 5];
    let scan = Scan {
        laser: LaserId::FIRST,
        start: Time::default(),
        beam_interval: 0.0,
        first_bearing: 0.0,
        bearing_step: 0.1,
        ranges: &ranges,
        intensities: &[],
    };
    let length = encode(&Record::Event(Event::Scan(scan)), 0, &mut buffer).unwrap();
    let mut scratch = Scratch::<4, 4>::new();
    let (_, step) = LogReader::new().step(&buffer[..length], true, &mut scratch);
    assert!(matches!(step, Step::Item(Item::Damage(damage)) if damage.reason == DamageReason::Payload), "{step:?}");
}

#[test]
fn pieces_of_a_state_are_all_of_it_in_order() {
    for length in [0, 1, STATE_A_RECORD, STATE_A_RECORD + 1, 3 * STATE_A_RECORD + 7] {
        let state: Vec<u8> = (0..length).map(|place| (place % 251) as u8).collect();
        let mut joined = Vec::new();
        for piece in StatePiece::of(StateOwner::Predictor, &state) {
            assert_eq!((piece.length as usize, piece.start as usize), (length, joined.len()));
            assert!((1..=STATE_A_RECORD).contains(&piece.bytes.len()));
            joined.extend_from_slice(piece.bytes);
        }
        assert_eq!(joined, state);
    }
}
