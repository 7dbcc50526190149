//! The machine that owns all below: one event in, outputs out.

mod bounds;
mod capacities;
mod contour_start_finder;
mod contours;
mod detail_bounds;
mod event;
mod evidence;
mod fusion;
mod given_pose;
mod gyro;
mod horizon;
mod lasers;
mod localize;
mod machine;
mod output;
mod output_predictor;
mod parameters;
mod prediction_state;
mod seen_through;
mod separate;
mod slam;
mod start_confirmation;
mod start_finder;
mod start_odometry;
mod start_search;
mod start_watch;
mod stored_state;
mod supervisor;
mod travel;

pub use bounds::{ParameterError, bounds};
pub use capacities::{
    Capacities, CapacitiesOf, ContourCapacities, LentCapacities, SlamCapacities, SlamSlots, StatedCapacities,
    VehicleCapacities, VehicleWithContours,
};
pub use contour_start_finder::ContourStartFinder;
pub use event::{AnyEvent, AsReflectors, AsScan, Event, kind};
pub use lasers::Lasers;
pub use localize::{ContourSearch, Localize};
pub use machine::Localizer;
pub use output::{Misuse, OBSERVATIONS, Outputs};
pub use output_predictor::OutputPredictor;
pub use parameters::{Limits, Parameters};
pub use prediction_state::PredictionState;

pub use start_confirmation::StartRule;
pub use start_finder::{StartFinder, StartState};
pub use start_search::{CONTOUR_EFFORT_A_REVOLUTION, CONTOUR_SLICE, EFFORT_A_REVOLUTION, StartSearch};
pub use stored_state::{STATE_VERSION, StateError};

pub use crate::measurement::PoseFix;
pub use crate::sources::{
    AssociationParameters, FeatureParameters, KeyScanParameters, MapUse, ReflectorParameters, SlamParameters,
};
pub use crate::state::{LandmarkSource, LandmarkUse, Mode, PoseOutput, Reason};
