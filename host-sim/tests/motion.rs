//! What tells the motion of a vehicle of each kind on the bus tells what was recorded.

use std::path::Path;

use agv_controller::{BusEvent, EncoderNodes, EncoderOutput, Encoders};
use agv_core::localizer::Event;
use agv_core::measurement::Time;
use agv_core::odometry::{Counted, MOST_COUNTERS};
use agv_host_sim::emulate::motion::EmulatedMotion;
use agv_host_sim::recording::Recording;
use agv_host_sim::simulate::scenario::{MotionReport, Scenario};
use agv_host_sim::simulate::{START, simulate};
use agv_settings::Settings;
use agv_wire::can::encoder::Profile;

/// When the vehicle drives off, ms.
const BEGIN: u64 = 1500;

fn recording(reports: MotionReport) -> Recording {
    let mut scenario = Scenario::read(Path::new("block_storage_p2")).unwrap();
    scenario.laser.scans = false;
    scenario.vehicle.reports = reports;
    simulate(&scenario).unwrap().recording
}

/// Plays a drive on a bus, and gives what the controller's side makes of it from when it drives, with the times of the recording.
fn play(recording: &Recording, profile: Profile) -> Vec<(Time, BusEvent)> {
    let settings = Settings::of(recording.parameters);
    let nodes = EncoderNodes { profiles: [profile; MOST_COUNTERS], ..EncoderNodes::of(&settings) };
    let mut motion = EmulatedMotion::new(recording, &nodes).unwrap().standing();
    let mut encoders = Encoders::new(&nodes, &recording.parameters, Time::from_micros(0));
    let begin = Time::from_micros(BEGIN * 1000);
    let mut events = Vec::new();
    for millisecond in 1..BEGIN + 12_000 {
        let now = Time::from_micros(millisecond * 1000);
        if now == begin {
            assert!(motion.are_operational());
            motion.begin(now);
        }
        let mut frames = motion.poll(now);
        while let Some(frame) = frames.pop() {
            let mut sent = Vec::new();
            encoders.look(now, Some(&frame), |output| match output {
                EncoderOutput::Send(frame) => sent.push(frame),
                EncoderOutput::Event(event) => events.push((now, event)),
            });
            frames.extend(sent.iter().flat_map(|frame| motion.handle(frame)));
        }
        let mut sent = Vec::new();
        encoders.poll(now, |output| match output {
            EncoderOutput::Send(frame) => sent.push(frame),
            EncoderOutput::Event(event) => events.push((now, event)),
        });
        for frame in sent {
            for answer in motion.handle(&frame) {
                encoders.hear(&answer, now, |event| events.push((now, event)));
            }
        }
    }
    events.retain(|(now, _)| *now > begin.offset(0.1));
    let shift = |time: Time| START.offset(time.since(begin));
    events.into_iter().map(|(now, event)| (shift(now), event)).collect()
}

/// Counters of a recorded sample.
fn counts(recording: &Recording, event: &Event) -> Option<(Time, [u32; MOST_COUNTERS])> {
    let counters = recording.parameters.vehicle.counters();
    match event {
        Event::Encoders(sample) => Some((sample.time, [sample.drive, sample.steering, 0, 0])),
        Event::Wheels(sample) => {
            let mut counts = [0; MOST_COUNTERS];
            counts.iter_mut().zip(&counters).for_each(|(count, counter)| *count = sample.count(counter));
            Some((sample.time, counts))
        }
        _ => None,
    }
}

#[test]
fn counters_come_over_the_bus_as_they_were_recorded() {
    for reports in [
        MotionReport::Encoders,
        MotionReport::Differential,
        MotionReport::BiSteerable,
        MotionReport::Ackermann,
        MotionReport::ThreeOmnidirectional,
        MotionReport::Omnidirectional,
        MotionReport::Mecanum,
    ] {
        let recording = recording(reports);
        let counters = recording.parameters.vehicle.counters();
        let recorded: Vec<_> = recording.events.iter().filter_map(|event| counts(&recording, &event.view())).collect();
        for profile in [Profile::Encoder, Profile::Drive] {
            let events = play(&recording, profile);
            let mut compared = 0;
            let mut moved = [0_i64; MOST_COUNTERS];
            for (_, event) in &events {
                assert!(!matches!(event, BusEvent::EncoderFaults(_)), "{reports:?} {profile:?}: {event:?}");
                let Some((_, found)) = counts(&recording, &event.event()) else { continue };
                // Which of the recorded ones it is: that with the same counter of the first wheel and the others near by.
                let is_it = |(_, known): &&(Time, [u32; MOST_COUNTERS])| {
                    known[0] == found[0]
                        && counters.iter().enumerate().all(|(place, counter)| {
                            // Positions change between the frames of one cycle: a period at most.
                            let most = if counter.counted == Counted::Turn { 40 } else { 120 };
                            counter.range.step(known[place], found[place]).abs() <= most
                        })
                };
                assert!(recorded.iter().any(|known| is_it(&known)), "{reports:?} {profile:?}: {event:?}");
                for (moved, (count, first)) in moved.iter_mut().zip(found.iter().zip(&recorded[0].1)) {
                    *moved = (*moved).max(i64::from(count.abs_diff(*first)));
                }
                compared += 1;
            }
            assert!(compared > 1000, "{reports:?} {profile:?}: {compared}");
            assert!(moved[..counters.len()].iter().all(|moved| *moved > 10), "{reports:?} {profile:?}: {moved:?}");
        }
    }
}

#[test]
fn reports_come_over_the_bus_as_they_were_recorded() {
    for reports in [MotionReport::TricycleSpeed, MotionReport::Speed] {
        let recording = recording(reports);
        let recorded = recording.events.iter().filter_map(|event| match event.view() {
            Event::Speed(sample) => Some((sample.speed, sample.steering)),
            _ => None,
        });
        let recorded: Vec<(f64, f64)> = recorded.collect();
        let mut compared = 0;
        for (_, event) in play(&recording, Profile::Encoder) {
            let BusEvent::Speed(sample) = event else { panic!("{event:?}") };
            // Steps of 1 mm/s and 0.1 mrad.
            let is_it = |(speed, steering): &(f64, f64)| {
                (sample.speed - speed).abs() < 0.51e-3 && (sample.steering - steering).abs() < 0.51e-4
            };
            assert!(recorded.iter().any(is_it), "{sample:?}");
            compared += 1;
        }
        assert!(compared > 1000, "{compared}");
    }
    // What steps leave out of an increment comes with the next one: the way is whole.
    let recording = recording(MotionReport::Increments);
    let told: f64 = play(&recording, Profile::Encoder)
        .iter()
        .map(|(_, event)| match event {
            BusEvent::Increment(increment) => increment.displacement.x,
            event => panic!("{event:?}"),
        })
        .sum();
    let recorded: f64 = recording
        .events
        .iter()
        .filter_map(|event| match event.view() {
            Event::Increment(increment) if increment.time.since(START) <= 11.99 => Some(increment.displacement.x),
            _ => None,
        })
        .sum();
    assert!(recorded > 5.0 && (told - recorded).abs() < 0.02, "{told} {recorded}");
}
