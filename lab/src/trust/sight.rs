//! What is in sight along a drive, and when docking, nominal protection and recovery may be asked for.

use super::kinds::Revealed;
use agv_core::geometry::difference;
use agv_core::measurement::Time;
use agv_host_sim::recording::{RecordedEvent, Recording, Truth};

/// Within this distance of a station, m, the vehicle docks.
const DOCKING: f64 = 3.0;
/// What docking asks for: so many reflectors in each revolution of so many metres.
const DOCKING_SIGHT: (usize, f64) = (4, 5.0);
/// What a nominal protection level asks for: so many reflectors in each of so many revolutions.
const NOMINAL_SIGHT: (usize, usize) = (4, 16);
/// What a recovery asks for: so many reflectors while the vehicle turns.
const RECOVERY_SIGHT: usize = 3;
/// How far the vehicle must have turned for a nominal protection level, and for a recovery, rad.
const TURNED: f64 = std::f64::consts::FRAC_PI_2;
/// How far it must have driven for a turned laser to be revealed, m.
const DRIVEN: f64 = 5.0;
/// How long before the end of the run a fault must end for a recovery, s.
const RECOVERY_TIME: f64 = 20.0;

/// One revolution of the laser.
#[derive(Clone, Copy, Debug)]
struct Look {
    time: Time,
    seen: usize,
    /// Distance driven and angle turned since the drive began, m and rad.
    driven: f64,
    turned: f64,
    distance_to_station: f64,
}

/// The revolutions of a drive whose sensors are sound.
#[derive(Clone, Debug)]
pub struct Sight {
    looks: Vec<Look>,
    start: Time,
    end: Time,
}

impl Sight {
    /// What is in sight along a recorded drive to a station (W, m).
    #[must_use]
    pub fn of(recording: &Recording, station: [f64; 2]) -> Self {
        let truth = &recording.truth;
        let mut way = Vec::with_capacity(truth.len());
        let (mut driven, mut turned) = (0.0, 0.0);
        let mut before: Option<&Truth> = None;
        for sample in truth {
            if let Some(before) = before {
                driven += before.pose.between(&sample.pose).position().norm();
                turned += difference(sample.pose.theta, before.pose.theta).abs();
            }
            before = Some(sample);
            way.push((sample.time, driven, turned, sample.pose));
        }
        let mut looks = Vec::new();
        for event in &recording.events {
            let RecordedEvent::Reflectors(seen) = event else { continue };
            let Some(time) = event.time() else { continue };
            let index = way.partition_point(|(at, ..)| *at < time).min(way.len().saturating_sub(1));
            let Some((_, driven, turned, pose)) = way.get(index) else { continue };
            looks.push(Look {
                time,
                seen: seen.observations.len(),
                driven: *driven,
                turned: *turned,
                distance_to_station: libm::hypot(pose.x - station[0], pose.y - station[1]),
            });
        }
        let end = truth.last().map_or(Time::default(), |last| last.time);
        Self { looks, start: truth.first().map_or(end, |first| first.time), end }
    }

    /// The revolutions up to `time`, s since the drive began.
    fn until(&self, time: f64) -> &[Look] {
        let time = self.start.offset(time.max(0.0));
        &self.looks[..self.looks.partition_point(|look| look.time <= time)]
    }

    /// Whether the vehicle docks, with what docking asks for in sight, `time` s since the drive began.
    #[must_use]
    pub fn docks(&self, time: f64) -> bool {
        let (fewest, metres) = DOCKING_SIGHT;
        let looks = self.until(time);
        let Some(last) = looks.last() else { return false };
        let mut lately = looks.iter().rev().take_while(|look| last.driven - look.driven <= metres);
        last.distance_to_station <= DOCKING && lately.all(|look| look.seen >= fewest)
    }

    /// Whether a nominal protection level may be asked for.
    #[must_use]
    pub fn is_nominal(&self, time: f64) -> bool {
        let (fewest, revolutions) = NOMINAL_SIGHT;
        let looks = self.until(time);
        let lately = looks.get(looks.len().saturating_sub(revolutions)..).unwrap_or_default();
        lately.len() == revolutions
            && lately.iter().all(|look| look.seen >= fewest)
            && lately.last().is_some_and(|look| look.turned >= TURNED)
    }

    /// Whether what was wrong from `since` on is revealed at `time`, s since the drive began.
    #[must_use]
    pub fn reveals(&self, by: Revealed, since: f64, time: f64) -> bool {
        let measure = |look: &Look| match by {
            Revealed::Turn => look.turned / TURNED,
            Revealed::Drive => look.driven / DRIVEN,
        };
        let looks = self.until(time);
        let wrong = looks.get(self.until(since).len().saturating_sub(1)..).unwrap_or_default();
        let shown: f64 = wrong
            .windows(2)
            .filter(|pair| pair[1].seen >= RECOVERY_SIGHT)
            .map(|pair| measure(&pair[1]) - measure(&pair[0]))
            .sum();
        shown >= 1.0
    }

    /// Whether a recovery may be asked for of a fault that ends `until` s after the drive began.
    #[must_use]
    pub fn can_recover(&self, until: f64) -> bool {
        let from = self.until(until).len();
        let turned: f64 = self.looks[from..]
            .windows(2)
            .filter(|pair| pair[1].seen >= RECOVERY_SIGHT)
            .map(|pair| pair[1].turned - pair[0].turned)
            .sum();
        self.end.since(self.start) - until >= RECOVERY_TIME && turned >= TURNED
    }
}
