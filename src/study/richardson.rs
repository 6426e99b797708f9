//! Richardson extrapolation: the limit of a sequence of meshes, and how far it can be believed.
//!
//! f_h = f + C h^p on the three finest levels, h halved `step` times from one to the next, gives
//! p = log2(|f_1 - f_0| / |f_2 - f_1|) / step and f = f_2 + (f_2 - f_1) / (2^(p step) - 1). (Roache, Verification and
//! Validation in Computational Science and Engineering, 1998, ch. 5.)
use super::quantity::{difference, norm};

/// Orders below this are no convergence that could be extrapolated.
pub(super) const LOWEST_ORDER: f64 = 0.5;
/// Orders of two triples of levels that differ by more than this show no rate.
const STEADY_ORDER: f64 = 1.0;
/// The limit is never taken to be better than this part of what the extrapolation added.
const TRUST: f64 = 0.1;
/// Differences below this part of the value are round-off.
const ROUND_OFF: f64 = 1e-11;

/// The limit of a sequence.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Limit {
    pub values: Vec<f64>,
    /// How far it may be off, relative.
    pub uncertainty: f64,
    pub order: Option<f64>,
    pub behaviour: Behaviour,
    /// From the second finest level to the finest, relative.
    pub change: f64,
}

impl Limit {
    /// True if the finest level stands for the limit: it is no judge of itself.
    pub fn is_finest_level(&self) -> bool {
        matches!(self.behaviour, Behaviour::Settled | Behaviour::Oscillating | Behaviour::Slow)
    }
}

/// How the three finest levels behave.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Behaviour {
    /// They converge with an order that an element of this kind can have.
    Asymptotic,
    /// They agree to round-off.
    Settled,
    /// Their differences change sign.
    Oscillating,
    /// They converge slower than with [`LOWEST_ORDER`], or not at all.
    Slow,
    /// They converge faster than these elements can.
    Fast,
    /// They converge, but with another order from one triple of levels to the next.
    Erratic,
}

/// The limit of values by level, coarse first; none with fewer than three levels, or levels unevenly spaced. `highest` is
/// the largest order that the elements can have.
pub(super) fn limit(levels: &[(usize, &[f64])], highest: f64) -> Option<Limit> {
    let found = extrapolate(levels.get(levels.len().checked_sub(3)?..)?, highest)?;
    // Four levels make two limits, whose difference says how far the better one may be off.
    let before = levels.len().checked_sub(4).and_then(|from| levels.get(from..from + 3));
    let before = before.and_then(|levels| extrapolate(levels, highest));
    match before {
        Some(before)
            if before.behaviour == Behaviour::Asymptotic && found.behaviour == Behaviour::Asymptotic =>
        {
            let moved = norm(&difference(&found.values, &before.values)) / norm(&found.values);
            let change = before.order.zip(found.order).map_or(0.0, |(a, b)| (a - b).abs());
            if change > STEADY_ORDER {
                let uncertainty = moved.max(found.uncertainty);
                return Some(Limit { uncertainty, behaviour: Behaviour::Erratic, ..found });
            }
            Some(Limit { uncertainty: moved.max(TRUST * found.uncertainty), ..found })
        }
        _ => Some(found),
    }
}

fn extrapolate(levels: &[(usize, &[f64])], highest: f64) -> Option<Limit> {
    let &[(l0, f0), (l1, f1), (l2, f2)] = levels else { return None };
    let step = l1 - l0;
    let scale = norm(f2);
    if l2 - l1 != step || scale == 0.0 {
        return None;
    }
    let (d1, d2) = (difference(f1, f0), difference(f2, f1));
    let (n1, n2) = (norm(&d1) / scale, norm(&d2) / scale);
    let finest = |behaviour, order, uncertainty| {
        Some(Limit { values: f2.to_vec(), uncertainty, order, behaviour, change: n2 })
    };
    if n2 <= ROUND_OFF {
        return finest(Behaviour::Settled, None, n2);
    }
    let order = (n1 / n2).log2() / step as f64;
    if d1.iter().zip(&d2).map(|(a, b)| a * b).sum::<f64>() < 0.0 {
        return finest(Behaviour::Oscillating, None, n1.max(n2));
    }
    // What is left of the geometric series at the lowest order that counts.
    let rest = |order: f64| n2 / ((order * step as f64).exp2() - 1.0);
    if order < LOWEST_ORDER {
        return finest(Behaviour::Slow, Some(order), rest(LOWEST_ORDER));
    }
    let factor = 1.0 / ((order * step as f64).exp2() - 1.0);
    let values = f2.iter().zip(&d2).map(|(f, d)| f + factor * d).collect();
    if order <= highest {
        let behaviour = Behaviour::Asymptotic;
        return Some(Limit { values, uncertainty: rest(order), order: Some(order), behaviour, change: n2 });
    }
    // The last difference is small by chance, as where the error changes its sign: no less is left than the highest order
    // leaves of the difference before.
    let gain = (highest * step as f64).exp2();
    let uncertainty = n2.max(n1 / gain / (gain - 1.0));
    Some(Limit { values, uncertainty, order: Some(order), behaviour: Behaviour::Fast, change: n2 })
}

/// Order between two levels from their errors.
pub(super) fn order_of_errors((l0, e0): (usize, f64), (l1, e1): (usize, f64)) -> Option<f64> {
    let order = (e0 / e1).log2() / (l1 - l0) as f64;
    order.is_finite().then_some(order)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sequence(f: impl Fn(f64) -> f64, levels: &[usize]) -> Vec<(usize, Vec<f64>)> {
        levels.iter().map(|&l| (l, vec![f(0.5f64.powi(l as i32))])).collect()
    }

    fn limit_of(f: impl Fn(f64) -> f64, levels: &[usize]) -> Option<Limit> {
        let sequence = sequence(f, levels);
        let borrowed: Vec<(usize, &[f64])> = sequence.iter().map(|(l, v)| (*l, &v[..])).collect();
        limit(&borrowed, 4.5)
    }

    #[test]
    fn a_power_is_extrapolated_exactly() {
        for p in [1.0, 1.5, 2.0, 4.0] {
            for levels in [&[0, 1, 2, 3][..], &[0, 2, 4]] {
                let limit = limit_of(|h| 3.0 + 0.7 * h.powf(p), levels).unwrap();
                assert!((limit.values[0] - 3.0).abs() < 1e-12, "{limit:?}");
                assert!((limit.order.unwrap() - p).abs() < 1e-9, "{limit:?}");
                assert_eq!(limit.behaviour, Behaviour::Asymptotic);
            }
        }
    }

    #[test]
    fn the_limit_is_within_its_uncertainty() {
        let limit = limit_of(|h| 1.0 + 0.3 * h.powi(2) + 0.2 * h.powi(3), &[1, 2, 3, 4]).unwrap();
        assert!((limit.values[0] - 1.0).abs() <= limit.uncertainty && limit.uncertainty < 1e-3, "{limit:?}");
    }

    /// The error changes its sign between the finest levels: nothing is known to their difference.
    #[test]
    fn a_zero_crossing_is_no_accuracy() {
        let values = |f: [f64; 3]| limit_of(move |h| f[h.log2().abs() as usize], &[0, 1, 2]).unwrap();
        let limit = values([1.1, 1.001, 1.0009]);
        assert_eq!(limit.behaviour, Behaviour::Fast);
        assert!(limit.uncertainty >= 1e-4, "{limit:?}");
    }

    #[test]
    fn what_does_not_converge_is_told() {
        let behaviour = |f: fn(f64) -> f64| limit_of(f, &[0, 1, 2]).unwrap().behaviour;
        assert_eq!(
            behaviour(|h| 1.0 + 0.1 * h * (h.log2() * std::f64::consts::PI).cos()),
            Behaviour::Oscillating
        );
        assert_eq!(behaviour(|h| 1.0 - 0.1 * h.log2()), Behaviour::Slow);
        assert_eq!(behaviour(|h| h.powf(-0.5)), Behaviour::Slow);
        assert_eq!(behaviour(|h| 1.0 + h.powi(6)), Behaviour::Fast);
        assert_eq!(behaviour(|_| 2.0), Behaviour::Settled);
        let erratic = |h: f64| 1.0 + if h > 0.9 { 0.5 } else { 0.1 * h };
        assert_eq!(limit_of(erratic, &[0, 1, 2, 3]).unwrap().behaviour, Behaviour::Erratic);
        assert!(limit_of(|h| h, &[0, 1]).is_none() && limit_of(|h| 1.0 + h, &[0, 1, 3]).is_none());
    }
}
