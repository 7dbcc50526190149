//! Files of the machine that emulates the board (ARM, "Semihosting for AArch32 and AArch64", SYS_OPEN, SYS_READ, SYS_WRITE,
//! SYS_SEEK).
#![allow(unsafe_code, reason = "semihosting passes addresses to the host")]

use cortex_m_semihosting::{nr, syscall};

/// A file of the host.
pub struct HostFile {
    handle: usize,
}

/// The host has not done what it was asked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct HostFileError;

impl HostFile {
    /// Opens a file to read. `name` ends with a zero.
    ///
    /// # Errors
    /// If the host does not.
    pub fn open(name: &core::ffi::CStr) -> Result<Self, HostFileError> {
        Self::open_as(name, nr::open::R_BINARY)
    }

    /// Creates a file to write; an older one is replaced.
    ///
    /// # Errors
    /// If the host does not.
    pub fn create(name: &core::ffi::CStr) -> Result<Self, HostFileError> {
        Self::open_as(name, nr::open::W_TRUNC_BINARY)
    }

    /// Opens a file to read and write; it must be there.
    ///
    /// # Errors
    /// If the host does not.
    pub fn open_to_change(name: &core::ffi::CStr) -> Result<Self, HostFileError> {
        Self::open_as(name, nr::open::RW_BINARY)
    }

    /// Goes to a place, from the beginning of the file.
    ///
    /// # Errors
    /// If the host does not.
    pub fn seek(&mut self, offset: usize) -> Result<(), HostFileError> {
        // SAFETY: no addresses are passed.
        let outcome = unsafe { syscall!(SEEK, self.handle, offset) };
        if outcome == 0 { Ok(()) } else { Err(HostFileError) }
    }

    fn open_as(name: &core::ffi::CStr, mode: usize) -> Result<Self, HostFileError> {
        // SAFETY: name and length are those of a string that lives through the call.
        let handle = unsafe { syscall!(OPEN, name.as_ptr(), mode, name.count_bytes()) };
        if handle == usize::MAX { Err(HostFileError) } else { Ok(Self { handle }) }
    }

    /// Reads as much as fits; returns how many bytes.
    ///
    /// # Errors
    /// If the host does not.
    pub fn read(&mut self, buffer: &mut [u8]) -> Result<usize, HostFileError> {
        // SAFETY: address and length are those of a buffer that is ours for the call.
        let rest = unsafe { syscall!(READ, self.handle, buffer.as_mut_ptr(), buffer.len()) };
        buffer.len().checked_sub(rest).ok_or(HostFileError)
    }

    /// Writes all bytes.
    ///
    /// # Errors
    /// If the host does not.
    pub fn write(&mut self, bytes: &[u8]) -> Result<(), HostFileError> {
        // SAFETY: address and length are those of bytes that live through the call.
        let rest = unsafe { syscall!(WRITE, self.handle, bytes.as_ptr(), bytes.len()) };
        if rest == 0 { Ok(()) } else { Err(HostFileError) }
    }
}
