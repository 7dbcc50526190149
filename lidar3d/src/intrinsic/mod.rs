//! Intrinsic calibration from scans of planes (M chapter 3).
