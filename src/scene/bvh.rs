//! The flattened BVH.
