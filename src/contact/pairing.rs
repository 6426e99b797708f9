//! Conjugate points of the two surfaces of a pair, and the initial gap between them.
use super::{ConjugateRule, Gap};
use super::{
    Projection, Surface,
    search::Search,
    vector::{dot, norm, sub, unit},
};

/// The conjugate point s of a contact node m.
#[derive(Debug, Clone, PartialEq)]
pub struct Conjugate {
    /// Nodes of the other surface and the weight of each: u_s = sum N_i u_i (27), R_s = sum N_i R_i (28).
    pub terms: Vec<(u32, f64)>,
    /// Common normal, unit, outwards from the node's own body: the mean of both surfaces' normals, so that the two
    /// bodies see the same line.
    pub normal: [f64; 3],
    /// Initial gap along the normal, m; negative is penetration.
    pub gap: f64,
}

/// Conjugate points of every node of both surfaces.
#[derive(Debug, Clone, PartialEq)]
pub struct Pairing {
    /// Per surface (A, B), per node: its conjugate point, if the surfaces face each other there.
    pub conjugates: [Vec<Option<Conjugate>>; 2],
    /// True if every node with a conjugate point has a node for it: forces then transfer without loss.
    pub matching: bool,
}

/// Smallest cosine between the common normal and the way to the conjugate point.
const AHEAD: f64 = 0.5;

impl Pairing {
    /// Pairs the two surfaces.
    ///
    /// The conjugate point is the closest point of the other surface (or the intersection with the node's normal).
    /// Where a node of the other surface lies within the slack that two normals that are not parallel leave, and
    /// the reverse holds, the two nodes are conjugate to each other: nodes that match by construction across an open,
    /// curved gap are found as such. `thickness` of the gap comes from the geometry unless the case gives it.
    pub fn new(surfaces: [&Surface; 2], gap: &Gap, rule: ConjugateRule) -> Pairing {
        let [a, b] = surfaces;
        let projections = [project(a, b, rule), project(b, a, rule)];
        let near = [nearest_nodes(&projections[0], b), nearest_nodes(&projections[1], a)];
        let pair_side = |own: usize| -> Vec<Option<Conjugate>> {
            let (mine, other) = (surfaces[own], surfaces[1 - own]);
            (0..mine.nodes.len())
                .map(|i| {
                    let projection = projections[own][i].as_ref()?;
                    let mutual = near[own][i].filter(|&j| near[1 - own][j as usize] == Some(i as u32));
                    let (terms, point, normal) = match mutual {
                        Some(j) => (vec![(j, 1.0)], other.points[j as usize], other.normals[j as usize]),
                        None if projection.overshoot > projection.slack => return None,
                        None => {
                            let nodes = other.facets[projection.facet].iter().copied();
                            let terms = nodes.zip(projection.shape).filter(|t| t.1 != 0.0).collect();
                            (terms, projection.point, projection.normal)
                        }
                    };
                    let normal = unit(&sub(&mine.normals[i], &normal));
                    // Far apart and aside rather than ahead: the surfaces do not face each other there.
                    let offset = sub(&point, &mine.points[i]);
                    let apart = norm(&offset) > 1e-6 * other.facet_size(projection.facet);
                    if apart && dot(&offset, &normal).abs() < AHEAD * norm(&offset) {
                        return None;
                    }
                    let gap = match gap {
                        Gap::Value(value) => *value,
                        Gap::Geometry { offset: added } => {
                            let shape = projection.shape;
                            let curve = || {
                                let eta = shape[1] - shape[0];
                                other.distance_to_curve(projection.facet, &mine.points[i], &normal, eta)
                            };
                            let of_curve = if terms.len() > 1 { curve() } else { None };
                            of_curve.unwrap_or_else(|| dot(&normal, &offset)) + added
                        }
                    };
                    Some(Conjugate { terms, normal, gap })
                })
                .collect()
        };
        let conjugates = [pair_side(0), pair_side(1)];
        let matching = conjugates.iter().flatten().flatten().all(|c| c.terms.len() == 1);
        Pairing { conjugates, matching }
    }
}

/// Projection of every node of `from` onto `onto`.
fn project(from: &Surface, onto: &Surface, rule: ConjugateRule) -> Vec<Option<Projection>> {
    let search = Search::new(onto);
    std::iter::zip(&from.points, &from.normals)
        .map(|(x, normal)| match rule {
            ConjugateRule::ClosestPoint => search.closest(x, normal),
            ConjugateRule::Intersection => search.intersection(x, normal),
        })
        .collect()
}

/// For each projection the node of its facet that lies within the slack, if any.
fn nearest_nodes(projections: &[Option<Projection>], onto: &Surface) -> Vec<Option<u32>> {
    projections
        .iter()
        .map(|projection| {
            let p = projection.as_ref()?;
            let distance = |&node: &u32| norm(&sub(&onto.points[node as usize], &p.point));
            onto.facets[p.facet]
                .iter()
                .copied()
                .min_by(|i, j| distance(i).total_cmp(&distance(j)))
                .filter(|node| distance(node) <= p.slack)
        })
        .collect()
}
