//! The Hertz case written for the other programs: the same nodes, cells, supports and surfaces.
use crate::common::HALF_WIDTH;
use kontakt::{
    Error, Result,
    case::{Case, Region, Scalar},
    mesh::{Facet, Mesh},
    scene::build_mesh,
};

/// Young's modulus, Pa, and Poisson's ratio of both bodies.
pub const ELASTIC: [f64; 2] = [2.1e11, 0.3];

/// A case of two bodies with their meshes.
pub struct Pair {
    pub meshes: [Mesh; 2],
    /// Prescribed displacement of the flat, m.
    pub lift: [f64; 2],
    /// Node that keeps x.
    pub axis: [usize; 2],
}

impl Pair {
    pub fn new(case: &Case) -> Result<Pair> {
        let (mut lift, mut axis) = ([0.0; 2], [0; 2]);
        let meshes = [build_mesh(&case.bodies[0].geometry)?, build_mesh(&case.bodies[1].geometry)?];
        for (b, body) in case.bodies.iter().enumerate() {
            for support in &body.supports {
                match (&support.region, &support.displacement[1]) {
                    (Region::Surface { .. }, Some(Scalar::Constant(y))) => lift[b] = *y,
                    (Region::Point(p), _) => {
                        axis[b] =
                            kontakt::mesh::nearest_node(&meshes[b].points, p).expect("a mesh has nodes").0
                    }
                    _ => return Err(Error::internal("a support the other programs' decks do not know")),
                }
            }
        }
        Ok(Pair { meshes, lift, axis })
    }

    /// Facets of a body's arc that can touch: within two half-widths, with room for round-off.
    pub fn facets(&self, body: usize) -> Vec<Facet> {
        let mesh = &self.meshes[body];
        let near =
            |f: &&Facet| mesh.facet_nodes(**f).all(|n| mesh.points[n as usize][0].abs() <= 2.01 * HALF_WIDTH);
        mesh.surfaces["arc"].iter().filter(near).copied().collect()
    }

    /// Nodes of a body's flat.
    pub fn flat(&self, body: usize) -> Vec<u32> {
        let mesh = &self.meshes[body];
        let mut nodes: Vec<u32> = mesh.surfaces["flat"].iter().flat_map(|f| mesh.facet_nodes(*f)).collect();
        nodes.sort_unstable();
        nodes.dedup();
        nodes
    }

    /// Size of the elements in contact, m.
    pub fn contact_size(&self) -> f64 {
        let mesh = &self.meshes[0];
        let ends: Vec<u32> = mesh.facet_nodes(self.facets(0)[0]).collect();
        let [p, q] = [0, 1].map(|i| mesh.points[ends[i] as usize]);
        (p[0] - q[0]).hypot(p[1] - q[1])
    }
}
