//! Scenarios that commands take if none is stated, as files.

/// The standard hall: reflectors everywhere.
pub const HALL: &str = include_str!("../../scenarios/warehouse_hall.toml");

/// A drive into the standard block storage.
pub const BLOCK_STORAGE: &str = include_str!("../../scenarios/block_storage_p1.toml");

/// The drive from which a block storage is mapped.
pub const MAPPING: &str = include_str!("../../scenarios/block_storage_mapping.toml");
