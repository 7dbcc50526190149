//! What a prediction costs a vehicle of each kind, on a way of bends to both sides.

use agv_core::geometry::{Pose, Twist};
use agv_core::localizer::{Event, Localizer, Parameters, PoseFix};
use agv_core::measurement::{EncoderSample, MOST_WHEELS, PoseIncrement, SpeedSample, Time, WheelReading, WheelSample};
use agv_core::odometry::{Contact, Counted, Counter, MOST_COUNTERS, Vehicle, Wheel, WheelBased};
use agv_firmware::board::an500::stopwatch::Stopwatch;
use agv_settings::{VehicleKind, VehicleSettings};
use heapless::Vec;
use static_cell::StaticCell;

use super::{Count, init};

static LOCALIZER: StaticCell<Localizer> = StaticCell::new();

/// Samples that are counted, and their interval, us.
const SAMPLES: u32 = 800;
const INTERVAL: u32 = 10_000;

/// Speed, m/s; the largest turn rate, rad/s, and how fast it changes, rad/s.
const SPEED: f64 = 1.0;
const TURN: f64 = 0.4;
const FREQUENCY: f64 = 1.6;

/// A prediction of each kind with its measures by default, and the other parameters of the log.
#[inline(never)]
pub fn count(stopwatch: &Stopwatch, parameters: &Parameters) -> [Count; VehicleKind::ALL.len()] {
    let mut localizer: Option<&mut Localizer> = None;
    VehicleKind::ALL.map(|kind| {
        let vehicle = VehicleSettings { kind, ..VehicleSettings::default() }.vehicle();
        let new = || Localizer::new(Parameters { vehicle, ..*parameters });
        let localizer = match &mut localizer {
            Some(localizer) => {
                renew(localizer, new);
                localizer
            }
            none => none.insert(init(&LOCALIZER, new)),
        };
        drive(stopwatch, localizer, &vehicle, kind.name())
    })
}

/// The new one is built on the stack, too: see [`init`].
#[inline(never)]
fn renew(localizer: &mut Localizer, new: impl FnOnce() -> Localizer) {
    *localizer = new();
}

fn drive(stopwatch: &Stopwatch, localizer: &mut Localizer, vehicle: &Vehicle, name: &'static str) -> Count {
    let mut count = Count::new(name);
    let fix =
        PoseFix { time: Time::default(), pose: Pose::default(), position_deviation: 0.01, heading_deviation: 1e-3 };
    localizer.handle(&Event::SetPose(fix));
    let mut driven = Driven::new(vehicle);
    for sample in 0..=SAMPLES {
        let event = driven.report(sample);
        let instructions = stopwatch.count(|| {
            localizer.handle(&event);
        });
        // The first report is compared with nothing.
        if sample > 0 {
            count.add(instructions);
        }
    }
    let found = localizer.outputs().pose.pose;
    let off = libm::hypot(found.x - driven.pose.x, found.y - driven.pose.y);
    assert!(off < 0.01, "{name} is {off} m off");
    count
}

/// A vehicle on its way, and what it reports.
struct Driven<'a> {
    vehicle: &'a Vehicle,
    counters: Vec<Counter, MOST_COUNTERS>,
    wheels: Vec<Wheel, MOST_WHEELS>,
    /// How far each wheel has turned, m.
    ways: [f64; MOST_WHEELS],
    pose: Pose,
}

impl<'a> Driven<'a> {
    fn new(vehicle: &'a Vehicle) -> Self {
        let wheels = match vehicle {
            Vehicle::Tricycle(tricycle) => tricycle.wheels().into_iter().collect(),
            Vehicle::Wheels(vehicle) => vehicle.wheels().as_ref().iter().copied().collect(),
            Vehicle::Ackermann(_) | Vehicle::Increments | Vehicle::TricycleSpeed(_) => Vec::new(),
        };
        Self { vehicle, counters: vehicle.counters(), wheels, ways: [0.0; MOST_WHEELS], pose: Pose::default() }
    }

    /// Drives to the next sample, and reports.
    fn report(&mut self, sample: u32) -> Event<'static> {
        let time = Time::from_micros(u64::from(sample * INTERVAL));
        let (turn, middle) = (turn_rate(f64::from(sample)), turn_rate(f64::from(sample) - 0.5));
        let interval = if sample == 0 { 0.0 } else { 1e-6 * f64::from(INTERVAL) };
        for (way, wheel) in self.ways.iter_mut().zip(&self.wheels) {
            *way += rolling_speed(wheel, middle) * interval;
        }
        let displacement = Pose::exp(&Twist { x: SPEED * interval, y: 0.0, theta: middle * interval });
        self.pose = self.pose.compose(&displacement);
        match self.vehicle {
            Vehicle::Increments => Event::Increment(PoseIncrement { time, displacement }),
            Vehicle::Ackermann(car) => {
                Event::Speed(SpeedSample { time, speed: SPEED, steering: steering(car.wheelbase, turn) })
            }
            Vehicle::TricycleSpeed(tricycle) => {
                let across = tricycle.wheelbase * turn;
                let speed = libm::sqrt(SPEED * SPEED + across * across);
                Event::Speed(SpeedSample { time, speed, steering: steering(tricycle.wheelbase, turn) })
            }
            Vehicle::Tricycle(_) => {
                let WheelReading { count: drive, steering } = self.readings(time, turn).wheels[0];
                Event::Encoders(EncoderSample { time, drive, steering })
            }
            Vehicle::Wheels(_) => Event::Wheels(self.readings(time, turn)),
        }
    }

    fn readings(&self, time: Time, turn: f64) -> WheelSample {
        let mut sample = WheelSample { time, wheels: [WheelReading::default(); MOST_WHEELS] };
        for counter in &self.counters {
            let shown = match counter.counted {
                Counted::Turn => self.ways[counter.wheel],
                Counted::Steering => steering(self.wheels[counter.wheel].x, turn),
            };
            sample.set_count(counter, counter.range.wrap(libm::round(shown / counter.scale) as i64));
        }
        sample
    }
}

/// Turn rate after so many samples, rad/s.
fn turn_rate(samples: f64) -> f64 {
    TURN * libm::sin(FREQUENCY * 1e-6 * f64::from(INTERVAL) * samples)
}

/// Angle of a wheel so far ahead of R, m, that does not slip, rad.
fn steering(ahead: f64, turn: f64) -> f64 {
    libm::atan2(ahead * turn, SPEED)
}

/// How fast a wheel rolls, m/s.
fn rolling_speed(wheel: &Wheel, turn: f64) -> f64 {
    let (x, y) = (SPEED - turn * wheel.y, turn * wheel.x);
    if wheel.steering.is_some() {
        return libm::sqrt(x * x + y * y);
    }
    let (sine, cosine) = libm::sincos(wheel.heading);
    let along = x * cosine + y * sine;
    match wheel.contact {
        Contact::Tyre => along,
        Contact::Rollers(angle) => along + (y * cosine - x * sine) * libm::tan(angle),
    }
}
