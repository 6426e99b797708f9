//! What counts as round-off, in the places that several files know of; a number that only one file needs stands there.
//!
//! Each is far above what double precision leaves (2.2e-16 of a number) and far below what a model can mean; what ten times
//! more or less would do is said with each. All of them ten times larger at once ([`HELD_PRESCRIBED`] three times), or all ten
//! times smaller, leave every verification problem within its bounds.

/// Rounding the product A x alone leaves about this share of |A| |x|: rows of some tens of entries, each rounded twice. Ten
/// times less asks for refinement that cannot help; ten times more leaves one digit of a badly conditioned body.
pub const PRODUCT: f64 = 16.0 * f64::EPSILON;

/// What is below this share of its parts is round-off: sums of some hundreds of terms. Ten times less chases digits that are
/// none, ten times more gives one away.
pub const SUM: f64 = 64.0 * f64::EPSILON;

/// Smallest thresholds of tension and penetration, relative to the largest force and the elastic approach: with exact zeros a
/// gap that just closes lets nodes flip in round-off for ever. They grow tenfold, up to the tolerance, when a set returns; so
/// ten times less costs updates, ten times more leaves a node open or closed whose force is 1e-10 of the largest.
pub const THRESHOLD: f64 = 1e-11;

/// Lengths below this share of a facet, or of the distance at hand, are round-off in the coordinates: a model may lie a million
/// facets from the origin. Ten times less fails a model that lies further off, ten times more moves nothing by more than 1e-8
/// of a facet.
pub const COORDINATES: f64 = 1e-9;

/// Work of the loads on a motion below this share of the sum of the absolute works is what quadrature and coordinates leave. Ten
/// times less refuses balanced loads on coarse curved surfaces, ten times more overlooks a drive of 1e-8 of the load.
pub const NO_WORK: f64 = 1e-9;

/// An eigenvalue of the support matrix below this, relative to the largest, is a motion that supports leave free: a square, so
/// that 1e-6 of the size of a body is the smallest base that holds its rotation.
pub const FREE_OF_SUPPORTS: f64 = 1e-12;

/// An eigenvalue of Z' Q Z below this, relative to the largest, is a motion that contact does not restrain. Normals of round
/// surfaces resist a spin by the square of their round-off only; ten times more would overlook contact on 1e-5 of a body.
pub const FREE_OF_CONTACT: f64 = 1e-11;

/// A contact node whose free directions carry less than this share of the normal is held by its support: what the cosine of a
/// right angle between given directions leaves. Ten times more or less means other nodes only where supports lean by so little.
pub const HELD_DIRECTION: f64 = 1e-6;

/// A row whose compliance is below this share of the mean is held by a support: a row that moves at all has its share of the
/// mesh's compliance, which falls with the ratio of cell sizes only. Ten times more would take a cell a hundred million times
/// smaller for held.
pub const HELD_COMPLIANCE: f64 = 1e-9;

/// A direction of which supports leave less than this cannot be prescribed: the force in it would be ten times that on the
/// surface. Where it leans by more, ten times more or less decides who carries the force, support or contact.
pub const HELD_PRESCRIBED: f64 = 0.1;

/// An eigenvalue below this share of the largest is round-off: a Gram matrix of modes does not see that direction.
pub const UNSEEN: f64 = 1e-10;
