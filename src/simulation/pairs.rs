//! Contact pairs in numbers, and their tables along the surface.
use super::{Found, Plan, interface::Contacts};
use crate::{
    case::{Case, ContactCase},
    contact::{Surface, vector::dot},
    output::{self, PairTables, SideTable},
    parallel,
    schwarz::{self, Side},
};
use mpi::topology::SimpleCommunicator;

/// Summaries and tables of the pairs, and whether a node beyond the search distance penetrates. Collective.
pub(super) fn pair_results(
    case: &Case,
    plan: &Plan,
    contacts: &Option<Contacts>,
    found: &Found,
    world: &SimpleCommunicator,
    warnings: &mut Vec<String>,
) -> (Vec<output::PairSummary>, Vec<PairTables>, bool) {
    let names = |contact: &ContactCase| {
        [0, 1]
            .map(|s| format!("{}.{}", case.body_name(contact.surfaces[s].body), contact.surfaces[s].surface))
    };
    let mut tables: Vec<PairTables> = case
        .contacts
        .iter()
        .map(|c| PairTables { name: c.name.clone(), surfaces: names(c), sides: [None, None] })
        .collect();
    // Per pair: sums over the ranks of what each side contributes, and maxima.
    let mut sums = vec![[0.0; 12]; case.contacts.len()];
    let mut maxima = vec![[0.0_f64; 5]; case.contacts.len()];
    if let Some(contacts) = contacts {
        for (i, (side, state)) in std::iter::zip(&contacts.sides, &found.states).enumerate() {
            let surface = &plan.surfaces[i];
            let table = side_table(surface, side, state);
            let sum = &mut sums[side.pair];
            let max = &mut maxima[side.pair];
            let column = usize::from(!side.first);
            for f in &table.force {
                (0..3).for_each(|c| sum[3 * column + c] += f[c]);
            }
            if side.first {
                let moment = |(x, f): (&[f64; 3], &[f64; 3])| x[0] * f[1] - x[1] * f[0];
                sum[11] = std::iter::zip(&table.x, &table.force).map(moment).sum();
                sum[6] += state.force.iter().sum::<f64>();
                sum[7] = contact_length(&table);
            }
            sum[8] += state.active.iter().filter(|a| **a).count() as f64;
            sum[9] += side.nodes.len() as f64;
            let touching = std::iter::zip(&side.nodes, &state.active).filter(|(_, active)| **active);
            let unmatched = touching.filter(|(node, _)| node.conjugate.terms.len() > 1).count();
            sum[10] += unmatched as f64;
            max[0] = table.pressure.iter().copied().fold(max[0], f64::max);
            max[1] = state.gap.iter().map(|g| -g).fold(max[1], f64::max);
            for (k, node) in side.nodes.iter().enumerate() {
                let pressure = state.force[k] / surface.weights[node.node];
                let travel = dot(&node.conjugate.normal, &state.displacement[node.node]).abs();
                max[3] = max[3].max((pressure * state.gap[k]).abs());
                max[4] = max[4].max(state.gap[k].abs()).max(node.conjugate.gap.abs()).max(travel);
            }
            for node in &contacts.beyond[i] {
                let other = Side::vector_at_conjugate(node, &state.other_displacement);
                let approach = crate::contact::vector::sub(&state.displacement[node.node], &other);
                max[2] = max[2].max(dot(&node.conjugate.normal, &approach) - node.conjugate.gap);
            }
            tables[side.pair].sides[column] = Some(table);
        }
    }
    let sums = parallel::sum(world, sums.as_flattened());
    let maxima = parallel::max(world, maxima.as_flattened());
    let threshold = parallel::max(world, &[found.gap_threshold])[0];
    let mut beyond = false;
    let pairs = case
        .contacts
        .iter()
        .enumerate()
        .map(|(p, contact)| {
            let (s, m) = (&sums[12 * p..12 * p + 12], &maxima[5 * p..5 * p + 5]);
            beyond |= m[2] > threshold;
            let size = |v: &[f64]| v.iter().map(|c| c * c).sum::<f64>().sqrt();
            let together: Vec<f64> = (0..3).map(|c| s[c] + s[3 + c]).collect();
            let scale = size(&s[..3]) + size(&s[3..6]);
            let force_imbalance = if scale > 0.0 { size(&together) / scale } else { 0.0 };
            if s[10] > 0.0 {
                warnings.push(format!(
                    "contact '{}': the nodes of the two surfaces do not match; the pointwise transfer of nodal forces is \
                     wrong there (force imbalance {force_imbalance:.2e}): match the meshes at the interface",
                    contact.name
                ));
            }
            output::PairSummary {
                name: contact.name.clone(),
                normal_force: s[6],
                resultant: s[..2].to_vec(),
                moment: s[11],
                multiplier_side: output::PairSide::A,
                max_pressure: m[0],
                contact_length: s[7],
                max_penetration: m[1],
                force_imbalance,
                complementarity: if m[0] * m[4] > 0.0 { m[3] / (m[0] * m[4]) } else { 0.0 },
                contraction: output::mean_contraction(
                    found.history.iter().filter_map(|row| row.pairs.get(p)).map(|pair| pair.contraction),
                ),
                active: s[8] as u64,
                open: (s[9] - s[8]) as u64,
                candidates: s[9] as u64,
            }
        })
        .collect();
    (pairs, tables, beyond)
}

fn side_table(surface: &Surface, side: &Side, state: &schwarz::alternation::SideState) -> SideTable {
    let n = surface.nodes.len();
    let mut table = SideTable {
        s: surface.s.clone(),
        x: surface.points.clone(),
        normal: surface.normals.clone(),
        gap: vec![f64::NAN; n],
        pressure: vec![0.0; n],
        force: vec![[0.0; 3]; n],
        status: vec![0; n],
    };
    for (k, node) in side.nodes.iter().enumerate() {
        let i = node.node;
        table.normal[i] = node.conjugate.normal;
        table.gap[i] = state.gap[k];
        table.pressure[i] = state.force[k] / surface.weights[i];
        table.force[i] = node.conjugate.normal.map(|c| -state.force[k] * c);
        table.status[i] = if state.active[k] { 2 } else { 1 };
    }
    table
}

/// Length in contact, m: between the zeros of the pressure. At a smooth edge p^2 is linear in the distance from the
/// edge, so the zero is extrapolated from the last two nodes in contact; it lies between the last node in contact
/// and the first open one.
fn contact_length(table: &SideTable) -> f64 {
    let (s, p) = (&table.s, &table.pressure);
    let touches = |i: usize| table.status[i] == 2;
    let edge = |inside: usize, next: usize, open: Option<usize>| {
        let Some(open) = open else { return 0.0 };
        let (p0, p1) = (p[inside].powi(2), p[next].powi(2));
        let room = (s[open] - s[inside]).abs();
        let step = (s[inside] - s[next]).abs();
        if p1 > p0 { (step * p0 / (p1 - p0)).min(room) } else { room }
    };
    let mut length = 0.0;
    let mut start = None;
    for i in 0..=s.len() {
        match start {
            None if i < s.len() && touches(i) => start = Some(i),
            Some(first) if i == s.len() || !touches(i) => {
                let last = i - 1;
                length += s[last] - s[first];
                if last > first {
                    length += edge(first, first + 1, first.checked_sub(1));
                    length += edge(last, last - 1, (i < s.len()).then_some(i));
                }
                start = None;
            }
            _ => {}
        }
    }
    length
}
