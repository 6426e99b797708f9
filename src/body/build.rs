//! How a body comes to be: its share of the mesh and its matrix first, then the factorisation.
use super::{
    Body, Constraints, Elements, Fixing, FreeModes, Interface, LoadFactors, NodeConstraint, ResponseKind,
    assembly::{Assembled, Model},
    condense_estimate,
    cost::SharedCost,
    laws::Laws,
    load::{Loads, scaled},
    options_prefix,
    points::Points,
    soft::Split,
    system::{Setting, System},
    temperature::temperatures,
    zone::Zone,
};
use crate::{
    case::{BodyCase, Case, ZoneCase},
    error::Result,
    mesh::{Cell, Mesh, MeshPart, Numbering, give_to_first, partition},
    parallel::{agree, busy_with},
    petsc::{Gather, Matrix, Stage, Vector, smooth_stretched},
};
use mpi::{topology::SimpleCommunicator, traits::*};
use std::{collections::BTreeSet, rc::Rc, time::Instant};

/// Relative residual that the answers of an iterative solver may have at most, if nobody says more: what the tightest
/// alternations need.
const ACCURATE: f64 = 1e-12;

/// The residual of the bodies' answers is to be this much smaller than that of the alternation, or it is what stops it, ...
const SHARE: f64 = 0.01;

/// ... and at most this, whatever the alternation's tolerance.
const LOOSEST: f64 = 1e-8;

/// From this ratio of a cell's longest to its shortest side on, multigrid needs smoothers for stretched cells.
const STRETCHED: f64 = 4.0;

/// A body with its stiffness matrix and its loads, not factorised yet.
pub struct AssembledBody {
    part: Rc<MeshPart>,
    numbering: Numbering,
    free: FreeModes,
    fixings: Vec<Fixing>,
    interface: Interface,
    cost: SharedCost,
    model: Model,
    temperature: Option<Rc<Vec<f64>>>,
    loads: Loads,
    points: Option<Points>,
    zone: Option<Zone>,
    matrix: Matrix,
    setting: Setting,
    condensed: bool,
    split: Option<Split>,
    ghosts: Gather,
}

impl Body {
    /// Builds the body on its rank group from its whole mesh: partition, assembly, factorisation. `whole`: the case that it is of.
    ///
    /// `interface`: mesh nodes that contact may reach, the same on all ranks; rows name them by their position in the
    /// list. The first rank owns them. Collective.
    pub fn new(
        case: &BodyCase,
        whole: &Case,
        mesh: &Mesh,
        group: &SimpleCommunicator,
        interface: &[u32],
        response: ResponseKind,
    ) -> Result<Body> {
        Body::assemble(case, whole, mesh, group, interface, response)?.factorise(group)
    }

    /// The same without the factorisation. Collective.
    pub fn assemble(
        case: &BodyCase,
        whole: &Case,
        mesh: &Mesh,
        group: &SimpleCommunicator,
        interface: &[u32],
        response: ResponseKind,
    ) -> Result<AssembledBody> {
        let _stage = Stage::Assemble.enter();
        let parts = group.size() as usize;
        let need = condense_estimate(mesh.points.len() * mesh.dim, interface.len() * mesh.dim, mesh.dim);
        busy_with(format!(
            "assembling body '{}' of {} unknowns, whose factor alone takes about {:.0} MB",
            case.name,
            mesh.points.len() * mesh.dim,
            (need.bytes + need.factor_bytes) / 1e6
        ));
        // The same on every rank of the group, errors included.
        let elements = Elements::new(mesh, case, whole.analysis)?;
        let mut owners = partition(mesh, parts)
            .map_err(|e| case.origin.error(format!("cannot be spread over {parts} ranks: {e}")))?;
        give_to_first(mesh, &mut owners, interface);
        // METIS draws from the C library's random numbers: only one rank's answer may count.
        group.process_at_rank(0).broadcast_into(&mut owners[..]);
        let numbering = Numbering::new(mesh, &owners, parts);
        let part = Rc::new(MeshPart::with_numbering(mesh, &owners, group.rank() as u32, &numbering));
        let temperature = case.temperature.as_ref().map(|t| temperatures(t, &part.points)).transpose();
        // From here on ranks see different nodes: an error of one is agreed before the next collective call.
        let temperature = agree(group, temperature)?.map(Rc::new);
        let mut constraints = Constraints::new(case, mesh)?;
        let paths = case.supports.iter().filter_map(|support| support.path).collect::<BTreeSet<_>>();
        let mut on_paths = Vec::new();
        for path in paths {
            on_paths.push((path, Constraints::of_path(case, mesh, Some(path))?));
        }
        let free = FreeModes::new(mesh, &constraints);
        let fixings = free.fixings(mesh, &constraints, interface);
        constraints.fix(&fixings);
        on_paths.iter_mut().for_each(|(_, supports)| supports.fix(&fixings));
        let interface = Interface::new(interface, mesh, &constraints, &numbering, group);
        let model = Model {
            part: part.clone(),
            elements,
            laws: Laws::new(case, whole.analysis, &whole.plasticity),
            constraints: constraints.of_part(&part),
            on_paths: on_paths.into_iter().map(|(path, supports)| (path, supports.of_part(&part))).collect(),
            thickness: whole.analysis.thickness(),
        };
        let dim = part.dim;
        let condensed =
            response.is_condensed(&case.name, part.n_global_nodes * dim, interface.nodes.len() * dim, dim)?;

        let start = Instant::now();
        let dofs: Vec<i32> =
            part.global.iter().flat_map(|&g| (0..dim).map(move |c| (g as usize * dim + c) as i32)).collect();
        let ghosts = Gather::new(&Vector::zeros(group, part.n_owned * dim)?, &dofs)?;
        let parameters = model.parameters(temperature.as_ref().map(|t| &t[..]), &model.constraints);
        let external = parameters.external_forces(case, mesh, group)?;
        let Assembled { matrix, thermal, prescribed } =
            model.assemble(temperature.as_ref().map(|t| &t[..]), None, group)?;
        let rule = |cell: &Cell| model.elements.of(cell.kind).points().len();
        let yields = model.laws.yield_somewhere();
        let points = yields.then(|| Points::new(&part.cells, rule, whole.plasticity.tangent));
        let may_have_zone = yields && condensed && parts == 1 && whole.plasticity.zone != ZoneCase::Never;
        let zone =
            may_have_zone.then(|| Zone::new(whole.plasticity.zone, &part, interface.nodes.len() * dim));
        let cost = SharedCost::default();
        cost.add(|c| c.assemble = start.elapsed().as_secs_f64());
        if stretching(mesh) > STRETCHED {
            smooth_stretched(&options_prefix(&case.name))?;
        }
        let setting =
            Setting { body: case.name.clone(), prefix: options_prefix(&case.name), dim, tolerance: ACCURATE };
        let loads = Loads {
            factors: LoadFactors::default(),
            external,
            temperature_path: case.temperature_path,
            // As it is given, whatever its path says.
            heat: 1.0,
            thermal,
            prescribed,
            mode_work: Vec::new(),
            current: Vec::new(),
            condensed: None,
        };
        Ok(AssembledBody {
            part,
            numbering,
            free,
            fixings,
            interface,
            cost,
            model,
            temperature,
            loads,
            points,
            zone,
            matrix,
            setting,
            condensed,
            split: None,
            ghosts,
        })
    }
}

/// Largest ratio of a cell's longest to its shortest side.
fn stretching(mesh: &Mesh) -> f64 {
    let of_cell = |cell: &Cell| {
        let side = |facet: u8| {
            let mut nodes = cell.facet_nodes(facet).map(|node| &mesh.points[node as usize]);
            let (Some(a), Some(b)) = (nodes.next(), nodes.next()) else { return 0.0 };
            std::iter::zip(a, b).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
        };
        let sides = (0..cell.kind.facets().len() as u8).map(side);
        let (shortest, longest) = sides.fold((f64::INFINITY, 0.0), |(s, l): (f64, f64), side| {
            (if side < s { side } else { s }, if side > l { side } else { l })
        });
        longest / shortest
    };
    mesh.cells.iter().map(of_cell).fold(1.0, |most, ratio| if ratio > most { ratio } else { most })
}

impl AssembledBody {
    /// The stiffness matrix with supports and fixings eliminated.
    pub fn matrix(&self) -> &Matrix {
        &self.matrix
    }

    /// Right-hand side of all loads at factor 1 at the owned nodes, N, in the nodes' frames.
    pub fn load(&self) -> Vec<f64> {
        let loads = &self.loads;
        let external = scaled(&loads.external, loads.thermal.len(), |_| 1.0);
        let external = self.model.constraints.to_frames(&external, self.part.dim);
        let prescribed = scaled(&loads.prescribed, loads.thermal.len(), |_| 1.0);
        let parts = external.iter().zip(&loads.thermal).zip(&prescribed);
        parts.map(|((e, t), p)| e + t + p).collect()
    }

    /// Deformations softer than this share of the longest wave of a body as deep as its interface is long are to be
    /// [modes](crate::schwarz::Respond::modes) of a condensed body, each with its stiffness.
    pub fn split_soft_modes(&mut self, softness: f64) {
        let (dim, interface) = (self.part.dim, &self.interface);
        let rigid = (0..self.free.modes.len()).map(|k| interface.mode(&self.free, k, dim));
        let is_held = |(i, c)| {
            let constraint = interface.constraints.0.get(&(i as u32));
            constraint.is_some_and(|constraint: &NodeConstraint| constraint.held(c).is_some())
        };
        self.split = Some(Split {
            softness,
            rigid: rigid.map(|mode| interface.constraints.to_frames(&mode, dim)).collect(),
            held: (0..interface.nodes.len())
                .flat_map(|i| (0..dim).map(move |c| (i, c)))
                .map(is_held)
                .collect(),
            dim,
        });
    }

    /// An iterative solver is to be accurate enough for an alternation to this relative tolerance.
    pub fn answer_to(&mut self, tolerance: f64) {
        self.setting.tolerance = (SHARE * tolerance).clamp(ACCURATE, LOOSEST);
    }

    /// Factorises. Collective.
    pub fn factorise(self, group: &SimpleCommunicator) -> Result<Body> {
        let AssembledBody { interface, setting, cost, loads, temperature, split, .. } = self;
        let name = setting.body.clone();
        let system =
            System::new(group, self.matrix, &interface, setting, self.condensed, split.as_ref(), &cost)?;
        let mut body = Body {
            name,
            part: self.part,
            numbering: self.numbering,
            free: Rc::new(self.free),
            fixings: Rc::new(self.fixings),
            interface: Rc::new(interface),
            cost,
            model: Rc::new(self.model),
            given_temperature: temperature.clone(),
            temperature,
            loads,
            points: self.points,
            zone: self.zone,
            zone_acts: false,
            system: Rc::new(system),
            split,
            ghosts: self.ghosts,
        };
        if let Some(points) = &mut body.points {
            points.keep_elastic(&body.system, &body.loads.prescribed);
        }
        body.loads.mode_work = body.work_on_modes(group);
        body.combine_loads();
        Ok(body)
    }
}
