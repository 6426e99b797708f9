//! What the user chooses of a pair: where the gap comes from, and how conjugate points are found.

/// Initial gap of a pair, m; negative is interference.
#[derive(Debug, Clone, PartialEq)]
pub enum Gap {
    /// From the geometry, plus an offset.
    Geometry {
        /// Added to the geometric gap.
        offset: f64,
    },
    /// This value at every node, whatever the geometry.
    Value(f64),
}

/// How the conjugate point of a contact node is found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ConjugateRule {
    /// Closest point of the other surface.
    ClosestPoint,
    /// The paper's rule: where the line through the node along its normal meets the other surface.
    Intersection,
}
