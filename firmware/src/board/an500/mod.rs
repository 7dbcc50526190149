//! ARM's MPS2 with the image AN500: a Cortex-M7 that QEMU emulates (ARM DAI 0500, "Example Cortex-M7 SMM on V2M-MPS2+").

pub mod host_file;
pub mod log_file;
pub mod panic;
pub mod stopwatch;
