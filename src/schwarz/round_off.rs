//! What is round-off.

/// What is below this share of its parts is round-off.
pub(super) const ROUND_OFF: f64 = 64.0 * f64::EPSILON;

/// Smallest thresholds of tension and penetration, relative to the largest force and the elastic approach: with exact
/// zeros a gap that just closes lets nodes flip in round-off for ever. They grow tenfold, up to the tolerance, when a
/// set returns.
pub(super) const THRESHOLD: f64 = 1e-11;
