//! One side of a contact pair: which nodes may touch, and their conjugate points.
use crate::contact::Conjugate;
use std::ops::Range;

/// One side of a pair, on the first rank of its body's group.
#[derive(Debug, Clone)]
pub struct Side {
    /// Pair index.
    pub pair: usize,
    /// True for side A.
    pub first: bool,
    /// Index of the body among this rank's bodies.
    pub body: usize,
    /// The side's nodes among the body's observed nodes.
    pub observed: Range<usize>,
    /// The nodes that may touch.
    pub nodes: Vec<ContactNode>,
    /// Plane moduli E' of the own and the other body, Pa.
    pub moduli: super::weights::Both,
}

/// A node that may touch the other surface.
#[derive(Debug, Clone)]
pub struct ContactNode {
    /// Position among the side's nodes.
    pub node: usize,
    /// Contact row of the body.
    pub row: usize,
    /// Conjugate point, common normal, initial gap.
    pub conjugate: Conjugate,
    /// The conjugate point is held by a support: this node takes the whole displacement correction and keeps its force.
    pub follows: bool,
}

impl Side {
    /// Value at a node's conjugate point of a nodal quantity of the other side (27, 28).
    pub fn at_conjugate(node: &ContactNode, values: &[f64]) -> f64 {
        node.conjugate.terms.iter().map(|&(i, n)| n * values[i as usize]).sum()
    }

    /// The same for a vector.
    pub fn vector_at_conjugate(node: &ContactNode, values: &[[f64; 3]]) -> [f64; 3] {
        crate::contact::vector::combine(node.conjugate.terms.iter().map(|&(i, n)| (n, &values[i as usize])))
    }
}
