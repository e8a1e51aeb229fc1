//! Which camera saw these views? Estimation; nothing here knows a truth.

pub mod single_plane;
