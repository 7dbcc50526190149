//! The bus as the application sees it.

use agv_core::wire::can::frame::{AnyFrame, Frame};

/// A CAN controller with queues.
pub trait CanPort {
    /// The next frame of others.
    fn receive(&mut self) -> impl Future<Output = AnyFrame>;

    /// Queues a frame to send; false if it is dropped because the queue is full. Never waits.
    fn send(&mut self, frame: &Frame) -> bool;

    /// How many frames were lost so far, in either direction.
    fn lost(&self) -> u32;
}
