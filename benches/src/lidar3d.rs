//! Points decoded a second, and the cost of signatures and of their comparisons.
//!
//! Limits on one core: 20 million points a second, 2 ms a signature, 0.2 us a comparison; of 64 rings of 2000 columns 2 ms an image
//! of a place, 4 ms with its panorama, 4 ms an alignment; of 100,000 places 50 ms the ten most alike, 300 ms an answer.

#[path = "../../lidar3d/tests/support/scan_context.rs"]
mod scan_context;

use std::f32::consts::TAU;
use std::hint::black_box;

use agv_lidar3d::calibration::{Full, Laser};
use agv_lidar3d::cloud::Cloud;
use agv_lidar3d::geometry::Offsets;
use agv_lidar3d::packet::{BLOCKS, Decoder, LENGTH, Model, Packet, RETURNS, Return, Sensor, Tail};
use agv_lidar3d::place::{
    Asked, Enriched, Floor, Histogram, Neighbours, Panorama, Place, PlaceImage, PlaceIndex, Pose, Query,
    RINGS as RING_BINS, Span, Stored, chi_square,
};
use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use scan_context::ScanContext;

const PACKETS: usize = 100;
const RINGS: usize = 64;
const COLUMNS: usize = 2000;

fn packets(sensor: Sensor) -> Vec<[u8; LENGTH]> {
    let packet = |number: usize| {
        let blocks = std::array::from_fn::<_, BLOCKS, _>(|block| {
            let returns = std::array::from_fn::<_, RETURNS, _>(|place| Return {
                distance: (1500 + (number * 7919 + block * 613 + place * 97) % 20_000) as u16,
                intensity: place as u8,
            });
            let azimuth = (18 * (BLOCKS * number + block)) % 36_000;
            (sensor == Sensor::Hdl64e && block % 2 == 1, azimuth as u16, returns)
        });
        Packet::write(&blocks, Tail([0; 6]))
    };
    (0..PACKETS).map(packet).collect()
}

fn decode(criterion: &mut Criterion) {
    let full = Full { distance_x: 0.02, distance_y: 0.03, has_two_points: true, ..Full::default() };
    let lasers: Vec<Laser> = (0..RINGS)
        .map(|number| Laser {
            distance: 0.01,
            elevation: 0.03 - 0.006 * number as f64,
            rotation: 0.01 * (number % 4) as f64,
            vertical_offset: 0.2,
            horizontal_offset: 0.026,
            is_enabled: true,
            full: Some(full),
        })
        .collect();
    let mut group = criterion.benchmark_group("decode");
    group.throughput(Throughput::Elements((PACKETS * BLOCKS * RETURNS) as u64));
    for (name, sensor, two_points) in [
        ("hdl64e", Sensor::Hdl64e, false),
        ("hdl64e_two_points", Sensor::Hdl64e, true),
        ("hdl32e", Sensor::Hdl32e, false),
        ("vlp16", Sensor::Vlp16, false),
    ] {
        let packets = packets(sensor);
        let lasers = &lasers[..sensor.lasers()];
        group.bench_function(name, |bencher| {
            let mut decoder = Decoder::new(
                &Model {
                    sensor,
                    lasers,
                    distance_resolution: sensor.distance_resolution(),
                    offsets: Offsets::Orthogonal,
                    two_points,
                },
                sensor.filter(),
            );
            let mut points = Vec::with_capacity(PACKETS * BLOCKS * RETURNS);
            bencher.iter(|| {
                points.clear();
                for bytes in black_box(&packets) {
                    let packet = Packet::new(bytes).expect("a packet that was written");
                    decoder.packet(&packet, |point| points.push(point.position)).expect("a packet of this sensor");
                }
                points.len()
            });
        });
    }
    group.finish();
}

/// A street: level ground, and walls to both sides.
fn street() -> Vec<Option<[f32; 3]>> {
    let at = |ring: usize, column: usize| {
        let elevation = (2.0 - 0.42 * ring as f32).to_radians();
        let (sin, cos) = (column as f32 * TAU / COLUMNS as f32).sin_cos();
        let to_ground = if elevation < 0.0 { -1.7 / elevation.sin() } else { f32::MAX };
        let to_wall = 8.0 / (sin.abs() * elevation.cos()).max(1e-3);
        let range = to_ground.min(to_wall);
        (range < 80.0).then(|| [range * cos * elevation.cos(), range * sin * elevation.cos(), range * elevation.sin()])
    };
    (0..RINGS).flat_map(|ring| (0..COLUMNS).map(move |column| at(ring, column))).collect()
}

fn signatures(criterion: &mut Criterion) {
    let points = street();
    let cloud = Cloud::new(&points, RINGS).expect("as many points as rings and columns");
    let histogram = Histogram::new(&cloud, &Neighbours::default());
    let enriched = Enriched::new(&cloud, &histogram, 1.7);
    criterion.bench_function("signature/thesis", |bencher| {
        bencher.iter(|| Histogram::new(black_box(&cloud), &Neighbours::default()));
    });
    criterion.bench_function("signature/enriched", |bencher| {
        bencher.iter(|| Enriched::new(black_box(&cloud), &histogram, 1.7));
    });
    criterion.bench_function("compare/chi_square", |bencher| {
        bencher.iter(|| chi_square(black_box(&histogram), black_box(&histogram)));
    });
    criterion.bench_function("compare/enriched", |bencher| {
        bencher.iter(|| black_box(&enriched).distance(black_box(&enriched)));
    });
}

/// Posts beside the street, so that something tells where along it a scan was made.
fn street_with_posts() -> Vec<Option<[f32; 3]>> {
    let mut points = street();
    for (at, point) in points.iter_mut().enumerate() {
        let (ring, column) = (at / COLUMNS, at % COLUMNS);
        if column % 150 < 9 && ring < 40 {
            let elevation = (2.0 - 0.42 * ring as f32).to_radians();
            let (sin, cos) = (column as f32 * TAU / COLUMNS as f32).sin_cos();
            let range = 4.0 + (column / 150 * 7 % 5) as f32;
            *point = Some([range * cos, range * sin, range * elevation.tan()]);
        }
    }
    points
}

fn places(criterion: &mut Criterion) {
    let points = street_with_posts();
    let cloud = Cloud::new(&points, RINGS).expect("as many points as rings and columns");
    let floor = Floor::level(1.7);
    criterion.bench_function("place/floor", |bencher| bencher.iter(|| Floor::find(black_box(&cloud))));
    criterion.bench_function("place/image", |bencher| bencher.iter(|| PlaceImage::new(black_box(&cloud), &floor)));
    criterion.bench_function("place/image_and_panorama", |bencher| {
        bencher.iter(|| {
            (PlaceImage::new(black_box(&cloud), &floor), Panorama::new(black_box(&cloud), &floor, Span::HDL64E))
        });
    });
    criterion.bench_function("place/scan_context", |bencher| bencher.iter(|| ScanContext::new(black_box(&points))));
    let (image, context) = (PlaceImage::new(&cloud, &floor), ScanContext::new(&points));
    criterion.bench_function("compare/image", |bencher| bencher.iter(|| black_box(&image).likeness(black_box(&image))));
    criterion.bench_function("compare/scan_context", |bencher| {
        bencher.iter(|| black_box(&context).distance(black_box(&context)));
    });
    let panorama = Panorama::new(&cloud, &floor, Span::HDL64E);
    let asked = Asked::new(&panorama, cloud.seen().map(|point| floor.levelled(point)));
    criterion.bench_function("place/alignment", |bencher| {
        bencher.iter(|| Stored::new(black_box(&panorama)).align(&asked, &[0.0, std::f32::consts::PI], 6.0));
    });
    fleet(criterion, &image, &panorama);
}

/// The ten of 100,000 places that are most like a scan, and the whole answer, by scans that are whole and with a third hidden.
fn fleet(criterion: &mut Criterion, image: &PlaceImage, panorama: &Panorama) {
    const PLACES: usize = 100_000;
    let bytes = image.to_bytes();
    // Each place has other heights, as none is like another.
    let other = |number: usize| {
        let mut bytes = bytes;
        for (at, byte) in bytes.iter_mut().take(PlaceImage::BYTES - 8).enumerate() {
            *byte = byte.wrapping_add(((number * (at % 97 + 1) * 2_654_435_761) >> 24) as u8);
        }
        PlaceImage::from_bytes(&bytes)
    };
    let others: Vec<PlaceImage> = (0..PLACES).filter_map(other).collect();
    let place =
        |(number, image)| Place { pose: Pose { place: [5.0 * number as f32, 0.0], heading: 0.0 }, image, panorama };
    let index = PlaceIndex::new(others.iter().enumerate().map(place).collect(), 3.0);
    let mut group = criterion.benchmark_group("fleet");
    group.sample_size(10);
    let mut hidden = bytes;
    hidden[..20 * RING_BINS].fill(0);
    let known = u64::from_le_bytes(std::array::from_fn(|at| hidden[PlaceImage::BYTES - 8 + at])) & !((1 << 20) - 1);
    hidden[PlaceImage::BYTES - 8..].copy_from_slice(&known.to_le_bytes());
    let hidden = PlaceImage::from_bytes(&hidden).expect("the bins of hidden sectors are empty");
    for (name, asked) in [("whole", image), ("third_hidden", &hidden)] {
        group.bench_function(format!("ten_most_alike/{name}"), |bencher| {
            bencher.iter(|| index.candidates(black_box(asked)))
        });
        group.bench_function(format!("answer/{name}"), |bencher| {
            bencher.iter(|| {
                index.find(&Query { image: asked, scan: Asked::new(panorama, panorama.points()), earlier: &[] })
            });
        });
    }
}

criterion_group! { name = benches; config = agv_benches::briefly(); targets = decode, signatures, places }
criterion_main!(benches);
