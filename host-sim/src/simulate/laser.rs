//! A planar laser that turns.

use std::f64::consts::{PI, TAU};

use agv_core::geometry::{Point, Pose};
use agv_core::measurement::{LaserId, Time};

use super::people::Person;
use super::random::Random;
use super::raycast::{Hit, RayCaster, Surface, circle_hit};
use super::scenario::LaserOptions;
use super::vehicle::Motion;
use crate::recording::RecordedScan;

/// Where the laser was at any time of the drive.
///
/// Positions and headings between two states of the motion are interpolated linearly: at 100 states a second, 0.8 m/s and
/// a radius of 2.5 m the arc is then missed by less than 5 um.
#[derive(Clone, Debug)]
pub struct LaserTrack {
    interval: f64,
    positions: Vec<Point>,
    /// Headings without jumps, rad.
    headings: Vec<f64>,
}

impl LaserTrack {
    /// The track of a laser whose mounting (S in R) depends on the vehicle's pose, and on the time since the first state, s.
    #[must_use]
    pub fn new(motion: &Motion, mounting: impl Fn(&Pose, f64) -> Pose) -> Self {
        let mut heading = 0.0;
        let mut previous = 0.0;
        let (positions, headings) = motion
            .states
            .iter()
            .enumerate()
            .map(|(index, state)| {
                let pose = state.pose.compose(&mounting(&state.pose, index as f64 * motion.interval));
                heading += agv_core::geometry::difference(pose.theta, previous);
                previous = pose.theta;
                (pose.position(), heading)
            })
            .unzip();
        Self { interval: motion.interval, positions, headings }
    }

    /// The track of a laser that stands still.
    #[must_use]
    pub fn standing(laser: &Pose) -> Self {
        Self { interval: 1.0, positions: vec![laser.position()], headings: vec![laser.theta] }
    }

    /// From the first state to the last, s.
    #[must_use]
    pub fn duration(&self) -> f64 {
        self.interval * self.positions.len().saturating_sub(1) as f64
    }

    /// Position (W, m) and heading (W, rad, not wrapped) of S at `time`, s since the first state, held at both ends.
    #[must_use]
    pub fn at(&self, time: f64) -> (Point, f64) {
        let last = self.positions.len() - 1;
        let steps = (time / self.interval).clamp(0.0, last as f64);
        let index = (steps as usize).min(last.saturating_sub(1));
        let next = (index + 1).min(last);
        let share = steps - index as f64;
        (
            self.positions[index] + (self.positions[next] - self.positions[index]) * share,
            self.headings[index] + (self.headings[next] - self.headings[index]) * share,
        )
    }
}

/// Everything that a ray of the laser can meet.
#[derive(Clone, Copy, Debug)]
pub struct Scene<'a> {
    /// What does not move.
    pub fixed: &'a RayCaster,
    /// What does.
    pub people: &'a [Person],
}

impl Scene<'_> {
    /// The first surface on the ray from `origin` in `direction` at `time`, s since the start of the drive.
    #[must_use]
    pub fn first_hit(&self, origin: &Point, direction: &Point, farthest: f64, time: f64) -> Option<Hit> {
        let mut hit = self.fixed.first_hit(origin, direction, farthest);
        for circle in self.people.iter().flat_map(|person| person.circles(time)).flatten() {
            if let Some(distance) = circle_hit(origin, direction, &circle)
                && distance < hit.map_or(farthest, |hit| hit.distance)
            {
                hit = Some(Hit { distance, surface: Surface::Plain });
            }
        }
        hit
    }
}

/// Strength of a plain surface's return and of a foil's.
const PLAIN_INTENSITY: u16 = 100;
const FOIL_INTENSITY: u16 = 1000;
/// Beyond this distance, m, the second range noise holds.
const FAR: f64 = 30.0;
/// Two surfaces that are farther apart than this along a beam, m, can mix.
const MIXING_STEP: f64 = 0.1;

/// The first beam looks backward and the laser turns counter-clockwise.
pub const FIRST_BEARING: f64 = -PI;

/// Angle between beams, rad.
#[must_use]
pub fn bearing_step(options: &LaserOptions) -> f64 {
    TAU / f64::from(options.beams)
}

/// Time between beams, s.
#[must_use]
pub fn beam_interval(options: &LaserOptions) -> f64 {
    1.0 / (options.frequency * f64::from(options.beams))
}

/// Number of whole revolutions in a track that starts with the first beam of the first one.
#[must_use]
pub fn revolutions(options: &LaserOptions, track: &LaserTrack) -> usize {
    (track.duration() * options.frequency + 1e-9) as usize
}

/// One turn of the laser.
#[derive(Clone, Copy, Debug)]
pub struct Revolution<'a> {
    /// How many came before.
    pub index: usize,
    /// What the rays can meet.
    pub scene: Scene<'a>,
    /// Where the laser is.
    pub track: &'a LaserTrack,
    /// The laser.
    pub options: &'a LaserOptions,
    /// Time of the track's first state.
    pub drive_start: Time,
}

impl Revolution<'_> {
    /// When the first beam is cast, s since the track's first state.
    #[must_use]
    pub fn start(&self) -> f64 {
        self.index as f64 / self.options.frequency
    }
}

/// The ranges of one revolution. Each beam is cast from where the laser is at that beam's time. Faults have random numbers
/// of their own, so switching them on leaves the noise of the other beams as it was.
#[must_use]
pub fn scan(revolution: &Revolution, noise: &mut Random, faults: &mut Random) -> RecordedScan {
    let &Revolution { scene, track, options, drive_start, .. } = revolution;
    let bearing_noise = options.bearing_noise_deg.to_radians();
    let (bearing_step, beam_interval) = (bearing_step(options), beam_interval(options));
    let scan_start = revolution.start();
    let count = options.beams as usize;
    let mut ranges = Vec::with_capacity(count);
    let mut intensities = Vec::with_capacity(if options.intensities { count } else { 0 });
    for beam in 0..count {
        let time = scan_start + beam as f64 * beam_interval;
        let bearing = FIRST_BEARING + beam as f64 * bearing_step;
        let (origin, heading) = track.at(options.measured(time));
        let (bearing_error, range_error) = (bearing_noise * noise.normal(), noise.normal());
        // Told is where the beam would be without the error.
        let angle = heading + bearing - options.systematic.bearing(bearing) + bearing_error;
        let hit = scene.first_hit(&origin, &unit(angle), options.farthest, time);
        let mut distance = hit.map(|hit| hit.distance);
        if options.mixed_share > 0.0 {
            distance = mixed(distance, &scene, &origin, angle, options, time, faults);
        }
        let is_lost = is_lost(bearing, options, faults);
        let range = distance.filter(|_| !is_lost).map_or(0.0, |distance| {
            let deviation = if distance > FAR { options.far_range_noise } else { options.range_noise };
            options.systematic.range(distance, 1.0) + deviation * range_error
        });
        let is_return = range >= options.nearest && range <= options.farthest;
        ranges.push(if is_return { range as f32 } else { 0.0 });
        if options.intensities {
            intensities.push(match hit {
                Some(Hit { surface: Surface::Reflector(_), .. }) if is_return => FOIL_INTENSITY,
                _ if is_return => PLAIN_INTENSITY,
                _ => 0,
            });
        }
    }
    RecordedScan {
        laser: LaserId::FIRST,
        start: drive_start.offset(scan_start),
        beam_interval,
        first_bearing: FIRST_BEARING,
        bearing_step,
        ranges,
        intensities,
    }
}

/// The direction of `angle`, of length one.
#[must_use]
pub fn unit(angle: f64) -> Point {
    let (sine, cosine) = libm::sincos(angle);
    Point::new(cosine, sine)
}

/// The distance that the beam reports if its spot lies on two surfaces: with the given probability, one between them.
fn mixed(
    distance: Option<f64>,
    scene: &Scene,
    origin: &Point,
    angle: f64,
    options: &LaserOptions,
    time: f64,
    faults: &mut Random,
) -> Option<f64> {
    let (is_mixed, share) = (faults.happens(options.mixed_share), faults.uniform());
    if !is_mixed {
        return distance;
    }
    let half_spot = 0.5 * options.divergence_deg.to_radians();
    let edge = |side: f64| scene.first_hit(origin, &unit(angle + side * half_spot), options.farthest, time);
    match (edge(-1.0), edge(1.0)) {
        (Some(a), Some(b)) if (a.distance - b.distance).abs() > MIXING_STEP => {
            Some(a.distance + (b.distance - a.distance) * share)
        }
        _ => distance,
    }
}

fn is_lost(bearing: f64, options: &LaserOptions, faults: &mut Random) -> bool {
    let mut is_lost = options.lost_share > 0.0 && faults.happens(options.lost_share);
    for sector in &options.dirty_sectors {
        let inside = (bearing.to_degrees() - sector.from_deg).rem_euclid(360.0)
            <= (sector.to_deg - sector.from_deg).rem_euclid(360.0);
        is_lost |= inside && faults.happens(sector.lost_share);
    }
    is_lost
}
