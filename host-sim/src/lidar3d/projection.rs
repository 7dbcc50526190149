//! A cloud as a planar laser would have seen it: a level slice, beam by beam at the times of the laser's own beams.
//!
//! The controller takes every beam at the time that follows from its direction. A point that was measured at another time is moved to
//! where it is seen from then, by the speed of the sensor.

use std::f64::consts::{PI, TAU};

use agv_core::measurement::{LaserId, ReflectorObservation, Time};
use agv_wire::nav350::SensorFrame;
use nalgebra::{Rotation3, Vector3};

use super::revolution::Revolution;
use super::ring_surfaces::lay_onto_surfaces;
use crate::recording::{RecordedReflectors, RecordedScan};

/// Beams of a turn.
const BEAMS: usize = 1440;
/// Heights above and below the sensor up to which points count, m: the nearer ones if there are any, else the farther ones.
const NEAR_LEVEL: f64 = 0.3;
const FAR_LEVEL: f64 = 1.0;
/// Points lower above the floor than this do not count, m.
const LOWEST: f64 = 0.3;
/// Rings of one beam whose distances differ by less than this see the same surface, and are averaged, m.
const SAME_SURFACE: f64 = 0.15;
/// Neighbours on a ring that lie farther apart than this, rad, leave a gap, and those whose distances differ by more than this share an
/// edge.
const GAP: f64 = 0.02;
const EDGE: f64 = 0.05;
/// Bright returns are of one reflector if they lie within this, m; one that is wider is none.
const REFLECTOR: f64 = 0.2;
/// Radius of a reflector, m: its place is that of its axis.
const RADIUS: f64 = 0.04;
/// Fewest bright returns of a reflector.
const BRIGHT: usize = 2;

/// Speed of a sensor along its own level axes, m/s, and its turn, rad/s, counter-clockwise.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Speed {
    /// Ahead.
    pub x: f64,
    /// To the left.
    pub y: f64,
    /// Of rotation.
    pub turn: f64,
}

impl Speed {
    /// The way after a time, s, along the axes at its beginning, m: the chord of the arc.
    pub(super) fn way(&self, time: f64) -> [f64; 2] {
        let (sin, cos) = libm::sincos(0.5 * self.turn * time);
        [time * (self.x * cos - self.y * sin), time * (self.x * sin + self.y * cos)]
    }
}

/// How clouds become turns of a planar laser.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Projection {
    /// Makes the points level.
    pub levelling: Rotation3<f64>,
    /// Height of the sensor above the floor, m.
    pub height: f64,
    /// Returns above this intensity are of reflectors; None if it has no intensities that say so.
    pub bright: Option<u16>,
    /// The planar laser whose place is taken.
    pub frame: SensorFrame,
}

/// A turn of the planar laser.
#[derive(Clone, Debug, PartialEq)]
pub struct Projected {
    /// Its beams.
    pub scan: RecordedScan,
    /// Reflectors, by their intensity.
    pub reflectors: RecordedReflectors,
}

/// A levelled point as it is seen at the time of its beam.
#[derive(Clone, Copy)]
struct Seen {
    position: [f64; 2],
    bearing: f64,
    /// Above the sensor, m.
    level: f64,
    intensity: u16,
}

/// What a ring sees at a beam.
#[derive(Clone, Copy)]
struct Candidate {
    range: f64,
    level: f64,
    intensity: u16,
}

impl Projection {
    /// The turn that a revolution is taken for. Its middle is that of the revolution, so its times lie as near as they can to those of
    /// the points.
    #[must_use]
    pub fn project(&self, revolution: &Revolution, speed: Speed) -> Projected {
        let last = revolution.points.iter().map(|point| point.time).max().unwrap_or(0);
        let start = revolution.start.offset(0.5 * (1e-9 * f64::from(last) - self.frame.period));
        let mut rings: Vec<Vec<Seen>> = Vec::new();
        for point in &revolution.points {
            let [x, y, level] = (self.levelling * Vector3::from(point.position.map(f64::from))).into();
            if level.abs() > FAR_LEVEL || self.height + level < LOWEST {
                continue;
            }
            let measured = revolution.start.since(start) + 1e-9 * f64::from(point.time);
            let (position, bearing) = self.at_its_beam([x, y], measured, speed);
            let ring = usize::from(point.ring);
            rings.resize_with(rings.len().max(ring + 1), Vec::new);
            rings[ring].push(Seen { position, bearing, level, intensity: point.intensity });
        }
        self.take_noise_off(&mut rings);
        let mut beams: Vec<Vec<Candidate>> = vec![Vec::new(); BEAMS];
        for ring in &rings {
            ring_beams(ring, &mut beams);
        }
        let (ranges, intensities) = beams.iter().map(|candidates| combined(candidates)).unzip();
        let scan = RecordedScan {
            laser: LaserId::FIRST,
            start,
            beam_interval: self.frame.period / BEAMS as f64,
            first_bearing: -PI,
            bearing_step: TAU / BEAMS as f64,
            ranges,
            intensities: if self.bright.is_some() { intensities } else { Vec::new() },
        };
        Projected { reflectors: self.reflectors(&rings, start).into(), scan }
    }

    /// Lays points onto their surfaces. Those of reflectors stay.
    fn take_noise_off(&self, rings: &mut [Vec<Seen>]) {
        let mut positions: Vec<Vec<[f64; 2]>> =
            rings.iter().map(|ring| ring.iter().map(|seen| seen.position).collect()).collect();
        let is_plain = |seen: &Seen| self.bright.is_none_or(|limit| seen.intensity <= limit);
        lay_onto_surfaces(&mut positions, |ring, index| is_plain(&rings[ring][index]));
        for (seen, position) in rings.iter_mut().flatten().zip(positions.into_iter().flatten()) {
            let bearing = libm::atan2(position[1], position[0]);
            *seen = Seen { position, bearing, ..*seen };
        }
    }

    /// Time of a direction after the turn's first beam, s.
    fn beam_time(&self, bearing: f64) -> f64 {
        self.frame.period * (bearing + PI) / TAU
    }

    /// A point as it is seen at the time of the beam that meets it, and the direction of that.
    fn at_its_beam(&self, [x, y]: [f64; 2], measured: f64, speed: Speed) -> ([f64; 2], f64) {
        let mut bearing = libm::atan2(y, x);
        let mut position = [x, y];
        // What the first round moves changes the time of the beam by less than a millisecond.
        for _ in 0..2 {
            let later = self.beam_time(bearing) - measured;
            let way = speed.way(later);
            let (sin, cos) = libm::sincos(speed.turn * later);
            let [a, b] = [x - way[0], y - way[1]];
            position = [a * cos + b * sin, b * cos - a * sin];
            bearing = libm::atan2(position[1], position[0]);
        }
        (position, bearing)
    }

    /// The reflectors among bright returns, in order of their directions.
    fn reflectors(&self, rings: &[Vec<Seen>], start: Time) -> Vec<ReflectorObservation> {
        let Some(limit) = self.bright else { return Vec::new() };
        let mut bright: Vec<&Seen> = rings.iter().flatten().filter(|seen| seen.intensity > limit).collect();
        bright.sort_by(|a, b| a.bearing.total_cmp(&b.bearing));
        let mut groups: Vec<Vec<&Seen>> = Vec::new();
        for seen in bright {
            let is_near = |other: &&&Seen| apart(other, seen) < REFLECTOR;
            // Reflectors behind each other are interleaved.
            let group = groups.iter_mut().rev().take(4).find(|group| group.last().is_some_and(|last| is_near(&last)));
            match group {
                Some(group) => group.push(seen),
                None => groups.push(vec![seen]),
            }
        }
        let observation = |group: &Vec<&Seen>| {
            let count = group.len() as f64;
            let mean = |axis: usize| group.iter().map(|seen| seen.position[axis]).sum::<f64>() / count;
            let is_wide = group.iter().any(|seen| apart(seen, group[0]) > REFLECTOR);
            let (x, y) = (mean(0), mean(1));
            let bearing = libm::atan2(y, x);
            let observation = ReflectorObservation {
                time: start.offset(self.beam_time(bearing)),
                range: (libm::hypot(x, y) + RADIUS) as f32,
                bearing: bearing as f32,
            };
            (group.len() >= BRIGHT && !is_wide).then_some(observation)
        };
        let mut found: Vec<ReflectorObservation> = groups.iter().filter_map(observation).collect();
        found.sort_by_key(|observation| observation.time);
        found
    }
}

fn apart(one: &Seen, other: &Seen) -> f64 {
    libm::hypot(one.position[0] - other.position[0], one.position[1] - other.position[1])
}

/// Gives every beam what a ring sees in its direction: on the line between the two points beside it, or the nearer of these at an edge.
fn ring_beams(ring: &[Seen], beams: &mut [Vec<Candidate>]) {
    let step = TAU / BEAMS as f64;
    for (one, other) in ring.iter().zip(ring.iter().skip(1)) {
        let (low, high) =
            if agv_core::geometry::difference(other.bearing, one.bearing) > 0.0 { (one, other) } else { (other, one) };
        let width = agv_core::geometry::difference(high.bearing, low.bearing);
        // Behind the sensor, a turn lies between the two.
        if width > GAP || (one.bearing - other.bearing).abs() > PI {
            continue;
        }
        let first = libm::ceil((low.bearing + PI) / step);
        let mut number = 0.0;
        loop {
            let bearing = (first + number) * step - PI;
            let along = bearing - low.bearing;
            if along >= width {
                break;
            }
            let nearer = if 2.0 * along < width { low } else { high };
            let ranges = [low, high].map(|seen| libm::hypot(seen.position[0], seen.position[1]));
            let is_edge = (ranges[0] - ranges[1]).abs() > EDGE * ranges[0].min(ranges[1]);
            let range = if is_edge {
                libm::hypot(nearer.position[0], nearer.position[1])
            } else {
                // 1 / r is linear in the sine of the angle on a line.
                let (a, b) = (libm::sin(width - along) / ranges[0], libm::sin(along) / ranges[1]);
                libm::sin(width) / (a + b)
            };
            let beam = (first + number) as usize % BEAMS;
            beams[beam].push(Candidate { range, level: nearer.level, intensity: nearer.intensity });
            number += 1.0;
        }
    }
}

/// Range, m, 0 for none, and intensity of a beam: the nearest surface near the level of the sensor, averaged over the rings that see it. What
/// lies between two rings changes with the distance; the nearest surface stays.
fn combined(candidates: &[Candidate]) -> (f32, u16) {
    let level = candidates.iter().map(|candidate| candidate.level.abs()).fold(f64::INFINITY, f64::min);
    let limit = NEAR_LEVEL.max(level);
    let near = || candidates.iter().filter(|candidate| candidate.level.abs() <= limit);
    let Some(best) = near().min_by(|a, b| a.range.total_cmp(&b.range)) else { return (0.0, 0) };
    let same = near().filter(|other| other.range - best.range < SAME_SURFACE);
    let (sum, count) = same.fold((0.0, 0.0), |(sum, count), other| (sum + other.range, count + 1.0));
    ((sum / count) as f32, best.intensity)
}
