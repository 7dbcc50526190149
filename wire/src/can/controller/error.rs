//! Why a frame is not understood.

/// Why a frame is none of the controller's.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ControllerError {
    /// Another identifier.
    Foreign,
    /// The frame has not eight bytes.
    Length,
    /// A mode, reason or fault has no meaning.
    Value,
}
