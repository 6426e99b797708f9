//! Newton's iteration for bodies that yield: each iteration takes them for the linear ones that they are close to its displacements,
//! and solves their contact to the end.
use super::{
    engine::{Engine, Nodal},
    state::State,
    task::{Scene, Solution, Target},
};
use crate::{
    body::{Accuracy, Body, Extent, LoadFactors, Unbalanced},
    case::PlasticityCase,
    error::{Error, Result},
    material::{PointState, Tangent},
    parallel::{self, agree},
    scene::Plan,
    vector::{larger, ratio, smaller},
};
use std::{borrow::Cow, collections::HashMap};

/// Iterations in a row whose residual grows, after which they lead nowhere.
const GROWING: usize = 3;

/// First iterations after which all points are looked at: with fewer, what yields late is found at the end, and takes as many again.
const LOOKING: usize = 3;

/// Trials of a step along the line of an iteration, and how short and how long they may be.
const TRIALS: usize = 6;
const STEPS: [f64; 2] = [0.1, 0.9];

/// A step is taken if what is missing does this share of its work at the start on the motion, or less, ...
const WORK: f64 = 0.5;

/// ... or if its residual is this share of that at the start.
const RESIDUAL: f64 = 0.5;

/// How many times the unit round-off of the displacements a solver may leave of equilibrium, and the largest share of the forces
/// that is taken for it: beyond, no digit of the stresses is left.
const ROUND_OFF: [f64; 2] = [10.0, 1e-7];

/// Forces of a body below this share of those of all bodies are none.
const NO_FORCE: f64 = 1e-10;

/// The iterations of an increment.
pub(super) struct Newton {
    tolerance: f64,
    limit: usize,
    /// Steps are shortened where they are too long: not those of the secant method, which is kept as its authors have it.
    searches: bool,
    /// This iterate: displacements and contact forces at the owned nodes of each body.
    at: Nodal,
    /// The last iterate of which all points were looked at: what is left if there is no equilibrium.
    pub whole: Nodal,
    /// Whether the supports' displacements are those of the increment: after the first iteration.
    moved: bool,
    growing: usize,
    /// Of each iteration.
    pub residuals: Vec<f64>,
}

/// How an iteration ended.
pub(super) enum Progress {
    /// In equilibrium.
    Solved,
    /// The bodies are linear at the new displacements.
    Goes,
    /// There is no use in going on.
    Failed(String),
}

/// A measure of what is missing to equilibrium.
#[derive(Clone, Copy)]
struct Missing {
    /// Largest of a body, relative to its forces.
    ratio: f64,
    /// The same without what round-off may leave.
    proven: f64,
    /// Norm over all bodies, N.
    norm: f64,
    /// Work on the motion of the iteration, J.
    work: f64,
    settled: bool,
}

impl Engine {
    /// Begins an increment: the points at the state `from`, the bodies elastic, with the factor they have. Starts that guess what will
    /// yield, where the last increment leads, took as many iterations on a plastic indentation, and a factorisation more. Collective.
    pub(super) fn begin(&mut self, scene: &Scene, from: &State) -> Result<Newton> {
        let Scene { case, plan, .. } = *scene;
        let PlasticityCase { tolerance, max_iterations: limit, tangent, .. } = case.plasticity;
        let start = self.displacements_of(plan, from)?;
        self.set_points(plan, from)?;
        self.bodies.iter_mut().for_each(|body| body.start_elastic());
        self.linearise(plan)?;
        let contact = start.iter().map(|u| vec![0.0; u.len()]).collect();
        let at = Nodal { contact, displacement: start };
        Ok(Newton {
            tolerance,
            limit,
            searches: tangent == Tangent::Consistent,
            whole: at.clone(),
            at,
            moved: false,
            growing: 0,
            residuals: Vec::new(),
        })
    }

    /// Takes `end`, what the linear bodies and their contacts came to, for the next iterate, or as much of the way to it as does
    /// good, which `end` is then. Collective.
    pub(super) fn iterate(
        &mut self,
        newton: &mut Newton,
        plan: &Plan,
        solution: &Solution,
        end: &mut Nodal,
    ) -> Result<Progress> {
        let motion: Vec<Vec<f64>> = std::iter::zip(&end.displacement, &newton.at.displacement)
            .map(|(to, from)| std::iter::zip(to, from).map(|(a, b)| a - b).collect())
            .collect();
        let before = newton.moved.then(|| self.missing(plan, &newton.at.contact, &motion));
        let extent = newton.extent();
        self.evaluate(plan, &end.displacement, extent)?;
        let mut now = self.missing(plan, &end.contact, &motion);
        let mut share = 1.0;
        if let Some(before) = before.filter(|_| newton.searches) {
            let mut best = (1.0, now);
            for _ in 0..TRIALS {
                if now.is_enough(&before) || now.is_none(newton.tolerance) {
                    break;
                }
                let secant = share * before.work / (before.work - now.work);
                let next = if secant.is_finite() && secant > 0.0 { secant } else { 0.5 * share };
                share = next.clamp(STEPS[0] * share, STEPS[1] * share);
                let (u, contact) = between(&newton.at, end, share);
                self.evaluate(plan, &u, extent)?;
                now = self.missing(plan, &contact, &motion);
                if now.norm < best.1.norm {
                    best = (share, now);
                }
            }
            if !now.is_enough(&before) && best.0 != share {
                (share, now) = best;
                let (u, _) = between(&newton.at, end, share);
                self.evaluate(plan, &u, extent)?;
            }
            if share < 1.0 {
                (end.displacement, end.contact) = between(&newton.at, end, share);
            }
        }
        let mut looked = extent == Extent::All;
        if newton.is_solved(share, &now) && !looked {
            looked = true;
            // What was not iterated is looked at as well.
            *end = self.recover(plan, solution, Accuracy::Refined)?;
            self.bring_to(plan, &end.displacement)?;
            now = self.missing(plan, &end.contact, &motion);
        }
        newton.residuals.push(now.ratio);
        newton.at = end.clone();
        if looked {
            newton.whole = end.clone();
        }
        newton.moved = true;
        if newton.is_solved(share, &now) {
            return Ok(Progress::Solved);
        }
        if let Some(why) = newton.is_lost(&now) {
            return Ok(Progress::Failed(why));
        }
        match self.linearise(plan) {
            Ok(()) => Ok(Progress::Goes),
            Err(error) if is_of_stiffness(&error) => Ok(Progress::Failed(error.to_string())),
            Err(error) => Err(error),
        }
    }

    /// Brings the points to the end `to` of an increment that begins in `from`. Collective.
    pub(super) fn return_to(&mut self, scene: &Scene, from: &State, to: &State) -> Result<()> {
        if !scene.case.has_plasticity() {
            return Ok(());
        }
        self.set_points(scene.plan, from)?;
        let displacement = self.displacements_of(scene.plan, to)?;
        self.bring_to(scene.plan, &displacement)
    }

    /// Begins at the points of a state. Collective.
    fn set_points(&mut self, plan: &Plan, from: &State) -> Result<()> {
        let of_body = |(body, &index): (&Body, &usize)| points_of(from, index, &body.part.original_cells);
        let points =
            std::iter::zip(&self.bodies, plan.groups.bodies()).map(of_body).collect::<Result<Vec<_>>>();
        for (body, points) in std::iter::zip(&mut self.bodies, agree(&plan.groups.world, points)?) {
            body.begin(points.as_deref());
        }
        Ok(())
    }

    /// Goes back to displacements of the last accepted state, under what acted there. Collective.
    pub(crate) fn revisit(
        &mut self,
        scene: &Scene,
        factors: &LoadFactors,
        displacement: &[Vec<f64>],
    ) -> Result<()> {
        self.load(scene.plan, Target { factors, ..Target::FULL })?;
        self.bring_to(scene.plan, displacement)
    }

    /// Brings all points of all bodies to displacements at their owned nodes. Collective.
    pub(super) fn bring_to(&mut self, plan: &Plan, displacement: &[Vec<f64>]) -> Result<()> {
        self.evaluate(plan, displacement, Extent::All)
    }

    /// The same, or of the points that iterations change. Collective.
    fn evaluate(&mut self, plan: &Plan, displacement: &[Vec<f64>], extent: Extent) -> Result<()> {
        let group = &plan.groups.group;
        let done = std::iter::zip(&mut self.bodies, displacement)
            .try_for_each(|(body, u)| body.evaluate(group, u, extent));
        agree(&plan.groups.world, done)
    }

    /// Makes the bodies that yield linear where their points are, and their responses. Collective.
    fn linearise(&mut self, plan: &Plan) -> Result<()> {
        let start = std::time::Instant::now();
        let group = &plan.groups.group;
        let done = std::iter::zip(&mut self.bodies, &mut self.responses).try_for_each(|(body, response)| {
            if body.yields() {
                body.linearise(group)?;
                body.reload(group, response)?;
            }
            Ok(())
        });
        agree(&plan.groups.world, done)?;
        self.clock.factorise += start.elapsed().as_secs_f64();
        self.number_modes(plan);
        Ok(())
    }

    /// Collective.
    fn missing(&self, plan: &Plan, contact: &[Vec<f64>], motion: &[Vec<f64>]) -> Missing {
        let groups = &plan.groups;
        let mut own = [0.0; 4];
        let mut of_bodies = Vec::new();
        for (body, (contact, motion)) in std::iter::zip(&self.bodies, std::iter::zip(contact, motion)) {
            let Unbalanced { squares, work, settled } = body.unbalanced(contact, motion);
            of_bodies.extend(squares);
            own[0] += squares[0];
            own[1] += squares[1];
            own[2] += work;
            own[3] += f64::from(u8::from(!settled));
        }
        let sums = parallel::sum(&groups.world, &own);
        let all = sums[1].sqrt();
        let of_bodies = parallel::sum(&groups.group, &of_bodies);
        let ratios = of_bodies.as_chunks::<3>().0.iter().map(|squares| {
            let [missing, forces, round_off] = squares.map(f64::sqrt);
            let forces = larger(forces, NO_FORCE * all);
            let left = smaller(ROUND_OFF[0] * round_off, ROUND_OFF[1] * forces);
            [missing, larger(missing - left, 0.0)].map(|missing| ratio(missing, forces))
        });
        let worst = ratios.fold([0.0; 2], |[a, b], [c, d]| [larger(a, c), larger(b, d)]);
        let worst = parallel::max(&groups.world, &worst);
        Missing {
            ratio: worst[0],
            proven: worst[1],
            norm: sums[0].sqrt(),
            work: sums[2],
            settled: sums[3] == 0.0,
        }
    }
}

impl Missing {
    /// True in equilibrium.
    fn is_none(&self, tolerance: f64) -> bool {
        self.settled && self.proven <= tolerance
    }

    /// True if a step is long enough, and not too long.
    fn is_enough(&self, before: &Missing) -> bool {
        self.norm <= RESIDUAL * before.norm || self.work.abs() <= WORK * before.work.abs()
    }
}

impl Newton {
    /// The points that this iteration brings to its displacements.
    fn extent(&self) -> Extent {
        if self.residuals.len() < LOOKING { Extent::All } else { Extent::Iterated }
    }

    /// How the displacements of this iteration are recovered.
    pub fn accuracy(&self) -> Accuracy {
        match self.extent() {
            Extent::All => Accuracy::Refined,
            Extent::Iterated => Accuracy::Iterated,
        }
    }

    fn is_solved(&self, share: f64, now: &Missing) -> bool {
        share == 1.0 && now.is_none(self.tolerance)
    }

    /// An accurate contact asks for equilibrium as accurate.
    pub fn as_accurate_as(&mut self, tolerance: f64) {
        self.tolerance = self.tolerance.min(tolerance);
    }

    /// Why the iterations lead nowhere, if they do.
    fn is_lost(&mut self, now: &Missing) -> Option<String> {
        let [.., last, ratio] = self.residuals[..] else { return self.is_out_of_numbers(now) };
        self.growing = if ratio > last { self.growing + 1 } else { 0 };
        if self.growing >= GROWING && self.searches {
            return Some(format!(
                "the residual of equilibrium grows from iteration to iteration, at last {ratio:.1e}"
            ));
        }
        if self.residuals.len() >= self.limit {
            return Some(format!(
                "the residual of equilibrium is {ratio:.1e} after {} iterations, above the tolerance of {:.1e}",
                self.limit, self.tolerance
            ));
        }
        self.is_out_of_numbers(now)
    }

    fn is_out_of_numbers(&self, now: &Missing) -> Option<String> {
        (!now.ratio.is_finite() || !now.work.is_finite())
            .then(|| "the stresses are not finite numbers".to_string())
    }
}

/// Displacements and contact forces a share of the way from one to the other.
fn between(from: &Nodal, to: &Nodal, share: f64) -> (Vec<Vec<f64>>, Vec<Vec<f64>>) {
    let blend = |a: &[Vec<f64>], b: &[Vec<f64>]| {
        let of_body =
            |(a, b): (&Vec<f64>, &Vec<f64>)| std::iter::zip(a, b).map(|(a, b)| a + share * (b - a)).collect();
        std::iter::zip(a, b).map(of_body).collect()
    };
    (blend(&from.displacement, &to.displacement), blend(&from.contact, &to.contact))
}

/// True if a stiffness cannot be factorised: with the moduli of an iteration there is no equilibrium.
fn is_of_stiffness(error: &Error) -> bool {
    matches!(error, Error::Indefinite(_) | Error::NotConverged(_) | Error::NotFinite(_))
}

/// The points of the `cells` of a body; `None` if nothing is known of them: they have not yielded.
fn points_of<'s>(state: &'s State, body: usize, cells: &[u32]) -> Result<Option<Cow<'s, [PointState]>>> {
    let Some(known) = state.bodies.iter().find(|b| b.body == body).filter(|b| !b.cells.is_empty()) else {
        return Ok(None);
    };
    if known.cells == cells {
        return Ok(Some(Cow::Borrowed(&known.points)));
    }
    // A state of other ranks: by its cells.
    let first = std::iter::once(0).chain(known.ends.iter().copied());
    let ranges = std::iter::zip(first, &known.ends).map(|(first, end)| first as usize..*end as usize);
    let of_cell: HashMap<u32, &[PointState]> =
        std::iter::zip(known.cells.iter().copied(), ranges.map(|range| &known.points[range])).collect();
    let found: Option<Vec<&[PointState]>> = cells.iter().map(|cell| of_cell.get(cell).copied()).collect();
    let found = found.map(|points| Some(Cow::Owned(points.concat())));
    found.ok_or_else(|| Error::internal("the state lacks cells of the mesh"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::step::BodyState;

    /// Points of mixed cells, in the order of this rank, of a state in the order of others, some cells twice.
    #[test]
    fn points_are_found_by_their_cells() {
        let point = |equivalent: f64| PointState { equivalent, ..PointState::default() };
        let (quad, triangle) = ([1.0, 2.0, 3.0, 4.0].map(point), [5.0].map(point));
        let mut state = State::start();
        assert_eq!(points_of(&state, 3, &[7, 9]).unwrap(), None);
        state.bodies.push(BodyState {
            body: 3,
            cells: vec![9, 7, 9],
            ends: vec![1, 5, 6],
            points: [&triangle[..], &quad, &triangle].concat(),
            ..BodyState::default()
        });
        assert_eq!(points_of(&state, 3, &[7, 9]).unwrap().unwrap(), [&quad[..], &triangle].concat());
        assert_eq!(points_of(&state, 3, &[9]).unwrap().unwrap(), &triangle[..]);
        assert!(points_of(&state, 3, &[8]).is_err());
    }
}
