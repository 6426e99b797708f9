//! Sides of coarse cells that stand against two finer ones, and the nodes that depend on others there.
use super::{Facet, Mesh};

/// A parabola at a quarter of its parameter: weights of the near end, the far end and the middle.
pub(super) const QUARTER: [f64; 3] = [0.375, -0.125, 0.75];

/// A side of a coarse cell against two of finer cells.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HangingSide {
    /// The side.
    pub coarse: Facet,
    /// The finer cells' corner in its middle. Of a quadratic side it is the mid-side node, and no slave.
    pub middle: u32,
    /// Of a quadratic side: the finer sides' mid-side nodes, at the first end and at the second.
    pub quarters: Option<[u32; 2]>,
}

impl HangingSide {
    /// The same in a mesh where other nodes and cells come first.
    pub(in crate::mesh) fn moved(&self, nodes: u32, cells: u32) -> HangingSide {
        HangingSide {
            coarse: Facet { cell: self.coarse.cell + cells, side: self.coarse.side },
            middle: self.middle + nodes,
            quarters: self.quarters.map(|q| q.map(|node| node + nodes)),
        }
    }
}

/// A node whose values follow from others: u = sum of weight * u(master). Masters are no slaves.
#[derive(Debug, Clone, PartialEq)]
pub struct Slave {
    /// The node.
    pub node: u32,
    /// Its masters and their weights, which add up to 1: what the coarse side has at the node.
    pub masters: Vec<(u32, f64)>,
}

impl Mesh {
    /// All slave nodes, by number.
    ///
    /// On a linear side the middle is 1/2, 1/2 of the ends; on a quadratic one the quarter points are 3/8 and -1/8 of
    /// the near and the far end and 6/8 of the middle.
    pub fn slaves(&self) -> Vec<Slave> {
        let mut slaves = Vec::new();
        for side in &self.hanging {
            let nodes: Vec<u32> = self.facet_nodes(side.coarse).collect();
            let (a, b) = (nodes[0], nodes[1]);
            match side.quarters {
                None => slaves.push(Slave { node: side.middle, masters: vec![(a, 0.5), (b, 0.5)] }),
                Some([p, q]) => slaves.extend([(p, a, b), (q, b, a)].map(|(node, near, far)| Slave {
                    node,
                    masters: std::iter::zip([near, far, side.middle], QUARTER).collect(),
                })),
            }
        }
        slaves.sort_by_key(|slave| slave.node);
        slaves
    }
}
