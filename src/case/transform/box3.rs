//! A box: the lower and the upper corner.
pub(super) type Box3 = [[f64; 3]; 2];
