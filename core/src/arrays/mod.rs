//! Arrays of any length as bytes: serde knows lengths up to 32.

use heapless::Vec;
use serde::de::Error;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// The length, and the elements.
///
/// # Errors
/// Those of the serializer.
pub fn serialize<T: Serialize, S: Serializer>(array: &impl AsRef<[T]>, serializer: S) -> Result<S::Ok, S::Error> {
    array.as_ref().serialize(serializer)
}

/// An array of that length.
///
/// # Errors
/// Those of the deserializer, and one where the length is another.
pub fn deserialize<'de, T, D, const LENGTH: usize>(deserializer: D) -> Result<[T; LENGTH], D::Error>
where
    T: Deserialize<'de>,
    D: Deserializer<'de>,
{
    let elements = Vec::<T, LENGTH>::deserialize(deserializer)?;
    elements.into_array().map_err(|elements| D::Error::invalid_length(elements.len(), &"the length of the array"))
}
