//! Contact rows of the pairs, and the bodies' shares of them.
use crate::estimate::coarse::Grain;
use crate::tolerances::{HELD_DIRECTION, HELD_PRESCRIBED};
use crate::vector::worst;
use crate::{
    body::{BodyRow, Constraints},
    case::{BodyRef, Case, ContactCase, Driver, Gap, RigidShape, Transfer},
    contact::{
        Conjugate, Law, Pairing, Row, Search, Surface, mortar, pointwise,
        vector::{dot, sub},
    },
    error::Result,
    material::LinearElastic,
    parallel::Exchange,
    scene::{ContactSide, Plan},
    schwarz::{End, Interpolated, PairRows},
};
use std::collections::{HashMap, HashSet};

/// Default search distance as a share of the smaller surface's extent.
const SEARCH: f64 = 0.1;

/// A pair as the first rank of either group sees it.
pub(crate) struct Pair {
    /// Side of the case (0: A) that carries the multipliers.
    pub multiplier: usize,
    /// Rows that may come into contact: those of nodes of the multiplier side first.
    pub rows: Vec<Row>,
    /// How many these are. The others, of nodes of the mortar side, are those of the paper's transfer where nodes do not
    /// match: both sides' nodes have conjugate points, and forces of their own.
    pub n_own: usize,
    /// Rows whose forces do not act on the multiplier side and on the mortar side.
    pub watched: [Vec<usize>; 2],
    /// Per row, tangential ones after the normal ones: whether supports hold the multiplier side and the mortar side, or
    /// these are rigid.
    pub held: Vec<[bool; 2]>,
    /// Mesh node of each row.
    pub nodes: Vec<u32>,
    /// Of each facet of the multiplier side: the part that has a partner, xi in [-1, 1].
    pub cover: Vec<Option<[f64; 2]>>,
    /// How far the surfaces may lie from what the gap of each row was measured with, m: [`Surface::sagitta_in_doubt`].
    pub doubt: Vec<f64>,
    /// Where the node of each row is along its surface, m.
    pub along: Vec<f64>,
    /// Index in the case.
    pub number: usize,
    /// The surface with the multipliers.
    pub grain: Grain,
    /// Rows beyond the search distance: they must not come to penetrate.
    pub beyond: Vec<Row>,
    /// Plane moduli of the bodies on the multiplier and the mortar side, Pa; infinite: rigid.
    pub moduli: [f64; 2],
    /// Nodes of the mortar surface that occur in the rows.
    pub mortar_nodes: usize,
    /// Of each node of the mortar surface: the multiplier nodes on either side of the point opposite, with their weights.
    pub opposite: Vec<Option<[(u32, f64); 2]>>,
    /// Outward displacement of a rigid mortar side at each row at factor 1, m; then its tangential one, of a pair with a law.
    pub rigid_motion: Vec<f64>,
    /// What the surfaces do tangentially.
    pub law: Law,
}

/// Whether supports hold a node of a surface along its normal, and along the surface.
pub(super) type Held = [bool; 2];

/// Rows of every pair this rank takes part in, by pair; `surfaces`: both sides of each end's pair, own side first; `before`: the pairs
/// of the geometry before, empty of the first. Not collective.
pub(crate) fn pair_rows(
    case: &Case,
    plan: &Plan,
    surfaces: &[[Surface; 2]],
    held: &[[Vec<Held>; 2]],
    before: &[Option<Pair>],
) -> Vec<Option<Pair>> {
    let mut pairs: Vec<Option<Pair>> = case.contacts.iter().map(|_| None).collect();
    for (i, &ContactSide { pair, side, .. }) in plan.ends.iter().enumerate() {
        if pairs[pair].is_none() {
            let (mut sides, mut holds) = ([&surfaces[i][0], &surfaces[i][1]], [&held[i][0], &held[i][1]]);
            if side == 1 {
                sides.reverse();
                holds.reverse();
            }
            let names = case.contacts[pair].surfaces.each_ref().map(|s| s.body);
            // Nodes whose multipliers an earlier pair of the same bodies carries.
            let taken: Vec<(BodyRef, HashSet<u32>)> = (0..pair)
                .filter_map(|q| {
                    let (data, other) =
                        (pairs[q].as_ref()?, case.contacts[q].surfaces.each_ref().map(|s| s.body));
                    let same = other == names || (other[0], other[1]) == (names[1], names[0]);
                    same.then(|| (other[data.multiplier], data.nodes.iter().copied().collect()))
                })
                .collect();
            // What nodes have slipped and lost is known on one side, and stays there.
            let before =
                before.get(pair).and_then(Option::as_ref).filter(|before| before.law.is_frictional());
            let multiplier = before.map(|before| before.multiplier);
            pairs[pair] = Some(one_pair(case, plan, pair, sides, holds, &taken, multiplier));
        }
    }
    pairs
}

/// `taken`: bodies and mesh nodes that carry the multipliers of earlier pairs of the same two bodies; `multiplier`: the side that carries
/// those of this one, if that is settled.
fn one_pair(
    case: &Case,
    plan: &Plan,
    pair: usize,
    sides: [&Surface; 2],
    held: [&Vec<Held>; 2],
    taken: &[(BodyRef, HashSet<u32>)],
    multiplier: Option<usize>,
) -> Pair {
    let contact = &case.contacts[pair];
    let moduli = [0, 1].map(|s| match contact.surfaces[s].body.deformable() {
        Some(b) => LinearElastic::new(&case.bodies[b].material, case.analysis).plane_modulus(),
        None => f64::INFINITY,
    });
    let is_relaxed = matches!(case.alternation.driver, Driver::Relaxed(_));
    let multiplier = match (multiplier, moduli.iter().position(|m| m.is_infinite())) {
        (Some(side), _) => side,
        (None, Some(rigid)) => 1 - rigid,
        (None, None) => {
            // Of sides that are alike the first by the name of its body: whatever order the case has.
            let names = [0, 1].map(|s| case.body_name(contact.surfaces[s].body));
            let [a, b] = if names[0] <= names[1] { [0, 1] } else { [1, 0] };
            // The paper's alternation prescribes the displacements of both sides.
            let coarser = if is_relaxed { mortar::coarser_side([sides[a], sides[b]]) } else { None };
            let by_rule = || mortar::multiplier_side([sides[a], sides[b]], [moduli[a], moduli[b]]);
            let side = [a, b][coarser.unwrap_or_else(by_rule)];
            // Nodes that all lie beyond the other surface have nothing to say: its nodes have.
            let faces = |side: usize, pairing: &Pairing| pairing.conjugates[side].iter().any(Option::is_some);
            match case.alternation.transfer {
                Transfer::Pointwise if !is_relaxed => {
                    let pairing = Pairing::new(sides, &contact.gap, contact.conjugate);
                    if faces(side, &pairing) || !faces(1 - side, &pairing) { side } else { 1 - side }
                }
                _ => side,
            }
        }
    };
    let (own, other) = (sides[multiplier], sides[1 - multiplier]);
    // Bonded are surfaces that are near each other, whatever a force may move.
    let floating = plan.floating(case, pair) && contact.law != Law::Tied;
    let reach = search_distance(contact, own, other, moduli, floating);
    // The own normals of a body that only contact holds leave its spin free, as it is; a rigid surface's would not.
    let other = &Surface { rigid: other.rigid && !floating, ..other.clone() };
    let body = contact.surfaces[multiplier].body;
    let is_taken = |node: u32| {
        let node = own.nodes[node as usize];
        taken.iter().any(|(other, nodes)| *other == body && nodes.contains(&node))
    };
    let (all, cover): (Vec<(Row, Acts)>, _) = match case.alternation.transfer {
        Transfer::Mortar => {
            let thickness = case.analysis.thickness();
            let mortar::Transferred { rows, cover } =
                mortar::transfer(own, other, &contact.gap, thickness, f64::INFINITY, &is_taken);
            (rows.into_iter().map(|row| (row, BOTH)).collect(), cover)
        }
        Transfer::Pointwise => {
            let mut pairing = Pairing::new(sides, &contact.gap, contact.conjugate);
            pairing.conjugates.rotate_left(multiplier);
            // The paper's is of both sides' nodes.
            let both_sides = is_relaxed && moduli.iter().all(|m| m.is_finite());
            (
                nodal_rows([own, other], &pairing.conjugates, both_sides),
                vec![Some([-1.0, 1.0]); own.facets.len()],
            )
        }
    };
    // A row that supports hold on all sides that it acts on, but for next to nothing, carries a support's force, not a
    // contact's: where surfaces slip past a clamp by little, what neighbours have of the row there could close a gap only by
    // huge forces.
    let held = [held[multiplier], held[1 - multiplier]];
    let node_is_held =
        |side: usize, node: u32, along: usize| held[side].get(node as usize).is_none_or(|held| held[along]);
    let is_held = |row: &Row, along: usize| {
        [0, 1].map(|s| row.terms[s].iter().all(|&(node, _)| node_is_held(s, node, along)))
    };
    let yields = |(row, acts): &(Row, Acts)| {
        let (mut free, mut all) = (0.0, 0.0);
        for (s, terms) in row.terms.iter().enumerate().filter(|(s, _)| acts[*s]) {
            for (node, v) in terms {
                let size = dot(v, v).sqrt();
                all += size;
                free += if node_is_held(s, *node, NORMAL) { 0.0 } else { size };
            }
        }
        free > HELD_PRESCRIBED * all
    };
    let (near, beyond): (Vec<_>, Vec<_>) = all
        .into_iter()
        .filter(yields)
        .map(|(row, acts)| (closed(row, &contact.gap, [own, other]), acts))
        .partition(|(row, _)| row.gap <= reach);
    let watched = [0, 1].map(|side| (0..near.len()).filter(|&j| !near[j].1[side]).collect::<Vec<usize>>());
    let mut rows: Vec<Row> = near.into_iter().map(|(row, _)| row).collect();
    // Conjugate points have it already.
    if contact.law.is_frictional() && case.alternation.transfer == Transfer::Mortar {
        between_normals(&mut rows, own, other);
    }
    let n_own = rows.len() - watched[0].len();
    let doubts = [own, other].map(Surface::sagitta_in_doubt);
    let of_nodes = |side: usize, row: &Row| {
        row.terms[side].iter().map(|t| doubts[side][t.0 as usize]).fold(0.0, crate::vector::larger)
    };
    let doubt = rows.iter().map(|row| of_nodes(0, row) + of_nodes(1, row)).collect();
    let place = |(j, row): (usize, &Row)| [own, other][usize::from(j >= n_own)].s[row.node as usize];
    let along = rows.iter().enumerate().map(place).collect();
    let mut nodes: Vec<u32> = rows.iter().flat_map(|r| r.terms[1].iter().map(|t| t.0)).collect();
    nodes.sort_unstable();
    nodes.dedup();
    let rigid = rigid_motion(case, pair, 1 - multiplier);
    let u = rigid.unwrap_or_default();
    let mut rigid_motion: Vec<f64> =
        rows.iter().map(|row| row.terms[1].iter().map(|(_, v)| dot(v, &u)).sum()).collect();
    if contact.law.is_frictional() {
        let slides = |row: &Row| turned(&row.terms[1]).iter().map(|(_, v)| dot(v, &u)).sum::<f64>();
        rigid_motion.extend(rows.iter().map(slides));
    }
    Pair {
        law: contact.law,
        multiplier,
        nodes: rows[..n_own].iter().map(|row| own.nodes[row.node as usize]).collect(),
        held: (NORMAL..=if contact.law.is_frictional() { ALONG } else { NORMAL })
            .flat_map(|along| rows.iter().map(move |row| is_held(row, along)))
            .collect(),
        rows,
        n_own,
        watched,
        cover,
        doubt,
        along,
        beyond: beyond.into_iter().map(|(row, _)| row).collect(),
        number: pair,
        grain: Grain::new(own),
        moduli: [moduli[multiplier], moduli[1 - multiplier]],
        mortar_nodes: nodes.len(),
        opposite: match contact.surfaces[1 - multiplier].body {
            BodyRef::Deformable(_) => opposite(own, other),
            BodyRef::Rigid(_) => Vec::new(),
        },
        rigid_motion,
    }
}

/// Whether a row's force acts on the multiplier side and on the mortar side.
type Acts = [bool; 2];

const BOTH: Acts = [true, true];

/// The places in [`Held`].
const NORMAL: usize = 0;
const ALONG: usize = 1;

/// Rows of the nodes of the multiplier side, which act on both sides. With `both_sides` only where two nodes are each other's
/// conjugate points; all other nodes of either side have rows that act on their own side alone.
fn nodal_rows(
    [own, other]: [&Surface; 2],
    conjugates: &[Vec<Option<Conjugate>>; 2],
    both_sides: bool,
) -> Vec<(Row, Acts)> {
    let single = |side: usize, node: usize| match &conjugates[side].get(node)?.as_ref()?.terms[..] {
        [(other, _)] => Some(*other as usize),
        _ => None,
    };
    let matches = |side: usize, node: u32| {
        let node = node as usize;
        single(side, node).is_some_and(|other| single(1 - side, other) == Some(node))
    };
    let rows = pointwise(own, &conjugates[0], f64::INFINITY).into_iter();
    let acts = |row: &Row| [true, !both_sides || matches(0, row.node)];
    let mut all: Vec<(Row, Acts)> = rows.map(|row| (row.clone(), acts(&row))).collect();
    if both_sides {
        let rows = pointwise(other, &conjugates[1], f64::INFINITY).into_iter();
        all.extend(rows.filter(|row| !matches(1, row.node)).map(|mut row| {
            row.terms.reverse();
            (row, [false, true])
        }));
    }
    all
}

impl Pair {
    /// Values on the normal rows, followed by what they make on the tangential ones, if there are any.
    pub fn on_all_rows(
        &self,
        normal: impl Iterator<Item = f64>,
        tangential: impl Fn(f64) -> f64,
    ) -> Vec<f64> {
        let mut values: Vec<f64> = normal.collect();
        if self.law.is_frictional() {
            values.extend_from_within(..);
            let n = values.len() / 2;
            values[n..].iter_mut().for_each(|value| *value = tangential(*value));
        }
        values
    }

    /// The gap that a row has to close, m: bonded nodes keep theirs.
    pub fn gap_of(&self, row: &Row) -> f64 {
        if self.law == Law::Tied { 0.0 } else { row.gap }
    }

    /// Rows of nodes of the multiplier side.
    pub fn own_rows(&self) -> &[Row] {
        &self.rows[..self.n_own]
    }

    /// Of which rows the force is what the nodes of a side carry where a row does not act, and with which weights: the
    /// conjugate point's (28).
    fn interpolated(&self, side: usize) -> Vec<Interpolated> {
        let acts = |j: &usize| !self.watched[side].contains(j);
        // The node that a row which acts on this side belongs to there.
        let node = |j: usize| match side == 0 || j >= self.n_own {
            true => self.rows[j].node,
            false => self.rows[j].terms[side][0].0,
        };
        let rows: HashMap<u32, usize> = (0..self.rows.len()).filter(acts).map(|j| (node(j), j)).collect();
        let of_row = |&j: &usize| {
            let row = &self.rows[j];
            let terms = row.terms[side].iter();
            let terms = terms.filter_map(|(node, v)| Some((*rows.get(node)?, dot(v, &row.normal).abs())));
            Interpolated { row: j, terms: terms.collect() }
        };
        self.watched[side].iter().map(of_row).collect()
    }
}

/// Gives rows the mean of both surfaces' normals: where these are curved, what the pressure has along the mean of them would be
/// taken for friction, and what closes the gap for slip.
fn between_normals(rows: &mut [Row], own: &Surface, other: &Surface) {
    let search = Search::new(other);
    for row in rows {
        let Some(found) = search.closest(&own.points[row.node as usize], &row.normal) else { continue };
        let mean = sub(&row.normal, &found.normal);
        let size = dot(&mean, &mean).sqrt();
        let (before, normal) = (row.normal, mean.map(|n| n / size));
        for (_, v) in row.terms.iter_mut().flatten() {
            let weight = dot(v, &before);
            *v = normal.map(|n| weight * n);
        }
        row.normal = normal;
    }
}

/// The vectors of a normal row turned by 90 degrees against the clock: those of its tangential row, which add up to zero as well.
pub(super) fn turned<K: Copy>(terms: &[(K, [f64; 3])]) -> Vec<(K, [f64; 3])> {
    terms.iter().map(|&(node, [x, y, z])| (node, [-y, x, z])).collect()
}

/// Of each node of `mortar`: the nodes of `multiplier` on either side of the closest point, and their weights; `None` where
/// nothing lies opposite.
fn opposite(multiplier: &Surface, mortar: &Surface) -> Vec<Option<[(u32, f64); 2]>> {
    let search = Search::new(multiplier);
    let point = |(x, normal): (&[f64; 3], &[f64; 3])| {
        let found = search.closest(x, normal).filter(|found| found.overshoot <= found.slack)?;
        let facet = &multiplier.facets[found.facet];
        // Of lines with two and with three nodes: N_b - N_a = xi.
        let xi = (found.shape[1] - found.shape[0]).clamp(-1.0, 1.0);
        Some(match facet[..] {
            [a, _, m] if xi < 0.0 => [(a, -xi), (m, 1.0 + xi)],
            [_, b, m] => [(m, 1.0 - xi), (b, xi)],
            _ => [(facet[0], 0.5 * (1.0 - xi)), (facet[1], 0.5 * (1.0 + xi))],
        })
    };
    std::iter::zip(&mortar.points, &mortar.normals).map(point).collect()
}

/// Coordinates are rounded, and their interpolation along a surface adds as much again: a geometric gap of this many units
/// of their round-off is none. A stiff pair, whose approach is small, would feel it.
const TOUCHING: f64 = 4.0 * f64::EPSILON;

/// The row with a gap that coordinates cannot tell from none put to none.
fn closed(mut row: Row, gap: &Gap, surfaces: [&Surface; 2]) -> Row {
    if let Gap::Geometry { offset } = gap {
        let points = std::iter::zip(&row.terms, surfaces);
        let points = points.flat_map(|(terms, s)| terms.iter().map(|(node, _)| &s.points[*node as usize]));
        let size = worst(points.flat_map(|p| [p[0].abs(), p[1].abs()]));
        if (row.gap - offset).abs() <= TOUCHING * size {
            row.gap = *offset;
        }
    }
    row
}

/// Motion of a rigid side of a pair at factor 1, m.
pub(crate) fn rigid_motion(case: &Case, pair: usize, side: usize) -> Option<[f64; 3]> {
    match case.contacts[pair].surfaces[side].body {
        BodyRef::Rigid(i) => Some(case.rigid[i].motion),
        BodyRef::Deformable(_) => None,
    }
}

/// The normal of the straight rigid surface on the other side of an end's pair, if it is one.
pub(super) fn straight_partner(case: &Case, pair: usize, side: usize) -> Option<[f64; 3]> {
    let BodyRef::Rigid(i) = case.contacts[pair].surfaces[1 - side].body else { return None };
    match &case.rigid[i].shape {
        RigidShape::Plane { normal, .. } => Some(*normal),
        RigidShape::Circle { .. } | RigidShape::Polyline { .. } => None,
    }
}

fn search_distance(
    contact: &ContactCase,
    own: &Surface,
    other: &Surface,
    moduli: [f64; 2],
    floating: bool,
) -> f64 {
    match (contact.search_distance, &contact.gap) {
        (Some(distance), _) => distance,
        (None, Gap::Value(_)) => f64::INFINITY,
        // A force may move a body that only contact holds any distance.
        (None, Gap::Geometry { .. }) if floating => f64::INFINITY,
        (None, Gap::Geometry { .. }) if moduli.iter().any(|m| m.is_infinite()) => SEARCH * own.extent(),
        (None, Gap::Geometry { .. }) => SEARCH * own.extent().min(other.extent()),
    }
}

/// What the driver needs of this rank's ends, and each body's rows over its interface nodes.
pub(crate) struct Shares {
    pub ends: Vec<End>,
    pub rows: Vec<PairRows>,
    /// Per body of this rank: mesh nodes that contact may reach, each once.
    pub interface: Vec<Vec<u32>>,
    /// Per body: its rows, in the order of its ends.
    pub body_rows: Vec<Vec<BodyRow>>,
}

impl Shares {
    /// Deals the rows of the pairs to this rank's bodies. `interface`: the nodes to refer to, if they are fixed already.
    pub fn new(case: &Case, plan: &Plan, pairs: &[Option<Pair>], interface: Option<&[Vec<u32>]>) -> Shares {
        let n_bodies = plan.groups.bodies().len();
        let mut shares = Shares {
            ends: Vec::new(),
            rows: Vec::new(),
            interface: interface.map_or_else(|| vec![Vec::new(); n_bodies], <[_]>::to_vec),
            body_rows: vec![Vec::new(); n_bodies],
        };
        let mut places: Vec<HashMap<u32, usize>> = shares
            .interface
            .iter()
            .map(|nodes| nodes.iter().enumerate().map(|(i, &n)| (n, i)).collect())
            .collect();
        let thickness = case.analysis.thickness();
        for (i, &ContactSide { pair, side, body }) in plan.ends.iter().enumerate() {
            let Some(data) = &pairs[pair] else { continue };
            let place = plan.place(body);
            let is_multiplier = side == data.multiplier;
            let column = usize::from(!is_multiplier);
            let first = shares.body_rows[place].len();
            for row in &data.rows {
                let terms = row.terms[column].iter().map(|&(node, v)| {
                    let node = plan.surfaces[i].nodes[node as usize];
                    let nodes = &mut shares.interface[place];
                    let at = *places[place].entry(node).or_insert_with(|| {
                        nodes.push(node);
                        nodes.len() - 1
                    });
                    (at, v)
                });
                shares.body_rows[place].push(BodyRow { terms: terms.collect(), tangential: false });
            }
            if data.law.is_frictional() {
                let along = |row: &BodyRow| BodyRow { terms: turned(&row.terms), tangential: true };
                let tangential: Vec<BodyRow> = shares.body_rows[place][first..].iter().map(along).collect();
                shares.body_rows[place].extend(tangential);
            }
            let rows = first..shares.body_rows[place].len();
            let watched = data.watched[column].clone();
            shares.ends.push(End { pair, multiplier: is_multiplier, body: place, rows, watched });
            shares.rows.push(match is_multiplier {
                true => PairRows {
                    gap: data.on_all_rows(data.rows.iter().map(|row| data.gap_of(row)), |_| 0.0),
                    law: data.law,
                    coefficients: Vec::new(),
                    area: data.on_all_rows(data.rows.iter().map(|row| row.area), |area| area),
                    along: data.along.clone(),
                    stiffness: thickness / (1.0 / data.moduli[0] + 1.0 / data.moduli[1]),
                    compliance_ratio: data.moduli[1] / data.moduli[0],
                    mortar_is_coarse: data.mortar_nodes < data.rows.len(),
                    in_chain: case.contacts[pair].surfaces.iter().any(|s| case.pairs_of(s.body) > 1),
                    side: data.multiplier,
                    held: data.held.clone(),
                    interpolated: [0, 1].map(|side| data.interpolated(side)),
                },
                false => PairRows::default(),
            });
        }
        shares
    }
}

/// Both surfaces of each end's pair, own side first. Collective on the roots.
pub(crate) fn both_surfaces(
    case: &Case,
    plan: &Plan,
    exchange: &Exchange,
    own: &[Surface],
) -> Vec<[Surface; 2]> {
    let packed: Vec<Vec<f64>> = own.iter().map(Surface::pack).collect();
    let received = exchange.swap(&packed);
    std::iter::zip(own, received)
        .zip(&plan.ends)
        .map(|((own, received), &ContactSide { pair, side, .. })| {
            let other = match plan.rigid_surface(case, pair, 1 - side) {
                Some(rigid) => rigid,
                None => Surface::unpack(&received),
            };
            [own.clone(), other]
        })
        .collect()
}

/// Per end: which nodes of both surfaces a support holds. Collective on the roots.
pub(crate) fn held_nodes(case: &Case, plan: &Plan, exchange: &Exchange) -> Result<Vec<[Vec<Held>; 2]>> {
    let mut own = Vec::new();
    for (surface, &ContactSide { body, .. }) in std::iter::zip(&plan.surfaces, &plan.ends) {
        let mesh = &plan.meshes[plan.place(body)];
        let constraints = Constraints::new(&case.bodies[body], mesh)?;
        let is_held = |(node, normal): (&u32, &[f64; 3])| -> Held {
            let Some(support) = constraints.0.get(node) else { return [false; 2] };
            let [x, y, z] = *normal;
            [[x, y, z], [-y, x, z]].map(|direction| {
                let free = support.free_part(&direction, mesh.dim);
                dot(&free, &free).sqrt() < HELD_DIRECTION
            })
        };
        own.push(std::iter::zip(&surface.nodes, &surface.normals).map(is_held).collect::<Vec<Held>>());
    }
    // Without friction nobody asks for the second.
    let told = if case.has_friction() { 2 } else { 1 };
    let flags = |held: &Held| held.map(|h| f64::from(u8::from(h))).into_iter().take(told);
    let out: Vec<Vec<f64>> = own.iter().map(|held| held.iter().flat_map(flags).collect()).collect();
    let received = exchange.swap(&out);
    // Of a rigid surface nothing is received: all its nodes are held.
    let held = |flags: &[f64]| [0, 1].map(|k| flags.get(k).is_some_and(|flag| *flag > 0.5));
    let heard = |other: &[f64]| other.chunks_exact(told).map(held).collect();
    Ok(std::iter::zip(own, received).map(|(own, other)| [own, heard(&other)]).collect())
}
