//! A localiser of any capacities.

use super::{Event, Outputs, PredictionState, StateError};
use crate::maps::MapView;
use crate::sources::{FindContours, FindPlaces};

/// The map of contours as a search has it, and its room.
pub type ContourSearch<'a, C> =
    Option<(<C as FindContours>::Map, &'a mut <<C as FindContours>::Places as FindPlaces>::Room)>;

/// What a controller wants of its localiser, whatever the localiser has room for.
pub trait Localize {
    /// Its contours, of any capacity.
    type Contours: FindContours;

    /// See [`super::Localizer::handle`].
    fn handle(&mut self, event: &Event) -> &Outputs;

    /// See [`super::Localizer::outputs`].
    fn outputs(&self) -> &Outputs;

    /// See [`super::Localizer::prediction_state`].
    fn prediction_state(&self) -> PredictionState;

    /// See [`super::Localizer::reflectors`].
    fn reflectors(&self) -> MapView<'_>;

    /// See [`super::Localizer::features`].
    fn features(&self) -> MapView<'_>;

    /// See [`super::Localizer::for_search`].
    fn for_search(&mut self) -> (MapView<'_>, ContourSearch<'_, Self::Contours>);

    /// See [`super::Localizer::save_state`].
    ///
    /// # Errors
    /// If the room is too small.
    fn save_state(&self, room: &mut [u8]) -> Result<usize, StateError>;
}

impl<L: Localize> Localize for &mut L {
    type Contours = L::Contours;

    fn handle(&mut self, event: &Event) -> &Outputs {
        (**self).handle(event)
    }

    fn outputs(&self) -> &Outputs {
        (**self).outputs()
    }

    fn prediction_state(&self) -> PredictionState {
        (**self).prediction_state()
    }

    fn reflectors(&self) -> MapView<'_> {
        (**self).reflectors()
    }

    fn features(&self) -> MapView<'_> {
        (**self).features()
    }

    fn for_search(&mut self) -> (MapView<'_>, ContourSearch<'_, L::Contours>) {
        (**self).for_search()
    }

    fn save_state(&self, room: &mut [u8]) -> Result<usize, StateError> {
        (**self).save_state(room)
    }
}
