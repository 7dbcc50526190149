//! The vehicles of several wheels that parameters can describe.

use serde::{Deserialize, Serialize};

use super::{AckermannWheels, BiSteerable, Differential, DrivenWheel, Mecanum, Omnidirectional, Wheel, WheelBased};
use crate::measurement::MOST_WHEELS;

/// One of the kinematics of several wheels, chosen from this list. All report [`crate::measurement::WheelSample`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum WheelVehicle {
    /// Two driven wheels side by side.
    Differential(Differential),
    /// Two wheels that steer and drive.
    BiSteerable(BiSteerable),
    /// A car with counters at its rear wheels.
    Ackermann(AckermannWheels),
    /// Three omnidirectional wheels.
    ThreeOmnidirectional(#[serde(with = "around")] Omnidirectional<3>),
    /// Four omnidirectional wheels.
    FourOmnidirectional(#[serde(with = "around")] Omnidirectional<4>),
    /// Four mecanum wheels.
    Mecanum(Mecanum),
}

/// Up to [`MOST_WHEELS`] wheels.
struct List(heapless::Vec<Wheel, MOST_WHEELS>);

impl List {
    fn of(wheels: &[Wheel]) -> Self {
        let mut list = heapless::Vec::new();
        for wheel in wheels {
            // None of the vehicles has more than there is room for.
            let _ = list.push(*wheel);
        }
        Self(list)
    }
}

impl AsRef<[Wheel]> for List {
    fn as_ref(&self) -> &[Wheel] {
        &self.0
    }
}

impl WheelBased for WheelVehicle {
    fn wheels(&self) -> impl AsRef<[Wheel]> {
        match self {
            Self::Differential(vehicle) => List::of(vehicle.wheels().as_ref()),
            Self::BiSteerable(vehicle) => List::of(vehicle.wheels().as_ref()),
            Self::Ackermann(vehicle) => List::of(vehicle.wheels().as_ref()),
            Self::ThreeOmnidirectional(vehicle) => List::of(vehicle.wheels().as_ref()),
            Self::FourOmnidirectional(vehicle) => List::of(vehicle.wheels().as_ref()),
            Self::Mecanum(vehicle) => List::of(vehicle.wheels().as_ref()),
        }
    }
}

impl WheelVehicle {
    /// Whether something can be computed with all of its numbers: they are finite, no measured wheel is a point or stands still
    /// whatever is counted, and neither place nor radius is beyond 50 m.
    #[must_use]
    pub fn is_sound(&self) -> bool {
        const LARGEST: f64 = 50.0;
        let is_within = |value: f64| libm::fabs(value) <= LARGEST;
        self.wheels().as_ref().iter().all(|wheel| {
            let is_measured =
                wheel.turn.is_none_or(|turn| is_within(turn.scale) && turn.scale != 0.0 && wheel.radius != 0.0);
            let is_steered = wheel.steering.is_none_or(|steering| is_within(steering.scale) && steering.scale != 0.0);
            [wheel.x, wheel.y, wheel.heading, wheel.radius].into_iter().all(is_within) && is_measured && is_steered
        })
    }
}

/// Omnidirectional wheels as settings and logs hold them.
mod around {
    use serde::de::DeserializeOwned;
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    use super::{DrivenWheel, Omnidirectional};

    pub fn serialize<S: Serializer, const N: usize>(
        vehicle: &Omnidirectional<N>,
        serializer: S,
    ) -> Result<S::Ok, S::Error>
    where
        [DrivenWheel; N]: Serialize,
    {
        (vehicle.arm, vehicle.first, vehicle.driven).serialize(serializer)
    }

    pub fn deserialize<'de, D: Deserializer<'de>, const N: usize>(
        deserializer: D,
    ) -> Result<Omnidirectional<N>, D::Error>
    where
        [DrivenWheel; N]: DeserializeOwned,
    {
        let (arm, first, driven) = Deserialize::deserialize(deserializer)?;
        Ok(Omnidirectional { arm, first, driven })
    }
}
