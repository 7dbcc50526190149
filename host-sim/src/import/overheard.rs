//! Encoders in a recording of a bus whose master is another: which frames are theirs, how often they come, and what became of them.

use std::collections::BTreeSet;

use agv_controller::EncoderNodes;
use agv_core::measurement::{EncoderFault, Time};
use agv_core::odometry::Vehicle;
use agv_wire::can::canopen::{Message, NodeId, transmit_pdo_id};
use agv_wire::can::drive_402;
use agv_wire::can::encoder::Profile;
use agv_wire::can::frame::{AnyFrame, Frame, Id};

use super::raw::RawBytes;
use crate::account::Account;
use crate::recording::{RecordedEvent, Recording};

/// An encoder of the vehicle on the bus.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EncoderOnBus {
    /// Its node.
    pub node: NodeId,
    /// Identifier of the frames in which it tells its position.
    pub id: Id,
    /// Shortest content of such a frame, bytes.
    pub length: usize,
}

/// Bytes of a position, and of a drive's status word before it.
const POSITION: usize = 4;
const STATUS: usize = 2;

/// Identifier of the frames in which a node tells its position, if its master left it as the profile has it.
#[must_use]
pub fn position_id(node: NodeId, profile: Profile) -> Id {
    let number = match profile {
        Profile::Encoder => 1,
        Profile::Drive => drive_402::POSITION_PDO,
    };
    transmit_pdo_id(node, number)
}

/// The encoders of a vehicle; driving wheel and steering if it reports no counters. None of a vehicle whose own controller tells
/// its motion.
#[must_use]
pub fn encoders(nodes: &EncoderNodes, vehicle: &Vehicle) -> Vec<EncoderOnBus> {
    let counters = vehicle.counters().len();
    let count = match (counters, nodes.motion_frames) {
        (0, Some(_)) => 0,
        (0, None) => 2,
        (counters, _) => counters,
    };
    let found = nodes.encoders.iter().zip(&nodes.profiles).take(count);
    let on_bus = |(node, profile): (&NodeId, &Profile)| EncoderOnBus {
        node: *node,
        id: position_id(*node, *profile),
        length: if *profile == Profile::Drive { STATUS + POSITION } else { POSITION },
    };
    found.map(on_bus).collect()
}

fn frames(raw: &[RawBytes]) -> impl Iterator<Item = (Time, Frame)> {
    raw.iter().filter_map(|one| Some((one.time, one.can_frame().as_ref().and_then(AnyFrame::classic).copied()?)))
}

/// Time between the positions of the slowest encoder, s. None if one of them told no two.
#[must_use]
pub fn period(raw: &[RawBytes], encoders: &[EncoderOnBus]) -> Option<f64> {
    let usual = |encoder: &EncoderOnBus| {
        let times: Vec<Time> =
            frames(raw).filter(|(_, frame)| frame.id() == encoder.id).map(|(time, _)| time).collect();
        let mut steps: Vec<f64> = times.windows(2).map(|pair| pair[1].since(pair[0])).collect();
        steps.sort_by(f64::total_cmp);
        steps.get(steps.len() / 2).copied()
    };
    encoders.iter().map(usual).try_fold(0.0, |longest: f64, one| Some(longest.max(one?))).filter(|period| *period > 0.0)
}

/// Nodes that tell something where encoders tell their positions.
#[must_use]
pub fn talking_nodes(raw: &[RawBytes]) -> Vec<u8> {
    let node = |frame: Frame| match Message::decode(&frame) {
        Ok(Message::TransmitPdo { node, number: 1, .. }) => Some(node.number()),
        _ => None,
    };
    frames(raw).filter_map(|(_, frame)| node(frame)).collect::<BTreeSet<u8>>().into_iter().collect()
}

/// Says what became of the positions in a recording of which `drive` was made.
pub fn account(drive: &Recording, raw: &[RawBytes], encoders: &[EncoderOnBus], account: &mut Account) {
    let samples = drive.events.iter().filter(|event| event.is_odometry()).count();
    account.take(samples);
    if drive.parameters.vehicle == Vehicle::Increments && !encoders.is_empty() && samples > 0 {
        account.warn("no motion can be made of the counters: say which vehicle it is with --like LOG");
    }
    // Frames of an encoder that hold a position, and that do not.
    let of = |encoder: &EncoderOnBus| {
        let own = frames(raw).filter(|(_, frame)| frame.id() == encoder.id && !frame.is_remote());
        own.fold((0_usize, 0_usize), |(whole, short), (_, frame)| {
            if frame.data().len() < encoder.length { (whole, short + 1) } else { (whole + 1, short) }
        })
    };
    for encoder in encoders {
        let (_, short) = of(encoder);
        let (node, length) = (encoder.node.number(), encoder.length);
        account.leave_out_some(format!("frames of node {node} with less than the {length} bytes of a position"), short);
    }
    let Some(first) = encoders.first() else { return };
    // The last position waits for those of the others.
    let missing = of(first).0.saturating_sub(samples + 1);
    if missing > 0 {
        let why = faults(drive);
        let why = if why.is_empty() { String::new() } else { format!(" ({why})") };
        let node = first.node.number();
        account.leave_out_some(format!("positions of node {node} that made no sample{why}"), missing);
    }
}

/// Faults that the encoders had, in words.
fn faults(drive: &Recording) -> String {
    let mut found: Vec<String> = Vec::new();
    for event in &drive.events {
        let RecordedEvent::EncoderFaults(faults) = event else { continue };
        for (name, fault) in [("driving wheel", faults.drive), ("steering", faults.steering)] {
            let text = fault.map(|fault| format!("{name}: {}", fault_name(fault)));
            found.extend(text.filter(|text| !found.contains(text)));
        }
    }
    found.join(", ")
}

const fn fault_name(fault: EncoderFault) -> &'static str {
    match fault {
        EncoderFault::Missing => "missing",
        EncoderFault::Late => "late",
        EncoderFault::OutOfRange => "out of range",
        EncoderFault::Jumped => "jumped",
        EncoderFault::Frozen => "frozen",
        EncoderFault::Reported => "reports an error",
        EncoderFault::HeartbeatLost => "heartbeat lost",
        EncoderFault::WrongRange => "another range than set",
        EncoderFault::WrongDirection => "another direction than set",
    }
}
