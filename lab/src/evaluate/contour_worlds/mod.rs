//! Localising by contours in simulated worlds that are no block storage: racks on legs, an open hall, a corridor, a dock.

mod drives;
mod information;
mod sites;
mod starts;
mod survey;
mod ways;

pub use drives::{PoseAccuracy, SiteDrives, drive_in_worlds};
pub use sites::SiteKind;
pub use starts::{Outcome, STARTS_A_WORLD, run};
