//! The bus as the application sees it.

use agv_core::measurement::Time;
use agv_wire::can::frame::Frame;

/// A CAN controller with queues.
pub trait CanPort {
    /// The next classic frame of others, and when its end was heard.
    fn receive(&mut self) -> impl Future<Output = (Frame, Time)>;

    /// Queues a frame to send; false if it is dropped because the queue is full. Never waits.
    fn send(&mut self, frame: &Frame) -> bool;

    /// How many frames were lost so far, in either direction.
    fn lost(&self) -> u32;
}
