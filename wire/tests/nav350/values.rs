//! Any telegram.

use agv_wire::cola::Dialect;
use agv_wire::nav350::{
    Angle, ChannelName, Coordinate, CoordinateFormat, DataMask, DeviceTime, Distance, IdentificationWindow,
    IdentifiedLandmark, LandmarkDataFormat, LayoutLandmark, MapConfiguration, Milliangle, OperatingMode,
    PoseDataFormat, PoseDetails, PoseReport, PositionMode, Reflector, ReflectorDetails, ReflectorType, RotationSpeed,
    ScanDataFormat, Setting, Size, SpeedReport, Velocity,
};
use proptest::prelude::*;

pub fn dialect() -> impl Strategy<Value = Dialect> {
    prop_oneof![Just(Dialect::Ascii), Just(Dialect::Binary)]
}

pub fn mode() -> impl Strategy<Value = OperatingMode> {
    prop::sample::select(vec![
        OperatingMode::PowerDown,
        OperatingMode::Standby,
        OperatingMode::Mapping,
        OperatingMode::LandmarkDetection,
        OperatingMode::Navigation,
    ])
}

pub fn mask() -> impl Strategy<Value = DataMask> {
    prop::sample::select(vec![DataMask::PoseAndReflectors, DataMask::PoseAndScan, DataMask::All])
}

pub fn setting() -> impl Strategy<Value = Setting<'static>> {
    let flag = any::<bool>;
    prop_oneof![
        any::<u16>().prop_map(Setting::CurrentLayer),
        (flag(), flag()).prop_map(|(is_extrapolated, has_details)| {
            Setting::PoseDataFormat(PoseDataFormat { is_extrapolated, has_details })
        }),
        (flag(), flag(), any::<u8>()).prop_map(|(is_polar, has_details, filter)| {
            let coordinates = if is_polar { CoordinateFormat::Polar } else { CoordinateFormat::Cartesian };
            Setting::LandmarkDataFormat(LandmarkDataFormat { coordinates, has_details, filter })
        }),
        (any::<u8>(), flag()).prop_map(|(channels, has_remission)| {
            Setting::ScanDataFormat(ScanDataFormat { channels, has_remission })
        }),
        any::<u8>().prop_map(Setting::SlidingMean),
        (any::<u8>(), flag(), any::<i32>(), any::<i32>(), any::<i32>()).prop_map(
            |(mean, only_unknown, x, y, heading)| {
                Setting::MapConfiguration(MapConfiguration {
                    mean,
                    only_unknown,
                    x: Coordinate(x),
                    y: Coordinate(y),
                    heading: Milliangle(heading),
                })
            }
        ),
        any::<u16>().prop_map(|size| Setting::ReflectorSize(Size(size))),
        flag().prop_map(|is_flat| {
            Setting::ReflectorType(if is_flat { ReflectorType::Flat } else { ReflectorType::Cylindrical })
        }),
        any::<(u16, u16, u32, u32)>().prop_map(|(low, high, low_distance, high_distance)| {
            Setting::IdentificationWindow(IdentificationWindow {
                low: Size(low),
                high: Size(high),
                low_distance: Distance(low_distance),
                high_distance: Distance(high_distance),
            })
        }),
        any::<u8>().prop_map(Setting::NearestReflectors),
        any::<(u32, u32)>().prop_map(|(near, far)| Setting::ActionRadius(Distance(near), Distance(far))),
        any::<u8>().prop_map(Setting::ReflectorThreshold),
        any::<u8>().prop_map(Setting::LandmarkMatching),
        any::<u8>().prop_map(Setting::CoordinateOrientation),
        any::<(u8, u8)>().prop_map(|(mode, mask)| Setting::HardwareTimeSync(mode, mask)),
        dialect().prop_map(Setting::ColaDialect),
    ]
}

pub fn landmark() -> impl Strategy<Value = LayoutLandmark> {
    (any::<(i32, i32, u8, u8, u16)>(), prop::collection::vec(any::<u16>(), 0..=8)).prop_map(
        |((x, y, kind, subtype, size), layers)| LayoutLandmark {
            x: Coordinate(x),
            y: Coordinate(y),
            kind,
            subtype,
            size: Size(size),
            layers: layers.into_iter().collect(),
        },
    )
}

pub fn identified() -> impl Strategy<Value = IdentifiedLandmark> {
    (any::<u16>(), landmark()).prop_map(|(id, landmark)| IdentifiedLandmark { id, landmark })
}

pub fn speed() -> impl Strategy<Value = SpeedReport> {
    any::<(i16, i16, i32, u32, bool)>().prop_map(|(x, y, rotation, time, is_absolute)| SpeedReport {
        x: Velocity(x),
        y: Velocity(y),
        rotation: RotationSpeed(rotation),
        time: DeviceTime(time),
        is_absolute,
    })
}

pub fn pose() -> impl Strategy<Value = PoseReport> {
    let details = any::<(u8, u32, i32, u8, u32, u8)>().prop_map(
        |(output_mode, time, mean_deviation, mode, info, used_reflectors)| PoseDetails {
            output_mode,
            time: DeviceTime(time),
            mean_deviation,
            mode: PositionMode::from_number(mode),
            info,
            used_reflectors,
        },
    );
    (any::<(i32, i32, u32)>(), prop::option::of(details)).prop_map(|((x, y, heading), details)| PoseReport {
        x: Coordinate(x),
        y: Coordinate(y),
        heading: Angle(heading),
        details,
    })
}

pub fn reflector() -> impl Strategy<Value = Reflector> {
    let details = (any::<(u16, u16, u8, u16, u16, u32)>(), any::<(u16, u16, u16, u16, u16)>()).prop_map(
        |(
            (local_id, global_id, kind, subtype, quality, time),
            (size, hit_count, mean_echo, start_index, end_index),
        )| {
            ReflectorDetails {
                local_id,
                global_id,
                kind,
                subtype,
                quality,
                time: DeviceTime(time),
                size: Size(size),
                hit_count,
                mean_echo,
                start_index,
                end_index,
            }
        },
    );
    (prop::option::of(any::<(i32, i32)>()), prop::option::of(any::<(u32, u32)>()), prop::option::of(details)).prop_map(
        |(cartesian, polar, details)| Reflector {
            cartesian: cartesian.map(|(x, y)| (Coordinate(x), Coordinate(y))),
            polar: polar.map(|(distance, angle)| (Distance(distance), Angle(angle))),
            details,
        },
    )
}

/// What stands before the numbers of a channel, and the numbers.
#[derive(Clone, Debug)]
pub struct OwnedChannel<T> {
    pub name: ChannelName,
    pub numbers: (f32, f32, i32, u16, u32),
    pub samples: Vec<T>,
}

fn single() -> impl Strategy<Value = f32> {
    any::<u32>().prop_map(f32::from_bits).prop_filter("comparable", |value| !value.is_nan())
}

pub fn channel<T: Arbitrary>(names: Vec<ChannelName>) -> impl Strategy<Value = OwnedChannel<T>> {
    let numbers = (single(), single(), any::<i32>(), any::<u16>(), any::<u32>());
    (prop::sample::select(names), numbers, prop::collection::vec(any::<T>(), 0..40))
        .prop_map(|(name, numbers, samples)| OwnedChannel { name, numbers, samples })
}
