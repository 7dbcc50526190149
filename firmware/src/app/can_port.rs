//! The bus as the application sees it.

use agv_core::measurement::Time;
use agv_wire::can::canopen::NodeId;
use agv_wire::can::frame::{Frame, Id};

/// What has become of the bus.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BusChange {
    /// Frames of others came faster than they were taken.
    Overrun,
    /// Errors have driven the controller off the bus.
    Off,
    /// It takes part again.
    BackFromOff,
}

/// A CAN controller with queues.
pub trait CanPort {
    /// Takes only the frames of these nodes and for them, those for all nodes, and those of the `other` identifier. Everything, if it
    /// cannot choose.
    fn listen_to(&mut self, _nodes: &[NodeId], _others: &[Id]) {}

    /// The next classic frame of others, and when its end was heard.
    fn receive(&mut self) -> impl Future<Output = (Frame, Time)>;

    /// Queues a frame to send; false if it is dropped because the queue is full, or nobody would hear it. Never waits.
    fn send(&mut self, frame: &Frame) -> bool;

    /// Does what is due; to be called every millisecond.
    fn supervise(&mut self, _now: Time) -> Option<BusChange> {
        None
    }

    /// How many frames were lost so far, in either direction.
    fn lost(&self) -> u32;
}
