/// How far a vehicle that does not know where it is has come with finding out.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Relocalization {
    /// It knows, or it does not try.
    #[default]
    Idle,
    /// It searches.
    Searching,
    /// Two poses fit what it sees equally.
    Ambiguous,
    /// It sees too few reflectors.
    TooFew,
    /// No place of the map looks like what it sees.
    Unknown,
}
