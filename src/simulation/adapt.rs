//! Adaptive refinement: solve, estimate, cut the cells that matter, and again, until the estimate is small enough.
//!
//! Energy: the fewest cells that hold a share of the squared error are cut (bulk criterion, Dorfler, SIAM J. Numer.
//! Anal. 33 (1996) 1106). Contact pressure: the cells under the nodes whose pressure is off by more than the target, on
//! both surfaces, and the cells whose errors change the peak most, wherever they are (dual-weighted). All ranks
//! find the same cells; ties go together, so that what is symmetric stays so.
use super::{
    adapted::{Adapted, Verdict},
    report::Start,
    solved::Solved,
};
use crate::{
    case::{Case, Driver, Temperature, Transfer},
    contact::{
        Surface,
        vector::{combine, dot, norm, sub},
    },
    element::ElementKind,
    error::{Error, Result},
    estimate::Estimate,
    mesh::Mesh,
    parallel,
    petsc::Stage,
    record::{AdaptRound, HistoryRow, Summary},
    scene::{self, ContactSide},
    vector,
};
use mpi::{topology::SimpleCommunicator, traits::*};
use std::{collections::HashMap, path::Path, str::FromStr, time::Instant};

/// What is to be accurate, and how accurate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Goal {
    /// The quantity.
    pub quantity: Quantity,
    /// Largest estimated relative error.
    pub target: f64,
}

/// A quantity whose error is estimated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Quantity {
    /// The energy norm of the displacements.
    Energy,
    /// The peak contact pressure.
    Pressure,
}

/// When to give up.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Limits {
    /// Most solves.
    pub rounds: usize,
    /// No mesh is made that has more unknowns than this, but for the first.
    pub dofs: usize,
}

impl Default for Limits {
    fn default() -> Self {
        Limits { rounds: 20, dofs: 2_000_000 }
    }
}

/// Meshes without progress after which there is none to be hoped for: the pressure's estimate may rise for one or two where the edge
/// of the contact comes to lie in another element.
const PATIENCE: usize = 5;

/// Meshes with which the peak has to grow to have no limit, and by how much with each: at a right-angled rigid corner it is 41 % where a
/// cell is cut into four, at blunt ones 5 %; near a limit the steps become smaller.
const GROWING: usize = 3;
const GROWTH: f64 = 0.03;

/// Times the unknowns from which a user is told what elements of second order would take.
const DEAR: f64 = 10.0;

/// Share of the squared error in energy that the cut cells hold.
const BULK: f64 = 0.6;

/// The same where the pressure is the goal.
const BULK_BESIDE_PRESSURE: f64 = 0.3;

/// Indicators that differ by less than this are the same but for round-off.
const TIE: f64 = 1e-6;

/// A surface node is refined if its error is more than this share of the target.
const SHARE: f64 = 0.5;

/// A facet is under a node that is nearer than this share of its length.
const NEAR: f64 = 0.51;

/// Neighbours on the surface up to so many lengths of a facet away are cut with it.
const PAD: f64 = 3.1;

/// A facet is as long as another from this share of its length on: a quarter less by grading, not half by a cut.
const AS_LONG: f64 = 0.75;

impl Quantity {
    /// Name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Quantity::Energy => "energy",
            Quantity::Pressure => "pressure",
        }
    }
}

impl FromStr for Goal {
    type Err = String;

    /// `pressure=1%` or `energy=0.01`.
    fn from_str(text: &str) -> std::result::Result<Goal, String> {
        const ALL: [Quantity; 2] = [Quantity::Energy, Quantity::Pressure];
        let (name, value) =
            text.split_once('=').ok_or("give a quantity and its error: pressure=1% or energy=1%")?;
        let name = name.trim();
        let quantity = ALL.into_iter().find(|q| q.name() == name).ok_or_else(|| {
            let nearest = ALL.into_iter().min_by_key(|q| strsim::damerau_levenshtein(q.name(), name));
            let nearest = nearest.map_or("", Quantity::name);
            format!("the error of '{name}' is not estimated; nearest: {nearest} (there is: energy, pressure)")
        })?;
        let (number, unit) = match value.trim().strip_suffix('%') {
            Some(number) => (number.trim(), 0.01),
            None => (value.trim(), 1.0),
        };
        let number: f64 =
            number.parse().map_err(|_| format!("'{value}' is no relative error; write 1% or 0.01"))?;
        let target = number * unit;
        if target > 0.0 && target < 1.0 {
            return Ok(Goal { quantity, target });
        }
        Err(format!("{value}: the relative error must be more than 0 and less than 100%"))
    }
}

impl Goal {
    /// The estimate of its quantity; `None` if there is no pressure.
    fn value(&self, estimate: &Estimate) -> Option<f64> {
        match self.quantity {
            Quantity::Energy => Some(estimate.energy),
            Quantity::Pressure => estimate.contact_pressure,
        }
    }
}

/// Runs a case on finer and finer meshes until the error estimate of the last load step is below the target, and writes
/// the results of the last mesh. `round` is called after each solve on rank 0. If the target is not reached, the
/// summary's `adapt_reached` is false and its diagnosis says why. Collective.
pub fn run_adaptive(
    case: &Case,
    goal: Goal,
    limits: Limits,
    world: &SimpleCommunicator,
    directory: &Path,
    mut progress: impl FnMut(&HistoryRow),
    mut round: impl FnMut(&AdaptRound),
) -> Result<Summary> {
    let start = Start::now();
    refuse(case, goal)?;
    crate::output::prepare(world, directory)?;
    let mut case = case.clone();
    let mut rounds = Rounds::default();
    loop {
        let begun = Instant::now();
        let solved = Solved::new(&case, world, directory, false, &mut progress);
        let failure = match &solved {
            Ok(solved) if solved.converged() => None,
            Ok(_) => Some("did not converge".to_owned()),
            Err(error) => Some(format!("failed: {error}")),
        };
        let number = rounds.done.len() + 1;
        if let (Some(why), 2..) = (failure, number) {
            drop(solved);
            // Solved once more: to keep every round's factorisations would double the memory.
            case.bodies.iter_mut().for_each(|body| drop(body.cuts.pop()));
            let last = Solved::new(&case, world, directory, false, &mut progress)?;
            let verdict = Err(format!(
                "round {number} {why}; these are the mesh and the results of round {}",
                number - 1
            ));
            let adapted = Adapted { rounds: rounds.done, verdict, warning: None };
            return Ok(last.finish(&case, world, directory, &start, Some(adapted))?.0);
        }
        let solved = solved?;
        let estimate = solved.estimate();
        let done = AdaptRound {
            dofs: solved.plan.dofs.iter().sum::<usize>() as u64,
            energy: estimate.energy,
            contact_pressure: estimate.contact_pressure,
            alternations: solved.alternations(),
            seconds: parallel::max(world, &[begun.elapsed().as_secs_f64()])[0],
        };
        if world.rank() == 0 {
            round(&done);
        }
        rounds.add(case.contacts.len(), goal, &solved, done);
        let mut verdict = rounds.verdict(goal, limits, &solved);
        let mut next = case.clone();
        if verdict.is_none() {
            let stage = Stage::Estimate.enter();
            let cuts = mark(&case, goal, &solved, world);
            drop(stage);
            let stuck = cuts.iter().all(Vec::is_empty);
            std::iter::zip(&mut next.bodies, cuts).for_each(|(body, cells)| body.cuts.push(cells));
            verdict = match stuck {
                true => Some(Err("no cell has an error to refine for".to_owned())),
                false => rounds.too_large(goal, limits, &next, world),
            };
        }
        if let Some(verdict) = verdict {
            let warning = rounds.dear_elements(goal, &solved, world);
            let adapted = Adapted { rounds: rounds.done, verdict, warning };
            return Ok(solved.finish(&case, world, directory, &start, Some(adapted))?.0);
        }
        case = next;
    }
}

/// What cannot be refined.
fn refuse(case: &Case, goal: Goal) -> Result<()> {
    if case.alternation.driver != Driver::ActiveSet || case.alternation.transfer != Transfer::Mortar {
        return Err(Error::input(
            "--adapt needs driver = \"active set\" and transfer = \"mortar\": refined surfaces do not match",
        ));
    }
    if goal.quantity == Quantity::Pressure && case.contacts.is_empty() {
        return Err(Error::input("--adapt pressure: the case has no contact; nearest: --adapt energy"));
    }
    for body in &case.bodies {
        if let Some(Temperature::Nodal { origin, .. }) = &body.temperature {
            return Err(origin.error(
                "--adapt makes nodes for which the file has no temperature; give the temperature as an expression",
            ));
        }
    }
    Ok(())
}

/// What the rounds so far have given.
#[derive(Default)]
struct Rounds {
    done: Vec<AdaptRound>,
    /// The estimates of the goal; infinite where nothing touches.
    values: Vec<f64>,
    /// The largest pressures, Pa.
    peaks: Vec<f64>,
}

impl Rounds {
    fn add(&mut self, n_pairs: usize, goal: Goal, solved: &Solved, done: AdaptRound) {
        self.values.push(goal.value(solved.estimate()).unwrap_or(f64::INFINITY));
        self.peaks.push(vector::worst((0..n_pairs).map(|p| solved.max_pressure(p))));
        self.done.push(done);
    }

    /// `None`: go on. Otherwise done, or why the target is not reached.
    fn verdict(&self, goal: Goal, limits: Limits, solved: &Solved) -> Option<Verdict> {
        let round = self.done.len();
        if !solved.converged() {
            return Some(Err(format!("round {round} did not converge")));
        }
        let Some(value) = goal.value(solved.estimate()) else {
            return Some(Err("nothing touches: there is no contact pressure".to_owned()));
        };
        if value <= goal.target {
            return Some(Ok(()));
        }
        if makes_no_progress(&self.values) {
            let why = format!("{PATIENCE} more meshes have not lowered it by a tenth");
            return Some(Err(self.left(goal, &why)));
        }
        let why = format!("{round} rounds were made, no more are allowed (--adapt-rounds)");
        (round >= limits.rounds).then(|| Err(self.left(goal, &why)))
    }

    /// Why the next case may not be solved. Collective.
    fn too_large(
        &self,
        goal: Goal,
        limits: Limits,
        next: &Case,
        world: &SimpleCommunicator,
    ) -> Option<Verdict> {
        let _stage = Stage::SetUp.enter();
        match scene::count_dofs(next, world) {
            Ok(dofs) if dofs <= limits.dofs => None,
            Ok(dofs) => Some(Err(self.left(
                goal,
                &format!(
                    "the next mesh would have {dofs} unknowns, no more than {} are allowed (--adapt-dofs)",
                    limits.dofs
                ),
            ))),
            Err(error) => Some(Err(self.left(goal, &format!("the next mesh cannot be made: {error}")))),
        }
    }

    /// Where the rounds have ended, and why.
    fn left(&self, goal: Goal, why: &str) -> String {
        let percent = |v: f64| format!("{:.3} %", 100.0 * v);
        let value = self.values.last().copied().unwrap_or(f64::INFINITY);
        let mut left =
            format!("the estimated error is {}, the target {}: {why}", percent(value), percent(goal.target));
        if let (Quantity::Pressure, Some(from)) = (goal.quantity, grows(&self.peaks)) {
            let to = self.peaks.last().copied().unwrap_or_default();
            left += &format!(
                "; the peak pressure grows with every mesh, from {from:.4e} to {to:.4e} in the last {GROWING}: it may have no \
                 limit, as at a sharp corner, and no mesh gives it; round the corner, or ask for the energy"
            );
        }
        left
    }

    /// What elements of first order cost where the energy is the goal: their error goes with the root of the number of unknowns, that of
    /// elements of second order with the number. Collective.
    fn dear_elements(&self, goal: Goal, solved: &Solved, world: &SimpleCommunicator) -> Option<String> {
        let mut kinds = solved.plan.meshes.iter().flat_map(|mesh| &mesh.cells).map(|cell| cell.kind);
        let quadratic = kinds.any(|kind| matches!(kind, ElementKind::Tri6 | ElementKind::Quad8));
        let quadratic = parallel::max(world, &[f64::from(u8::from(quadratic))])[0] > 0.0;
        let [first, target] = [self.values.first().copied().unwrap_or(0.0), goal.target];
        let times = (first / target).powi(2);
        (goal.quantity == Quantity::Energy && !quadratic && times > DEAR).then(|| {
            format!(
                "energy to {} % from {:.3} % takes about {times:.0} times the unknowns with elements of first order, about {:.0} times \
                 with those of second order (element = \"quad8\" or \"tri6\")",
                100.0 * target,
                100.0 * first,
                first / target
            )
        })
    }
}

/// True if the last [`PATIENCE`] meshes have not brought the estimate a tenth below what it was. As long as it says that
/// nothing is known, there is nothing to be lowered.
fn makes_no_progress(values: &[f64]) -> bool {
    let Some(before) = values.len().checked_sub(PATIENCE) else { return false };
    let [before, since] = [&values[..before], &values[before..]].map(|v| vector::least(v.iter().copied()));
    before < 1.0 && since > 0.9 * before
}

/// The peak [`GROWING`] meshes ago if each mesh since has raised it by more than [`GROWTH`].
fn grows(peaks: &[f64]) -> Option<f64> {
    let last = &peaks[peaks.len().checked_sub(GROWING + 1)?..];
    last.windows(2).all(|pair| pair[1] > (1.0 + GROWTH) * pair[0]).then_some(last[0])
}

/// Cells of each body to cut, the same on all ranks. Collective.
fn mark(case: &Case, goal: Goal, solved: &Solved, world: &SimpleCommunicator) -> Vec<Vec<u32>> {
    let plan = &solved.plan;
    let mut counts = vec![0.0; case.bodies.len()];
    for (&b, mesh) in std::iter::zip(plan.groups.bodies(), &plan.meshes) {
        counts[b] = mesh.cells.len() as f64;
    }
    let counts = parallel::max(world, &counts);
    let first: Vec<usize> = std::iter::once(0)
        .chain(counts.iter().scan(0, |sum, n| {
            *sum += *n as usize;
            Some(*sum)
        }))
        .collect();
    let total = first[case.bodies.len()];
    let mut errors = vec![0.0; total];
    for body in &solved.estimate().bodies {
        for cell in &body.cells {
            errors[first[body.body] + cell.cell as usize] = match goal.quantity {
                Quantity::Energy => cell.energy2,
                Quantity::Pressure => cell.peaks,
            };
        }
    }
    let errors = parallel::sum(world, &errors);
    let mut marked = match goal.quantity {
        Quantity::Energy => bulk(&errors, BULK),
        Quantity::Pressure => bulk(&errors, BULK_BESIDE_PRESSURE),
    };
    if goal.quantity == Quantity::Pressure {
        let under = under_pressure(goal, solved, world, &first, &marked);
        std::iter::zip(&mut marked, under).for_each(|(marked, under)| *marked |= under);
    }
    first
        .windows(2)
        .map(|range| (range[0]..range[1]).filter(|&i| marked[i]).map(|i| (i - range[0]) as u32).collect())
        .collect()
}

/// The fewest indicators that hold a share of their sum, and those as large as the least of them.
fn bulk(values: &[f64], share: f64) -> Vec<bool> {
    let mut sorted: Vec<f64> = values.iter().copied().filter(|v| *v > 0.0).collect();
    sorted.sort_by(|a, b| b.total_cmp(a));
    let (total, mut sum) = (sorted.iter().sum::<f64>(), 0.0);
    let least = sorted.iter().find(|v| {
        sum += **v;
        sum >= share * total
    });
    let least = least.map_or(f64::INFINITY, |v| v * (1.0 - TIE));
    values.iter().map(|v| *v >= least).collect()
}

/// The cells of both surfaces of each pair under the nodes whose pressure is wrong. Collective.
///
/// A contact pressure has a kink where the size of the facets changes: what is cut there takes its neighbours along.
fn under_pressure(
    goal: Goal,
    solved: &Solved,
    world: &SimpleCommunicator,
    first: &[usize],
    marked: &[bool],
) -> Vec<bool> {
    let plan = &solved.plan;
    let mut under = vec![0.0; first[first.len() - 1]];
    for (p, pair) in solved.estimate().pairs.iter().enumerate() {
        // One rank knows the nodes.
        let least = SHARE * goal.target * solved.max_pressure(p) * (1.0 - TIE);
        let wrong = pair.nodes.iter().filter(|node| node.error >= least);
        let own = plan.groups.bodies().iter().position(|&b| b == pair.body);
        let points = own.map_or_else(Vec::new, |i| {
            wrong.flat_map(|node| plan.meshes[i].points[node.node as usize]).collect::<Vec<f64>>()
        });
        let points = spread(world, &points);
        let ends = std::iter::zip(&plan.surfaces, &plan.ends);
        for (surface, &ContactSide { body: b, .. }) in ends.filter(|(_, end)| end.pair == p) {
            let cells = cells_of(surface, &plan.meshes[plan.place(b)]);
            let mut facets = facets_under(surface, points.as_chunks().0);
            for (facet, cell) in std::iter::zip(&mut facets, &cells) {
                *facet |= marked[first[b] + cell];
            }
            // A surface may be in several pairs.
            for (cell, _) in std::iter::zip(cells, pad(surface, &facets)).filter(|(_, padded)| *padded) {
                under[first[b] + cell] = 1.0;
            }
        }
    }
    parallel::max(world, &under).into_iter().map(|v| v > 0.0).collect()
}

/// Values that one rank has, on all. Collective.
fn spread(world: &SimpleCommunicator, values: &[f64]) -> Vec<f64> {
    let n = parallel::max(world, &[values.len() as f64])[0] as usize;
    let mut all = values.to_vec();
    all.resize(n, 0.0);
    parallel::sum(world, &all)
}

/// The cell of each facet of a surface.
fn cells_of(surface: &Surface, mesh: &Mesh) -> Vec<usize> {
    let ends = |facet: &Vec<u32>| [facet[0], facet[1]].map(|n| surface.nodes[n as usize]);
    let place: HashMap<[u32; 2], usize> =
        surface.facets.iter().enumerate().map(|(f, facet)| (ends(facet), f)).collect();
    let mut cells = vec![0; surface.facets.len()];
    for (c, cell) in mesh.cells.iter().enumerate() {
        for side in 0..cell.kind.facets().len() as u8 {
            let nodes: Vec<u32> = cell.facet_nodes(side).take(2).collect();
            if let Some(&f) = place.get(&[nodes[0], nodes[1]]) {
                cells[f] = c;
            }
        }
    }
    cells
}

/// Ends of a facet.
fn ends(surface: &Surface, facet: usize) -> [[f64; 3]; 2] {
    [0, 1].map(|k| surface.points[surface.facets[facet][k] as usize])
}

/// Facets of a surface that end in one of the points or pass as near it as any, but for half their length.
fn facets_under(surface: &Surface, points: &[[f64; 3]]) -> Vec<bool> {
    // Distance and length.
    let to = |f: usize, x: &[f64; 3]| {
        let [a, b] = ends(surface, f);
        let (along, to) = (sub(&b, &a), sub(x, &a));
        let length = norm(&along);
        let t = (dot(&along, &to) / (length * length)).clamp(0.0, 1.0);
        let foot: [f64; 3] = std::array::from_fn(|c| a[c] + t * along[c]);
        (norm(&sub(x, &foot)), length)
    };
    let mut under = vec![false; surface.facets.len()];
    for x in points {
        let all: Vec<(f64, f64)> = (0..under.len()).map(|f| to(f, x)).collect();
        let least = all.iter().fold(f64::INFINITY, |least, (distance, _)| least.min(*distance));
        for (under, (distance, length)) in std::iter::zip(&mut under, all) {
            *under |= distance <= least + NEAR * length;
        }
    }
    under
}

/// The facets with their neighbours that are as long, up to [`PAD`] lengths away.
fn pad(surface: &Surface, facets: &[bool]) -> Vec<bool> {
    let shape = |f: usize| {
        let [a, b] = ends(surface, f);
        (combine([(0.5, &a), (0.5, &b)]), norm(&sub(&b, &a)))
    };
    let shapes: Vec<([f64; 3], f64)> = (0..facets.len()).map(shape).collect();
    let seeds: Vec<usize> = (0..facets.len()).filter(|&f| facets[f]).collect();
    let near = |(center, length): &([f64; 3], f64)| {
        seeds.iter().any(|&seed| {
            let (at, size) = &shapes[seed];
            *length > AS_LONG * size && norm(&sub(center, at)) <= PAD * size
        })
    };
    std::iter::zip(facets, &shapes).map(|(seed, shape)| *seed || near(shape)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn goals_are_read_and_wrong_ones_say_what_is_right() {
        let read = |text: &str| text.parse::<Goal>();
        let pressure = Goal { quantity: Quantity::Pressure, target: 0.01 };
        for text in ["pressure=1%", "pressure=0.01", "pressure = 1 %"] {
            assert_eq!(read(text), Ok(pressure), "{text}");
        }
        assert_eq!(read("energy=2%"), Ok(Goal { quantity: Quantity::Energy, target: 0.02 }));
        for (text, part) in [
            ("pressure", "pressure=1%"),
            ("presure=1%", "nearest: pressure"),
            ("enrgy=1%", "nearest: energy"),
            ("pressure=1 percent", "'1 percent' is no relative error; write 1% or 0.01"),
            ("pressure=", "is no relative error"),
            ("pressure=0", "more than 0"),
            ("pressure=-1%", "more than 0"),
            ("energy=100%", "less than 100%"),
            ("energy=nan", "more than 0"),
        ] {
            let error = read(text).unwrap_err();
            assert!(error.contains(part), "{text}: {error}");
        }
    }

    #[test]
    fn rounds_without_progress_and_peaks_without_limit_are_seen() {
        let rings = [0.117, 0.25, 0.029, 0.107, 0.78, 0.30, 0.46, 0.54, 0.20];
        assert!((1..8).all(|n| !makes_no_progress(&rings[..n])) && makes_no_progress(&rings[..8]));
        let falls: Vec<f64> = (0..20).map(|i| 0.3 * 0.95_f64.powi(i)).collect();
        assert!((1..=20).all(|n| !makes_no_progress(&falls[..n])));
        // Too few nodes touch to say anything.
        assert!(!makes_no_progress(&[1.0; 9]) && !makes_no_progress(&[1.0, 1.0, 1.0, 1.0, 0.5, 0.3]));
        assert_eq!(grows(&[5.0, 1.0, 1.4, 2.0, 2.8]), Some(1.0));
        assert_eq!(grows(&[1.0, 1.4, 2.0]), None);
        assert_eq!(grows(&[1.0, 1.4, 1.41, 1.5]), None);
    }

    #[test]
    fn the_largest_are_taken_until_they_hold_their_share_and_ties_go_together() {
        assert_eq!(bulk(&[1.0, 4.0, 0.0, 3.0, 2.0], 0.6), [false, true, false, true, false]);
        assert_eq!(bulk(&[1.0, 2.0, 2.0 * (1.0 - 1e-9), 1.0], 0.3), [false, true, true, false]);
        assert_eq!(bulk(&[0.0, 0.0], 0.5), [false, false]);
        assert_eq!(bulk(&[1.0, 1.0], 1.0), [true, true]);
    }
}
