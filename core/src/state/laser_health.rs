/// Whether the laser can be used.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum LaserHealth {
    /// Nobody knows.
    #[default]
    Unknown,
    /// It measures.
    Sound,
    /// It does not answer.
    Silent,
    /// It reports an error.
    Faulty,
}
