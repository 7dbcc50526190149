//! The maps that the localiser compares its observations with.

use core::fmt::Debug;

use crate::geometry::Point;
use crate::maps::{
    DynamicLandmark, DynamicMap, DynamicMapParameters, DynamicMapView, FixedMap, Landmark, LandmarkKind, MapError,
    MapView,
};

/// The fixed maps and the dynamic one.
#[derive(Clone, Debug)]
pub struct Maps<const REFLECTORS: usize, const FEATURES: usize, const DYNAMIC: usize> {
    reflectors: FixedMap<REFLECTORS>,
    features: FixedMap<FEATURES>,
    dynamic: DynamicMap<DYNAMIC>,
}

/// What is compared with what is seen.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MapViews<'a> {
    pub reflectors: MapView<'a>,
    pub features: MapView<'a>,
    pub dynamic: DynamicMapView<'a>,
}

/// [`Maps`] of any capacities.
pub trait LandmarkMaps: Clone + Debug {
    /// Landmarks of the fixed maps, at the most.
    const FIXED: usize;

    /// Empty maps.
    fn new(dynamic: DynamicMapParameters) -> Self;

    /// The fixed map of reflectors.
    fn reflectors(&self) -> MapView<'_>;

    /// The fixed map of natural features.
    fn features(&self) -> MapView<'_>;

    /// The dynamic map.
    fn dynamic(&self) -> DynamicMapView<'_>;

    /// Adds landmarks to the fixed maps, each to the one of its kind.
    ///
    /// # Errors
    /// [`MapError`] if a landmark does not fit; those before it are in the map.
    fn add(&mut self, landmarks: &[Landmark]) -> Result<(), MapError>;

    /// Replaces all landmarks of the fixed maps.
    ///
    /// # Errors
    /// [`MapError`] if the landmarks do not fit; the maps are as before then.
    fn replace(&mut self, landmarks: &[Landmark]) -> Result<(), MapError>;

    /// All landmarks of the dynamic map.
    fn found(&self) -> &[DynamicLandmark];

    /// Forgets what was found.
    fn forget_found(&mut self);

    /// Brings the dynamic map up to date by the features of one scan: positions in W, m, with the landmark that each belongs to.
    fn find(&mut self, features: impl Iterator<Item = (LandmarkKind, Point, Option<u16>)>);
}

fn is_reflector(landmark: &Landmark) -> bool {
    landmark.kind == LandmarkKind::Reflector
}

impl<const REFLECTORS: usize, const FEATURES: usize, const DYNAMIC: usize> LandmarkMaps
    for Maps<REFLECTORS, FEATURES, DYNAMIC>
{
    const FIXED: usize = REFLECTORS + FEATURES;

    #[inline(always)]
    fn new(dynamic: DynamicMapParameters) -> Self {
        Self { reflectors: FixedMap::new(), features: FixedMap::new(), dynamic: DynamicMap::new(dynamic) }
    }

    #[inline]
    fn reflectors(&self) -> MapView<'_> {
        self.reflectors.view()
    }

    #[inline]
    fn features(&self) -> MapView<'_> {
        self.features.view()
    }

    #[inline]
    fn dynamic(&self) -> DynamicMapView<'_> {
        self.dynamic.view()
    }

    fn add(&mut self, landmarks: &[Landmark]) -> Result<(), MapError> {
        // Runs of one kind, so that each map is indexed once for a list that is sorted by kind.
        let mut rest = landmarks;
        while let Some(first) = rest.first() {
            let are_reflectors = is_reflector(first);
            let length = rest.iter().take_while(|landmark| is_reflector(landmark) == are_reflectors).count();
            let Some((run, others)) = rest.split_at_checked(length) else { break };
            if are_reflectors {
                self.reflectors.extend(run)?;
            } else {
                self.features.extend(run)?;
            }
            rest = others;
        }
        Ok(())
    }

    fn replace(&mut self, landmarks: &[Landmark]) -> Result<(), MapError> {
        if !landmarks.iter().all(Landmark::is_finite) {
            return Err(MapError::NotFinite);
        }
        let reflectors = landmarks.iter().filter(|landmark| is_reflector(landmark)).count();
        if reflectors > REFLECTORS || landmarks.len() - reflectors > FEATURES {
            return Err(MapError::Full);
        }
        self.reflectors.clear();
        self.features.clear();
        self.add(landmarks)
    }

    fn found(&self) -> &[DynamicLandmark] {
        self.dynamic.landmarks()
    }

    fn forget_found(&mut self) {
        self.dynamic.clear();
    }

    #[inline]
    fn find(&mut self, features: impl Iterator<Item = (LandmarkKind, Point, Option<u16>)>) {
        for (kind, position, matched) in features {
            match matched {
                Some(id) => self.dynamic.update(id, position),
                None => self.dynamic.insert(kind, position),
            }
        }
        self.dynamic.finish();
    }
}
