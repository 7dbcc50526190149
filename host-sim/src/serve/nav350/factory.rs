//! What the emulated sensor's settings are before anybody writes them. Those of real sensors are not known here.

use agv_wire::nav350::{
    Coordinate, CoordinateFormat, Distance, IdentificationWindow, LandmarkDataFormat, MapConfiguration, Milliangle,
    PoseDataFormat, ReflectorType, ScanDataFormat, Setting, Size,
};

/// All settings but the muted sectors, whose layout is not known.
pub(super) fn settings() -> Vec<Setting<'static>> {
    vec![
        Setting::CurrentLayer(0),
        Setting::PoseDataFormat(PoseDataFormat { is_extrapolated: false, has_details: false }),
        Setting::LandmarkDataFormat(LandmarkDataFormat {
            coordinates: CoordinateFormat::Cartesian,
            has_details: false,
            filter: 0,
        }),
        Setting::ScanDataFormat(ScanDataFormat { channels: 1, has_remission: false }),
        Setting::SlidingMean(4),
        Setting::MapConfiguration(MapConfiguration {
            mean: 10,
            only_unknown: false,
            x: Coordinate(0),
            y: Coordinate(0),
            heading: Milliangle(0),
        }),
        Setting::ReflectorSize(Size(80)),
        Setting::ReflectorType(ReflectorType::Cylindrical),
        Setting::IdentificationWindow(IdentificationWindow {
            low: Size(300),
            high: Size(300),
            low_distance: Distance(500),
            high_distance: Distance(70_000),
        }),
        Setting::NearestReflectors(0),
        Setting::ActionRadius(Distance(500), Distance(70_000)),
        Setting::ReflectorThreshold(50),
        Setting::LandmarkMatching(0),
        Setting::CoordinateOrientation(0),
        Setting::HardwareTimeSync(0, 0),
    ]
}
