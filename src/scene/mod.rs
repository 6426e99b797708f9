//! The scene, before anything is solved: meshes, ranks, contact surfaces, and bodies that could move freely.
mod insert;

use crate::vector::larger;
use crate::{
    body::{Elements, find_facets},
    case::{BodyCase, BodyRef, Case, Driver, Geometry, Origin, RigidShape},
    contact::Surface,
    error::{Error, Result},
    mesh::{self, Mesh},
    parallel::{self, Exchange, Groups, Partner, Traffic, agree},
};
use mpi::{topology::SimpleCommunicator, traits::*};
use std::{collections::HashSet, rc::Rc};

/// A side of a contact pair.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct ContactSide {
    /// Index of the pair in the case.
    pub pair: usize,
    /// Side in the case: 0 is A.
    pub side: usize,
    /// Index of its body in the case.
    pub body: usize,
}

/// What `kontakt check` reports, and what a run starts from: meshes checked, ranks dealt, bodies restrained.
pub struct Plan {
    /// Unknowns of each body.
    pub dofs: Vec<usize>,
    /// The communicators.
    pub groups: Groups,
    /// Meshes of this group's bodies.
    pub(crate) meshes: Vec<Mesh>,
    /// Contact surfaces of this group's bodies, in the order of `ends`.
    pub(crate) surfaces: Vec<Surface>,
    /// Of which side of which pair each surface is.
    pub(crate) ends: Vec<ContactSide>,
    /// Bodies of the case that supports do not hold.
    floating: Vec<bool>,
    /// Wall seconds it took.
    pub(crate) seconds: f64,
    /// Sent between the groups so far.
    pub(crate) traffic: Rc<Traffic>,
}

/// Builds a body's mesh, all of it of the body's own material; [`mesh_of`] knows its inserts.
pub fn build_mesh(geometry: &Geometry) -> Result<Mesh> {
    let (mesh, origin) = match geometry {
        Geometry::Gmsh { file, groups, scale, refine, origin } => {
            let groups: Vec<&str> = groups.iter().map(String::as_str).collect();
            let read = mesh::read_gmsh(file, &groups, *scale).map_err(|e| origin.error(e))?;
            (finer(read, *refine, origin), origin)
        }
        Geometry::Generated { shape, element, rotate, translate, origin } => {
            (mesh::generate(shape, *element, *rotate, *translate), origin)
        }
    };
    let mesh = mesh.map_err(|e| origin.error(e))?;
    mesh::check(&mesh).map_err(|e| origin.error(e))?;
    Ok(mesh)
}

/// Builds a body's mesh with its inserts, without its cuts.
pub fn mesh_of(body: &BodyCase) -> Result<Mesh> {
    let mut mesh = build_mesh(&body.geometry)?;
    insert::mark(&mut mesh, body)?;
    Ok(mesh)
}

/// A body's mesh with its inserts and cuts.
pub(crate) fn cut_mesh(body: &BodyCase) -> Result<Mesh> {
    let mut mesh = mesh_of(body)?;
    // Contact, too, is with the smooth outline, not with the sides.
    if let Geometry::Gmsh { refine: 0, .. } = body.geometry {
        mesh.follow_smooth_outline();
    }
    if body.cuts.is_empty() {
        return Ok(mesh);
    }
    for cells in &body.cuts {
        let mut marked = vec![false; mesh.cells.len()];
        for &cell in cells {
            let marked = marked.get_mut(cell as usize);
            *marked.ok_or_else(|| body.origin.error(format!("there is no cell {cell} to cut")))? = true;
        }
        mesh = mesh::refine(&mesh, &marked);
    }
    mesh::check(&mesh).map_err(|e| body.origin.error(format!("after refinement: {e}")))?;
    Ok(mesh)
}

/// A mesh from a file, every cell cut into four `times` times.
fn finer(mut mesh: Mesh, times: usize, origin: &Origin) -> Result<Mesh> {
    if times == 0 {
        return Ok(mesh);
    }
    // What is wrong with the file's own mesh is said of that.
    mesh::check(&mesh).map_err(|e| origin.error(e))?;
    mesh.follow_smooth_outline();
    mesh::refine_all(mesh, times)
}

/// Unknowns of all bodies with their cuts. Collective.
pub(crate) fn count_dofs(case: &Case, world: &SimpleCommunicator) -> Result<usize> {
    Ok(sized_meshes(case, world)?.0.iter().sum())
}

/// Unknowns of each body, and the meshes that this rank has made to know them: body b is meshed first by rank b mod P.
/// Collective.
fn sized_meshes(case: &Case, world: &SimpleCommunicator) -> Result<(Vec<usize>, Vec<Option<Mesh>>)> {
    let (rank, size) = (world.rank() as usize, world.size() as usize);
    let mut counts = vec![0.0; case.bodies.len()];
    let mut known: Vec<Option<Mesh>> = vec![None; case.bodies.len()];
    let sized = (rank..case.bodies.len()).step_by(size).try_for_each(|b| {
        let mesh = cut_mesh(&case.bodies[b])?;
        Elements::new(&mesh, &case.bodies[b], case.analysis)?;
        counts[b] = (mesh.points.len() * mesh.dim) as f64;
        known[b] = Some(mesh);
        Ok(())
    });
    agree(world, sized)?;
    Ok((parallel::sum(world, &counts).into_iter().map(|n| n as usize).collect(), known))
}

impl Plan {
    /// Meshes the bodies, deals the ranks, finds the contact surfaces, and refuses what cannot be solved. Collective.
    pub fn new(case: &Case, world: &SimpleCommunicator) -> Result<Plan> {
        let start = std::time::Instant::now();
        let (dofs, mut known) = sized_meshes(case, world)?;
        let groups = Groups::new(world, &dofs);
        let meshes = groups.bodies().iter().map(|&b| match known[b].take() {
            Some(mesh) => Ok(mesh),
            None => cut_mesh(&case.bodies[b]),
        });
        let meshes = agree(world, meshes.collect::<Result<Vec<Mesh>>>())?;
        let floating = vec![false; case.bodies.len()];
        let mut plan = Plan {
            dofs,
            groups,
            meshes,
            surfaces: Vec::new(),
            ends: Vec::new(),
            floating,
            seconds: 0.0,
            traffic: Rc::default(),
        };
        let found = plan.find_surfaces(case);
        agree(world, found)?;
        plan.refuse_duplicates(case)?;
        if let Driver::Relaxed(_) = case.alternation.driver {
            let restrained = plan.refuse_free_bodies(case);
            agree(world, restrained)?;
        }
        plan.find_floating_bodies(case)?;
        plan.seconds = start.elapsed().as_secs_f64();
        Ok(plan)
    }

    fn find_surfaces(&mut self, case: &Case) -> Result<()> {
        for (p, contact) in case.contacts.iter().enumerate() {
            for (side, name) in contact.surfaces.iter().enumerate() {
                let Some(index) = name.body.deformable() else { continue };
                let Some(i) = self.groups.bodies().iter().position(|&b| b == index) else { continue };
                let body = &case.bodies[index].name;
                let facets =
                    find_facets(&self.meshes[i], body, &name.surface, name.within.as_ref(), &contact.origin)?;
                self.surfaces.push(Surface::new(&self.meshes[i], &facets, case.analysis.thickness()));
                self.ends.push(ContactSide { pair: p, side, body: index });
            }
        }
        Ok(())
    }

    /// Refuses two pairs of the same bodies that share facets on both sides: where these meet, each pair would carry the
    /// pressure. Collective.
    fn refuse_duplicates(&self, case: &Case) -> Result<()> {
        let n = case.contacts.len();
        let bodies = |p: usize| case.contacts[p].surfaces.each_ref().map(|s| s.body);
        // Pairs q < p, and the side of q that belongs to side 0 of p.
        let alike: Vec<(usize, usize, usize)> = (0..n)
            .flat_map(|p| (0..p).map(move |q| (q, p)))
            .filter_map(|(q, p)| {
                let ([a, b], other) = (bodies(p), bodies(q));
                let first = if other == [a, b] { 0 } else { 1 };
                (other == [a, b] || other == [b, a]).then_some((q, p, first))
            })
            .collect();
        let facets = |end: usize| -> HashSet<[u32; 2]> {
            let surface = &self.surfaces[end];
            surface.facets.iter().map(|f| [f[0], f[1]].map(|n| surface.nodes[n as usize])).collect()
        };
        let shared = alike.iter().flat_map(|&(q, p, first)| {
            [0, 1].map(|side| match (self.end(p, side), self.end(q, side ^ first)) {
                (Some(i), Some(j)) => f64::from(u8::from(!facets(i).is_disjoint(&facets(j)))),
                // Another group's, or rigid: a rigid surface is one.
                _ => f64::from(u8::from(case.contacts[p].surfaces[side].body.deformable().is_none())),
            })
        });
        let shared: Vec<f64> = shared.collect();
        let shared = parallel::max(&self.groups.world, &shared);
        for (&(q, p, _), sides) in std::iter::zip(&alike, shared.chunks_exact(2)) {
            if sides.iter().all(|s| *s > 0.5) {
                let [first, second] = [&case.contacts[q], &case.contacts[p]];
                return Err(second.origin.error(format!(
                    "contact '{}' pairs surfaces that contact '{}' ({}) pairs already: write each part of a surface into one \
                     pair only, or part them by 'within'",
                    second.name, first.name, first.origin
                )));
            }
        }
        Ok(())
    }

    fn refuse_free_bodies(&self, case: &Case) -> Result<()> {
        for (&b, mesh) in std::iter::zip(self.groups.bodies(), &self.meshes) {
            let body = &case.bodies[b];
            let constraints = crate::body::Constraints::new(body, mesh)?;
            let free = crate::body::free_motions(mesh, &constraints);
            if !free.is_empty() {
                let held = if case
                    .contacts
                    .iter()
                    .any(|c| c.surfaces.iter().any(|s| s.body == BodyRef::Deformable(b)))
                {
                    "is held by nothing but contact, which the relaxed driver cannot solve (driver = \"active set\" can)"
                } else {
                    "is not held by its supports"
                };
                return Err(Error::Unrestrained(format!(
                    "{}: body '{}' {held}: free motion: {}; add a [[body.support]] that prevents it",
                    body.origin,
                    body.name,
                    free.join(", ")
                )));
            }
        }
        Ok(())
    }

    /// Which bodies supports do not hold, over all ranks. Collective.
    fn find_floating_bodies(&mut self, case: &Case) -> Result<()> {
        let mut found = vec![0.0; case.bodies.len()];
        let own = std::iter::zip(self.groups.bodies(), &self.meshes).try_for_each(|(&b, mesh)| {
            let constraints = crate::body::Constraints::new(&case.bodies[b], mesh)?;
            found[b] = f64::from(u8::from(!crate::body::free_motions(mesh, &constraints).is_empty()));
            Ok(())
        });
        agree(&self.groups.world, own)?;
        self.floating = parallel::max(&self.groups.world, &found).iter().map(|f| *f > 0.5).collect();
        Ok(())
    }

    /// True if supports do not hold one of the pair's bodies.
    pub(crate) fn floating(&self, case: &Case, pair: usize) -> bool {
        let bodies = case.contacts[pair].surfaces.iter().filter_map(|s| s.body.deformable());
        bodies.into_iter().any(|b| self.floating[b])
    }

    /// Which of this rank's surfaces is that of a side of a pair.
    pub(crate) fn end(&self, pair: usize, side: usize) -> Option<usize> {
        self.ends.iter().position(|end| (end.pair, end.side) == (pair, side))
    }

    /// Place of a body of the case among this group's.
    pub(crate) fn place(&self, body: usize) -> usize {
        self.groups.bodies().iter().position(|&b| b == body).expect("the body is this group's")
    }

    /// The surface of a rigid side of a pair; `None` if the side is deformable.
    pub(crate) fn rigid_surface(&self, case: &Case, pair: usize, side: usize) -> Option<Surface> {
        let BodyRef::Rigid(i) = case.contacts[pair].surfaces[side].body else { return None };
        let xy = |p: &[f64; 3]| [p[0], p[1]];
        Some(match &case.rigid[i].shape {
            RigidShape::Plane { through, normal } => {
                // Long enough for the other surface wherever it lies.
                let end = self.end(pair, 1 - side);
                let reach = end.map_or(1.0, |e| {
                    let surface = &self.surfaces[e];
                    let far = surface.points.iter().map(|p| {
                        let d = crate::contact::vector::sub(p, through);
                        crate::contact::vector::norm(&d)
                    });
                    far.fold(0.0, larger) + surface.extent()
                });
                Surface::rigid_plane(xy(through), xy(normal), 2.0 * reach)
            }
            RigidShape::Circle { center, radius, inside } => {
                Surface::rigid_circle(xy(center), *radius, *inside)
            }
            RigidShape::Polyline { points } => {
                Surface::rigid_polyline(&points.iter().map(xy).collect::<Vec<_>>())
            }
        })
    }

    /// The exchange between this rank's surfaces and their partners'.
    pub fn exchange(&self, case: &Case) -> Exchange<'_> {
        Exchange {
            comm: self.groups.roots.as_ref(),
            partners: self.partners(case),
            traffic: self.traffic.clone(),
        }
    }

    /// Partners of this rank's surfaces.
    fn partners(&self, case: &Case) -> Vec<Partner> {
        self.ends
            .iter()
            .map(|&ContactSide { pair, side, .. }| {
                let other = case.contacts[pair].surfaces[1 - side].body;
                let Some(other) = other.deformable() else { return Partner::Rigid };
                let group = self.groups.group_of(other);
                if group == self.groups.own {
                    let here = self.end(pair, 1 - side);
                    Partner::Here(here.expect("both sides are on this rank"))
                } else {
                    Partner::Remote { rank: group as i32, pair }
                }
            })
            .collect()
    }
}
