//! The state of a localiser as bytes: another one goes on with it as if nothing had been, with every kind of vehicle.

use agv_core::localizer::{Event, Localizer, Mode, Parameters, PoseFix, VehicleCapacities};
use agv_core::measurement::Reflectors;

use super::kind::Kind;
use super::simulator::{Drive, Outage, Told, is_odometry, ramp, time};
use crate::support::replaced::Replaced;

/// Drives it with replacements after about one in so many events; returns the modes that were seen.
fn drive(drive: &Drive, every: f64) -> Vec<Mode> {
    drive_as(drive, drive.parameters(), every)
}

fn drive_as(drive: &Drive, parameters: Parameters, every: f64) -> Vec<Mode> {
    let begin = || {
        let mut localizer: Box<Localizer<VehicleCapacities>> = Box::new(Localizer::new(parameters));
        localizer.add_landmarks(&drive.reflectors).unwrap();
        localizer
    };
    let mut both = Replaced::new(begin, every, drive.seed);
    let happened = drive.happen();
    let (mut is_told, mut modes) = (false, Vec::new());
    for (_, told) in &happened.events {
        let mode = match told {
            Told::Whole(event) => both.handle(event).pose.mode,
            Told::Seen(seen) => both.handle(&Event::Reflectors(Reflectors::of_first(seen))).pose.mode,
        };
        if !modes.contains(&mode) {
            modes.push(mode);
        }
        // Some time before the first pose, and the odometry is heard.
        if !is_told && is_odometry(told) && both.events > 100 {
            is_told = true;
            let (time, pose) = match told {
                Told::Whole(event) => (event.time().unwrap(), happened.truth(event.time().unwrap())),
                Told::Seen(_) => (time(0.0), happened.truth(time(0.0))),
            };
            both.handle(&Event::SetPose(PoseFix { time, pose, position_deviation: 0.01, heading_deviation: 0.003 }));
        }
    }
    both.finish();
    modes
}

/// Off after three seconds, with a bend.
fn bend(kind: Kind, seed: u64) -> Drive {
    Drive {
        motion: Box::new(|time| (0.8 * ramp(time, 3.0, 1.0), 0.0, 0.3 * ramp(time, 5.0, 0.5))),
        seconds: 9.0,
        jitter: 0.1,
        seed,
        ..Drive::new(kind)
    }
}

#[test]
fn every_kind_of_vehicle_goes_on_from_its_stored_state() {
    for (seed, kind) in (1..).zip(Kind::ALL) {
        let modes = drive(&bend(kind, seed), 25.0);
        assert!(modes.contains(&Mode::Reflectors), "{kind:?}: {modes:?}");
        drive(&Drive { gyro: Some(100.0), gyro_latency: 0.01, ..bend(kind, 100 + seed) }, 25.0);
    }
}

#[test]
fn a_vehicle_that_is_lost_or_without_odometry_goes_on_from_its_stored_state() {
    for (seed, outage) in (1..).zip([Outage::Silence, Outage::Faults]) {
        let modes = drive(&Drive { outage: Some((outage, 5.5, 1.0)), ..bend(Kind::Tricycle, seed) }, 10.0);
        assert!(modes.contains(&Mode::WithoutOdometry), "{outage:?}: {modes:?}");
    }
    let hidden = Drive { sees: Box::new(|time, _| time < 5.0), seconds: 20.0, ..bend(Kind::Differential, 7) };
    let mut parameters = hidden.parameters();
    (parameters.limits.dead_reckoning_from, parameters.limits.lost_after) = (1.0, 5.0);
    let modes = drive_as(&hidden, parameters, 60.0);
    assert!(modes.contains(&Mode::DeadReckoning) && modes.contains(&Mode::Lost), "{modes:?}");
}

#[test]
fn a_vehicle_whose_state_is_stored_at_every_event_goes_on() {
    drive(&Drive { gyro: Some(100.0), seconds: 5.0, ..bend(Kind::Mecanum, 3) }, 1.0);
}
