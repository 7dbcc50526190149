//! The maps that the localiser compares its observations with.

use core::fmt::Debug;
use core::marker::PhantomData;

use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::geometry::Point;
use crate::maps::{
    DynamicLandmark, DynamicMap, DynamicMapParameters, DynamicMapView, FixedMap, Landmark, LandmarkKind, LendError,
    LentMap, MapError, MapView,
};

/// The fixed maps and the dynamic one.
#[derive(Clone, Debug)]
pub struct Maps<R, F, const DYNAMIC: usize> {
    fixed: FixedMaps<R, F>,
    dynamic: DynamicMap<DYNAMIC>,
}

/// The fixed map of reflectors, and that of natural features.
#[derive(Clone, Debug)]
pub struct FixedMaps<R, F> {
    reflectors: R,
    features: F,
}

/// What is compared with what is seen.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MapViews<'a> {
    pub reflectors: MapView<'a>,
    pub features: MapView<'a>,
    pub dynamic: DynamicMapView<'a>,
}

/// One fixed map.
pub trait KeptLandmarks: Clone + Debug {
    /// Landmarks, at the most.
    const MOST: usize;

    /// An empty map.
    fn new() -> Self;

    /// What it holds.
    fn view(&self) -> MapView<'_>;
}

/// How a localiser has its fixed maps: [`Own`], or [`Lent`].
pub trait MapKeeping: Clone + Debug {
    /// A map of so many landmarks.
    type Map<const LANDMARKS: usize>: KeptLandmarks;
}

/// The localiser has a copy of its map.
#[derive(Clone, Copy, Debug)]
pub struct Own;

/// The map is lent to the localiser for `'m`: it stands in memory once.
#[derive(Clone, Copy, Debug)]
pub struct Lent<'m>(PhantomData<&'m Landmark>);

impl MapKeeping for Own {
    type Map<const LANDMARKS: usize> = FixedMap<LANDMARKS>;
}

impl<'m> MapKeeping for Lent<'m> {
    type Map<const LANDMARKS: usize> = LentMap<'m, LANDMARKS>;
}

/// [`Maps`] of any capacities.
pub trait LandmarkMaps: Clone + Debug {
    /// What has been found while driving.
    type Found: Serialize + DeserializeOwned;

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

    /// All landmarks of the dynamic map.
    fn found(&self) -> &[DynamicLandmark];

    /// What was found, as it is stored.
    fn found_map(&self) -> &Self::Found;

    /// Takes what was found from where it was stored.
    fn set_found_map(&mut self, found: Self::Found);

    /// Forgets what was found.
    fn forget_found(&mut self);

    /// Brings the dynamic map up to date by the features of one scan: positions in W, m, with the landmark that each belongs to.
    fn find(&mut self, features: impl Iterator<Item = (LandmarkKind, Point, Option<u16>)>);
}

/// Maps to which landmarks are copied.
pub trait AddLandmarks: LandmarkMaps {
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
}

/// Maps to which landmarks are lent for `'m`.
pub trait LendLandmarks<'m>: LandmarkMaps {
    /// Takes these landmarks instead of those before: reflectors, then features.
    ///
    /// # Errors
    /// [`LendError`] if they do not fit or are in another order; the maps are as before then.
    fn lend(&mut self, landmarks: &'m [Landmark]) -> Result<(), LendError>;
}

fn is_reflector(landmark: &Landmark) -> bool {
    landmark.kind == LandmarkKind::Reflector
}

impl<const LANDMARKS: usize> KeptLandmarks for FixedMap<LANDMARKS> {
    const MOST: usize = LANDMARKS;

    #[inline(always)]
    fn new() -> Self {
        Self::new()
    }

    #[inline]
    fn view(&self) -> MapView<'_> {
        self.view()
    }
}

impl<const LANDMARKS: usize> KeptLandmarks for LentMap<'_, LANDMARKS> {
    const MOST: usize = LANDMARKS;

    #[inline(always)]
    fn new() -> Self {
        Self::new()
    }

    #[inline]
    fn view(&self) -> MapView<'_> {
        self.view()
    }
}

impl<R: KeptLandmarks, F: KeptLandmarks, const DYNAMIC: usize> LandmarkMaps for Maps<R, F, DYNAMIC> {
    type Found = DynamicMap<DYNAMIC>;

    const FIXED: usize = R::MOST + F::MOST;

    #[inline(always)]
    fn new(dynamic: DynamicMapParameters) -> Self {
        Self { fixed: FixedMaps { reflectors: R::new(), features: F::new() }, dynamic: DynamicMap::new(dynamic) }
    }

    #[inline]
    fn reflectors(&self) -> MapView<'_> {
        self.fixed.reflectors.view()
    }

    #[inline]
    fn features(&self) -> MapView<'_> {
        self.fixed.features.view()
    }

    #[inline]
    fn dynamic(&self) -> DynamicMapView<'_> {
        self.dynamic.view()
    }

    fn found(&self) -> &[DynamicLandmark] {
        self.dynamic.landmarks()
    }

    fn found_map(&self) -> &DynamicMap<DYNAMIC> {
        &self.dynamic
    }

    fn set_found_map(&mut self, found: DynamicMap<DYNAMIC>) {
        self.dynamic = found;
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

impl<const REFLECTORS: usize, const FEATURES: usize, const DYNAMIC: usize> AddLandmarks
    for Maps<FixedMap<REFLECTORS>, FixedMap<FEATURES>, DYNAMIC>
{
    fn add(&mut self, landmarks: &[Landmark]) -> Result<(), MapError> {
        // Runs of one kind, so that each map is indexed once for a list that is sorted by kind.
        let mut rest = landmarks;
        while let Some(first) = rest.first() {
            let are_reflectors = is_reflector(first);
            let length = rest.iter().take_while(|landmark| is_reflector(landmark) == are_reflectors).count();
            let Some((run, others)) = rest.split_at_checked(length) else { break };
            if are_reflectors {
                self.fixed.reflectors.extend(run)?;
            } else {
                self.fixed.features.extend(run)?;
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
        self.fixed.reflectors.clear();
        self.fixed.features.clear();
        self.add(landmarks)
    }
}

impl<'m, const REFLECTORS: usize, const FEATURES: usize, const DYNAMIC: usize> LendLandmarks<'m>
    for Maps<LentMap<'m, REFLECTORS>, LentMap<'m, FEATURES>, DYNAMIC>
{
    fn lend(&mut self, landmarks: &'m [Landmark]) -> Result<(), LendError> {
        let count = landmarks.iter().take_while(|landmark| is_reflector(landmark)).count();
        let Some((reflectors, features)) = landmarks.split_at_checked(count) else { return Err(LendError::Order) };
        if features.iter().any(is_reflector) {
            return Err(LendError::Order);
        }
        let mut lent = FixedMaps { reflectors: LentMap::new(), features: LentMap::new() };
        lent.reflectors.lend(reflectors)?;
        lent.features.lend(features)?;
        self.fixed = lent;
        Ok(())
    }
}
