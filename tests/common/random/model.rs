//! The bodies of a case by dense algebra of the test's own: element arrays, loads and supports. From the program come the
//! mesh and the arrays of single elements, which tests of their own check.
use kontakt::{
    body::find_facets,
    case::{BodyCase, Case, LoadKind, Region, Temperature},
    element::{SolidElement, body_load, facet_load, facet_weights, resolve_for},
    material::{Analysis, LinearElastic},
    mesh::{Facet, Mesh},
    scene::build_mesh,
};

/// One element: its nodes, its stiffness and the forces of its initial strain.
pub struct Element {
    pub nodes: Vec<usize>,
    pub k: Vec<f64>,
    pub f: Vec<f64>,
}

/// A displacement that a support prescribes.
pub struct Held {
    pub node: usize,
    pub direction: [f64; 2],
    pub value: f64,
}

/// A traction, Pa, from the position and the outward normal.
type Traction<'t> = dyn Fn(&[f64; 3], &[f64; 3]) -> [f64; 3] + 't;

/// A body.
pub struct Model {
    pub mesh: Mesh,
    pub elements: Vec<Element>,
    /// External forces at the nodes, N.
    pub external: Vec<f64>,
    pub held: Vec<Held>,
}

impl Model {
    /// A body of a case with the loads and supports of its last step, and the temperature as written.
    pub fn new(case: &Case, body: &BodyCase) -> Model {
        let mesh = build_mesh(&body.geometry).expect("the program has meshed it, too");
        let law = LinearElastic::new(&body.material, case.analysis);
        let poisson = match case.analysis {
            Analysis::PlaneStress { .. } => 0.0,
            Analysis::PlaneStrain { .. } => body.material.poisson.largest(),
        };
        let thickness = case.analysis.thickness();
        let temperature: Option<Vec<f64>> = body.temperature.as_ref().map(|t| match t {
            Temperature::Field(t) => mesh.points.iter().map(|x| t.at(x)).collect(),
            Temperature::Nodal { .. } => panic!("no scene has temperatures from a file"),
        });
        let elements = mesh.cells.iter().map(|cell| {
            let formulation = resolve_for(cell.kind, body.formulation, poisson).expect("not refused");
            let element = SolidElement::new(cell.kind, Some(formulation)).expect("it fits");
            let nodes: Vec<usize> = cell.nodes().iter().map(|&n| n as usize).collect();
            let x: Vec<[f64; 3]> = nodes.iter().map(|&n| mesh.points[n]).collect();
            let n = 2 * nodes.len();
            let (mut k, mut f) = (vec![0.0; n * n], vec![0.0; n]);
            let at = |_: usize, shape: &[f64]| {
                let t =
                    temperature.as_ref().map(|t| std::iter::zip(&nodes, shape).map(|(&a, n)| n * t[a]).sum());
                law.law(t)
            };
            element.stiffness(&x, thickness, at, &mut k, &mut f).expect("a sound cell");
            Element { nodes, k, f }
        });
        let elements = elements.collect();
        let (mut held, mut external) = (supports(body, &mesh), external(body, &mesh, thickness));
        if let Some(step) = case.steps.last() {
            held.iter_mut().for_each(|held| held.value *= step.supports);
            external.iter_mut().for_each(|f| *f *= step.loads);
        }
        Model { mesh, elements, external, held }
    }

    /// Internal forces K u - f, N, and at each unknown the sum of the sizes of what it is summed from.
    pub fn internal(&self, u: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let (mut force, mut size) = (vec![0.0; u.len()], vec![0.0; u.len()]);
        for Element { nodes, k, f } in &self.elements {
            let dofs: Vec<usize> = nodes.iter().flat_map(|&a| [2 * a, 2 * a + 1]).collect();
            for (i, &row) in dofs.iter().enumerate() {
                for (j, &column) in dofs.iter().enumerate() {
                    let part = k[i * dofs.len() + j] * u[column];
                    force[row] += part;
                    size[row] += part.abs();
                }
                force[row] -= f[i];
                size[row] += f[i].abs();
            }
        }
        (force, size)
    }

    /// Nodes of a surface of the body along it, without repetition.
    pub fn surface(&self, case: &Case, pair: usize, side: usize) -> Vec<Vec<usize>> {
        let contact = &case.contacts[pair];
        let name = &contact.surfaces[side];
        let body = case.body_name(name.body);
        let facets = find_facets(&self.mesh, body, &name.surface, name.within.as_ref(), &contact.origin);
        let facets = facets.expect("the program found it, too");
        facets.iter().map(|&f| self.mesh.facet_nodes(f).map(|n| n as usize).collect()).collect()
    }
}

fn region_nodes(body: &BodyCase, mesh: &Mesh, region: &Region, origin: &kontakt::case::Origin) -> Vec<usize> {
    match region {
        Region::Point(at) => vec![nearest(mesh, at)],
        Region::Surface { name, within } => {
            let facets = find_facets(mesh, &body.name, name, within.as_ref(), origin).expect("it is there");
            let mut nodes: Vec<usize> =
                facets.iter().flat_map(|&f| mesh.facet_nodes(f)).map(|n| n as usize).collect();
            nodes.sort_unstable();
            nodes.dedup();
            nodes
        }
    }
}

fn nearest(mesh: &Mesh, at: &[f64; 3]) -> usize {
    let distance = |p: &[f64; 3]| (p[0] - at[0]).hypot(p[1] - at[1]);
    let nodes = 0..mesh.points.len();
    nodes.min_by(|&a, &b| distance(&mesh.points[a]).total_cmp(&distance(&mesh.points[b]))).expect("a node")
}

fn supports(body: &BodyCase, mesh: &Mesh) -> Vec<Held> {
    let mut held: Vec<Held> = Vec::new();
    for support in &body.supports {
        let (s, c) = support.angle.sin_cos();
        for node in region_nodes(body, mesh, &support.region, &support.origin) {
            for (value, direction) in std::iter::zip(&support.displacement, [[c, s], [-s, c]]) {
                let Some(value) = value else { continue };
                let known = held.iter().any(|h| {
                    let along = h.direction[0] * direction[0] + h.direction[1] * direction[1];
                    h.node == node && along.abs() > 1.0 - 1e-9
                });
                if !known {
                    held.push(Held { node, direction, value: value.at(&mesh.points[node]) });
                }
            }
        }
    }
    held
}

fn external(body: &BodyCase, mesh: &Mesh, thickness: f64) -> Vec<f64> {
    let mut f = vec![0.0; 2 * mesh.points.len()];
    let mut add = |nodes: &[usize], local: &[f64]| {
        for (&node, part) in std::iter::zip(nodes, local.chunks(2)) {
            f[2 * node] += part[0];
            f[2 * node + 1] += part[1];
        }
    };
    let facets = |region: &Region, origin| -> Vec<Facet> {
        let Region::Surface { name, within } = region else { panic!("a surface") };
        find_facets(mesh, &body.name, name, within.as_ref(), origin).expect("it is there")
    };
    for load in &body.loads {
        let mut on = |region: &Region, t: &Traction<'_>| {
            for facet in facets(region, &load.origin) {
                let nodes: Vec<usize> = mesh.facet_nodes(facet).map(|n| n as usize).collect();
                let x: Vec<[f64; 3]> = nodes.iter().map(|&n| mesh.points[n]).collect();
                let mut local = vec![0.0; 2 * nodes.len()];
                facet_load(&x, thickness, t, &mut local);
                add(&nodes, &local);
            }
        };
        match &load.kind {
            LoadKind::Pressure(region, p) => on(region, &|x, n| n.map(|n| -p.at(x) * n)),
            LoadKind::Traction(region, t) => on(region, &|x, _| [t[0].at(x), t[1].at(x), 0.0]),
            LoadKind::Force(Region::Point(at), force) => add(&[nearest(mesh, at)], &force[..2]),
            LoadKind::Force(region, force) => {
                let area: f64 = facets(region, &load.origin)
                    .into_iter()
                    .map(|facet| {
                        let x: Vec<[f64; 3]> =
                            mesh.facet_nodes(facet).map(|n| mesh.points[n as usize]).collect();
                        let mut weights = vec![0.0; x.len()];
                        facet_weights(&x, thickness, &mut weights);
                        weights.iter().sum::<f64>()
                    })
                    .sum();
                on(region, &|_, _| force.map(|f| f / area));
            }
            LoadKind::BodyForce(b) => {
                for cell in &mesh.cells {
                    let nodes: Vec<usize> = cell.nodes().iter().map(|&n| n as usize).collect();
                    let x: Vec<[f64; 3]> = nodes.iter().map(|&n| mesh.points[n]).collect();
                    let mut local = vec![0.0; 2 * nodes.len()];
                    let b = |x: &[f64; 3]| [b[0].at(x), b[1].at(x), 0.0];
                    body_load(cell.kind, &x, thickness, b, &mut local).expect("a sound cell");
                    add(&nodes, &local);
                }
            }
        }
    }
    f
}
