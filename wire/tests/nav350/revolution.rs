//! What a revolution keeps of an answer that is larger than it has room for.

use agv_core::localizer::OBSERVATIONS;
use agv_core::measurement::Time;
use agv_wire::cola::{Dialect, ReadError, Sequence};
use agv_wire::nav350::{
    Angle, Answer, Channel, ChannelName, DeviceTime, Distance, ErrorCode, MethodResult, Milliangle, NavigationData,
    Reflector, ReflectorList, Revolution, RevolutionError, SensorClock, SensorFrame,
};

#[test]
fn too_many_reflectors_cost_neither_the_scan_nor_a_direction() {
    let mut clock = SensorClock::new();
    clock.record(Time::default(), Time::default(), DeviceTime(0)).unwrap();
    for count in [OBSERVATIONS, OBSERVATIONS + 1, 300, 700] {
        let reflectors: Vec<Reflector> = (0..count)
            .map(|index| Reflector {
                cartesian: None,
                polar: Some((Distance(5000), Angle((360_000 * index / count) as u32))),
                details: None,
            })
            .collect();
        let samples = [1000_u32; 1440];
        let distances = Channel {
            name: ChannelName::DISTANCE,
            scale: 1.0,
            offset: 0.0,
            first: Milliangle(0),
            resolution: 250,
            start: DeviceTime(0),
            samples: Sequence::Values(&samples),
        };
        let data = NavigationData {
            version: 1,
            error: ErrorCode::OK,
            wait: 1,
            mask: 2,
            pose: None,
            reflectors: Some(ReflectorList { filter: 1, reflectors: Sequence::Values(&reflectors) }),
            channels: [distances].into_iter().collect(),
            remission: None,
        };
        let mut revolution = Box::new(Revolution::<1440>::new());
        assert_eq!(revolution.take(&data, &clock, &SensorFrame::default()), Ok(()));
        assert_eq!(revolution.scan().unwrap().ranges.len(), 1440);
        let kept = revolution.reflectors().unwrap().observations;
        // One more than the localiser takes, so that it knows.
        assert_eq!(kept.len(), count.min(OBSERVATIONS + 1));
        let of = |low: f32, high: f32| kept.iter().filter(|seen| (low..high).contains(&seen.bearing)).count();
        let half = std::f32::consts::FRAC_PI_2;
        for quarter in [of(-4.0, -half), of(-half, 0.0), of(0.0, half), of(half, 4.0)] {
            assert!(quarter.abs_diff(kept.len() / 4) <= 2, "{count}: {quarter}");
        }
    }
}

/// An answer with one channel of 4 beams, as often as `count` says.
fn with_channels(count: usize, scale: f32, offset: f32, resolution: u16) -> Vec<u8> {
    let samples = [1000_u32; 4];
    let distances = Channel {
        name: ChannelName::DISTANCE,
        scale,
        offset,
        first: Milliangle(0),
        resolution,
        start: DeviceTime(0),
        samples: Sequence::Values(&samples),
    };
    let data = NavigationData {
        version: 1,
        error: ErrorCode::OK,
        wait: 1,
        mask: 2,
        pose: None,
        reflectors: None,
        channels: [distances].into_iter().collect(),
        remission: None,
    };
    let mut buffer = [0; 512];
    let length = Answer::Result(MethodResult::Data(data)).encode(Dialect::Binary, &mut buffer).unwrap();
    // Behind frame, name, version, error, wait, mask and two flags stands the number of channels; no strengths follow.
    let body = &buffer[8..length - 1];
    let begin = b"sAN mNPOSGetData ".len() + 2 + 1 + 1 + 1 + 2 + 2;
    let channel = &body[begin + 2..body.len() - 2];
    [&body[..begin], &(count as u16).to_be_bytes(), &channel.repeat(count), &[0, 0]].concat()
}

fn taken(payload: &[u8]) -> Result<usize, RevolutionError> {
    let mut clock = SensorClock::new();
    clock.record(Time::default(), Time::default(), DeviceTime(0)).unwrap();
    let Answer::Result(MethodResult::Data(data)) = Answer::decode(Dialect::Binary, payload).unwrap() else { panic!() };
    let mut revolution = Box::new(Revolution::<1440>::new());
    revolution.take(&data, &clock, &SensorFrame::default())?;
    Ok(revolution.scan().map_or(0, |scan| scan.ranges.len()))
}

#[test]
fn of_up_to_four_channels_the_first_two_are_taken() {
    for count in 1..=4 {
        assert_eq!(taken(&with_channels(count, 1.0, 0.0, 250)), Ok(4), "{count} channels");
    }
    assert_eq!(Answer::decode(Dialect::Binary, &with_channels(5, 1.0, 0.0, 250)), Err(ReadError::Capacity));
}

#[test]
fn a_scan_without_scale_or_angle_is_none() {
    for (scale, offset, resolution) in [
        (f32::NAN, 0.0, 250),
        (f32::INFINITY, 0.0, 250),
        (0.0, 0.0, 250),
        (-1.0, 0.0, 250),
        (1.0, f32::NAN, 250),
        (1.0, f32::NEG_INFINITY, 250),
        (1.0, 0.0, 0),
    ] {
        assert_eq!(taken(&with_channels(1, scale, offset, resolution)), Err(RevolutionError::Channel));
    }
}
