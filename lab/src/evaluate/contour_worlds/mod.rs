//! Localising by contours in simulated worlds that are no block storage: racks on legs, an open hall, a corridor, a dock.

mod sites;
mod starts;
mod survey;

pub use sites::SiteKind;
pub use starts::{Outcome, STARTS_A_WORLD, run};
