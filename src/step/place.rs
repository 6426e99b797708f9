//! Where the surfaces are, and the damped way from one geometry to the next.
use crate::vector::larger;
use crate::{
    body::LoadFactors,
    case::{BodyRef, Case},
    contact::vector::{combine, dot, sub},
    parallel,
    scene::Plan,
};

/// Where the surfaces are: displacements of the interface nodes by body, on the first ranks, and the factors on the motions
/// of the rigid bodies.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Place {
    pub displacement: Vec<Vec<[f64; 3]>>,
    pub rigid: Vec<f64>,
}

/// Damping of the geometry's updates: none as long as each update moves the surfaces by less than half of the one before;
/// else Aitken's factor (Irons and Tuck, Int. J. Numer. Meth. Eng. 1 (1969) 275), w' = -w r.(r' - r) / |r' - r|^2 of two
/// motions r, r' to come.
pub(super) struct Damping {
    factor: f64,
    last: Option<(Place, f64)>,
}

/// Least and largest damping factor: none is an update, and a larger one would not be damping.
const DAMPED: [f64; 2] = [0.05, 1.0];

impl Default for Damping {
    fn default() -> Self {
        Damping { factor: 1.0, last: None }
    }
}

impl Damping {
    /// The geometry to go on with: a share of the way from `place`, where the rows are, to `now`, where the bodies are.
    /// Collective.
    pub fn next(&mut self, place: Place, now: Place, plan: &Plan) -> Place {
        let motion = now.combined(1.0, &place, -1.0);
        let size = parallel::sum(&plan.groups.world, &[motion.dot(&motion)])[0];
        if let Some((last, before)) = &self.last {
            let change = motion.combined(1.0, last, -1.0);
            let sums = [last.dot(&change), change.dot(&change)];
            let sums = parallel::sum(&plan.groups.world, &sums);
            if size > 0.25 * before || self.factor < 1.0 {
                let factor = -self.factor * sums[0] / sums[1];
                self.factor = if factor.is_finite() { factor.clamp(DAMPED[0], DAMPED[1]) } else { 1.0 };
            }
        }
        let mut next = place.combined(1.0, &motion, self.factor);
        if self.factor >= 1.0 {
            next = now.clone();
        }
        next.rigid.clone_from(&now.rigid);
        self.last = Some((motion, size));
        next
    }
}

/// Factors on the motions of the rigid bodies.
pub(super) fn rigid_factors(case: &Case, factors: &LoadFactors) -> Vec<f64> {
    case.rigid.iter().map(|rigid| factors.on_supports(rigid.path)).collect()
}

/// Factor on the motion of the rigid body on a side of a pair; of a deformable one there is none.
pub(super) fn rigid_factor(case: &Case, factors: &LoadFactors, pair: usize, side: usize) -> f64 {
    match case.contacts[pair].surfaces[side].body {
        BodyRef::Rigid(i) => factors.on_supports(case.rigid[i].path),
        BodyRef::Deformable(_) => 0.0,
    }
}

impl Place {
    /// Factor on the motion of the rigid body on a side of a pair; of a deformable one there is none.
    pub fn rigid_factor(&self, case: &Case, pair: usize, side: usize) -> f64 {
        match case.contacts[pair].surfaces[side].body {
            BodyRef::Rigid(i) => self.rigid[i],
            BodyRef::Deformable(_) => 0.0,
        }
    }

    /// a x + b y of the displacements.
    fn combined(&self, a: f64, other: &Place, b: f64) -> Place {
        let sum = |(x, y): (&Vec<[f64; 3]>, &Vec<[f64; 3]>)| {
            std::iter::zip(x, y).map(|(x, y)| combine([(a, x), (b, y)])).collect()
        };
        let displacement = std::iter::zip(&self.displacement, &other.displacement).map(sum).collect();
        Place { displacement, rigid: self.rigid.clone() }
    }

    /// x . y over this rank's nodes.
    fn dot(&self, other: &Place) -> f64 {
        let pairs =
            std::iter::zip(&self.displacement, &other.displacement).flat_map(|(x, y)| std::iter::zip(x, y));
        pairs.map(|(x, y)| dot(x, y)).sum()
    }

    /// Largest difference of the displacements from another place's, relative to the largest displacement. Collective.
    pub fn distance(&self, other: &Place, plan: &Plan) -> f64 {
        let size = |v: &[f64; 3]| dot(v, v).sqrt();
        let mut largest = [0.0_f64; 2];
        for (u, old) in std::iter::zip(self.displacement.as_slice(), &other.displacement)
            .flat_map(|(now, old)| std::iter::zip(now, old))
        {
            largest[0] = larger(largest[0], size(&sub(u, old)));
            largest[1] = larger(largest[1], size(u));
        }
        let largest = parallel::max(&plan.groups.world, &largest);
        if largest[1] > 0.0 { largest[0] / largest[1] } else { 0.0 }
    }
}
