//! Reflectors as a laser of the NAV350 kind reports them.

use agv_core::geometry::{difference, wrap};
use agv_core::measurement::{ReflectorObservation, Time};

use super::laser::{FIRST_BEARING, LaserTrack, Revolution, beam_interval, bearing_step, unit};
use super::random::Random;
use super::raycast::Surface;
use super::scenario::{LaserOptions, ReflectorOptions};
use super::shape::Reflector;

/// Steps of the search for the time at which the beam crosses a reflector; each reduces the error by the ratio of the
/// vehicle's to the laser's rotation.
const CROSSING_STEPS: usize = 4;

/// The reflectors of one revolution, in order of time. A reflector is seen if the ray to its axis hits it first, if its
/// foil is turned to the laser, and if it is near enough.
#[must_use]
pub fn detect(
    revolution: &Revolution,
    reflectors: &[Reflector],
    options: &ReflectorOptions,
    random: &mut Random,
) -> Vec<ReflectorObservation> {
    let &Revolution { scene, track, options: laser, drive_start, .. } = revolution;
    let scan_start = revolution.start();
    let bearing_noise = options.bearing_noise_deg.to_radians();
    let mut seen = Vec::new();
    for (index, reflector) in reflectors.iter().enumerate() {
        let noise = (random.normal(), random.normal());
        let is_missed = random.happens(options.missing_share);
        let time = crossing(reflector, track, laser, scan_start);
        let (origin, heading) = track.at(laser.measured(time));
        let offset = reflector.body.centre - origin;
        let distance = offset.norm();
        if is_missed || distance > reflector.farthest.min(options.farthest) || distance < laser.nearest {
            continue;
        }
        let hit = scene.first_hit(&origin, &(offset / distance), laser.farthest, time);
        if hit.is_none_or(|hit| hit.surface != Surface::Reflector(index)) || !reflector.faces(&origin) {
            continue;
        }
        let bearing = libm::atan2(offset.y, offset.x) - heading;
        seen.push(observation(
            drive_start.offset(time),
            laser.systematic.range(distance, reflector.cosine_of_incidence(&origin)) + options.range_noise * noise.0,
            bearing + laser.systematic.bearing(bearing) + bearing_noise * noise.1,
        ));
    }
    for _ in 0..seen.len().max(1) {
        let is_false = random.happens(options.false_share);
        let beam = random.uniform() * f64::from(laser.beams);
        if is_false {
            let time = scan_start + beam * beam_interval(laser);
            let bearing = FIRST_BEARING + beam * bearing_step(laser);
            let (origin, heading) = track.at(laser.measured(time));
            if let Some(hit) = scene.first_hit(&origin, &unit(heading + bearing), options.farthest, time)
                && hit.distance >= laser.nearest
            {
                seen.push(observation(drive_start.offset(time), hit.distance, bearing));
            }
        }
    }
    seen.sort_by_key(|observation| observation.time);
    seen
}

fn observation(time: Time, range: f64, bearing: f64) -> ReflectorObservation {
    ReflectorObservation { time, range: range as f32, bearing: wrap(bearing) as f32 }
}

/// When the beam of this revolution points at the reflector, s since the first state of the track.
fn crossing(reflector: &Reflector, track: &LaserTrack, laser: &LaserOptions, scan_start: f64) -> f64 {
    let period = 1.0 / laser.frequency;
    let mut time = scan_start + 0.5 * period;
    for _ in 0..CROSSING_STEPS {
        let (origin, heading) = track.at(laser.measured(time));
        let offset = reflector.body.centre - origin;
        let beam_bearing = FIRST_BEARING + (time - scan_start) / period * std::f64::consts::TAU;
        let lead = difference(libm::atan2(offset.y, offset.x) - heading, beam_bearing);
        time = (time + lead / std::f64::consts::TAU * period).clamp(scan_start, scan_start + period);
    }
    time
}
