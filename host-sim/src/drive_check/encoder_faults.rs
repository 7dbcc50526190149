//! What the vehicle itself has found wrong with its encoders.

use agv_core::localizer::AnyEvent;
use agv_core::measurement::{EncoderFault, EncoderFaults, Time};

use super::Finding;
use crate::recording::Recording;

/// Which of a tricycle's encoders.
#[derive(Clone, Copy)]
enum Encoder {
    Drive,
    Steering,
}

const FAULTS: [EncoderFault; 9] = [
    EncoderFault::Late,
    EncoderFault::Missing,
    EncoderFault::Frozen,
    EncoderFault::Jumped,
    EncoderFault::OutOfRange,
    EncoderFault::Reported,
    EncoderFault::HeartbeatLost,
    EncoderFault::WrongRange,
    EncoderFault::WrongDirection,
];

/// Each fault of each encoder, with the time that it lasted.
pub(super) fn findings(recording: &Recording) -> Vec<Finding> {
    let told: Vec<EncoderFaults> = recording
        .events
        .iter()
        .filter_map(|event| if let AnyEvent::EncoderFaults(faults) = event { Some(*faults) } else { None })
        .collect();
    let end = recording.events.iter().filter_map(|event| event.time()).max();
    let mut findings = Vec::new();
    for encoder in [Encoder::Drive, Encoder::Steering] {
        for fault in FAULTS {
            let is_it = |faults: &EncoderFaults| match encoder {
                Encoder::Drive => faults.drive == Some(fault),
                Encoder::Steering => faults.steering == Some(fault),
            };
            let times = told.iter().filter(|faults| is_it(faults)).count();
            if times > 0 {
                findings.push(finding(encoder, fault, times, duration(&told, end, is_it)));
            }
        }
    }
    findings
}

/// How long a fault was there, s: from each word of it to the next word of the encoders' faults, or to the end.
fn duration(told: &[EncoderFaults], end: Option<Time>, is_it: impl Fn(&EncoderFaults) -> bool) -> f64 {
    let next = |index: usize| told.get(index + 1).map(|faults| faults.time).or(end);
    let spans = told.iter().enumerate().filter(|(_, faults)| is_it(faults));
    spans.filter_map(|(index, faults)| Some(next(index)?.since(faults.time).max(0.0))).sum()
}

fn finding(encoder: Encoder, fault: EncoderFault, times: usize, duration: f64) -> Finding {
    let (name, node, values) = match encoder {
        Encoder::Drive => ("drive", "can.drive_node", "vehicle.drive_counter_values"),
        Encoder::Steering => ("steering", "can.steering_node", "vehicle.steering_counter_values"),
    };
    let (what, next) = match fault {
        EncoderFault::Late => ("is late", "look at the load of the bus: agv can monitor can0".to_owned()),
        EncoderFault::Missing => {
            ("is missing", format!("look at its plug and supply, and whether {node} is its node: agv can monitor can0"))
        }
        EncoderFault::Frozen => ("stands still while the vehicle moves", "look at its coupling".to_owned()),
        EncoderFault::Jumped => ("jumps", "look at its cable, its shield and its coupling".to_owned()),
        EncoderFault::OutOfRange => ("shows counts beyond its range", format!("agv settings {values}")),
        EncoderFault::Reported => {
            ("reports an error of its own", "look up its emergency: agv can monitor can0".to_owned())
        }
        EncoderFault::HeartbeatLost => {
            ("has no heartbeat any more", "look at its plug and supply: agv can monitor can0".to_owned())
        }
        EncoderFault::WrongRange => {
            ("has another number of positions than the settings", format!("agv settings {values}"))
        }
        EncoderFault::WrongDirection => {
            ("counts the other way than the settings say", format!("agv settings can.{name}_code_sequence"))
        }
    };
    let times = if times == 1 { "once".to_owned() } else { format!("{times} times") };
    Finding::new(format!("the controller says that the {name} encoder {what}: {times}, for {duration:.1} s"), next)
}
