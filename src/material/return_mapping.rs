//! Radial return in six components: implicit flow theory by von Mises' criterion with isotropic and kinematic hardening.
//!
//! Wilkins (1964); consistent tangent: Simo and Taylor, Comp. Meth. Appl. Mech. Engng 48 (1985) 101, eq. (3.17). The
//! backstress follows Armstrong and Frederick, CEGB RD/B/N 731 (1966), and is integrated exactly along the constant
//! direction n of the increment, so that cyclic loading in one direction has no error of time integration:
//!
//! beta = w beta_old + (2/3)^(1/2) b n, w = exp(-gamma dp), b = C (1 - w) / gamma, and by Prager w = 1, b = C dp.
//!
//! Only deviators enter: the pressure K tr(eps - eps_th) is added outside, and near incompressibility nothing cancels.
use super::tensor::{Tensor, add, deviator, dot, equivalent, scaled};
use super::{
    Hardening, PointState,
    root::{Sample, root},
};

/// What counts as round-off at the yield surface, relative to the stress.
const TIE: f64 = 1e-12;

/// What the law needs at one temperature.
pub(super) struct ReturnMapping<'a> {
    /// K, Pa.
    pub bulk: f64,
    /// G, Pa.
    pub shear: f64,
    pub hardening: &'a Hardening,
    /// Modulus C, Pa, and recall gamma of the backstress.
    pub kinematic: (f64, f64),
    /// K.
    pub temperature: f64,
}

/// A point that has yielded.
pub(super) struct Returned {
    /// Deviator of the stress, Pa.
    pub deviator: Tensor,
    pub plastic_strain: Tensor,
    pub equivalent: f64,
    /// Pa.
    pub backstress: Tensor,
    pub stiffness: Stiffness,
}

/// C = K 1 (x) 1 + s I_dev - n (x) a - c (x) n, Pa. It is symmetric, c = a, but for the recall of the backstress.
pub(super) struct Stiffness {
    /// K.
    pub bulk: f64,
    /// s.
    pub shear: f64,
    pub n: Tensor,
    pub a: Tensor,
    pub c: Tensor,
}

impl Stiffness {
    /// Derivative of the stress component `i` with respect to the strain component `j`, engineering shear.
    #[inline]
    pub fn entry(&self, i: usize, j: usize) -> f64 {
        let elastic = match (i < 3 && j < 3, i == j) {
            (true, true) => self.bulk + self.shear * (2. / 3.),
            (true, false) => self.bulk - self.shear / 3.,
            (false, true) => 0.5 * self.shear,
            (false, false) => 0.,
        };
        elastic - self.n[i] * self.a[j] - self.c[i] * self.n[j]
    }

    /// The secant stiffness, with K and s = 2 Gs: the flow direction adds nothing.
    pub fn secant(&self) -> Stiffness {
        Stiffness { n: [0.; 6], a: [0.; 6], c: [0.; 6], ..*self }
    }
}

/// Where the increment would end without plastic flow.
struct Trial<'a> {
    law: &'a ReturnMapping<'a>,
    old: &'a PointState,
    /// s_tr, Pa.
    deviator: Tensor,
}

/// The yield condition at the plastic increment dp.
struct Condition {
    /// eta = s_tr - w beta_old, along which the stress returns, Pa.
    eta: Tensor,
    /// q = (3/2 eta:eta)^(1/2), Pa.
    q: f64,
    /// w.
    kept: f64,
    /// b, Pa.
    gained: f64,
    /// q - 3 G dp - b, Pa: to be sigma_y.
    stress: f64,
    /// -d stress / d dp, Pa.
    slope: f64,
}

impl ReturnMapping<'_> {
    /// The answer to a deviatoric strain, thermal strain taken off; `None`: no plastic strain is added to that of `old`.
    ///
    /// A stress on the yield surface to 1e-12 of it is elastic: round-off does not decide.
    pub fn respond(&self, strain: &Tensor, old: &PointState) -> Option<Returned> {
        let elastic: Tensor = add(strain, -1., &old.plastic_strain);
        let trial = Trial { law: self, old, deviator: scaled(2. * self.shear, &elastic) };
        let begin = trial.condition(0.);
        let (yield_stress, slope) = self.hardening.at(old.equivalent, self.temperature);
        let excess = begin.q - yield_stress;
        // False for a strain that is not a number, too.
        let leaves = excess > TIE * yield_stress;
        if !leaves {
            return None;
        }
        let dp = match self.hardening {
            Hardening::Linear { .. } if self.kinematic.1 == 0. => excess / (begin.slope + slope),
            Hardening::RambergOsgood { .. } => trial.increment_by_stress(yield_stress),
            _ => trial.increment(),
        };
        if dp * 3. * self.shear > TIE * begin.q { Some(trial.returned(dp)) } else { None }
    }

    /// Equivalent stress of a stress without the backstress over the yield stress sigma_y(p, T).
    pub fn yield_ratio(&self, state: &PointState) -> f64 {
        let q = equivalent(&add(&deviator(&state.stress), -1., &state.backstress));
        if q == 0. { 0. } else { q / self.hardening.at(state.equivalent, self.temperature).0 }
    }
}

impl Trial<'_> {
    #[inline]
    fn condition(&self, dp: f64) -> Condition {
        let (modulus, recall) = self.law.kinematic;
        let (kept, gained) = match recall {
            0. => (1., modulus * dp),
            _ => ((-recall * dp).exp(), -modulus * (-recall * dp).exp_m1() / recall),
        };
        let eta = add(&self.deviator, -kept, &self.old.backstress);
        let q = equivalent(&eta);
        // dq/d dp = gamma w (3/2)^(1/2) n:beta_old, n = eta / |eta|.
        let recalled = match recall {
            0. => 0.,
            _ => 1.5 * recall * kept * dot(&eta, &self.old.backstress) / q,
        };
        let stress = q - 3. * self.law.shear * dp - gained;
        let slope = 3. * self.law.shear + modulus * kept - recalled;
        Condition { eta, q, kept, gained, stress, slope }
    }

    /// dp beyond any solution, as sigma_y and b are not negative, and the stress there.
    fn largest(&self) -> (f64, f64) {
        let stress = equivalent(&self.deviator) + equivalent(&self.old.backstress);
        (stress / (3. * self.law.shear), stress)
    }

    /// dp of sigma_y(p + dp) = q - 3 G dp - b. Curves that bend down make the function convex: Newton's method from zero
    /// is then monotone.
    fn increment(&self) -> f64 {
        let (largest, stress) = self.largest();
        root(0., (0., largest), |dp| {
            let (yield_stress, slope) = self.law.hardening.at(self.old.equivalent + dp, self.law.temperature);
            let condition = self.condition(dp);
            Sample {
                value: yield_stress - condition.stress,
                slope: slope + condition.slope,
                noise: 2. * f64::EPSILON * stress,
            }
        })
    }

    /// The same with sigma_y as the unknown, for a curve p(sigma_y) that begins with an infinite slope of sigma_y.
    fn increment_by_stress(&self, old_yield_stress: f64) -> f64 {
        let Hardening::RambergOsgood { yield_stress, offset, exponent } = self.law.hardening else {
            return self.increment();
        };
        let reference = yield_stress.at(self.law.temperature);
        let increment = |x: f64| (offset * (x / reference).powf(*exponent) - self.old.equivalent).max(0.);
        let (largest, stress) = self.largest();
        // The solution is at least half of the smaller bound or where the increment begins: Newton is then fast.
        let (bound, _) = self.law.hardening.at(self.old.equivalent + largest, self.law.temperature);
        let solution = root(bound.min(stress), (old_yield_stress, stress), |x| {
            let condition = self.condition(increment(x));
            let dp_dx = exponent * offset / x * (x / reference).powf(*exponent);
            Sample {
                value: x - condition.stress,
                slope: 1. + condition.slope * dp_dx,
                noise: 2. * f64::EPSILON * stress,
            }
        });
        increment(solution)
    }

    /// With (3/2)^(1/2) n dp the plastic strain, theta = 3 G dp / q and D the slope of the yield condition:
    /// d s = 2 G (1 - theta) de + (2 G theta - 6 G^2 / D) n (n:de)
    ///       - theta gamma w 6^(1/2) G / D (beta_old - n n:beta_old) n:de.
    fn returned(&self, dp: f64) -> Returned {
        let (shear, old) = (self.law.shear, self.old);
        let condition = self.condition(dp);
        let (_, slope) = self.law.hardening.at(old.equivalent + dp, self.law.temperature);
        let n = scaled(1.5_f64.sqrt() / condition.q, &condition.eta);
        let (root_3_2, theta, d) = (1.5_f64.sqrt(), 3. * shear * dp / condition.q, condition.slope + slope);
        let along = scaled(3. * shear * shear / d - shear * theta, &n);
        let recall = theta * self.law.kinematic.1 * condition.kept * 6_f64.sqrt() * shear / d;
        let c = match recall {
            0. => along,
            _ => {
                let across = add(&old.backstress, -dot(&n, &old.backstress), &n);
                add(&along, recall, &across)
            }
        };
        let (direction, strain) = (condition.gained / root_3_2, root_3_2 * dp);
        Returned {
            deviator: add(&self.deviator, -2. * shear * strain, &n),
            plastic_strain: add(&old.plastic_strain, strain, &n),
            equivalent: old.equivalent + dp,
            backstress: add(&scaled(condition.kept, &old.backstress), direction, &n),
            stiffness: Stiffness { bulk: self.law.bulk, shear: 2. * shear * (1. - theta), n, a: along, c },
        }
    }
}
