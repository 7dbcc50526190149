//! What a revolution keeps of an answer that is larger than it has room for.

use agv_core::localizer::OBSERVATIONS;
use agv_core::measurement::Time;
use agv_wire::cola::Sequence;
use agv_wire::nav350::{
    Angle, Channel, ChannelName, DeviceTime, Distance, ErrorCode, Milliangle, NavigationData, Reflector, ReflectorList,
    Revolution, SensorClock, SensorFrame,
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
