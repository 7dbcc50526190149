//! The reflectors that mapping finds: means over several turns, in the frame of the layout.

use agv_core::geometry::{Point, Pose};
use agv_core::measurement::ReflectorObservation;
use agv_wire::nav350::{MapConfiguration, Reflector, ReflectorDetails, Setting};

use super::drive::Turn;
use super::seen::{details, reflector};
use super::sensor::Sensor;

/// Farthest that what is seen of one reflector lies apart, and that a reflector is from its place in the layout, m.
const NEAR: f64 = 0.3;
/// A vehicle that has moved less than this, m, stands.
const STILL: f64 = 1e-3;

/// What was seen of one reflector.
struct Track {
    sum: Point,
    count: u16,
    details: ReflectorDetails,
}

impl Track {
    fn mean(&self) -> Point {
        let share = 1.0 / f64::from(self.count);
        Point::new(share * self.sum.x, share * self.sum.y)
    }
}

impl Sensor {
    /// How mapping is to be done.
    pub(super) fn map_configuration(&self) -> MapConfiguration {
        let found = self.settings.iter().find_map(|setting| match setting {
            Setting::MapConfiguration(configuration) => Some(*configuration),
            _ => None,
        });
        found.expect("the factory sets it, and nobody takes it away")
    }

    /// What mapping finds that began with a turn, whose time on the sensor's clock is `start`, s.
    pub(super) fn mapped(&self, first: usize, start: f64) -> Vec<Reflector> {
        let configuration = self.map_configuration();
        let turns = self.mapping_turns(first, usize::from(configuration.mean));
        let place = Pose::new(
            configuration.x.metres(),
            configuration.y.metres(),
            f64::from(configuration.heading.0).to_radians() * 1e-3,
        );
        let format = self.seen(first, start).landmark_format();
        let tracks = self.tracks(&turns, start);
        let placed = tracks.iter().map(|track| (place.transform(&track.mean()), track));
        let wanted = placed.filter(|(point, _)| !configuration.only_unknown || !self.is_known(*point));
        let found = wanted.zip(0_u16..).map(|((point, track), local_id)| {
            let details = ReflectorDetails { local_id, hit_count: track.count, ..track.details };
            reflector(&format, libm::hypot(point.x, point.y), libm::atan2(point.y, point.x), details)
        });
        found.collect()
    }

    /// The turns that are averaged: while the vehicle stands those of its standstill, over and over.
    fn mapping_turns(&self, first: usize, mean: usize) -> Vec<&Turn> {
        let turns = &self.drive.turns[first..];
        let still = |turn: &&Turn| match (turns[0].pose, turn.pose) {
            (Some(before), Some(now)) => (now.position() - before.position()).norm() < STILL,
            _ => false,
        };
        let standing = turns.iter().take_while(still).count().max(1);
        turns[..standing].iter().cycle().take(mean).collect()
    }

    fn tracks(&self, turns: &[&Turn], start: f64) -> Vec<Track> {
        let frame = &self.frame();
        let point = |seen: &ReflectorObservation| {
            let (sine, cosine) = libm::sincos(frame.angle(f64::from(seen.bearing)));
            Point::new(f64::from(seen.range) * cosine, f64::from(seen.range) * sine)
        };
        let mut tracks: Vec<Track> = Vec::new();
        for turn in turns {
            for seen in &turn.reflectors {
                let point = point(seen);
                let near = |track: &&mut Track| (track.mean() - point).norm() < NEAR;
                if let Some(track) = tracks.iter_mut().find(near) {
                    track.sum = Point::new(track.sum.x + point.x, track.sum.y + point.y);
                    track.count += 1;
                } else {
                    let time = self.device_time(seen.time.since(turn.start) + start);
                    tracks.push(Track { sum: point, count: 1, details: details(0, time) });
                }
            }
        }
        tracks
    }

    fn is_known(&self, point: Point) -> bool {
        let distance = |x: f64, y: f64| libm::hypot(x - point.x, y - point.y);
        self.layout().iter().any(|known| distance(known.landmark.x.metres(), known.landmark.y.metres()) < NEAR)
    }
}
