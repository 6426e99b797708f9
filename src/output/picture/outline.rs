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

/// All edges of the grid. The partitions have their own copies of the nodes they share: nodes of the same
/// body at the same place are one, or the seams between ranks would be drawn as outlines.
pub(super) fn edges(piece: &Piece) -> Vec<Edge> {
    let mut first_at = FxHashMap::default();
    let mut same = vec![u32::MAX; piece.points.len()];
    for (cell, &body) in piece.cells.iter().zip(&piece.cell_bodies) {
        for &node in cell.nodes().iter().take(cell.kind.n_corners()) {
            if same[node as usize] == u32::MAX {
                // `+ 0.0` makes -0 and 0 one number.
                let place = piece.points[node as usize].map(|x| (x + 0.0).to_bits());
                same[node as usize] = *first_at.entry((body, place)).or_insert(node);
            }
        }
    }
    let mut edges: FxHashMap<[u32; 2], Edge> = FxHashMap::default();
    edges.reserve(2 * piece.cells.len());
    for (cell, &body) in piece.cells.iter().zip(&piece.cell_bodies) {
        for facet in cell.kind.facets() {
            let node = |k: usize| cell.nodes()[facet[k]];
            let mut key = [same[node(0) as usize], same[node(1) as usize]];
            key.sort_unstable();
            let edge = match facet.len() {
                2 => Edge { nodes: [node(0), node(1), 0], n_nodes: 2, body, outer: true },
                _ => Edge { nodes: [node(0), node(2), node(1)], n_nodes: 3, body, outer: true },
            };
            edges.entry(key).and_modify(|edge| edge.outer = false).or_insert(edge);
        }
    }
    close_hanging(piece, &first_at, &mut edges);
    edges.into_values().collect()
}

/// A side of a coarse cell against two sides of finer ones is no outline, and neither are these.
fn close_hanging(
    piece: &Piece,
    first_at: &FxHashMap<(i32, [u64; 3]), u32>,
    edges: &mut FxHashMap<[u32; 2], Edge>,
) {
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
        let place = middle.map(|x| (x + 0.0).to_bits());
        let Some(&middle) = first_at.get(&(edges[&key].body, place)) else { continue };
        let halves = key.map(|end| [end.min(middle), end.max(middle)]);
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
        // A square, and to its right two half as high.
        let points =
            [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [1.0, 0.5], [2.0, 0.0], [2.0, 0.5], [2.0, 1.0]];
        let piece = Piece {
            points: points.map(|[x, y]| [x, y, 0.0]).to_vec(),
            cells: [[0, 1, 2, 3], [1, 5, 6, 4], [4, 6, 7, 2]]
                .map(|n| Cell::new(ElementKind::Quad4, &n))
                .to_vec(),
            cell_bodies: vec![0; 3],
            ..Piece::default()
        };
        assert_eq!(edges(&piece).iter().filter(|e| e.outer).count(), 7);
    }

    #[test]
    fn a_seam_between_bodies_is_one() {
        let edges = edges(&two_squares([0, 1]));
        assert_eq!((edges.len(), edges.iter().filter(|e| e.outer).count()), (8, 8));
    }
}
