//! ARM's MPS2 with the image AN500: a Cortex-M7 that QEMU emulates (ARM DAI 0500, "Example Cortex-M7 SMM on V2M-MPS2+").

pub mod host_file;
pub mod interrupts;
pub mod lan9118;
pub mod log_file;
pub mod panic;
mod registers;
pub mod settings_file;
pub mod stopwatch;
pub mod time_driver;
pub mod uart;
