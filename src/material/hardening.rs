//! Isotropic hardening: the yield stress over equivalent plastic strain and temperature.
use super::Hardening;

/// A curve's ordinate and slope to the right, Pa.
type Sample = (f64, f64);

impl Hardening {
    /// sigma_y, Pa, and its slope d sigma_y / dp, Pa, at the equivalent plastic strain `p` and the temperature, K. At a kink
    /// the slope is that to the right; without an elastic range it is infinite at p = 0.
    pub(super) fn at(&self, p: f64, temperature: f64) -> (f64, f64) {
        match self {
            Hardening::Linear { yield_stress, modulus } => {
                let modulus = modulus.at(temperature);
                (yield_stress.at(temperature) + modulus * p, modulus)
            }
            Hardening::Table(curves) => table(curves, p, temperature),
            // Ramberg and Osgood, NACA TN 902 (1943), solved for the stress.
            Hardening::RambergOsgood { yield_stress, offset, exponent } => {
                if p <= 0. {
                    return (0., f64::INFINITY);
                }
                let stress = yield_stress.at(temperature) * (p / offset).powf(1. / exponent);
                (stress, stress / (exponent * p))
            }
            // Swift, J. Mech. Phys. Solids 1 (1952) 1.
            Hardening::Power { yield_stress, strain, exponent } => {
                let ratio = 1. + p / strain;
                let stress = yield_stress.at(temperature) * ratio.powf(*exponent);
                (stress, exponent * stress / (ratio * strain))
            }
        }
    }
}

/// Between the curves of two temperatures, the values and with them the slopes are interpolated.
fn table(curves: &[(f64, Vec<(f64, f64)>)], p: f64, temperature: f64) -> Sample {
    let i = curves.partition_point(|curve| curve.0 <= temperature);
    let (below, above) = (i.checked_sub(1).and_then(|i| curves.get(i)), curves.get(i));
    match (below, above) {
        (Some((t0, cold)), Some((t1, hot))) => {
            let part = (temperature - t0) / (t1 - t0);
            let (a, b) = (curve(cold, p), curve(hot, p));
            (a.0 + (b.0 - a.0) * part, a.1 + (b.1 - a.1) * part)
        }
        (Some((_, points)), None) | (None, Some((_, points))) => curve(points, p),
        // Without a curve there is no yield stress to reach.
        (None, None) => (f64::INFINITY, 0.),
    }
}

/// Piecewise linear through (p, sigma_y), constant beyond the ends.
fn curve(points: &[(f64, f64)], p: f64) -> Sample {
    let i = points.partition_point(|point| point.0 <= p);
    match (i.checked_sub(1).and_then(|i| points.get(i)), points.get(i)) {
        (Some((p0, s0)), Some((p1, s1))) => {
            let slope = (s1 - s0) / (p1 - p0);
            (s0 + slope * (p - p0), slope)
        }
        (Some((_, s)), None) | (None, Some((_, s))) => (*s, 0.),
        (None, None) => (f64::INFINITY, 0.),
    }
}
