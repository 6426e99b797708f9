//! Element kinds: shape functions, facets, quadrature, and the matrices of a solid element.
//!
//! The only place, with `mesh` generators and surface integration, that knows the number of dimensions.
mod dilatation;
mod formulation;
mod geometry;
mod load;
mod locking;
mod quadrature;
mod recovery;
mod shape;
mod solid;

pub use formulation::Formulation;
pub use geometry::PointGeometry;
pub use load::{body_load, facet_load, facet_weights};
pub use locking::{LARGEST_POISSON, resolve_for};
pub use quadrature::{
    FacetPoint, MAX_POINTS, QuadraturePoint, error_rule, facet_rule, load_rule, stiffness_rule,
};
pub use shape::{FacetKind, FacetShape, MAX_NODES, Shape};
pub use solid::{PointLaw, SolidElement, Workspace, resolve};

/// Kinds of solid element, nodes numbered as VTK and Gmsh do: corners counter-clockwise, then mid-sides.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum ElementKind {
    /// 3-node triangle.
    Tri3,
    /// 6-node triangle.
    Tri6,
    /// 4-node quadrilateral.
    Quad4,
    /// 8-node serendipity quadrilateral.
    Quad8,
}

impl ElementKind {
    /// Every kind.
    pub const ALL: [ElementKind; 4] =
        [ElementKind::Tri3, ElementKind::Tri6, ElementKind::Quad4, ElementKind::Quad8];

    /// Name in the case file.
    pub fn name(self) -> &'static str {
        match self {
            ElementKind::Tri3 => "tri3",
            ElementKind::Tri6 => "tri6",
            ElementKind::Quad4 => "quad4",
            ElementKind::Quad8 => "quad8",
        }
    }

    /// Number of nodes.
    pub fn n_nodes(self) -> usize {
        match self {
            ElementKind::Tri3 => 3,
            ElementKind::Tri6 => 6,
            ElementKind::Quad4 => 4,
            ElementKind::Quad8 => 8,
        }
    }

    /// Number of corner nodes, which come first.
    pub fn n_corners(self) -> usize {
        match self {
            ElementKind::Tri3 | ElementKind::Tri6 => 3,
            ElementKind::Quad4 | ElementKind::Quad8 => 4,
        }
    }

    /// VTK cell type.
    pub fn vtk_type(self) -> u8 {
        match self {
            ElementKind::Tri3 => 5,
            ElementKind::Tri6 => 22,
            ElementKind::Quad4 => 9,
            ElementKind::Quad8 => 23,
        }
    }

    /// Local nodes of each facet (2D: edge), ends first, then the mid-side node; the body lies to the left, so that
    /// (t_y, -t_x) is the outward normal.
    pub fn facets(self) -> &'static [&'static [usize]] {
        match self {
            ElementKind::Tri3 => &[&[0, 1], &[1, 2], &[2, 0]],
            ElementKind::Tri6 => &[&[0, 1, 3], &[1, 2, 4], &[2, 0, 5]],
            ElementKind::Quad4 => &[&[0, 1], &[1, 2], &[2, 3], &[3, 0]],
            ElementKind::Quad8 => &[&[0, 1, 4], &[1, 2, 5], &[2, 3, 6], &[3, 0, 7]],
        }
    }
}
