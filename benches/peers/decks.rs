//! A case of two discs written for the other programs: the same nodes, cells, supports, loads and surfaces.
use crate::common::HALF_WIDTH;
use kontakt::{
    Error, Result,
    case::{Case, LoadKind, Region, Scalar},
    contact::Law,
    mesh::{Facet, Mesh},
    scene::build_mesh,
};
use std::collections::BTreeMap;

/// Young's modulus, Pa, and Poisson's ratio of both bodies.
pub const ELASTIC: [f64; 2] = [2.1e11, 0.3];

/// A case of two bodies with their meshes.
pub struct Pair {
    pub meshes: [Mesh; 2],
    /// Prescribed displacement of the flat, m.
    pub lift: [f64; 2],
    /// Node that keeps x, if there is one.
    pub axis: [Option<usize>; 2],
    /// With friction: pressed in a first step, sheared in a second.
    pub shear: Option<Shear>,
}

/// Friction, and what acts on it.
pub struct Shear {
    pub friction: f64,
    /// Traction of the flat along x at the end, Pa.
    pub pull: [f64; 2],
}

impl Pair {
    pub fn new(case: &Case) -> Result<Pair> {
        let (mut lift, mut axis) = ([0.0; 2], [None; 2]);
        let meshes = [build_mesh(&case.bodies[0].geometry)?, build_mesh(&case.bodies[1].geometry)?];
        for (b, body) in case.bodies.iter().enumerate() {
            for support in &body.supports {
                match (&support.region, &support.displacement[1]) {
                    (Region::Surface { .. }, Some(Scalar::Constant(y))) => lift[b] = *y,
                    (Region::Point(p), _) => {
                        axis[b] = kontakt::mesh::nearest_node(&meshes[b].points, p).map(|found| found.0);
                    }
                    _ => return Err(Error::internal("a support the other programs' decks do not know")),
                }
            }
        }
        if case.contacts[0].over_temperature.is_some() {
            return Err(Error::internal(
                "a law over temperature, which the other programs' decks do not know",
            ));
        }
        let shear = match case.contacts[0].law {
            Law::Coulomb { friction } => Some(Shear { friction, pull: pulls(case)? }),
            _ => None,
        };
        Ok(Pair { meshes, lift, axis, shear })
    }

    /// Unknowns of both.
    pub fn dofs(&self) -> usize {
        self.meshes.iter().map(|mesh| 2 * mesh.points.len()).sum()
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

    /// The node of a body's flat nearest to its middle.
    pub fn middle(&self, body: usize) -> usize {
        let off = |n: &u32| self.meshes[body].points[*n as usize][0].abs();
        let nearest = self.flat(body).into_iter().min_by(|a, b| off(a).total_cmp(&off(b)));
        nearest.expect("a flat has nodes") as usize
    }

    /// Forces along x that stand for a traction on a body's flat: node, N.
    pub fn pulled(&self, body: usize, traction: f64) -> Vec<(u32, f64)> {
        let mesh = &self.meshes[body];
        let ends = mesh.surfaces["flat"].iter().flat_map(|f| {
            let nodes: Vec<u32> = mesh.facet_nodes(*f).collect();
            let [p, q] = [0, 1].map(|i| mesh.points[nodes[i] as usize]);
            let half = 0.5 * traction * (p[0] - q[0]).hypot(p[1] - q[1]);
            nodes.into_iter().map(move |n| (n, half))
        });
        let mut forces = BTreeMap::new();
        ends.for_each(|(n, force)| *forces.entry(n).or_insert(0.0) += force);
        forces.into_iter().collect()
    }

    /// Size of the elements in contact, m.
    pub fn contact_size(&self) -> f64 {
        let mesh = &self.meshes[0];
        let ends: Vec<u32> = mesh.facet_nodes(self.facets(0)[0]).collect();
        let [p, q] = [0, 1].map(|i| mesh.points[ends[i] as usize]);
        (p[0] - q[0]).hypot(p[1] - q[1])
    }
}

/// Traction along x of the flats in the last step, Pa.
fn pulls(case: &Case) -> Result<[f64; 2]> {
    let share = case.steps.last().map_or(1.0, |step| step.loads);
    let mut pull = [0.0; 2];
    for (pull, body) in std::iter::zip(&mut pull, &case.bodies) {
        for load in &body.loads {
            match &load.kind {
                LoadKind::Traction(Region::Surface { .. }, [Scalar::Constant(x), ..]) => *pull += share * x,
                _ => return Err(Error::internal("a load the other programs' decks do not know")),
            }
        }
    }
    Ok(pull)
}
