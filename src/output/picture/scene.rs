//! What the picture of the bodies shows: deformed cells with a value at each node.
use super::colour::{ColourScale, Palette};
use super::outline::{Edge, edges};
use super::pixel::{Pixel, Rgb};
use super::raster::Canvas;
use super::scale::round_near;
use super::view::{View, Window};
use crate::case::{Shown, StressComponent};
use crate::error::{Error, Result};
use crate::mesh::Cell;
use crate::output::{Field, Outline, Piece, Results};
use crate::vector::larger;

/// Element edges are drawn when fewer cells can be seen.
const EDGES_BELOW: usize = 4000;
/// Pixels of a cell so small that the diagonals of its triangles cannot be seen.
const SMALL: f64 = 10.0;
const OUTLINE: Rgb = [30, 30, 30];
const UNDEFORMED: Rgb = [165, 165, 165];

/// The grid with what is drawn of it.
pub(super) struct Scene<'a> {
    piece: &'a Piece,
    rigid: &'a [Outline],
    displacement: Vec<[f64; 2]>,
    shown: Shown,
    /// What is shown, at the nodes.
    values: Vec<f64>,
    edges: Vec<Edge>,
}

impl<'a> Scene<'a> {
    /// An error if the file has no nodal `displacement`, or not what is to be shown.
    pub fn new(results: &'a Results, shown: Shown) -> Result<Self> {
        let piece = &results.piece;
        let displacement = nodal(piece, "displacement", 3)?.values.chunks(3).map(|u| [u[0], u[1]]).collect();
        let values = match shown {
            Shown::Stress(component) => {
                nodal(piece, "stress", 6)?.values.chunks(6).map(|s| component_of(component, s)).collect()
            }
            Shown::PlasticStrain => nodal(piece, "equivalent_plastic_strain", 1)?.values.clone(),
        };
        Ok(Scene { piece, rigid: &results.run.rigid, displacement, shown, values, edges: edges(piece) })
    }

    /// Where a node is, undeformed (0), deformed (1), or more so.
    pub fn place(&self, node: usize, magnification: f64) -> [f64; 2] {
        let (x, u) = (self.piece.points[node], self.displacement[node]);
        [x[0] + magnification * u[0], x[1] + magnification * u[1]]
    }

    /// Displacement of the node closest to a place.
    pub fn displacement_near(&self, place: [f64; 2]) -> [f64; 2] {
        let distance = |node: &usize| {
            let x = self.piece.points[*node];
            (x[0] - place[0]).hypot(x[1] - place[1])
        };
        let nearest = (0..self.displacement.len()).min_by(|a, b| distance(a).total_cmp(&distance(b)));
        nearest.map_or([0.0; 2], |node| self.displacement[node])
    }

    /// Around all nodes.
    pub fn bounds(&self, magnification: f64) -> Window {
        Window::around((0..self.piece.points.len()).map(|node| self.place(node, magnification)))
    }

    /// Around what to show: all nodes, and a strip of the rigid bodies beside them.
    pub fn window(&self, magnification: f64) -> Window {
        self.bounds(magnification).widened(if self.rigid.is_empty() { 0.03 } else { 0.08 })
    }

    /// A round magnification with which the largest displacement is about 4 % of the bodies' size.
    pub fn magnification(&self) -> f64 {
        let [width, height] = self.bounds(0.0).size();
        let largest =
            self.displacement.iter().map(|u| u[0].hypot(u[1])).filter(|u| u.is_finite()).fold(0.0, larger);
        let wanted = 0.04 * width.max(height) / largest;
        if wanted.is_normal() { round_near(wanted) } else { 1.0 }
    }

    /// Colours for what can be seen in the window.
    pub fn colours(&self, window: &Window, magnification: f64) -> ColourScale {
        let seen = |node: usize| window.sees(std::iter::once(self.place(node, magnification)));
        let values = || (0..self.values.len()).filter(|&node| seen(node)).map(|node| self.values[node]);
        match self.shown {
            Shown::Stress(_) => ColourScale::of(values()),
            Shown::PlasticStrain => ColourScale::from_nought(values().fold(0.0, larger)),
        }
    }

    /// Draws all of it.
    pub fn paint(&self, view: &View, magnification: f64, scale: &ColourScale) -> Canvas {
        let mut canvas = Canvas::new(view.pixels[0], view.pixels[1]);
        let palette = Palette::new(scale);
        let pixels: Vec<Pixel> =
            (0..self.values.len()).map(|node| view.pixel(self.place(node, magnification))).collect();
        let panel = Window { low: [0.0; 2], high: view.pixels.map(|n| n as f64) };
        let mut visible = 0;
        for cell in &self.piece.cells {
            let around = Window::around(cell.nodes().iter().map(|&node| pixels[node as usize]));
            if around.overlaps(&panel) {
                visible += 1;
                if canvas.has_points(around.low, around.high) {
                    self.paint_cell(&mut canvas, &pixels, &palette, cell);
                }
            }
        }
        if visible < EDGES_BELOW {
            self.paint_edges(&mut canvas, view, magnification, |_| true, (0.6, OUTLINE, 0.45));
        }
        self.paint_edges(&mut canvas, view, 0.0, |edge| edge.outer, (1.2, UNDEFORMED, 0.8));
        self.paint_edges(&mut canvas, view, magnification, |edge| edge.outer, (1.8, OUTLINE, 1.0));
        let rigid_place = |outline: &Outline, x: &[f64; 3]| {
            let u = outline.motion;
            view.pixel([x[0] + magnification * u[0], x[1] + magnification * u[1]])
        };
        for outline in self.rigid {
            let line: Vec<_> = outline.points.iter().map(|x| rigid_place(outline, x)).collect();
            canvas.hatched(&line, OUTLINE);
        }
        canvas
    }

    /// A fan of triangles about the middle, so that no diagonal is preferred; one from a corner where that cannot be seen.
    fn paint_cell(&self, canvas: &mut Canvas, pixels: &[Pixel], palette: &Palette, cell: &Cell) {
        let corner = |node: u32| (pixels[node as usize], self.values[node as usize]);
        let rim: Vec<_> = cell
            .kind
            .facets()
            .iter()
            .flat_map(|facet| {
                let local = [Some(facet[0]), facet.get(2).copied()];
                local.into_iter().flatten().map(|k| corner(cell.nodes()[k]))
            })
            .collect();
        let [width, height] = Window::around(rim.iter().map(|corner| corner.0)).size();
        if rim.len() == 3 || width.max(height) < SMALL {
            for ends in rim[1..].windows(2) {
                let corners = [rim[0], ends[0], ends[1]];
                canvas.triangle(corners.map(|c| c.0), corners.map(|c| c.1), palette);
            }
            return;
        }
        let (middle, value) = middle(&rim, cell.kind.n_corners());
        for (i, &(a, value_a)) in rim.iter().enumerate() {
            let (b, value_b) = rim[(i + 1) % rim.len()];
            canvas.triangle([a, b, middle], [value_a, value_b, value], palette);
        }
    }

    fn paint_edges(
        &self,
        canvas: &mut Canvas,
        view: &View,
        magnification: f64,
        which: impl Fn(&Edge) -> bool,
        (width, colour, opacity): (f64, Rgb, f64),
    ) {
        for edge in self.edges.iter().filter(|edge| which(edge)) {
            let at: Vec<_> = edge
                .nodes()
                .iter()
                .map(|&node| view.pixel(self.place(node as usize, magnification)))
                .collect();
            at.windows(2).for_each(|ends| canvas.line(ends[0], ends[1], width, colour, opacity));
        }
    }
}

/// Place and value in the middle of a cell, from its rim: corners and, of a quadratic cell, mid-sides in
/// turn.
fn middle(rim: &[([f64; 2], f64)], n_corners: usize) -> ([f64; 2], f64) {
    let quadratic = rim.len() > n_corners;
    // Serendipity shape functions at the centre.
    let (corner, side) = match (quadratic, n_corners) {
        (false, n) => (1.0 / n as f64, 0.0),
        (true, 3) => (-1.0 / 9.0, 4.0 / 9.0),
        (true, _) => (-0.25, 0.5),
    };
    let mut sum = [0.0; 3];
    for (i, (p, value)) in rim.iter().enumerate() {
        let weight = if quadratic && i % 2 == 1 { side } else { corner };
        sum = [sum[0] + weight * p[0], sum[1] + weight * p[1], sum[2] + weight * value];
    }
    ([sum[0], sum[1]], sum[2])
}

fn nodal<'a>(piece: &'a Piece, name: &str, components: usize) -> Result<&'a Field> {
    let field = piece.point_fields.iter().find(|field| field.name == name && field.components == components);
    field.ok_or_else(|| {
        Error::input(format!("the result file has no nodal field \"{name}\" of {components} components"))
    })
}

fn component_of(component: StressComponent, s: &[f64]) -> f64 {
    let [xx, yy, zz, xy, yz, xz] = [s[0], s[1], s[2], s[3], s[4], s[5]];
    match component {
        StressComponent::Xx => xx,
        StressComponent::Yy => yy,
        StressComponent::Zz => zz,
        StressComponent::Xy => xy,
        StressComponent::VonMises => {
            let normal = (xx - yy).powi(2) + (yy - zz).powi(2) + (zz - xx).powi(2);
            (0.5 * normal + 3.0 * (xy * xy + yz * yz + xz * xz)).sqrt()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_middle_is_exact_for_linear_fields() {
        let value = |p: [f64; 2]| (p, 1.0 + 2.0 * p[0] - 3.0 * p[1]);
        let quad8 =
            [[0., 0.], [1., 0.], [2., 0.], [2., 1.], [2., 2.], [1., 2.], [0., 2.], [0., 1.]].map(value);
        assert_eq!(middle(&quad8, 4), value([1.0, 1.0]));
        let tri6 = [[0., 0.], [1.5, 0.], [3., 0.], [1.5, 1.5], [0., 3.], [0., 1.5]].map(value);
        let (p, v) = middle(&tri6, 3);
        assert!((p[0] - 1.0).abs() < 1e-12 && (v - value(p).1).abs() < 1e-12);
        let quad4 = [[0., 0.], [2., 0.], [2., 2.], [0., 2.]].map(value);
        assert_eq!(middle(&quad4, 4), value([1.0, 1.0]));
    }

    #[test]
    fn von_mises_of_shear_and_of_pressure() {
        assert!(
            (component_of(StressComponent::VonMises, &[0., 0., 0., 1., 0., 0.]) - 3f64.sqrt()).abs() < 1e-12
        );
        assert_eq!(component_of(StressComponent::VonMises, &[5., 5., 5., 0., 0., 0.]), 0.0);
        assert_eq!(component_of(StressComponent::Zz, &[1., 2., 3., 4., 5., 6.]), 3.0);
    }
}
