//! What surfaces do along each other, at the nodes of the grid: fields that only a case with friction has.
use crate::{
    body::Body,
    contact::vector::combine,
    output::{Field, Piece},
    parallel,
    record::{PairTables, SideTable},
    scene::Plan,
    vector::larger,
};
use std::collections::HashMap;

/// What one side of a pair says of a node: its status, 1 if the pair has a tangential law, and traction and slip as vectors.
const TOLD: usize = 8;

/// A node of the contact surfaces.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
struct SurfaceNode {
    /// The highest status that it has in a pair.
    status: f64,
    /// The highest that it has in a pair with a tangential law, and how many of these pairs it has it in.
    frictional: f64,
    pairs: u32,
    /// Sums over those pairs: traction, Pa, and slip, m.
    traction: [f64; 3],
    slip: [f64; 3],
}

impl SurfaceNode {
    /// Takes in what a pair tells.
    fn add(&mut self, &[status, frictional, t @ .., u, v, w]: &[f64; TOLD]) {
        self.status = larger(self.status, status);
        if frictional == 0.0 || status < self.frictional {
            return;
        }
        if status > self.frictional {
            *self = SurfaceNode { status: self.status, frictional: status, ..SurfaceNode::default() };
        }
        self.pairs += 1;
        self.traction = combine([(1.0, &self.traction), (1.0, &t)]);
        self.slip = combine([(1.0, &self.slip), (1.0, &[u, v, w])]);
    }
}

/// Adds tangential traction, slip and status to this rank's piece; the tables are on the first rank of each group. Collective on
/// the groups.
pub(super) fn add_friction(piece: &mut Piece, plan: &Plan, bodies: &[Body], tables: &[PairTables]) {
    let mut nodes: Vec<HashMap<u32, SurfaceNode>> = vec![HashMap::new(); bodies.len()];
    for (surface, end) in std::iter::zip(&plan.surfaces, &plan.ends) {
        let mut told = tables[end.pair].sides[end.side].as_ref().map_or_else(Vec::new, tell);
        parallel::broadcast(&plan.groups.group, 0, &mut told);
        let of_body = &mut nodes[plan.place(end.body)];
        for (node, told) in std::iter::zip(&surface.nodes, told.as_chunks::<TOLD>().0) {
            of_body.entry(*node).or_default().add(told);
        }
    }
    let mut fields = [("tangential_traction", "Pa", 3), ("slip", "m", 3), ("contact_status", "-", 1)]
        .map(|(name, unit, components)| Field { name: name.into(), unit, components, values: Vec::new() });
    for (body, of_body) in std::iter::zip(bodies, &nodes) {
        for node in &body.part.original[..body.part.n_local] {
            let node = of_body.get(node).copied().unwrap_or_default();
            let mean = |sum: [f64; 3]| sum.map(|v| v / f64::from(node.pairs.max(1)));
            fields[0].values.extend(mean(node.traction));
            fields[1].values.extend(mean(node.slip));
            fields[2].values.push(node.status);
        }
    }
    piece.point_fields.extend(fields);
}

/// Node by node.
fn tell(table: &SideTable) -> Vec<f64> {
    let of_node = |i: usize| {
        // Forwards along the surface: the outward normal turned against the clock.
        let [x, y, _] = table.normal[i];
        let [q, g] = table.tangential.as_ref().map_or([0.0; 2], |t| [t.traction[i], t.slip[i]]);
        let frictional = f64::from(u8::from(table.tangential.is_some()));
        [f64::from(table.status[i]), frictional, -q * y, q * x, 0.0, -g * y, g * x, 0.0]
    };
    (0..table.s.len()).flat_map(of_node).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A node in the corner between two pairs with friction, and in one without.
    #[test]
    fn a_node_of_several_pairs_has_the_mean_of_those_where_it_does_most() {
        let pair =
            |status: f64, frictional: f64, [x, y]: [f64; 2]| [status, frictional, x, y, 0.0, y, x, 0.0];
        let of = |pairs: &[[f64; TOLD]]| {
            let mut node = SurfaceNode::default();
            pairs.iter().for_each(|told| node.add(told));
            assert_eq!(node.slip, [node.traction[1], node.traction[0], 0.0]);
            (node.status, node.pairs, node.traction)
        };
        let (open, sticks, slips) =
            (pair(1.0, 1.0, [0.0; 2]), pair(2.0, 1.0, [-4.0, 0.0]), pair(3.0, 1.0, [0.0, 6.0]));
        let smooth = pair(2.0, 0.0, [0.0; 2]);
        assert_eq!(of(&[open, sticks]), (2.0, 1, [-4.0, 0.0, 0.0]));
        assert_eq!(of(&[sticks, open, smooth]), of(&[open, sticks]));
        assert_eq!(of(&[sticks, slips]), (3.0, 1, [0.0, 6.0, 0.0]));
        assert_eq!(of(&[sticks, pair(2.0, 1.0, [0.0, 8.0])]), (2.0, 2, [-4.0, 8.0, 0.0]));
        assert_eq!(of(&[smooth, open]), (2.0, 1, [0.0; 3]));
        assert_eq!(of(&[]), (0.0, 0, [0.0; 3]));
    }
}
