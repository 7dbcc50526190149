//! The board's first serial line (CMSDK UART, ARM DDI 0479, 4.2), which carries the CAN bus as SLCAN.
#![allow(unsafe_code, reason = "registers are at fixed addresses")]

use core::cell::RefCell;
use core::future::poll_fn;
use core::task::Poll;

use agv_core::measurement::Time;
use agv_wire::can::frame::{AnyFrame, Frame};
use agv_wire::can::slcan::{Decoder, Message};
use critical_section::Mutex;
use embassy_sync::waitqueue::WakerRegistration;
use heapless::Deque;

use super::registers::{read, write};
use crate::app::can_port::CanPort;
use crate::app::exchange;

const BASE: usize = 0x4000_4000;
const DATA: usize = 0;
const STATE: usize = 4;
const CONTROL: usize = 8;
const INTERRUPT: usize = 12;
const BAUD: usize = 16;

const TRANSMIT_FULL: u32 = 1;
const RECEIVE_FULL: u32 = 1 << 1;
/// Both directions, with their interrupts.
const ENABLE: u32 = 0b1111;
const TRANSMIT_INTERRUPT: u32 = 1;
const RECEIVE_INTERRUPT: u32 = 1 << 1;

/// Frames that wait for the bus task.
const RECEIVED: usize = 64;
/// Bytes that wait for the line.
const SENT: usize = 2048;

struct State {
    decoder: Decoder,
    received: Deque<(Frame, Time), RECEIVED>,
    sent: Deque<u8, SENT>,
    waker: WakerRegistration,
    /// Frames that were lost because nobody took them, or the line was too slow.
    lost: u32,
}

static STATE_OF_LINE: Mutex<RefCell<Option<State>>> = Mutex::new(RefCell::new(None));

fn with<T>(work: impl FnOnce(&mut State) -> T) -> Option<T> {
    critical_section::with(|section| STATE_OF_LINE.borrow(section).try_borrow_mut().ok()?.as_mut().map(work))
}

/// Starts the line.
pub fn start() {
    critical_section::with(|section| {
        *STATE_OF_LINE.borrow(section).borrow_mut() = Some(State {
            decoder: Decoder::new(),
            received: Deque::new(),
            sent: Deque::new(),
            waker: WakerRegistration::new(),
            lost: 0,
        });
        // SAFETY: these are registers of a UART that only this driver uses.
        unsafe {
            write(BASE, BAUD, 16);
            write(BASE, CONTROL, ENABLE);
        }
    });
}

/// Bytes have come.
pub fn on_receive() {
    with(|state| {
        // SAFETY: these are registers of a UART that only this driver uses; one byte at most waits in it.
        unsafe {
            write(BASE, INTERRUPT, RECEIVE_INTERRUPT);
            while read(BASE, STATE) & RECEIVE_FULL != 0 {
                let byte = read(BASE, DATA) as u8;
                match state.decoder.push(byte) {
                    Some(Ok(Message::Frame { frame: AnyFrame::Classic(frame), .. })) => {
                        if state.received.push_back((frame, exchange::now())).is_err() {
                            state.lost += 1;
                        }
                        state.waker.wake();
                    }
                    // The other end takes this for an adapter: it is told that all is well.
                    Some(Ok(Message::Command(_))) => {
                        let _ = state.sent.push_back(b'\r');
                        state.transmit();
                    }
                    _ => {}
                }
            }
        }
    });
}

/// The line can take more.
pub fn on_transmit() {
    with(|state| {
        // SAFETY: this is a register of a UART that only this driver uses.
        unsafe { write(BASE, INTERRUPT, TRANSMIT_INTERRUPT) };
        state.transmit();
    });
}

impl State {
    fn transmit(&mut self) {
        // SAFETY: these are registers of a UART that only this driver uses.
        unsafe {
            while read(BASE, STATE) & TRANSMIT_FULL == 0 {
                let Some(byte) = self.sent.pop_front() else { return };
                write(BASE, DATA, u32::from(byte));
            }
        }
    }
}

/// The bus of the board.
pub struct SlcanPort;

impl CanPort for SlcanPort {
    async fn receive(&mut self) -> (Frame, Time) {
        poll_fn(|context| {
            let frame = with(|state| {
                state.waker.register(context.waker());
                state.received.pop_front()
            });
            frame.flatten().map_or(Poll::Pending, Poll::Ready)
        })
        .await
    }

    fn send(&mut self, frame: &Frame) -> bool {
        let line = Message::from(AnyFrame::from(*frame)).encode();
        with(|state| {
            let has_room = state.sent.capacity() - state.sent.len() >= line.len();
            if has_room {
                for byte in line {
                    // There is room.
                    let _ = state.sent.push_back(byte);
                }
                state.transmit();
            } else {
                state.lost += 1;
            }
            has_room
        })
        .unwrap_or(false)
    }

    fn lost(&self) -> u32 {
        with(|state| state.lost).unwrap_or(0)
    }
}
