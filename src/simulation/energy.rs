//! Where the work of loads and supports goes on a path on which surfaces rub or bodies yield: what is stored, and what
//! friction and plastic strains take.
//!
//! The work of forces f on displacements u in an increment is (f0 + f1)'(u1 - u0) / 2, as if both grew together, less what
//! [`EndFound::beside`](crate::step::EndFound) says of nodes that close or begin to slip. Heat adds what the elastic energy changes
//! beyond the work of the stresses on the strains.
use super::checks::SCENE;
use crate::{
    body::{Balance, LoadFactors},
    case::{BodyRef, Case, ContactGeometry, Driver, Transfer},
    parallel,
    record::{EnergySummary, PairSummary},
    step::{Energy, Found},
    vector::{larger, ratio},
};
use mpi::topology::SimpleCommunicator;

/// What acts on a body of this rank, at its owned nodes.
pub(super) struct Acting {
    /// m.
    pub displacement: Vec<f64>,
    /// Of the stresses, of loads and supports, and of the contacts, N.
    pub forces: [Vec<f64>; 3],
}

/// An accepted point of the path.
pub(super) struct Point {
    pub bodies: Vec<Acting>,
    /// Of each pair with a rigid side, on this rank: what holds the rigid body, N, and where it is, m.
    rigid: Vec<[[f64; 3]; 2]>,
}

impl Point {
    pub fn new(case: &Case, bodies: Vec<Acting>, found: &Found, factors: &LoadFactors) -> Point {
        let mut rigid = vec![[[0.0; 3]; 2]; case.contacts.len()];
        for (contact, [_, place]) in std::iter::zip(&case.contacts, &mut rigid) {
            for surface in &contact.surfaces {
                if let BodyRef::Rigid(i) = surface.body {
                    let factor = factors.on_supports(case.rigid[i].path);
                    *place = case.rigid[i].motion.map(|u| factor * u);
                }
            }
        }
        for end in &found.ends {
            for force in &end.table.force {
                (0..3).for_each(|c| rigid[end.pair][0][c] += force[c]);
            }
        }
        Point { bodies, rigid }
    }

    /// Work of the stresses, of loads and supports, and of the contacts from `before` to here, on this rank, J.
    fn works(&self, before: Option<&Point>) -> [f64; 3] {
        let mut works = [0.0; 3];
        for (i, now) in self.bodies.iter().enumerate() {
            let before = before.map(|point| &point.bodies[i]);
            for (k, work) in works.iter_mut().enumerate() {
                for (j, u) in now.displacement.iter().enumerate() {
                    let [u0, f0] = before.map_or([0.0; 2], |b| [b.displacement[j], b.forces[k][j]]);
                    *work += 0.5 * (f0 + now.forces[k][j]) * (u - u0);
                }
            }
        }
        for (i, [force, place]) in self.rigid.iter().enumerate() {
            let [force0, place0] = before.map_or_else(Default::default, |point| point.rigid[i]);
            for c in 0..3 {
                let work = 0.5 * (force0[c] + force[c]) * (place[c] - place0[c]);
                works[1] += work;
                works[2] -= work;
            }
        }
        works
    }
}

/// The energies at the point `now` after those at the point `before`, and by how much they do not balance, relative to the largest so
/// far. `balances`: of this rank's bodies, if it is the first of its group. Collective.
pub(super) fn balance(
    case: &Case,
    (before, so_far): (Option<&Point>, Energy),
    now: &Point,
    balances: &[Balance],
    (found, pairs): (&Found, &[PairSummary]),
    world: &SimpleCommunicator,
) -> (Energy, EnergySummary) {
    let beside = found.ends.iter().map(|end| end.beside).sum::<f64>();
    let [stresses, held, contact] = now.works(before);
    let [stored, plastic, all] = balances.iter().fold([0.0; 3], |[stored, plastic, all], b| {
        [stored + b.stored, plastic + b.plastic, all + b.work[2]]
    });
    let relieved = f64::from(u8::from(found.relieved));
    let sums = parallel::sum(world, &[stresses, held, contact, beside, stored, plastic, all, relieved]);
    let [stresses, held, contact, beside, stored, plastic, all, relieved] = sums[..] else {
        unreachable!("eight sums")
    };
    let dissipated = pairs.iter().filter_map(|pair| Some(pair.friction.as_ref()?.dissipated)).sum::<f64>();
    // Where rows are found again in each state, take forces by interpolation or are relieved of what facets make of them, what they
    // do is what the forces at the nodes do.
    let is_followed = case.contacts.iter().any(|c| c.geometry == ContactGeometry::Updated);
    let is_interpolated = matches!(case.alternation.driver, Driver::Relaxed(_))
        && case.alternation.transfer == Transfer::Pointwise;
    let external = match is_followed || is_interpolated || relieved > 0.0 {
        true => held + contact + dissipated - so_far.dissipated,
        false => held - beside,
    };
    let heated = case.bodies.iter().any(|body| body.temperature.is_some());
    let kept = stored - so_far.stored + plastic - so_far.plastic;
    let heat = if heated { kept - stresses } else { 0.0 };
    let mut energy = Energy {
        external: so_far.external + external,
        heat: so_far.heat + heat,
        stored,
        dissipated,
        plastic,
        largest: so_far.largest,
    };
    let Energy { external, heat, .. } = energy;
    energy.largest =
        [external, heat, stored, dissipated, plastic].iter().fold(energy.largest, |m, e| larger(m, e.abs()));
    let missing = (external + heat - stored - dissipated - plastic).abs();
    // Where all works cancel their round-off has no balance.
    let imbalance = if energy.largest <= SCENE * all { 0.0 } else { ratio(missing, energy.largest) };
    let summary = EnergySummary {
        external,
        heat: heated.then_some(heat),
        stored,
        dissipated: case.has_friction().then_some(dissipated),
        plastic: case.has_plasticity().then_some(plastic),
        imbalance,
    };
    (energy, summary)
}
