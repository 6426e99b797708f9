//! Contact conditions between two surfaces, one per multiplier.

use super::{Conjugate, Surface};
use crate::tolerances::COORDINATES;

/// One contact condition: the mean gap over the support of a multiplier must not be negative.
///
/// With v the vectors of `terms` and u the nodal displacements, the outward displacement of a side is
/// w = sum_i v_i . u_i, and the gap is `gap` - (w of both sides). A compressive force R, N, acts on the nodes of both
/// sides with -R v_i: the transposed operator. The vectors of both sides together add up to zero, so that action equals
/// reaction to round-off.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// Node of the multiplier side's surface that the multiplier belongs to.
    pub node: u32,
    /// Surface nodes and vectors v on the multiplier side and on the mortar side, outwards from the own body.
    pub terms: [Vec<(u32, [f64; 3])>; 2],
    /// Unit normal, outwards from the multiplier side's body.
    pub normal: [f64; 3],
    /// Initial gap, m; negative is penetration.
    pub gap: f64,
    /// Weight of the multiplier, int psi_j dA, m2: the pressure is R / area.
    pub area: f64,
}

/// Node-to-segment rows: one per node of the multiplier side's surface with a conjugate point and a gap within
/// `search_distance`, m. Forces then transfer without loss on matching nodes only.
pub fn pointwise(multiplier: &Surface, conjugates: &[Option<Conjugate>], search_distance: f64) -> Vec<Row> {
    let near = |c: &&Conjugate| c.gap <= search_distance * (1.0 + COORDINATES);
    (0..multiplier.nodes.len())
        .filter_map(|i| Some((i, conjugates.get(i)?.as_ref().filter(near)?)))
        .map(|(i, conjugate)| Row {
            node: i as u32,
            terms: [
                vec![(i as u32, conjugate.normal)],
                conjugate.terms.iter().map(|&(k, c)| (k, conjugate.normal.map(|n| -c * n))).collect(),
            ],
            normal: conjugate.normal,
            gap: conjugate.gap,
            area: multiplier.weights[i],
        })
        .collect()
}
