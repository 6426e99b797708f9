//! Stress in the plane.

/// Stresses (11, 22, 12), Pa.
pub(super) type Plane = [f64; 3];
