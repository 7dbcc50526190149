//! Recorded packets of Velodynes against two drivers: nebula's clouds of the same scans, and velodyne_decoder.

mod support;

use agv_lidar3d::calibration::{Calibration, Laser};
use agv_lidar3d::geometry::Offsets;
use agv_lidar3d::packet::{
    BLOCKS, Decoder, Filter, LENGTH, Model, PORT, Packet, Point, RETURNS, Return, Sensor, Tail, counts_between,
};
use support::compared::{Compared, TOLERANCE, apart_of, turned};
use support::{file, packets_of_bag, packets_of_capture, peer, points_of_pcd, recordings};

/// Packet by packet, the points.
fn decode(sensor: Sensor, calibration: &Calibration, packets: &[Vec<u8>]) -> Vec<Vec<Point>> {
    let model = Model {
        sensor,
        lasers: &calibration.lasers,
        distance_resolution: calibration.distance_resolution.unwrap(),
        // velodyne_decoder takes the offset of an HDL-64E for a height; of the others, none states one here.
        offsets: if sensor == Sensor::Hdl64e { Offsets::Alternate } else { Offsets::Orthogonal },
        two_points: true,
    };
    let mut decoder = Decoder::new(&model, Filter::ALL);
    let points_of = |bytes: &Vec<u8>| {
        let mut points = Vec::new();
        decoder.packet(&Packet::new(bytes).unwrap(), |point| points.push(point)).unwrap();
        points
    };
    packets.iter().map(points_of).collect()
}

/// Sensor, folder of its packets, name of its model at velodyne_decoder.
const SENSORS: [(Sensor, &str, &str); 3] =
    [(Sensor::Vlp16, "vlp16", "VLP16"), (Sensor::Vlp32c, "vlp32", "VLP32C"), (Sensor::Vls128, "vls128", "VLS128")];

/// Packets of one of these sensors.
fn recorded(test: &str, name: &str) -> Option<Vec<Vec<u8>>> {
    let folder = recordings(test, &format!("packets/{name}"))?;
    Some(packets_of_bag(&file(&folder, "db3"), LENGTH, false).concat())
}

/// Two angles of a packet that are too far apart for one firing: the sensor is blind between them.
fn has_leap(bytes: &[u8]) -> bool {
    let azimuths: Vec<u16> = Packet::new(bytes).unwrap().blocks().map(|block| block.azimuth()).collect();
    azimuths.windows(2).any(|pair| counts_between(pair[0], pair[1]) > 100)
}

/// Compares the points of packets with those of velodyne_decoder. None if it is not installed.
fn compare_with_velodyne_decoder(
    (sensor, model): (Sensor, &[&str]),
    calibration: &Calibration,
    packets: &[Vec<u8>],
) -> Option<Compared> {
    let ours = decode(sensor, calibration, packets);
    let script = ("velodyne_points.py", "velodyne_decoder");
    let theirs = peer::<6>("points of velodyne_decoder", script, model, packets)?;
    assert_eq!(ours.iter().map(Vec::len).sum::<usize>(), theirs.len());
    let mut rest = &theirs[..];
    let mut compared = Compared::default();
    for (number, (points, bytes)) in ours.iter().zip(packets).enumerate() {
        let (mine, behind) = rest.split_at(points.len());
        rest = behind;
        let mut mine: Vec<[f32; 6]> = mine.to_vec();
        for point in points {
            let position_of = |other: &[f32; 6]| [other[0], other[1], other[2]];
            let apart = |other: &[f32; 6]| apart_of(point.position, position_of(other));
            // Of two returns of a firing they may keep the other one, so the order differs. The intensity of an HDL-64E
            // they correct.
            let is_raw = sensor != Sensor::Hdl64e;
            let is_like = |other: &[f32; 6]| {
                other[4] == f32::from(point.ring) && (!is_raw || other[3] == f32::from(point.intensity))
            };
            let same = (0..mine.len()).filter(|other| is_like(&mine[*other]));
            let nearest = same.min_by(|a, b| apart(&mine[*a]).total_cmp(&apart(&mine[*b])));
            let other = mine.swap_remove(nearest.unwrap_or_else(|| panic!("nothing is like {point:?}")));
            // The pause of a VLS-128 behind its first eight groups is one slot long (manual), not two.
            let is_slot_later = apart_of(turned(point.position, 1.0), position_of(&other)) <= TOLERANCE;
            let is_behind_pause = sensor == Sensor::Vls128 && point.laser >= 64 && is_slot_later;
            // They take a leap for speed, and know no speed at the first packet of a VLS-128.
            let has_no_speed = has_leap(bytes) || (sensor == Sensor::Vls128 && number == 0);
            // They leave the height without the correction of near distances; the manual takes that of y.
            let [x, y, z] = position_of(&other);
            let is_level = apart_of(point.position, [x, y, point.position[2]]) <= TOLERANCE;
            let is_height = sensor == Sensor::Hdl64e && is_level && (z - point.position[2]).abs() < 0.02;
            compared.add(apart(&other), is_behind_pause || has_no_speed || is_height);
        }
    }
    compared.report(sensor.name(), "velodyne_decoder");
    assert!(compared.worst <= TOLERANCE, "{compared:?}");
    Some(compared)
}

/// With the maker's angles and offsets, which velodyne_decoder has as well.
#[test]
fn points_are_those_of_velodyne_decoder() {
    for (sensor, name, model) in SENSORS {
        let Some(packets) = recorded("points of velodyne_decoder", name) else { return };
        let calibration = Calibration::of_maker(sensor).unwrap();
        let Some(compared) = compare_with_velodyne_decoder((sensor, &[model]), &calibration, &packets) else { return };
        assert!(compared.points > 50_000);
    }
}

#[test]
fn points_of_an_hdl32e_are_those_of_velodyne_decoder() {
    let capture = "pcap/monterey-first-100-packets.pcap";
    let Some(capture) = recordings("points of velodyne_decoder", capture) else { return };
    let packets: Vec<_> = packets_of_capture(&capture, PORT);
    let calibration = Calibration::of_maker(Sensor::Hdl32e).unwrap();
    let compared = compare_with_velodyne_decoder((Sensor::Hdl32e, &["HDL32E"]), &calibration, &packets);
    assert!(compared.is_none_or(|compared| compared.points == 872_800));
}

/// There is no recording of packets of an HDL-64E; these are made, with the real calibration of one.
#[test]
fn points_of_an_hdl64e_are_those_of_velodyne_decoder() {
    let Some(path) = recordings("points of velodyne_decoder", "calib/ros_64e_s3-xiesc.yaml") else { return };
    let calibration = Calibration::read(&std::fs::read_to_string(&path).unwrap()).unwrap();
    let calibration = calibration.for_sensor(Sensor::Hdl64e).unwrap();
    let packets: Vec<Vec<u8>> = (0..200).map(hdl64e_packet).collect();
    let arguments = ["HDL64E_S3", path.to_str().unwrap()];
    let compared = compare_with_velodyne_decoder((Sensor::Hdl64e, &arguments), &calibration, &packets);
    assert!(compared.is_none_or(|compared| compared.points == 200 * BLOCKS * RETURNS));
}

/// A packet of ten turns a second, which sees something at 2 to 22 m: beyond 25 m they go on with the correction of near
/// distances, which the manual ends there.
fn hdl64e_packet(number: usize) -> Vec<u8> {
    let blocks = std::array::from_fn::<_, BLOCKS, _>(|block| {
        let firing = 6 * number + block / 2;
        let returns = std::array::from_fn(|place| Return {
            distance: (1000 + (7919 * firing + 613 * block + 97 * place) % 10_000) as u16,
            intensity: place as u8,
        });
        (block % 2 == 1, ((firing as f64 * 20.74) as usize % 36_000) as u16, returns)
    });
    Packet::write(&blocks, Tail([0; 6])).to_vec()
}

/// A point, the angle that its block states, 0.01 degrees, and the step from one such angle to the next.
struct Seen {
    point: Point,
    azimuth: u16,
    step: u16,
}

/// All points of packets.
fn seen(sensor: Sensor, calibration: &Calibration, packets: &[Vec<u8>]) -> Vec<Seen> {
    let points = decode(sensor, calibration, packets);
    let of_packet = |(points, bytes): (Vec<Point>, &Vec<u8>)| {
        let mut azimuths: Vec<u16> = Packet::new(bytes).unwrap().blocks().map(|block| block.azimuth()).collect();
        azimuths.dedup();
        let step = azimuths.windows(2).map(|pair| counts_between(pair[0], pair[1])).min().unwrap();
        let of_point = move |point: Point| {
            let before = |azimuth: &&u16| counts_between(**azimuth, point.azimuth);
            Seen { point, azimuth: *azimuths.iter().min_by_key(before).unwrap(), step }
        };
        points.into_iter().map(of_point).collect::<Vec<_>>()
    };
    points.into_iter().zip(packets).flat_map(of_packet).collect()
}

impl Seen {
    /// Where nebula puts the point, by how many hundredths of a degree clockwise of us, if not where we do. All: the speed
    /// of one firing instead of a packet's mean, none at the end of a packet. VLP-16 with two returns: the second block of
    /// each pair at the angle of the next pair. VLP-32C: one laser after the other every 2.304 us, while by the manual they
    /// fire in pairs. VLS-128: the step to the next block, which is mostly of the same angle, for the speed.
    fn shifts(&self, sensor: Sensor) -> Vec<f32> {
        let turned = f32::from(counts_between(self.azimuth, self.point.azimuth));
        let laser = f32::from(self.point.laser);
        let steps = (self.step.saturating_sub(1)..=self.step + 5).map(f32::from);
        let mut shifts = vec![-turned];
        match sensor {
            Sensor::Vlp16 => shifts.extend(steps.flat_map(|step| {
                let whole = (self.point.time % 110_592) as f32 / 110_592.0;
                [step - turned, (step * whole).round() - turned]
            })),
            Sensor::Vlp32c => {
                let singly = |step: f32| step * laser * 2.304 / 55.296;
                shifts.extend(steps.flat_map(|step| [singly(step).floor() - turned, singly(step).ceil() - turned]));
            }
            Sensor::Vls128 if self.point.laser >= 96 => shifts.extend([-1.0, 1.0]),
            _ => {}
        }
        shifts
    }
}

/// Their cloud of the VLS-128 was made with rotations that were rounded to 0.01 degrees, not with those of their file.
fn rounded(calibration: Calibration) -> Calibration {
    let round = |laser: &Laser| Laser {
        rotation: ((laser.rotation.to_degrees() * 100.0).round() / 100.0).to_radians(),
        ..*laser
    };
    Calibration { lasers: calibration.lasers.iter().map(round).collect(), ..calibration }
}

/// With the offsets of the driver's own file, which are 0.
#[test]
fn points_are_those_of_nebula() {
    for (sensor, name, _) in SENSORS {
        let test = "points of Velodynes";
        let Some(folder) = recordings(test, &format!("packets/{name}")) else { return };
        let Some(packets) = recorded(test, name) else { return };
        let text = std::fs::read_to_string(file(&folder, "yaml")).unwrap();
        let calibration = Calibration::read(&text).unwrap().for_sensor(sensor).unwrap();
        let calibration = if sensor == Sensor::Vls128 { rounded(calibration) } else { calibration };
        let ours = seen(sensor, &calibration, &packets);
        let theirs = points_of_pcd(&file(&folder, "pcd"));
        let compared = compare_with_nebula(sensor, &ours, &theirs);
        compared.report(sensor.name(), "nebula");
        assert_eq!(compared.points, theirs.len());
        assert!(compared.worst <= TOLERANCE, "{compared:?}");
    }
}

fn compare_with_nebula(sensor: Sensor, ours: &[Seen], theirs: &[[f32; 3]]) -> Compared {
    let is_like = |seen: &Seen, [x, y, z]: [f32; 3]| {
        let [a, b, c] = seen.point.position;
        (a.hypot(b) - x.hypot(y)).abs() < TOLERANCE && (c - z).abs() < TOLERANCE
    };
    let starts = |ours: &[Seen]| {
        let first = &theirs[..20];
        first.iter().all(|point| ours.iter().take(60).any(|seen| is_like(seen, *point)))
    };
    let start = (0..ours.len()).find(|start| starts(&ours[*start..])).expect("their scan is in the recording");
    let mut compared = Compared::default();
    let mut at = start;
    for other in theirs {
        // They leave out what is very near, and append the beginning of the next turn in another order.
        let window = at.saturating_sub(1500)..(at + 3000).min(ours.len());
        let near = |index: &usize| is_like(&ours[*index], *other);
        let apart = |index: usize| apart_of(ours[index].point.position, *other);
        let exact = window.clone().filter(near).min_by(|a, b| apart(*a).total_cmp(&apart(*b)));
        let is_explained = |seen: &Seen| {
            let by = |counts: &f32| apart_of(turned(seen.point.position, *counts), *other) <= TOLERANCE;
            seen.shifts(sensor).iter().any(by)
        };
        let (found, is_explained) = match exact {
            Some(index) if apart(index) <= TOLERANCE => (index, false),
            _ => match window.into_iter().find(|index| near(index) && is_explained(&ours[*index])) {
                Some(index) => (index, true),
                None => (exact.unwrap_or(at), false),
            },
        };
        compared.add(apart(found), is_explained);
        at = found;
    }
    compared
}
