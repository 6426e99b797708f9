//! Edges of the cells, each once, and which of them bound a body.
use crate::output::Piece;
use rustc_hash::FxHashMap;

/// An edge as the polyline it is drawn as: two ends, or two ends and a point between.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Edge {
    nodes: [u32; 3],
    n_nodes: usize,
    body: i32,
    /// True if only one cell has it.
    pub outer: bool,
}

impl Edge {
    /// Node numbers from end to end.
    pub fn nodes(&self) -> &[u32] {
        &self.nodes[..self.n_nodes]
    }
}

/// A place of a body: no two nodes of a partition share it.
type Place = (i32, [u64; 3]);

fn place(body: i32, point: [f64; 3]) -> Place {
    // `+ 0.0` makes -0 and 0 one number.
    (body, point.map(|x| (x + 0.0).to_bits()))
}

/// All edges of the grid. The partitions have their own copies of the nodes they share: nodes of the same
/// body at the same place are one, or the seams between ranks would be drawn as outlines.
pub(super) fn edges(piece: &Piece) -> Vec<Edge> {
    let mut inner = Vec::with_capacity(2 * piece.cells.len());
    // Edges of one cell of a partition only.
    let mut single: FxHashMap<[u32; 2], Edge> = FxHashMap::default();
    for (cell, &body) in piece.cells.iter().zip(&piece.cell_bodies) {
        for facet in cell.kind.facets() {
            let node = |k: usize| cell.nodes()[facet[k]];
            let key = sorted([node(0), node(1)]);
            let edge = match facet.len() {
                2 => Edge { nodes: [node(0), node(1), 0], n_nodes: 2, body, outer: false },
                _ => Edge { nodes: [node(0), node(2), node(1)], n_nodes: 3, body, outer: false },
            };
            match single.remove(&key) {
                Some(edge) => inner.push(edge),
                None => drop(single.insert(key, edge)),
            }
        }
    }
    let mut first_at = FxHashMap::default();
    let mut edges = FxHashMap::default();
    for (ends, edge) in single {
        let ends =
            ends.map(|node| *first_at.entry(place(edge.body, piece.points[node as usize])).or_insert(node));
        let outer = Edge { outer: true, ..edge };
        edges.entry(sorted(ends)).and_modify(|edge: &mut Edge| edge.outer = false).or_insert(outer);
    }
    close_hanging(piece, &first_at, &mut edges);
    inner.extend(edges.into_values());
    inner
}

fn sorted([a, b]: [u32; 2]) -> [u32; 2] {
    [a.min(b), a.max(b)]
}

/// A side of a coarse cell against two sides of finer ones is no outline, and neither are these.
fn close_hanging(piece: &Piece, first_at: &FxHashMap<Place, u32>, edges: &mut FxHashMap<[u32; 2], Edge>) {
    let at = |node: u32| piece.points[node as usize];
    let outer: Vec<[u32; 2]> = edges.iter().filter(|(_, edge)| edge.outer).map(|(key, _)| *key).collect();
    for key in outer {
        let middle = match *edges[&key].nodes() {
            [_, middle, _] => at(middle),
            _ => {
                let (a, b) = (at(key[0]), at(key[1]));
                std::array::from_fn(|c| 0.5 * (a[c] + b[c]))
            }
        };
        let Some(&middle) = first_at.get(&place(edges[&key].body, middle)) else { continue };
        let halves = key.map(|end| sorted([end, middle]));
        if halves.iter().all(|half| edges.get(half).is_some_and(|edge| edge.outer)) {
            for key in [key, halves[0], halves[1]] {
                edges.get_mut(&key).expect("just found").outer = false;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::element::ElementKind;
    use crate::mesh::Cell;

    /// Two squares side by side, as two partitions with nodes of their own.
    fn two_squares(bodies: [i32; 2]) -> Piece {
        let square = |x: f64| [[x, 0.0, 0.0], [x + 1.0, 0.0, 0.0], [x + 1.0, 1.0, 0.0], [x, 1.0, 0.0]];
        Piece {
            points: [square(0.0), square(1.0)].concat(),
            cells: [[0, 1, 2, 3], [4, 5, 6, 7]].map(|n| Cell::new(ElementKind::Quad4, &n)).to_vec(),
            cell_bodies: bodies.to_vec(),
            ..Piece::default()
        }
    }

    #[test]
    fn a_seam_between_partitions_is_no_outline() {
        let edges = edges(&two_squares([0, 0]));
        assert_eq!((edges.len(), edges.iter().filter(|e| e.outer).count()), (7, 6));
    }

    #[test]
    fn a_coarse_side_against_two_finer_ones_is_no_outline() {
        // A square, and to its right two half as high: in the same partition, or with nodes of their own.
        let left = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [1.0, 0.5]];
        let right = [[2.0, 0.0], [2.0, 0.5], [2.0, 1.0], [1.0, 0.0], [1.0, 1.0]];
        for fine in [[[1, 5, 6, 4], [4, 6, 7, 2]], [[8, 5, 6, 4], [4, 6, 7, 9]]] {
            let cells = [[0, 1, 2, 3], fine[0], fine[1]];
            let piece = Piece {
                points: [left, right].concat().iter().map(|&[x, y]| [x, y, 0.0]).collect(),
                cells: cells.map(|n| Cell::new(ElementKind::Quad4, &n)).to_vec(),
                cell_bodies: vec![0; 3],
                ..Piece::default()
            };
            assert_eq!(edges(&piece).iter().filter(|e| e.outer).count(), 7);
        }
    }

    #[test]
    fn a_seam_between_bodies_is_one() {
        let edges = edges(&two_squares([0, 1]));
        assert_eq!((edges.len(), edges.iter().filter(|e| e.outer).count()), (8, 8));
    }
}
