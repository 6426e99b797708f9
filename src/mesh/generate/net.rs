//! A net of quadrilaterals, and how it becomes a mesh of one element kind.
use crate::element::ElementKind;
use crate::mesh::{Cell, Curve, Facet, Mesh};
use std::collections::{BTreeMap, HashMap};

/// An edge: its two corner nodes, smaller number first.
type Edge = (u32, u32);

/// Node numbers of a rectangular grid of corners: `grid[column][row]`.
pub type Grid = Vec<Vec<u32>>;

/// Quadrilaterals between corner nodes, with what is needed to make any element kind of them.
#[derive(Debug, Default)]
pub struct Net {
    /// Corner nodes, m.
    pub points: Vec<[f64; 2]>,
    /// Corners counter-clockwise.
    quads: Vec<Quad>,
    /// How far the middle of a curved edge lies from the middle of its ends.
    bulges: HashMap<Edge, [f64; 2]>,
    /// Centres of the boundary's circular edges, from where bulges are measured.
    arcs: HashMap<Edge, [f64; 2]>,
    /// Named surfaces by their edges.
    surfaces: BTreeMap<&'static str, Vec<Edge>>,
}

/// A quadrilateral and the diagonal that cuts it into triangles.
#[derive(Debug)]
struct Quad {
    corners: [u32; 4],
    /// True: from corner 0 to corner 2; false: from 1 to 3.
    rising: bool,
}

fn edge(a: u32, b: u32) -> Edge {
    (a.min(b), a.max(b))
}

/// Middle of two points; the same bits whichever comes first.
pub fn middle(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    [0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1])]
}

impl Net {
    /// Adds a corner node.
    pub fn node(&mut self, point: [f64; 2]) -> u32 {
        self.points.push(point);
        (self.points.len() - 1) as u32
    }

    /// Adds the cells of a grid, row by row; `rising` chooses the diagonal of the cell in (column, row).
    pub fn cells(&mut self, grid: &Grid, rising: impl Fn(usize, usize) -> bool) {
        for row in 0..grid[0].len() - 1 {
            for column in 0..grid.len() - 1 {
                let (left, right) = (&grid[column], &grid[column + 1]);
                let corners = [left[row], right[row], right[row + 1], left[row + 1]];
                self.quads.push(Quad { corners, rising: rising(column, row) });
            }
        }
    }

    /// Moves the middle of the edge between two nodes by `by` from the middle of its ends.
    pub fn bulge(&mut self, a: u32, b: u32, by: [f64; 2]) {
        self.bulges.insert(edge(a, b), by);
    }

    /// Says that the boundary between neighbouring nodes of a chain is an arc about `center`.
    pub fn arc(&mut self, chain: impl IntoIterator<Item = u32>, center: [f64; 2]) {
        let chain: Vec<u32> = chain.into_iter().collect();
        self.arcs.extend(chain.windows(2).map(|w| (edge(w[0], w[1]), center)));
    }

    /// Adds a chain of nodes to a named surface.
    pub fn surface(&mut self, name: &'static str, chain: impl IntoIterator<Item = u32>) {
        let chain: Vec<u32> = chain.into_iter().collect();
        let edges = self.surfaces.entry(name).or_default();
        edges.extend(chain.windows(2).map(|w| edge(w[0], w[1])));
    }

    /// Maps all points by a linear map, then moves the origin to `center`.
    pub fn transform(&mut self, linear: impl Fn([f64; 2]) -> [f64; 2], center: [f64; 2]) {
        for p in &mut self.points {
            let [x, y] = linear(*p);
            *p = [x + center[0], y + center[1]];
        }
        for by in self.bulges.values_mut() {
            *by = linear(*by);
        }
        for arc in self.arcs.values_mut() {
            let [x, y] = linear(*arc);
            *arc = [x + center[0], y + center[1]];
        }
    }

    /// The mesh of this net.
    pub fn into_mesh(self, kind: ElementKind) -> Mesh {
        let mut build =
            Build { net: &self, kind, mesh: Mesh { dim: 2, ..Mesh::default() }, numbers: HashMap::new() };
        for quad in &self.quads {
            let [a, b, c, d] = quad.corners;
            match (kind, quad.rising) {
                (ElementKind::Quad4 | ElementKind::Quad8, _) => build.cell(&[a, b, c, d], quad),
                (_, true) => {
                    build.cell(&[a, b, c], quad);
                    build.cell(&[a, c, d], quad);
                }
                (_, false) => {
                    build.cell(&[a, b, d], quad);
                    build.cell(&[b, c, d], quad);
                }
            }
        }
        build.surfaces();
        build.mesh
    }

    /// How far the middle of an edge, or of the diagonal of `quad`, lies from the middle of its ends.
    fn offset(&self, ends: Edge, quad: &Quad) -> [f64; 2] {
        let side = |i: usize| edge(quad.corners[i], quad.corners[(i + 1) % 4]);
        let of = |e: Edge| self.bulges.get(&e).copied().unwrap_or_default();
        if (0..4).any(|i| side(i) == ends) {
            return of(ends);
        }
        // The diagonal follows its curved neighbours: the centre of a quad8 moves by half the sum of their
        // bulges.
        let b = [0, 1, 2, 3].map(|i| of(side(i)));
        [0, 1].map(|d| 0.5 * ((b[0][d] + b[2][d]) + (b[1][d] + b[3][d])))
    }
}

/// A mesh under construction.
struct Build<'a> {
    net: &'a Net,
    kind: ElementKind,
    mesh: Mesh,
    /// Mesh node of a corner (a, a) or an edge (a, b) of the net.
    numbers: HashMap<Edge, u32>,
}

impl Build<'_> {
    fn cell(&mut self, corners: &[u32], quad: &Quad) {
        let n = corners.len();
        let mut nodes = [0; 8];
        for (i, &corner) in corners.iter().enumerate() {
            nodes[i] = self.number((corner, corner), quad);
        }
        if self.kind.n_nodes() > n {
            for i in 0..n {
                nodes[n + i] = self.number(edge(corners[i], corners[(i + 1) % n]), quad);
            }
        }
        self.mesh.cells.push(Cell::new(self.kind, &nodes));
    }

    fn number(&mut self, ends: Edge, quad: &Quad) -> u32 {
        if let Some(&number) = self.numbers.get(&ends) {
            return number;
        }
        let (a, b) = (self.net.points[ends.0 as usize], self.net.points[ends.1 as usize]);
        let mut point = a;
        if ends.0 != ends.1 {
            let (mid, by) = (middle(a, b), self.net.offset(ends, quad));
            point = [mid[0] + by[0], mid[1] + by[1]];
        }
        let number = self.mesh.points.len() as u32;
        self.mesh.points.push([point[0], point[1], 0.0]);
        self.numbers.insert(ends, number);
        number
    }

    fn surfaces(&mut self) {
        let facets: HashMap<Edge, Facet> = self.mesh.sides().collect();
        for (name, edges) in &self.net.surfaces {
            let number = |corner: u32| self.numbers[&(corner, corner)];
            let list = edges.iter().map(|&(a, b)| facets[&edge(number(a), number(b))]).collect();
            self.mesh.surfaces.insert((*name).to_string(), list);
        }
        for (&(a, b), &center) in &self.net.arcs {
            let number = |corner: u32| self.numbers[&(corner, corner)];
            self.mesh.curves.insert(edge(number(a), number(b)), Curve::Arc { center });
        }
    }
}
