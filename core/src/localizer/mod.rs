//! The machine that owns all below: one event in, outputs out.

mod event;
mod machine;
mod maps;
mod mode;
mod output;
mod parameters;

pub use event::{Event, PoseFix};
pub use machine::Localizer;
pub use mode::{Mode, Reason};
pub use output::{LandmarkSource, LandmarkUse, Outputs, PoseOutput};
pub use parameters::{AssociationParameters, FeatureParameters, Limits, MapUse, Parameters, ReflectorParameters};
