//! A case of two bodies written for the other programs: the same nodes, cells, supports, loads and surfaces.
use kontakt::{
    Error, Result,
    case::{Case, Increments, LoadKind, Property, Region, Scalar},
    contact::Law,
    material::Hardening,
    mesh::{Facet, Mesh},
    scene::build_mesh,
};
use std::collections::BTreeMap;

/// Young's modulus, Pa, and Poisson's ratio of both bodies.
pub const ELASTIC: [f64; 2] = [2.1e11, 0.3];
/// Yield stress and its increase with plastic strain, Pa, of both bodies where they yield.
pub const YIELD: [f64; 2] = [500e6, 2e9];

/// A case of two bodies with their meshes.
pub struct Pair {
    pub meshes: [Mesh; 2],
    /// Names of each body's surface that is moved, and of the one that can touch.
    surfaces: [[String; 2]; 2],
    /// How far from x = 0 they can touch, m.
    reach: f64,
    /// Prescribed displacement of the surface that is moved, m.
    pub lift: [f64; 2],
    /// Node that keeps x, if there is one.
    pub axis: [Option<usize>; 2],
    /// With friction: pressed in a first step, sheared in a second.
    pub shear: Option<Shear>,
    /// The bodies yield, and are moved in so many equal increments.
    pub plastic: Option<usize>,
}

/// Friction, and what acts on it.
pub struct Shear {
    pub friction: f64,
    /// Traction of the flat along x at the end, Pa.
    pub pull: [f64; 2],
}

impl Pair {
    /// A case whose bodies can touch as far from x = 0 as `reach`, m.
    pub fn new(case: &Case, reach: f64) -> Result<Pair> {
        let (mut lift, mut axis) = ([0.0; 2], [None; 2]);
        let touching = case.contacts[0].surfaces.each_ref().map(|side| side.surface.clone());
        let mut surfaces = touching.map(|name| [String::new(), name]);
        let meshes = [build_mesh(&case.bodies[0].geometry)?, build_mesh(&case.bodies[1].geometry)?];
        for (b, body) in case.bodies.iter().enumerate() {
            for support in &body.supports {
                match (&support.region, &support.displacement[1]) {
                    (Region::Surface { name, .. }, Some(Scalar::Constant(y))) => {
                        (lift[b], surfaces[b][0]) = (*y, name.clone());
                    }
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
        Ok(Pair { meshes, surfaces, reach, lift, axis, shear, plastic: None })
    }

    /// The same with bodies that yield, in the increments of the case's only step.
    pub fn yielding(mut self, case: &Case) -> Result<Pair> {
        let hardening = case.bodies[0].material.plasticity.as_ref().map(|plasticity| &plasticity.hardening);
        let same = |[stress, modulus]: [&Property; 2]| {
            *stress == Property::Constant(YIELD[0]) && *modulus == Property::Constant(YIELD[1])
        };
        match hardening {
            Some(Hardening::Linear { yield_stress, modulus }) if same([yield_stress, modulus]) => {}
            _ => return Err(Error::internal("a material the other programs' decks do not know")),
        }
        match &case.steps[..] {
            [step] => match step.increments {
                Increments::Equal(n) => self.plastic = Some(n),
                Increments::Automatic => {
                    return Err(Error::internal("increments the other programs do not know"));
                }
            },
            _ => return Err(Error::internal("steps the other programs' decks do not know")),
        }
        Ok(self)
    }

    /// Unknowns of both.
    pub fn dofs(&self) -> usize {
        self.meshes.iter().map(|mesh| 2 * mesh.points.len()).sum()
    }

    /// Facets of a body that can touch, with room for round-off.
    pub fn facets(&self, body: usize) -> Vec<Facet> {
        let mesh = &self.meshes[body];
        let near = |f: &&Facet| {
            mesh.facet_nodes(**f).all(|n| mesh.points[n as usize][0].abs() <= (1.0 + 1e-6) * self.reach)
        };
        mesh.surfaces[&self.surfaces[body][1]].iter().filter(near).copied().collect()
    }

    /// Facets of a body that are moved.
    pub fn flat_facets(&self, body: usize) -> &[Facet] {
        &self.meshes[body].surfaces[&self.surfaces[body][0]]
    }

    /// Nodes of a body that are moved.
    pub fn flat(&self, body: usize) -> Vec<u32> {
        let mesh = &self.meshes[body];
        let mut nodes: Vec<u32> = self.flat_facets(body).iter().flat_map(|f| mesh.facet_nodes(*f)).collect();
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
        let ends = self.flat_facets(body).iter().flat_map(|f| {
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
