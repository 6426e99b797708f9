//! Finds the cell that contains a point, and the node nearest to it.
use super::Cell;
use crate::element::ElementKind;
use crate::tolerances::COORDINATES;
use rstar::primitives::{GeomWithData, Rectangle};
use rstar::{AABB, RTree};

/// Finds cells by position.
#[derive(Debug)]
pub struct Locator<'a> {
    points: &'a [[f64; 3]],
    cells: &'a [Cell],
    tree: RTree<GeomWithData<Rectangle<[f64; 2]>, usize>>,
}

impl<'a> Locator<'a> {
    /// A search tree over the boxes of the cells.
    pub fn new(points: &'a [[f64; 3]], cells: &'a [Cell]) -> Self {
        let boxed = |(i, cell): (usize, &Cell)| {
            let (low, high) = cell_box(points, cell);
            // A curved side may reach a little beyond its nodes.
            let curved = cell.kind.n_nodes() > cell.kind.n_corners();
            let size = (high[0] - low[0]).max(high[1] - low[1]);
            let margin = size * if curved { 0.1 } else { 2.0 * COORDINATES };
            let corners = (low.map(|v| v - margin), high.map(|v| v + margin));
            GeomWithData::new(Rectangle::from_aabb(AABB::from_corners(corners.0, corners.1)), i)
        };
        let tree = RTree::bulk_load(cells.iter().enumerate().map(boxed).collect());
        Locator { points, cells, tree }
    }

    /// The cell that contains `x` and the reference coordinates there; the first one if several share the
    /// point.
    pub fn find(&self, x: &[f64; 3]) -> Option<(usize, [f64; 3])> {
        if !x.iter().all(|v| v.is_finite()) {
            return None;
        }
        let mut candidates: Vec<usize> =
            self.tree.locate_all_at_point(&[x[0], x[1]]).map(|found| found.data).collect();
        candidates.sort_unstable();
        candidates.into_iter().find_map(|cell| {
            let xi = inverse_map(self.points, &self.cells[cell], x)?;
            inside(self.cells[cell].kind, &xi).then_some((cell, xi))
        })
    }
}

/// The node nearest to `x` and its distance; the first of equals, `None` without nodes.
pub fn nearest_node(points: &[[f64; 3]], x: &[f64; 3]) -> Option<(usize, f64)> {
    let square = |p: &[f64; 3]| (0..3).map(|d| (p[d] - x[d]).powi(2)).sum::<f64>();
    let near = points.iter().map(square).enumerate().min_by(|a, b| a.1.total_cmp(&b.1))?;
    Some((near.0, near.1.sqrt()))
}

fn cell_box(points: &[[f64; 3]], cell: &Cell) -> ([f64; 2], [f64; 2]) {
    let mut range = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
    for &node in cell.nodes() {
        let [x, y, _] = points[node as usize];
        range.0 = [range.0[0].min(x), range.0[1].min(y)];
        range.1 = [range.1[0].max(x), range.1[1].max(y)];
    }
    range
}

/// True inside the reference element, sides included.
fn inside(kind: ElementKind, xi: &[f64; 3]) -> bool {
    match kind {
        ElementKind::Tri3 | ElementKind::Tri6 => {
            xi[0] >= -COORDINATES && xi[1] >= -COORDINATES && xi[0] + xi[1] <= 1.0 + COORDINATES
        }
        ElementKind::Quad4 | ElementKind::Quad8 => xi.iter().all(|v| v.abs() <= 1.0 + COORDINATES),
    }
}

/// Reference coordinates of a point, by Newton's method on x(xi) = sum N_a(xi) x_a; `None` if it does not
/// converge, which happens only far outside the cell.
fn inverse_map(points: &[[f64; 3]], cell: &Cell, x: &[f64; 3]) -> Option<[f64; 3]> {
    // Relative to the first node, so that a cell far from the origin loses no digits.
    let origin = points[cell.nodes()[0] as usize];
    let nodes = cell.nodes().iter().map(|&n| &points[n as usize]);
    let relative: Vec<[f64; 2]> = nodes.map(|p| [p[0] - origin[0], p[1] - origin[1]]).collect();
    let target = [x[0] - origin[0], x[1] - origin[1]];
    let mut xi = cell.kind.center();
    for _ in 0..50 {
        let shape = cell.kind.shape(&xi);
        let mut r = target;
        let mut j = [[0.0; 2]; 2];
        for (a, p) in relative.iter().enumerate() {
            for d in 0..2 {
                r[d] -= shape.n[a] * p[d];
                j[d][0] += p[d] * shape.dn[a][0];
                j[d][1] += p[d] * shape.dn[a][1];
            }
        }
        let det = j[0][0] * j[1][1] - j[0][1] * j[1][0];
        let step = [(j[1][1] * r[0] - j[0][1] * r[1]) / det, (j[0][0] * r[1] - j[1][0] * r[0]) / det];
        let length = step[0].hypot(step[1]);
        if !length.is_finite() || xi[0].abs().max(xi[1].abs()) > 10.0 {
            return None;
        }
        // A long step may jump over the root of a curved cell.
        let shorten = 1.0 / length.max(1.0);
        xi = [xi[0] + shorten * step[0], xi[1] + shorten * step[1], 0.0];
        if length < 1e-12 {
            return Some(xi);
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::Shape;
    use crate::mesh::testing::{uniform, unit_square};
    use crate::mesh::{Mesh, generate};

    fn position(mesh: &Mesh, cell: usize, xi: &[f64; 3]) -> [f64; 3] {
        let cell = &mesh.cells[cell];
        let shape = cell.kind.shape(xi);
        let mut x = [0.0; 3];
        for (n, &node) in shape.n.iter().zip(cell.nodes()) {
            for (x, p) in x.iter_mut().zip(&mesh.points[node as usize]) {
                *x += n * p;
            }
        }
        x
    }

    /// A disc: curved and distorted cells.
    fn disc(kind: ElementKind, center: [f64; 2]) -> Mesh {
        let depth = uniform(0.0, 0.6, 3);
        generate(&Shape::Disc { center, radius: 1.0, quarter: 2, depth }, kind, 0.3, [0.0; 2]).unwrap()
    }

    #[test]
    fn points_of_a_cell_are_found_in_it() {
        for kind in ElementKind::ALL {
            for center in [[0.0; 2], [1e4, -1e4]] {
                let mesh = disc(kind, center);
                let locator = Locator::new(&mesh.points, &mesh.cells);
                for cell in 0..mesh.cells.len() {
                    let (lowest, far) = if kind.n_corners() == 3 { (0.01, 0.4) } else { (-0.9, 0.95) };
                    for xi in [[lowest, far, 0.0], [far, far, 0.0], [far, lowest, 0.0], kind.center()] {
                        let (found, back) = locator.find(&position(&mesh, cell, &xi)).unwrap();
                        assert_eq!(found, cell, "{kind:?}");
                        let accuracy = if center[0] == 0.0 { 1e-12 } else { 1e-9 };
                        assert!((back[0] - xi[0]).hypot(back[1] - xi[1]) < accuracy, "{kind:?} {back:?}");
                    }
                }
            }
        }
    }

    #[test]
    fn nodes_belong_to_the_first_of_their_cells_and_points_outside_to_none() {
        for kind in ElementKind::ALL {
            let mesh = disc(kind, [0.0; 2]);
            let locator = Locator::new(&mesh.points, &mesh.cells);
            for (node, x) in mesh.points.iter().enumerate() {
                let first = mesh.cells.iter().position(|c| c.nodes().contains(&(node as u32)));
                assert_eq!(locator.find(x).map(|found| found.0), first);
            }
            assert!(locator.find(&[1.01, 0.0, 0.0]).is_none());
            assert!(locator.find(&[f64::NAN, 0.0, 0.0]).is_none());
        }
        let square = unit_square(ElementKind::Quad4, 2);
        let locator = Locator::new(&square.points, &square.cells);
        assert!(locator.find(&[1.0 + 1e-11, 0.7, 0.0]).is_some());
        assert!(locator.find(&[1.0 + 1e-8, 0.7, 0.0]).is_none());
    }

    #[test]
    fn the_nearest_node_is_found_with_its_distance() {
        let mesh = unit_square(ElementKind::Quad4, 4);
        let (node, distance) = nearest_node(&mesh.points, &[0.5, 1.3, 0.0]).unwrap();
        assert_eq!(mesh.points[node], [0.5, 1.0, 0.0]);
        assert!((distance - 0.3).abs() < 1e-15);
        assert!(nearest_node(&[], &[0.0; 3]).is_none());
    }
}
