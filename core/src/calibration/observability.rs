//! What a set of segments cannot tell (K 2.4.1).

/// Why parameters cannot be found (K propositions 2.4.1 to 2.4.3).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unobservable {
    /// There are fewer segments than unknowns need.
    TooFewSegments,
    /// The driving wheel hardly moves.
    NoMotion,
    /// A value is not finite.
    NotFinite,
    /// All segments have one steering angle: the offset cannot be told from the scale.
    OneSteeringAngle,
    /// There are no two forward segments with different steering angles.
    OneSteeringAngleForward,
    /// There are no two backward segments with different steering angles.
    OneSteeringAngleBackward,
    /// No segment turns the vehicle: the laser's place cannot be told.
    NoRotation,
    /// The laser does not move though the vehicle turns: its heading cannot be told.
    NoTranslation,
    /// The rotations forward and backward allow no common drive scale.
    NoCommonScale,
    /// The laser seems to be on the other side than stated.
    WrongSide,
}

/// Smallest deviation of steering angles, rad, that counts as different angles.
pub(super) const SMALLEST_STEERING_DEVIATION: f64 = 0.01;

/// Smallest distance of the driving wheel, in ticks over all segments, that counts as motion.
pub(super) const SMALLEST_WAY: f64 = 16.0;
