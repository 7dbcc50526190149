//! The interrupts of the board, and what each one does.
#![allow(unsafe_code, reason = "the vector table is read by the processor")]

use cortex_m::interrupt::InterruptNumber;
use cortex_m::peripheral::NVIC;
use embassy_executor::InterruptExecutor;

use super::{lan9118, time_driver, uart};

/// Lines of the interrupt controller.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u16)]
pub enum Interrupt {
    /// UART 0 has received a byte.
    UartReceive = 0,
    /// UART 0 can take a byte.
    UartTransmit = 1,
    /// The alarm of the time driver.
    Alarm = 8,
    /// Ethernet.
    Ethernet = 13,
    /// Runs the tasks of the bus; no peripheral has this line.
    BusTasks = 29,
    /// Runs the tasks of the network; no peripheral has this line.
    NetworkTasks = 30,
}

// SAFETY: the numbers are those of the board's table (ARM DAI 0500, 3.6), and below 32.
unsafe impl InterruptNumber for Interrupt {
    fn number(self) -> u16 {
        self as u16
    }
}

/// Tasks that nothing but a driver may delay: encoders, prediction, the pose on the bus.
pub static BUS_TASKS: InterruptExecutor = InterruptExecutor::new();
/// Tasks of the network.
pub static NETWORK_TASKS: InterruptExecutor = InterruptExecutor::new();

/// Lets interrupts come: drivers above the bus, the bus above the network, the network above everything else.
pub fn enable(nvic: &mut NVIC) {
    for (interrupt, priority) in [
        (Interrupt::Alarm, 0x20),
        (Interrupt::UartReceive, 0x20),
        (Interrupt::UartTransmit, 0x20),
        (Interrupt::BusTasks, 0x40),
        (Interrupt::Ethernet, 0x60),
        (Interrupt::NetworkTasks, 0x80),
    ] {
        // SAFETY: no critical section rests on priorities; all of them mask every interrupt.
        unsafe {
            nvic.set_priority(interrupt, priority);
            NVIC::unmask(interrupt);
        }
    }
}

unsafe extern "C" {
    fn DefaultHandler();
}

extern "C" fn on_uart_receive() {
    uart::on_receive();
}

extern "C" fn on_uart_transmit() {
    uart::on_transmit();
}

extern "C" fn on_alarm() {
    time_driver::on_alarm();
}

extern "C" fn on_ethernet() {
    lan9118::on_interrupt();
}

extern "C" fn on_bus_tasks() {
    // SAFETY: this is the interrupt with whose number the executor is started.
    unsafe { BUS_TASKS.on_interrupt() };
}

extern "C" fn on_network_tasks() {
    // SAFETY: this is the interrupt with whose number the executor is started.
    unsafe { NETWORK_TASKS.on_interrupt() };
}

const fn vectors() -> [unsafe extern "C" fn(); 32] {
    let mut vectors: [unsafe extern "C" fn(); 32] = [DefaultHandler; 32];
    vectors[Interrupt::UartReceive as usize] = on_uart_receive;
    vectors[Interrupt::UartTransmit as usize] = on_uart_transmit;
    vectors[Interrupt::Alarm as usize] = on_alarm;
    vectors[Interrupt::Ethernet as usize] = on_ethernet;
    vectors[Interrupt::BusTasks as usize] = on_bus_tasks;
    vectors[Interrupt::NetworkTasks as usize] = on_network_tasks;
    vectors
}

/// The part of the vector table behind the processor's own exceptions.
#[unsafe(link_section = ".vector_table.interrupts")]
#[unsafe(no_mangle)]
pub static __INTERRUPTS: [unsafe extern "C" fn(); 32] = vectors();
