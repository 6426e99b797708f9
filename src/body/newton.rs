//! A body that yields, in Newton's iterations.
//!
//! A Newton iteration takes the body for the linear one that it is close to the displacements u of the last: the stiffness K at u, and
//! in place of the forces of the initial strain K u - f(u), with f(u) the nodal forces of the stresses (N). What is solved with it is
//! total displacements, and everything that knows linear bodies is used as it is.
use super::{
    Body,
    assembly::{cell_points, temperature_at},
    hanging::Hanging,
    laws::Law,
    points::{Elastic, Extent, Unbalanced, in_plane},
    rounding::rounded,
    zone::Zone,
};
use crate::{
    element::{MAX_NODES, Workspace},
    error::Result,
    material::PointState,
    parallel::{self, agree},
};
use mpi::topology::SimpleCommunicator;

/// Share of the forces that would hold plastic strains back, as far as stresses can, by which those that are missing are measured:
/// little where loads act, and far above what round-off leaves where none do.
const HELD: f64 = 0.01;

impl Body {
    /// True if it has a material that yields.
    pub fn yields(&self) -> bool {
        self.points.is_some()
    }

    /// Begins an increment at the accepted states of the points of all cells of the part; `None`: nothing has yielded yet.
    pub fn begin(&mut self, states: Option<&[PointState]>) {
        let Some(points) = &mut self.points else { return };
        match states {
            Some(states) => points.accepted.copy_from_slice(states),
            None => points.accepted.fill(PointState::default()),
        }
    }

    /// The states of the points of all cells of the part at the displacements of this iteration, and where those of each cell end.
    pub fn point_states(&self) -> (&[PointState], &[u32]) {
        self.points.as_ref().map_or((&[], &[]), |points| (&points.current, &points.ends))
    }

    /// Share of the cells that iterations factorise: of a body of which nothing has yielded, all.
    pub fn zone_fraction(&self) -> f64 {
        self.zone.as_ref().map_or(1.0, Zone::share)
    }

    /// The cells that alone are iterated; `None`: all are.
    fn iterated(&self) -> Option<&[bool]> {
        self.zone.as_ref().filter(|_| self.zone_acts).and_then(Zone::cells)
    }

    /// Owned nodes at which fixings hold the body in the stiffness matrix, in their order.
    pub(super) fn fixed_nodes(&self) -> Vec<usize> {
        let own = &self.part.original[..self.part.n_owned];
        self.fixings.iter().filter_map(|fixing| own.iter().position(|node| *node == fixing.node)).collect()
    }

    /// Owned nodes at which, while a zone alone is iterated, what the condensed rest does is not known: nothing is missing there if
    /// nothing is elsewhere.
    fn unseen(&self) -> Vec<usize> {
        if self.iterated().is_some() { self.fixed_nodes() } else { Vec::new() }
    }

    /// Takes the laws for elastic ones with the plastic strains of the accepted state: the way an increment begins.
    pub fn start_elastic(&mut self) {
        let Some(points) = &mut self.points else { return };
        let temperature = self.temperature.as_ref().map(|t| &t[..]);
        for (i, cell) in self.part.cells.iter().enumerate() {
            let law = self.model.laws.of(cell);
            let range = points.range(i);
            let rule = self.model.elements.of(cell.kind).points();
            for (p, point) in range.zip(rule) {
                let shape = cell.kind.shape(&point.xi);
                let t = temperature_at(temperature, cell, &shape.n[..cell.kind.n_nodes()]);
                points.laws[p] = law.frozen(&points.accepted[p], t);
            }
            points.yields[i] = false;
        }
    }

    /// Brings the points to the displacements `u` at the owned nodes, m, from the accepted state on: all of them, or those that
    /// iterations change, with the rest as it has been condensed. Collective.
    pub fn evaluate(&mut self, group: &SimpleCommunicator, u: &[f64], extent: Extent) -> Result<()> {
        if self.points.is_none() {
            return Ok(());
        }
        let iterated = match extent {
            Extent::All => None,
            Extent::Iterated => self.iterated().map(<[bool]>::to_vec),
        };
        let all = self.with_ghosts(group, u)?;
        let found = self.evaluate_cells(&all, iterated.as_deref());
        agree(group, found)?;
        if iterated.is_some() {
            let rest = self.forces_of_rest(u);
            let internal = self.points.iter_mut().flat_map(|points| &mut points.internal);
            std::iter::zip(internal, rest).for_each(|(sum, f)| *sum += f);
        }
        Ok(())
    }

    /// Of all cells, or of chosen ones.
    fn evaluate_cells(&mut self, u: &[f64], chosen: Option<&[bool]>) -> Result<()> {
        let Some(points) = &mut self.points else { return Ok(()) };
        let (part, model) = (&self.part, &self.model);
        let dim = part.dim;
        let temperature = self.temperature.as_ref().map(|t| &t[..]);
        let (mut internal, mut held) =
            (vec![0.0; part.points.len() * dim], vec![0.0; part.points.len() * dim]);
        let (mut x, mut own) = ([[0.0; 3]; MAX_NODES], [0.0; 3 * MAX_NODES]);
        let (mut force, mut work) = ([0.0; 3 * MAX_NODES], Workspace::default());
        let (mut rounding, stiffness) =
            (vec![0.0; part.points.len()], model.laws.stiffness() * model.thickness);
        let (mut geometry, mut stresses, mut temperatures) = (Vec::new(), Vec::new(), Vec::new());
        points.settled = true;
        for (i, cell) in part.cells.iter().enumerate().filter(|(i, _)| chosen.is_none_or(|c| c[*i])) {
            let (n, law) = (cell.kind.n_nodes(), model.laws.of(cell));
            cell_points(part, cell, &mut x);
            for (a, &node) in cell.nodes().iter().enumerate() {
                own[a * dim..][..dim].copy_from_slice(&u[node as usize * dim..][..dim]);
            }
            let element = model.elements.of(cell.kind);
            element.geometry(&x[..n], &mut geometry)?;
            let rounded = rounded(&geometry, n, stiffness, &own[..n * dim]);
            cell.nodes().iter().for_each(|&node| rounding[node as usize] += rounded);
            temperatures.clear();
            temperatures.extend(geometry.iter().map(|g| temperature_at(temperature, cell, &g.n[..n])));
            let range = points.range(i);
            if points.laws[range.start].h[0][0] == 0.0 {
                // The first time: what is elastic needs no second pass then.
                for (p, t) in range.clone().zip(&temperatures) {
                    points.laws[p] = law.frozen(&points.accepted[p], *t);
                }
            }
            let (accepted, current) = (&points.accepted[range.clone()], &mut points.current[range.clone()]);
            let (strains, tangent) = (&mut points.strains[range.clone()], points.tangent);
            let mut yields = false;
            let settled = element.respond(
                &x[..n],
                &geometry,
                &own[..n * dim],
                &mut points.laws[range.clone()],
                &mut work,
                |p, strain| {
                    let answer = law.respond(strain, &accepted[p], temperatures[p], tangent);
                    yields = answer.yields || (p > 0 && yields);
                    (current[p], strains[p]) = (answer.state, answer.strain);
                    answer.law
                },
            )?;
            points.settled &= settled;
            points.yields[i] = yields;
            stresses.clear();
            stresses.extend(points.current[range.clone()].iter().map(|state| in_plane(&state.stress)));
            let mut add = |stresses: &[[f64; 3]], sum: &mut [f64], sized: bool| {
                element.internal_force(&geometry, model.thickness, stresses, &mut force[..n * dim]);
                for (a, &node) in cell.nodes().iter().enumerate() {
                    for c in 0..dim {
                        let f = force[a * dim + c];
                        sum[node as usize * dim + c] += if sized { f.abs() } else { f };
                    }
                }
            };
            add(&stresses, &mut internal, false);
            if chosen.is_some() {
                continue;
            }
            if temperature.is_some() {
                thermal_stresses(law, &temperatures, &mut stresses);
                add(&stresses, &mut held, true);
            }
            if points.current[range.clone()].iter().any(|state| state.plastic_strain != [0.0; 6]) {
                let states = std::iter::zip(&points.current[range], &temperatures);
                stresses.clear();
                stresses.extend(states.map(|(state, t)| law.held(state, *t).map(|s| HELD * s)));
                add(&stresses, &mut held, true);
            }
        }
        Hanging::of(part).distribute(&mut internal, dim);
        internal.truncate(part.n_owned * dim);
        points.internal = internal;
        if chosen.is_none() {
            held.truncate(part.n_owned * dim);
            rounding.truncate(part.n_owned);
            (points.held, points.rounding) = (held, rounding);
        }
        Ok(())
    }

    /// What is missing to equilibrium with the nodal forces `contact` at the owned nodes, N, at the displacements of the last
    /// [`Body::evaluate`]; `motion`: displacements on which it works, m. This rank's share.
    pub fn unbalanced(&self, contact: &[f64], motion: &[f64]) -> Unbalanced {
        let Some(points) = &self.points else { return Unbalanced { settled: true, ..Unbalanced::default() } };
        let external = self.loads.external_at(&self.loads.factors);
        let dim = self.part.dim;
        let is_outside =
            |is_in: &[bool]| std::iter::zip(&points.yields, is_in).any(|(yields, is_in)| *yields && !is_in);
        let settled = points.settled && !self.iterated().is_some_and(is_outside);
        let mut sums = Unbalanced { settled, ..Unbalanced::default() };
        let square = |v: &[f64]| v.iter().map(|v| v * v).sum::<f64>();
        let unseen = self.unseen();
        for i in 0..self.part.n_owned {
            let [mut residual, reaction] = self.missing(i, [&points.internal, &external, contact]);
            if unseen.contains(&i) {
                residual = [0.0; 3];
            }
            sums.squares[0] += square(&residual);
            sums.squares[1] += square(&reaction);
            let of_node = i * dim..(i + 1) * dim;
            for forces in [&points.internal[..], &points.held, &external, contact] {
                sums.squares[1] += square(&forces[of_node.clone()]);
            }
            sums.squares[2] += points.rounding[i] * points.rounding[i];
            sums.work += std::iter::zip(&residual, &motion[of_node]).map(|(r, u)| r * u).sum::<f64>();
        }
        sums
    }

    /// Takes the body for the linear one that it is close to the displacements of the last [`Body::evaluate`], or after
    /// [`Body::start_elastic`], and factorises, unless nothing yields: then the elastic factor serves. Responses must be
    /// [reloaded](Body::reload). Collective.
    pub fn linearise(&mut self, group: &SimpleCommunicator) -> Result<()> {
        let Some(points) = &self.points else { return Ok(()) };
        let yields = f64::from(u8::from(points.yields.contains(&true)));
        let elastic = parallel::max(group, &[yields])[0] == 0.0;
        if let Some(points) = &mut self.points {
            points.is_elastic = elastic;
        }
        self.zone_acts = false;
        if !elastic {
            let of_zone = self.linearise_zone(group);
            self.zone_acts = agree(group, of_zone)?;
        }
        if !self.zone_acts {
            let kept = self.points.as_ref().and_then(|points| points.elastic.clone()).filter(|_| elastic);
            match (kept, &self.points) {
                (Some(Elastic { system, prescribed }), Some(points)) => {
                    let temperature = self.temperature.as_ref().map(|t| &t[..]);
                    self.loads.thermal = self.model.forces_of_points(temperature, points, group)?;
                    (self.system, self.loads.prescribed) = (system, prescribed);
                }
                _ => self.assemble_again(group, None)?,
            }
        }
        if let (true, Some(points)) = (elastic, &mut self.points) {
            points.keep_elastic(&self.system, &self.loads.prescribed);
        }
        self.combine_loads();
        Ok(())
    }
}

/// Stresses in the plane that would hold the thermal strains back, at each point.
fn thermal_stresses(law: &Law, temperatures: &[Option<f64>], stresses: &mut Vec<[f64; 3]>) {
    stresses.clear();
    stresses.extend(temperatures.iter().map(|t| law.elastic.law(*t).stress([0.0; 3])));
}
