//! Emulated encoders on a bus give the counters of the simulated drive.

use std::path::Path;
use std::time::Instant;

use agv_core::measurement::{EncoderSample, Time};
use agv_core::odometry::{Counted, CounterRange, Vehicle};
use agv_host_sim::bus::{Bus, InProcessBus, InProcessNode};
use agv_host_sim::emulate::encoder::EmulatedEncoder;
use agv_host_sim::simulate::random::{Random, Stream};
use agv_host_sim::simulate::scenario::{Scenario, believed_parameters};
use agv_host_sim::simulate::{odometer, vehicle};
use agv_wire::can::canopen::NodeId;
use agv_wire::can::encoder::{EncoderSettings, EncoderState, Reporting};
use agv_wire::can::encoder_group::{ChannelSettings, Counts, EncoderGroup};
use agv_wire::can::plausibility::PlausibilityLimits;

/// The counters of a simulated drive, one sample every 10 ms, and their ranges.
fn simulated() -> (Vec<EncoderSample>, CounterRange, CounterRange) {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../host-sim/scenarios/block_storage_p1.toml");
    let mut scenario = Scenario::read(&file).unwrap();
    scenario.odometry.rate = 100.0;
    let Vehicle::Tricycle(tricycle) = believed_parameters(&scenario).vehicle else { panic!("no tricycle") };
    let mut random = Random::new(scenario.seed, Stream::Odometry);
    let path = scenario.build_path();
    let motion = vehicle::drive(&path, tricycle.wheelbase, &scenario.drive, &scenario.odometry, 0.010, &mut random);
    let samples = odometer::encoders(&motion, &tricycle, &scenario.odometry, Time::from_seconds(1.0), &mut random);
    (samples, tricycle.drive_range, tricycle.steering_range)
}

fn channel(number: u8, counted: Counted, reporting: Reporting, fastest: f64, braking: f64) -> ChannelSettings {
    ChannelSettings {
        encoder: EncoderSettings { reporting, ..EncoderSettings::new(NodeId::new(number).unwrap()) },
        limits: PlausibilityLimits::every(0.010, fastest, braking),
        counted,
    }
}

/// Everything that has been sent to a node.
fn drain(node: &mut InProcessNode) -> Vec<agv_wire::can::frame::Frame> {
    std::iter::from_fn(|| node.receive(Instant::now()).unwrap()).map(|frame| *frame.classic().unwrap()).collect()
}

fn drive_over_the_bus(reporting: Reporting) {
    let (truth, drive_range, steering_range) = simulated();
    assert!(truth.len() > 1000);
    // The steering counter has its own idea of a revolution: no limits for it.
    let tick = |range: CounterRange| range.values() as f64;
    let mut group = EncoderGroup::new(
        &[
            channel(1, Counted::Turn, reporting, 0.1 * tick(drive_range), 0.1 * tick(drive_range)),
            channel(2, Counted::Steering, reporting, 4.0 * tick(steering_range), 1e3 * tick(steering_range)),
        ],
        0.010,
        Time::from_micros(900_000),
    );
    let bus = InProcessBus::new();
    let (mut master, mut devices) = (bus.join(), bus.join());
    let mut encoders = [
        EmulatedEncoder::new(NodeId::new(1).unwrap(), drive_range),
        EmulatedEncoder::new(NodeId::new(2).unwrap(), steering_range),
    ];
    encoders[0].set_position(truth[0].drive);
    encoders[1].set_position(truth[0].steering);
    let end = truth.last().unwrap().time;
    let mut samples = Vec::new();
    let mut now = Time::from_micros(900_000);
    let mut alarms = 0;
    while now <= end {
        if let Ok(index) = truth.binary_search_by_key(&now, |sample| sample.time) {
            encoders[0].set_position(truth[index].drive);
            encoders[1].set_position(truth[index].steering);
        }
        // Setup needs several questions and answers; virtual time does not pass meanwhile.
        for _ in 0..4 {
            while let Some(frame) = group.poll(now) {
                master.send(&frame.into()).unwrap();
            }
            for encoder in &mut encoders {
                while let Some(frame) = encoder.poll(now) {
                    devices.send(&frame.into()).unwrap();
                }
            }
            for frame in drain(&mut devices) {
                for encoder in &mut encoders {
                    if let Some(answer) = encoder.handle(&frame) {
                        devices.send(&answer.into()).unwrap();
                    }
                }
            }
            for frame in drain(&mut master) {
                let counts = group.handle(&frame, now);
                samples.extend(counts.map(|Counts { time, counts: [drive, steering, ..] }| EncoderSample {
                    time,
                    drive,
                    steering,
                }));
            }
        }
        alarms += u32::from(now > Time::from_seconds(1.3) && group.faults(now).any());
        now = now.offset(0.001);
    }
    assert_eq!(group.states().collect::<Vec<_>>(), [EncoderState::Reporting; 2]);
    assert_eq!(alarms, 0);
    let first = truth.iter().position(|sample| sample.time >= Time::from_seconds(1.3)).unwrap();
    let compared: Vec<EncoderSample> =
        samples.iter().filter(|sample| sample.time >= truth[first].time).copied().collect();
    let difference = compared.iter().zip(&truth[first..]).find(|(found, expected)| found != expected);
    assert_eq!((difference, compared.len()), (None, truth.len() - first));
}

#[test]
fn synchronous_encoders_tell_the_simulated_counters() {
    drive_over_the_bus(Reporting::Synchronous);
}

#[test]
fn encoders_with_timers_tell_the_simulated_counters() {
    drive_over_the_bus(Reporting::Timer { period: 10 });
}
