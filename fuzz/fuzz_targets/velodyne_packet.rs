#![no_main]

use agv_lidar3d::calibration::{Full, Laser};
use agv_lidar3d::geometry::Offsets;
use agv_lidar3d::calibration::calibration_from_stream;
use agv_lidar3d::packet::{Decoder, LENGTH, Model, Packet, Sensor};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let full = Full { has_two_points: true, ..Full::default() };
    let lasers = [Laser { is_enabled: true, full: Some(full), ..Laser::default() }; 128];
    for sensor in Sensor::ALL {
        let model = Model {
            sensor,
            lasers: &lasers[..sensor.lasers()],
            distance_resolution: sensor.distance_resolution(),
            offsets: Offsets::Orthogonal,
            two_points: true,
        };
        let mut decoder = Decoder::new(&model, sensor.filter());
        let (mut returns, mut points) = (0, 0);
        for bytes in bytes.chunks(LENGTH) {
            let Ok(packet) = Packet::new(bytes) else { continue };
            // What was read is what was given, and every return is accounted for. A full turn is written as zero.
            let _ = Sensor::of_packet(&packet);
            assert_eq!(Packet::new(&packet.bytes()).unwrap().tail(), packet.tail());
            let outcome = decoder.packet(&packet, |point| {
                assert!(point.azimuth < 36_000 && point.position.iter().all(|value| value.is_finite()));
                points += 1;
            });
            if outcome.is_ok() {
                returns += packet.blocks().map(|block| block.returns().count() as u64).sum::<u64>();
            }
        }
        let tally = decoder.tally();
        assert_eq!(tally.points, points);
        assert_eq!(tally.returns(), returns);
    }
    // The calibration in a stream of status bytes, two bytes a packet.
    let tails = bytes.as_chunks::<2>().0.iter().map(|pair| agv_lidar3d::packet::Tail([0, 0, 0, 0, pair[0], pair[1]]));
    if let Some(calibration) = calibration_from_stream(tails) {
        assert_eq!(calibration.lasers.len(), 64);
    }
});
