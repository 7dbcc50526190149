//! Counts the instructions of everything that the localiser does, on the drive `drive.agvlog` of the emulating machine's
//! folder, and writes them to `instructions.csv`. The emulator must run with `-icount shift=6,sleep=off`.
#![no_std]
#![no_main]

mod contours;
mod monitor;
mod search;
mod vehicles;

use core::fmt::Write;
use core::panic::PanicInfo;

use agv_core::geometry::Point;
use agv_core::localizer::{Event, Localize, Localizer, MapUse, Parameters, SlamCapacities};
use agv_core::maps::{DynamicMap, FixedMap, Landmark, LandmarkKind, NearestNeighbour};
use agv_core::measurement::{Reflectors, Scan, Time};
use agv_core::record::Record;
use agv_core::sensing::{Keypoint, PointScan, falko};
use agv_firmware::board::an500::host_file::HostFile;
use agv_firmware::board::an500::log_file::LogBuffer;
use agv_firmware::board::an500::panic;
use agv_firmware::board::an500::stopwatch::Stopwatch;
use agv_wire::cola::{Deframed, Deframer, Dialect, Sequence};
use agv_wire::nav350::{
    Answer, Channel, ChannelName, DeviceTime, ErrorCode, MethodResult, Milliangle, NavigationData, Revolution,
    SensorClock, SensorFrame,
};
use cortex_m_semihosting::{debug, hprintln};
use heapless::{String, Vec};
use static_cell::{ConstStaticCell, StaticCell};

use contours::Contours;

#[panic_handler]
fn on_panic(info: &PanicInfo) -> ! {
    panic::report(info)
}

/// Instructions of one kind of work.
#[derive(Clone, Copy)]
struct Count {
    name: &'static str,
    runs: u64,
    total: u64,
    most: u64,
}

impl Count {
    const fn new(name: &'static str) -> Self {
        Self { name, runs: 0, total: 0, most: 0 }
    }

    fn add(&mut self, instructions: u64) {
        self.runs += 1;
        self.total += instructions;
        self.most = self.most.max(instructions);
    }
}

impl core::fmt::Display for Count {
    fn fmt(&self, formatter: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        let mean = self.total / self.runs.max(1);
        write!(formatter, "{},{},{},{}", self.name, self.runs, mean, self.most)
    }
}

/// What is counted.
struct Counts {
    prediction: Count,
    reflector: Count,
    scan: Count,
    slam: Count,
    behind: Count,
    blind: Count,
    falko: Count,
    association: Count,
    map_update: Count,
}

impl Counts {
    const fn new() -> Self {
        Self {
            prediction: Count::new("prediction"),
            reflector: Count::new("one reflector update"),
            scan: Count::new("scan cycle"),
            slam: Count::new("scan cycle with landmarks and key scans in the state"),
            behind: Count::new("scan cycle with contours of the way behind"),
            blind: Count::new("scan cycle by laser odometry with all solutions"),
            falko: Count::new("falko on 1440 beams"),
            association: Count::new("association among 1000 reflectors"),
            map_update: Count::new("dynamic map update of 20 keypoints"),
        }
    }
}

static BUFFER: ConstStaticCell<LogBuffer> = ConstStaticCell::new(LogBuffer::new());
static LOCALIZER: StaticCell<Localizer<SlamCapacities>> = StaticCell::new();
static SLAM: StaticCell<Localizer<SlamCapacities>> = StaticCell::new();
static BEHIND: StaticCell<Localizer> = StaticCell::new();
static BLIND: StaticCell<Localizer> = StaticCell::new();
static POINTS: ConstStaticCell<PointScan<1440>> = ConstStaticCell::new(PointScan::new());
static DETECTOR: StaticCell<falko::Detector<1440>> = StaticCell::new();
static MAP: StaticCell<FixedMap<1000>> = StaticCell::new();
static DYNAMIC: StaticCell<DynamicMap<256>> = StaticCell::new();

#[cortex_m_rt::entry]
fn main() -> ! {
    let mut input = HostFile::open(c"drive.agvlog").expect("drive.agvlog is in the folder");
    let stopwatch = Stopwatch::new();
    let mut counts = Counts::new();
    let mut localizer: Option<&mut Localizer<SlamCapacities>> = None;
    let mut slam: Option<&mut Localizer<SlamCapacities>> = None;
    let mut behind: Option<&mut Localizer> = None;
    let mut blind: Option<&mut Localizer> = None;
    let mut detector: Option<&mut falko::Detector<1440>> = None;
    let mut kept: Option<Contours> = None;
    let mut believed: Option<Parameters> = None;
    let points = POINTS.take();
    let map = MAP.init_with(FixedMap::new);
    map.extend(&thousand_reflectors()).expect("a thousand reflectors fit");
    let dynamic = DYNAMIC.init_with(|| DynamicMap::new(agv_core::maps::DynamicMapParameters::default()));
    BUFFER
        .take()
        .for_each(&mut input, |record| match (record, &mut localizer) {
            (Record::Header(header), None) => {
                let mut parameters = *header.parameters;
                // A revolution that is told reflector by reflector would be many for the solutions; they are counted apart.
                parameters.protection = false;
                localizer = Some(init(&LOCALIZER, || Localizer::new(parameters)));
                believed = Some(parameters);
                parameters.maps = MapUse { reflectors: false, features: false, dynamic: false, slam: true };
                slam = Some(init(&SLAM, || Localizer::new(parameters)));
                behind = Some(init(&BEHIND, || Localizer::new(parameters)));
                blind = Some(init(&BLIND, || {
                    let maps = MapUse { reflectors: true, slam: false, ..parameters.maps };
                    Localizer::new(Parameters { maps, protection: true, ..parameters })
                }));
                kept = Some(Contours::new(&parameters));
                detector = Some(DETECTOR.init_with(|| falko::Detector::new(header.parameters.features.detector)));
            }
            (Record::Landmarks(landmarks), Some(localizer)) => {
                localizer.add_landmarks(landmarks).expect("the map has room for the landmarks");
                if let Some(blind) = &mut blind {
                    blind.add_landmarks(landmarks).expect("the map has room for the landmarks");
                }
            }
            (Record::Event(event), Some(localizer)) => {
                if let (Event::Scan(scan), Some(detector)) = (event, &mut detector) {
                    features(&stopwatch, &mut counts, scan, points, detector, dynamic);
                }
                handle(&stopwatch, &mut counts, localizer, event);
                if let Some(kept) = &mut kept {
                    kept.handle(&stopwatch, event);
                }
                if let (Some(slam), Some(behind), Some(blind)) = (&mut slam, &mut behind, &mut blind) {
                    count_scan(&stopwatch, &mut counts.slam, *slam, event);
                    if !matches!(event, Event::Reflectors(_)) {
                        count_scan(&stopwatch, &mut counts.blind, *blind, event);
                    }
                    count_scan(&stopwatch, &mut counts.behind, *behind, event);
                }
            }
            _ => {}
        })
        .expect("the log can be read");
    associate(&stopwatch, &mut counts, map);
    let predictions = vehicles::count(&stopwatch, &believed.expect("the log has a header"));
    write_table(&stopwatch, counts, kept.expect("the log has a header"), map, &predictions);
    debug::exit(debug::EXIT_SUCCESS);
    loop {
        cortex_m::asm::wfi();
    }
}

/// Values as large as a localiser are built on the stack, which has no room for two of them: each in a frame of its own.
#[inline(never)]
fn init<T>(cell: &'static StaticCell<T>, new: impl FnOnce() -> T) -> &'static mut T {
    cell.init_with(new)
}

/// Counts what needs no drive, and writes `instructions.csv`.
fn write_table(stopwatch: &Stopwatch, counts: Counts, kept: Contours, map: &mut FixedMap<1000>, predictions: &[Count]) {
    let mut text: String<4096> = String::new();
    let mut output = HostFile::create(c"instructions.csv").expect("the folder can be written");
    writeln!(text, "work,runs,mean,most").expect("the table fits");
    let Counts { prediction, reflector, scan, slam, behind, blind, falko, association, map_update } = counts;
    let [few, many] = search::count(stopwatch, map);
    let [in_map, slice, whole] = kept.counts();
    let of_monitor = monitor::count(stopwatch);
    let costs = [
        prediction,
        reflector,
        association,
        falko,
        map_update,
        scan,
        slam,
        behind,
        blind,
        decode(stopwatch),
        few,
        many,
    ];
    for count in costs.into_iter().chain(of_monitor).chain([in_map, slice, whole]) {
        writeln!(text, "{count}").expect("the table fits");
    }
    for count in predictions {
        writeln!(text, "prediction of {count}").expect("the table fits");
    }
    hprintln!("{}", text);
    output.write(text.as_bytes()).expect("the folder can be written");
}

/// Lets a localiser take an event, and counts it if it is a scan.
fn count_scan(stopwatch: &Stopwatch, scans: &mut Count, localizer: &mut impl Localize, event: &Event) {
    let count = stopwatch.count(|| {
        localizer.handle(event);
    });
    if matches!(event, Event::Scan(_)) {
        scans.add(count);
    }
}

/// Counts one event; reflectors one by one, as each is an update of its own.
fn handle(stopwatch: &Stopwatch, counts: &mut Counts, localizer: &mut Localizer<SlamCapacities>, event: &Event) {
    let mut count = |event: &Event| {
        stopwatch.count(|| {
            localizer.handle(event);
        })
    };
    match event {
        Event::Encoders(_) => counts.prediction.add(count(event)),
        Event::Scan(_) => counts.scan.add(count(event)),
        Event::Reflectors(reflectors) => {
            for observation in reflectors.observations {
                let one = Reflectors::of_first(core::slice::from_ref(observation));
                counts.reflector.add(count(&Event::Reflectors(one)));
            }
        }
        _ => {
            count(event);
        }
    }
}

fn features(
    stopwatch: &Stopwatch,
    counts: &mut Counts,
    scan: &Scan,
    points: &mut PointScan<1440>,
    detector: &mut falko::Detector<1440>,
    dynamic: &mut DynamicMap<256>,
) {
    let mut keypoints: Vec<Keypoint, 128> = Vec::new();
    points.set(scan, 0.5, 30.0);
    counts.falko.add(stopwatch.count(|| {
        detector.detect(points, &mut keypoints);
    }));
    let count = stopwatch.count(|| {
        for keypoint in keypoints.iter().take(20) {
            let position = Point::new(f64::from(keypoint.position.x), f64::from(keypoint.position.y));
            let known = dynamic.near(position, 0.3).next().map(|landmark| landmark.id);
            match known {
                Some(id) => dynamic.update(id, position),
                None => dynamic.insert(LandmarkKind::Corner, position),
            }
        }
        dynamic.finish();
    });
    if keypoints.len() >= 20 {
        counts.map_update.add(count);
    }
}

/// Reflectors in a grid that is not quite regular.
fn thousand_reflectors() -> Vec<Landmark, 1000> {
    (0..1000_u16)
        .map(|id| Landmark {
            id,
            kind: LandmarkKind::Reflector,
            x: f64::from(id % 40) * 2.3,
            y: f64::from(id / 40) * 2.9 + f64::from(id % 3) * 0.4,
            deviation: 0.002,
        })
        .collect()
}

fn associate(stopwatch: &Stopwatch, counts: &mut Counts, map: &FixedMap<1000>) {
    for step in 0..100 {
        let place = Point::new(f64::from(step) * 0.9, f64::from(step) * 0.7);
        counts.association.add(stopwatch.count(|| {
            let mut nearest = NearestNeighbour::default();
            for landmark in map.near(place, 1.5) {
                let (x, y) = (landmark.x - place.x, landmark.y - place.y);
                nearest.consider(landmark.id, (x * x + y * y) * 1e3);
            }
            core::hint::black_box(nearest.decide(11.8, 9.0));
        }));
    }
}

static TELEGRAM: ConstStaticCell<[u8; 16_384]> = ConstStaticCell::new([0; 16_384]);
static DEFRAMER: StaticCell<Deframer> = StaticCell::new();
static REVOLUTION: StaticCell<Revolution> = StaticCell::new();

/// From the bytes of one answer with 1440 beams in CoLa-B to a revolution in metres.
fn decode(stopwatch: &Stopwatch) -> Count {
    let mut ranges = [0; 1440];
    for (beam, range) in ranges.iter_mut().enumerate() {
        *range = 500 + (beam as u32 * 7919) % 65_000;
    }
    let distances = Channel {
        name: ChannelName::DISTANCE,
        scale: 1.0,
        offset: 0.0,
        first: Milliangle(0),
        resolution: 250,
        start: DeviceTime(1000),
        samples: Sequence::Values(&ranges),
    };
    let answer = Answer::Result(MethodResult::Data(NavigationData {
        version: 1,
        error: ErrorCode::OK,
        wait: 1,
        mask: 2,
        pose: None,
        reflectors: None,
        channels: [distances].into_iter().collect(),
        remission: None,
    }));
    let buffer = TELEGRAM.take();
    let length = answer.encode(Dialect::Binary, buffer).expect("the telegram fits");
    let telegram = &buffer[..length];
    let mut clock = SensorClock::new();
    let now = Time::from_micros(10_000_000);
    clock.record(now, now, DeviceTime(1000)).expect("the exchange is good");
    let deframer = DEFRAMER.init_with(Deframer::new);
    let revolution = REVOLUTION.init_with(Revolution::new);
    let mut count = Count::new("nav350 answer with 1440 beams");
    for _ in 0..3 {
        count.add(stopwatch.count(|| {
            deframer.extend(telegram);
            let Some(Deframed::Telegram { dialect, payload, .. }) = deframer.next() else {
                panic!("the telegram is whole")
            };
            let Ok(Answer::Result(MethodResult::Data(data))) = Answer::decode(dialect, payload) else {
                panic!("the telegram can be read")
            };
            revolution.take(&data, &clock, &SensorFrame::default()).expect("the telegram makes a revolution");
        }));
    }
    assert_eq!(revolution.scan().map(|scan| scan.ranges.len()), Some(1440));
    count
}
