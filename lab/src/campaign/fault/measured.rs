//! Faults of what the sensors measure and of the vehicle itself.

use agv_core::geometry::{Point, wrap};
use agv_core::measurement::{EncoderSample, ReflectorObservation, Time};
use agv_core::odometry::{Counted, Counter, CounterRange, Tricycle, Vehicle};

use super::counting::{CountState, SLOWLY};
use super::laser_state::LaserState;
use super::ranging::WARMS;
use super::tilt::Tilt;
use super::{Encoder, Fault, FaultKind, ViewError};
use agv_host_sim::recording::{RecordedEvent, RecordedScan, Recording};
use agv_host_sim::simulate::START;
use agv_host_sim::simulate::random::Random;

impl Fault {
    /// Makes what the sensors have seen on a drive wrong. `tricycle` is the true one. Of a vehicle with several wheels the
    /// first wheel is at fault, and the first that steers.
    pub fn spoil(&self, recording: &mut Recording, tricycle: &Tricycle, random: &mut Random) {
        let counters = recording.parameters.vehicle.counters();
        if let FaultKind::Kidnapped { seconds } = self.what {
            kidnap(recording, self.from, seconds, &counters);
        }
        let of = |counted| counters.iter().find(|counter| counter.counted == counted).copied();
        let (drive, steering) = (of(Counted::Turn), of(Counted::Steering));
        let offset = match recording.parameters.vehicle {
            Vehicle::Tricycle(_) => tricycle.steering_offset_forward,
            _ => 0.0,
        };
        let mut encoders = EncoderFaultState::default();
        let mut laser = LaserState::new(self.what, recording, random);
        for event in &mut recording.events {
            match event {
                RecordedEvent::Encoders(EncoderSample { time, drive: turn, steering: angle }) => {
                    let time = time.since(START);
                    drive.inspect(|counter| self.spoil_drive(turn, time, counter, &mut encoders, random));
                    steering
                        .inspect(|counter| self.spoil_steering(angle, time, (counter, offset), &mut encoders, random));
                }
                RecordedEvent::Wheels(sample) => {
                    let time = sample.time.since(START);
                    if let Some(counter) = &drive {
                        let mut turn = sample.count(counter);
                        self.spoil_drive(&mut turn, time, counter, &mut encoders, random);
                        sample.set_count(counter, turn);
                    }
                    if let Some(counter) = &steering {
                        let mut angle = sample.count(counter);
                        self.spoil_steering(&mut angle, time, (counter, offset), &mut encoders, random);
                        sample.set_count(counter, angle);
                    }
                }
                RecordedEvent::Reflectors(seen) => {
                    let Some(first) = seen.observations.first() else { continue };
                    let time = first.time.since(START);
                    if self.is_active(time) {
                        self.spoil_reflectors(&mut seen.observations, time, &mut laser, random);
                    }
                }
                RecordedEvent::Scan(scan) if self.is_active(scan.start.since(START)) => {
                    self.spoil_scan(scan, &mut laser, random);
                }
                _ => {}
            }
        }
    }

    fn spoil_scan(&self, scan: &mut RecordedScan, laser: &mut LaserState, random: &mut Random) {
        let time = scan.start.since(START);
        let returns = |scan: &mut RecordedScan, change: &mut dyn FnMut(f64, &mut f32)| {
            for (beam, range) in scan.ranges.iter_mut().enumerate().filter(|(_, range)| **range > 0.0) {
                change((scan.first_bearing + beam as f64 * scan.bearing_step).to_degrees(), range);
            }
        };
        match self.what {
            FaultKind::LaserShaken { deg } => scan.first_bearing += deg.to_radians() * random.normal(),
            FaultKind::RangesLong { metres } => returns(scan, &mut |_, range| *range += metres as f32),
            FaultKind::RangesWander { metres, seconds } => {
                let error = laser.wandering(metres, seconds, revolution_of(time), random);
                returns(scan, &mut |_, range| *range = (*range + error as f32).max(0.1));
            }
            FaultKind::BearingsWander { deg, seconds } => {
                scan.first_bearing += laser.wandering(deg, seconds, revolution_of(time), random).to_radians();
            }
            FaultKind::LaserTilted { deg, towards_deg, height } => Tilt::new(deg, towards_deg, height).spoil_scan(scan),
            FaultKind::SunShines { towards_deg, half_width_deg } => {
                let Some(sensor) = laser.sensor(scan.start) else { return };
                let middle = towards_deg - sensor.theta.to_degrees();
                returns(scan, &mut |bearing, range| {
                    if is_behind(bearing, middle - half_width_deg, middle + half_width_deg) {
                        *range = 0.0;
                    }
                });
            }
            FaultKind::RangesOff { how, size } if how.is_of_surfaces() => {
                let grown = self.grown(time, WARMS);
                returns(scan, &mut |bearing, range| {
                    let at = (f64::from(*range), wrap(bearing.to_radians()));
                    *range = (at.0 + how.error(size, at, grown, false)).max(0.1) as f32;
                });
            }
            FaultKind::BearingsOff { how, deg } => {
                let number = number_of(time);
                let (first, last) =
                    (how.error(deg, -std::f64::consts::PI, number), how.error(deg, std::f64::consts::PI, number));
                scan.first_bearing += first.to_radians();
                scan.bearing_step += (last - first).to_radians() / scan.ranges.len().max(1) as f64;
            }
            FaultKind::ViewOff { how, size } => {
                let number = number_of(time);
                returns(scan, &mut |bearing, range| {
                    if how.hides(size, (f64::from(*range), bearing.to_radians()), number) {
                        *range = 0.0;
                    } else if how == ViewError::Fog && random.happens(size) {
                        *range = ViewError::fog(random) as f32;
                    }
                });
            }
            FaultKind::RangesNoisy { metres } => {
                returns(scan, &mut |_, range| *range = (*range + (metres * random.normal()) as f32).max(0.1));
            }
            FaultKind::WindowDirty { from_deg, to_deg, share } => returns(scan, &mut |bearing, range| {
                if is_behind(bearing, from_deg, to_deg) && random.happens(share) {
                    *range = 0.0;
                }
            }),
            _ => {}
        }
    }

    fn spoil_drive(
        &self,
        count: &mut u32,
        time: f64,
        counter: &Counter,
        state: &mut EncoderFaultState,
        random: &mut Random,
    ) {
        if let FaultKind::CountsOff { of: Encoder::Drive, how, size } = self.what {
            if self.is_active(time) {
                how.spoil(size, count, (time, self.grown(time, SLOWLY)), (counter, 0.0), &mut state.counts, random);
            } else {
                state.counts.go_on(count, counter);
            }
            return;
        }
        let true_drive = *count;
        let moved = state.true_drive.map_or(0, |before| counter.range.step(before, true_drive));
        state.true_drive = Some(true_drive);
        let is_active = self.is_active(time);
        let begins = is_active && !std::mem::replace(&mut state.was_active, is_active);
        match self.what {
            FaultKind::DriveFrozen if is_active => *count = *state.frozen_drive.get_or_insert(*count),
            FaultKind::DriveJumps { ticks } => state.drive += if begins { ticks as f64 } else { 0.0 },
            FaultKind::DriveReversed if is_active => state.drive -= 2.0 * moved as f64,
            FaultKind::WheelSpins { share } if is_active => state.drive += share * moved as f64,
            FaultKind::WheelSlides { share } if is_active => state.drive -= share * moved as f64,
            _ => {}
        }
        *count = shifted(*count, libm::round(state.drive) as i64, counter.range);
    }

    /// `offset` is what the true angle is more than the told one, rad.
    fn spoil_steering(
        &self,
        count: &mut u32,
        time: f64,
        (counter, offset): (&Counter, f64),
        state: &mut EncoderFaultState,
        random: &mut Random,
    ) {
        let Counter { range, scale, .. } = *counter;
        if let FaultKind::CountsOff { of: Encoder::Steering, how, size } = self.what {
            let (ticks, values) = (i64::from(*count), range.values() as i64);
            let angle = if ticks > values / 2 { ticks - values } else { ticks } as f64 * scale + offset;
            if self.is_active(time) {
                how.spoil(size, count, (time, self.grown(time, SLOWLY)), (counter, angle), &mut state.counts, random);
            } else {
                state.counts.go_on(count, counter);
            }
            return;
        }
        if !self.is_active(time) {
            return;
        }
        match self.what {
            FaultKind::SteeringFrozen => *count = *state.frozen_steering.get_or_insert(*count),
            FaultKind::SteeringReversed => *count = count.wrapping_neg() & last_value(range),
            FaultKind::SlipInBends { share } => {
                let ticks = i64::from(*count);
                let values = range.values() as i64;
                let signed = if ticks > values / 2 { ticks - values } else { ticks };
                let angle = signed as f64 * scale + offset;
                let told = libm::atan((1.0 + share) * libm::tan(angle));
                *count = shifted(*count, libm::round((told - angle) / scale) as i64, range);
            }
            FaultKind::SteeringJumps { deg } | FaultKind::SteeringBent { deg } => {
                *count = shifted(*count, libm::round(deg.to_radians() / scale) as i64, range);
            }
            _ => {}
        }
    }

    fn spoil_reflectors(
        &self,
        seen: &mut Vec<ReflectorObservation>,
        time: f64,
        laser: &mut LaserState,
        random: &mut Random,
    ) {
        match self.what {
            FaultKind::WindowDirty { from_deg, to_deg, share } => seen.retain(|observation| {
                let bearing = f64::from(observation.bearing).to_degrees();
                !(is_behind(bearing, from_deg, to_deg) && random.happens(share))
            }),
            FaultKind::PeopleAround { share } => seen.retain(|_| !random.happens(share)),
            FaultKind::FalseReflectors { count } => {
                for _ in 0..count {
                    let (bearing, range) = (random.between(-3.1, 3.1), random.between(1.0, 25.0));
                    add(seen, bearing, range);
                }
            }
            FaultKind::Mirror { deg, distance } => {
                let images: Vec<Point> = images(seen, deg, distance);
                for image in images {
                    add(seen, libm::atan2(image.y, image.x), image.norm());
                }
            }
            FaultKind::PeopleShine { .. } => {
                for point in laser.people(time) {
                    add(seen, libm::atan2(point.y, point.x), point.norm());
                }
            }
            FaultKind::ViewOff { how, size } => spoil_view(seen, how, size, number_of(time), laser, random),
            FaultKind::ReflectorsGone { .. } => seen.retain(|observation| !laser.is_chosen(observation)),
            FaultKind::SunShines { towards_deg, half_width_deg } => {
                let sensor = seen.first().and_then(|first| laser.sensor(first.time));
                if let Some(sensor) = sensor.filter(|_| half_width_deg > 0.0) {
                    dazzle(seen, towards_deg - sensor.theta.to_degrees(), half_width_deg, random);
                }
            }
            _ => {}
        }
        self.falsify(seen, time, laser, random);
        seen.sort_by_key(|observation| observation.time);
    }

    /// Makes ranges and bearings of all reflectors false.
    fn falsify(&self, seen: &mut [ReflectorObservation], time: f64, laser: &mut LaserState, random: &mut Random) {
        match self.what {
            FaultKind::LaserTurned { deg } => turn(seen, -deg.to_radians()),
            FaultKind::LaserTurns { deg, seconds } => turn(seen, -deg.to_radians() * self.grown(time, seconds)),
            FaultKind::LaserShaken { deg } => turn(seen, deg.to_radians() * random.normal()),
            FaultKind::LaserShifted { x, y } => {
                for observation in seen.iter_mut() {
                    set_position(observation, &(position(observation) - Point::new(x, y)));
                }
            }
            FaultKind::RangesOff { how, size } => {
                let grown = self.grown(time, WARMS);
                for observation in seen.iter_mut() {
                    how.spoil(size, observation, grown, laser.is_chosen(observation));
                }
            }
            FaultKind::BearingsOff { how, deg } => {
                for observation in seen.iter_mut() {
                    let bearing = f64::from(observation.bearing);
                    let error = how.error(deg, bearing, number_of(time)).to_radians();
                    observation.bearing = wrap(bearing + error) as f32;
                }
            }
            FaultKind::RangesLong { metres } => {
                for observation in seen.iter_mut() {
                    observation.range += metres as f32;
                }
            }
            FaultKind::RangesNoisy { metres } => {
                for observation in seen.iter_mut() {
                    observation.range = (observation.range + (metres * random.normal()) as f32).max(0.1);
                }
            }
            FaultKind::RangesWander { metres, seconds } => {
                let error = laser.wandering(metres, seconds, revolution_of(time), random);
                for observation in seen.iter_mut() {
                    observation.range = (observation.range + error as f32).max(0.1);
                }
            }
            FaultKind::BearingsWander { deg, seconds } => {
                turn(seen, laser.wandering(deg, seconds, revolution_of(time), random).to_radians());
            }
            FaultKind::LaserTilted { deg, towards_deg, height } => {
                let tilt = Tilt::new(deg, towards_deg, height);
                for observation in seen.iter_mut() {
                    set_position(observation, &tilt.seen(&position(observation)));
                }
            }
            _ => {}
        }
    }
}

/// Makes wrong what the revolution of that number has seen.
fn spoil_view(
    seen: &mut Vec<ReflectorObservation>,
    how: ViewError,
    size: f64,
    number: u64,
    laser: &mut LaserState,
    random: &mut Random,
) {
    let added = how.added(size, seen, random);
    // What hides all leaves the last one, which tells the time of the revolution.
    let last = seen.last().copied();
    seen.retain(|one| !how.hides(size, (f64::from(one.range), f64::from(one.bearing)), number));
    if seen.is_empty() {
        seen.extend(last);
    }
    match how {
        ViewError::Fog => {
            for one in seen.iter_mut() {
                if random.happens(size) {
                    one.range = ViewError::fog(random) as f32;
                }
            }
        }
        ViewError::Repeats => laser.repeat(seen, random.happens(size)),
        ViewError::HalfHidden => {
            for one in seen.iter_mut().filter(|one| laser.is_chosen(one)) {
                one.bearing = wrap(f64::from(one.bearing) + size / f64::from(one.range).max(0.1)) as f32;
            }
        }
        _ => {}
    }
    for (bearing, range) in added {
        add(seen, bearing, range);
    }
}

/// The sun in a direction, deg: reflectors within so much to either side are not seen, and a false one is.
fn dazzle(seen: &mut Vec<ReflectorObservation>, middle: f64, half_width_deg: f64, random: &mut Random) {
    let (from, to) = (middle - half_width_deg, middle + half_width_deg);
    let false_one = (wrap(random.between(from, to).to_radians()), random.between(2.0, 25.0));
    // The sun does not take the last one, which tells the time of the revolution.
    let mut last = seen.last().copied();
    seen.retain(|observation| !is_behind(f64::from(observation.bearing).to_degrees(), from, to));
    if let Some(last) = last.take_if(|_| seen.is_empty()) {
        seen.push(last);
    }
    add(seen, false_one.0, false_one.1);
}

/// Images of reflectors behind a mirror at a distance, m, in a direction, deg, as far as they can be seen, m in S.
fn images(seen: &[ReflectorObservation], deg: f64, distance: f64) -> Vec<Point> {
    let (sine, cosine) = libm::sincos(deg.to_radians());
    let normal = Point::new(cosine, sine);
    seen.iter()
        .map(position)
        .filter(|point| point.dot(&normal) < distance)
        .map(|point| point + normal * (2.0 * (distance - point.dot(&normal))))
        .filter(|image| image.norm() < FARTHEST)
        .collect()
}

/// What the encoders' faults remember.
#[derive(Default)]
struct EncoderFaultState {
    true_drive: Option<u32>,
    frozen_drive: Option<u32>,
    frozen_steering: Option<u32>,
    was_active: bool,
    /// What the counter of the driving wheel has too much, ticks.
    drive: f64,
    counts: CountState,
}

/// Whether a bearing lies in a sector of the window, all in degrees.
fn is_behind(bearing: f64, from: f64, to: f64) -> bool {
    (bearing - from).rem_euclid(360.0) <= (to - from).rem_euclid(360.0)
}

/// A laser sees no reflector farther away, m.
pub(super) const FARTHEST: f64 = 30.0;

fn last_value(range: CounterRange) -> u32 {
    (range.values() - 1) as u32
}

/// A count with so many ticks more.
pub(super) fn shifted(counter: u32, ticks: i64, range: CounterRange) -> u32 {
    (i64::from(counter) + ticks).rem_euclid(range.values() as i64) as u32
}

fn turn(seen: &mut [ReflectorObservation], angle: f64) {
    for observation in seen {
        observation.bearing = wrap(f64::from(observation.bearing) + angle) as f32;
    }
}

fn position(observation: &ReflectorObservation) -> Point {
    let (sine, cosine) = libm::sincos(f64::from(observation.bearing));
    Point::new(cosine, sine) * f64::from(observation.range)
}

fn set_position(observation: &mut ReflectorObservation, point: &Point) {
    observation.bearing = libm::atan2(point.y, point.x) as f32;
    observation.range = point.norm() as f32;
}

/// Adds an observation at the time at which the beam of this revolution looks there.
fn add(seen: &mut Vec<ReflectorObservation>, bearing: f64, range: f64) {
    let Some(first) = seen.first().copied() else { return };
    let time = first.time.offset((bearing - f64::from(first.bearing)).max(0.0) / std::f64::consts::TAU * REVOLUTION);
    seen.push(ReflectorObservation { time, bearing: wrap(bearing) as f32, range: range as f32 });
}

/// Time of a revolution, s.
const REVOLUTION: f64 = 0.125;

/// How many revolutions were over then, s.
fn revolutions_until(time: f64) -> f64 {
    libm::floor(time / REVOLUTION + 1e-6)
}

/// When the revolution began that was under way then, s.
fn revolution_of(time: f64) -> f64 {
    REVOLUTION * revolutions_until(time)
}

/// The number of the revolution that was under way then, s.
fn number_of(time: f64) -> u64 {
    revolutions_until(time) as u64
}

/// A counter of which a part is cut out.
#[derive(Clone, Copy, Default)]
struct CutCounter {
    last: Option<u32>,
    ticks: i64,
}

impl CutCounter {
    /// Takes what it shows, and changes what it shows behind the cut; a steering angle is where it is.
    fn hear(&mut self, count: &mut u32, counter: &Counter, is_before: bool, is_behind: bool) {
        if counter.counted == Counted::Steering {
            return;
        }
        if is_behind {
            *count = shifted(*count, -self.ticks, counter.range);
        } else if is_before {
            self.last = Some(*count);
        } else if let Some(last) = &mut self.last {
            self.ticks += counter.range.step(*last, *count);
            *last = *count;
        }
    }
}

/// Cuts `seconds` out of a drive: the vehicle is set down where it would have been later, and its wheels have not turned.
fn kidnap(recording: &mut Recording, from: f64, seconds: f64, counters: &[Counter]) {
    let (begin, end) = (START.offset(from), START.offset(from + seconds));
    let earlier = |time: Time| time.offset(-seconds);
    let mut cut = vec![CutCounter::default(); counters.len()];
    recording.events.retain_mut(|event| {
        let Some(time) = event.time() else { return true };
        let is_before = time < begin;
        match event {
            RecordedEvent::Encoders(sample) => {
                let counts = [&mut sample.drive, &mut sample.steering];
                for ((cut, counter), count) in cut.iter_mut().zip(counters).zip(counts) {
                    cut.hear(count, counter, is_before, time >= end);
                }
                if time >= end {
                    sample.time = earlier(sample.time);
                }
            }
            RecordedEvent::Wheels(sample) => {
                for (cut, counter) in cut.iter_mut().zip(counters) {
                    let mut count = sample.count(counter);
                    cut.hear(&mut count, counter, is_before, time >= end);
                    sample.set_count(counter, count);
                }
                if time >= end {
                    sample.time = earlier(sample.time);
                }
            }
            RecordedEvent::Speed(sample) if time >= end => sample.time = earlier(sample.time),
            RecordedEvent::Increment(increment) if time >= end => increment.time = earlier(increment.time),
            RecordedEvent::Gyro(sample) if time >= end => sample.time = earlier(sample.time),
            RecordedEvent::Reflectors(seen) if time >= end => {
                for observation in &mut seen.observations {
                    observation.time = earlier(observation.time);
                }
            }
            RecordedEvent::Scan(scan) if time >= end => scan.start = earlier(scan.start),
            _ => {}
        }
        is_before || time >= end
    });
    recording.truth.retain_mut(|truth| {
        let is_kept = truth.time < begin || truth.time >= end;
        if truth.time >= end {
            truth.time = earlier(truth.time);
        }
        is_kept
    });
}
