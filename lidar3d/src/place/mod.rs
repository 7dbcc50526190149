//! Places recognised from signatures.
