//! SMSC LAN9118, the board's Ethernet controller (SMSC, "LAN9118 Datasheet", revision 1.5), for embassy-net.
#![allow(unsafe_code, reason = "registers are at fixed addresses")]

use core::task::Context;

use embassy_net_driver::{Capabilities, Driver, HardwareAddress, LinkState, RxToken, TxToken};
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::waitqueue::GenericAtomicWaker;

use super::registers::{read, write};

const BASE: usize = 0xA000_0000;
const RX_DATA: usize = 0x00;
const TX_DATA: usize = 0x20;
const RX_STATUS: usize = 0x40;
const TX_STATUS: usize = 0x48;
const IRQ_CFG: usize = 0x54;
const INT_STS: usize = 0x58;
const INT_EN: usize = 0x5C;
const FIFO_INT: usize = 0x68;
const RX_CFG: usize = 0x6C;
const TX_CFG: usize = 0x70;
const HW_CFG: usize = 0x74;
const RX_FIFO_INF: usize = 0x7C;
const TX_FIFO_INF: usize = 0x80;
const MAC_CSR_CMD: usize = 0xA4;
const MAC_CSR_DATA: usize = 0xA8;

/// MAC registers.
const MAC_CR: u32 = 1;
const ADDRH: u32 = 2;
const ADDRL: u32 = 3;

/// Full duplex; transmitter and receiver on.
const MAC_CR_ON: u32 = 0x0010_000C;
/// Push-pull, active high, enabled.
const IRQ_CFG_ON: u32 = 0x111;
/// A frame has been received.
const RSFL: u32 = 1 << 3;
/// Interrupt at the first received frame, and a threshold of free space for sending that QEMU ignores.
const FIFO_INT_LEVELS: u32 = 0x4800_0000;
const TX_ON: u32 = 1 << 1;
/// First and last segment of a frame, in one piece.
const TX_COMMAND_A: u32 = 0x3000;
const CSR_BUSY: u32 = 1 << 31;

/// Longest frame without its check sequence, bytes.
const FRAME: usize = 1514;

static WAKER: GenericAtomicWaker<CriticalSectionRawMutex> = GenericAtomicWaker::new(CriticalSectionRawMutex::new());

/// A frame has come.
pub fn on_interrupt() {
    // SAFETY: these are registers of a controller that only this driver uses. The task that is woken unmasks again.
    unsafe {
        write(BASE, INT_EN, 0);
        write(BASE, INT_STS, RSFL);
    }
    WAKER.wake();
}

/// The Ethernet controller.
pub struct Lan9118 {
    address: [u8; 6],
    buffer: [u8; FRAME + 6],
}

impl Lan9118 {
    /// Starts the controller with a MAC address.
    #[must_use]
    pub fn start(address: [u8; 6]) -> Self {
        let [a, b, c, d, e, f] = address;
        // SAFETY: these are registers of a controller that only this driver uses.
        unsafe {
            write(BASE, HW_CFG, 0x0005_0000);
            mac_write(ADDRL, u32::from_le_bytes([a, b, c, d]));
            mac_write(ADDRH, u32::from_le_bytes([e, f, 0, 0]));
            mac_write(MAC_CR, MAC_CR_ON);
            write(BASE, RX_CFG, 0);
            write(BASE, TX_CFG, TX_ON);
            write(BASE, FIFO_INT, FIFO_INT_LEVELS);
            write(BASE, INT_STS, u32::MAX);
            write(BASE, IRQ_CFG, IRQ_CFG_ON);
            write(BASE, INT_EN, RSFL);
        }
        Self { address, buffer: [0; FRAME + 6] }
    }

    /// Reads the next frame into the buffer; gives its length.
    fn read_frame(&mut self) -> Option<usize> {
        // SAFETY: these are registers of a controller that only this driver uses. As many words are read as the status
        // says that there are.
        unsafe {
            for _ in 0..16 {
                if read(BASE, RX_FIFO_INF) >> 16 & 0xFF == 0 {
                    return None;
                }
                let status = read(BASE, RX_STATUS);
                let length = (status >> 16 & 0x3FFF) as usize;
                let has_error = status & 1 << 15 != 0;
                // The check sequence comes along.
                let frame = length.saturating_sub(4);
                let is_good = !has_error && frame <= FRAME && frame > 0;
                for word in 0..length.div_ceil(4) {
                    let bytes = read(BASE, RX_DATA).to_le_bytes();
                    if let Some(place) = self.buffer.get_mut(4 * word..4 * word + 4) {
                        place.copy_from_slice(&bytes);
                    }
                }
                if is_good {
                    return Some(frame);
                }
            }
        }
        None
    }

    fn has_room() -> bool {
        // SAFETY: these are registers of a controller that only this driver uses.
        unsafe {
            for _ in 0..16 {
                // What became of earlier frames is of no interest, but takes room.
                if read(BASE, TX_FIFO_INF) >> 16 & 0xFF == 0 {
                    break;
                }
                let _ = read(BASE, TX_STATUS);
            }
            (read(BASE, TX_FIFO_INF) & 0xFFFF) as usize > FRAME + 16
        }
    }
}

/// Writes a register behind the MAC's own interface.
unsafe fn mac_write(register: u32, value: u32) {
    // SAFETY: the caller owns the controller.
    unsafe {
        write(BASE, MAC_CSR_DATA, value);
        write(BASE, MAC_CSR_CMD, CSR_BUSY | register);
        for _ in 0..1000 {
            if read(BASE, MAC_CSR_CMD) & CSR_BUSY == 0 {
                break;
            }
        }
    }
}

/// One received frame.
pub struct Received<'a>(&'a mut [u8]);

impl RxToken for Received<'_> {
    fn consume<R, F: FnOnce(&mut [u8]) -> R>(self, use_frame: F) -> R {
        use_frame(self.0)
    }
}

/// Room for one frame to send.
pub struct Room;

impl TxToken for Room {
    fn consume<R, F: FnOnce(&mut [u8]) -> R>(self, length: usize, fill: F) -> R {
        let mut frame = [0; FRAME + 2];
        let length = length.min(FRAME);
        let result = fill(&mut frame[..length]);
        // SAFETY: these are registers of a controller that only this driver uses; there is room, else there is no token.
        unsafe {
            write(BASE, TX_DATA, TX_COMMAND_A | length as u32);
            write(BASE, TX_DATA, length as u32);
            for bytes in frame[..length.next_multiple_of(4)].as_chunks::<4>().0 {
                write(BASE, TX_DATA, u32::from_le_bytes(*bytes));
            }
        }
        result
    }
}

impl Driver for Lan9118 {
    type RxToken<'a> = Received<'a>;
    type TxToken<'a> = Room;

    fn receive(&mut self, context: &mut Context) -> Option<(Self::RxToken<'_>, Self::TxToken<'_>)> {
        WAKER.register(context.waker());
        if !Self::has_room() {
            context.waker().wake_by_ref();
            return None;
        }
        let Some(length) = self.read_frame() else {
            // SAFETY: this is a register of a controller that only this driver uses.
            unsafe { write(BASE, INT_EN, RSFL) };
            return None;
        };
        Some((Received(&mut self.buffer[..length]), Room))
    }

    fn transmit(&mut self, context: &mut Context) -> Option<Self::TxToken<'_>> {
        if Self::has_room() {
            return Some(Room);
        }
        context.waker().wake_by_ref();
        None
    }

    fn link_state(&mut self, _: &mut Context) -> LinkState {
        LinkState::Up
    }

    fn capabilities(&self) -> Capabilities {
        let mut capabilities = Capabilities::default();
        capabilities.max_transmission_unit = FRAME;
        // A burst of one would shrink the window of TCP to one segment.
        capabilities.max_burst_size = None;
        capabilities
    }

    fn hardware_address(&self) -> HardwareAddress {
        HardwareAddress::Ethernet(self.address)
    }
}
