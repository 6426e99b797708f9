//! Contact pairs in numbers, and their tables along the surface.
use super::checks::SCENE;
use crate::step::{EndFound, Found};
use crate::vector::{larger, ratio};
use crate::{
    case::{Case, ContactCase, Law},
    parallel,
    record::{self, PairSide, PairTables, mean_contraction},
};
use mpi::topology::SimpleCommunicator;

/// Sums over the ends of a pair.
const SUMS: usize = 21;
/// Maxima over the ends of a pair.
const MAXIMA: usize = 9;

/// Summaries and tables of the pairs. Collective.
pub(super) fn pair_results(
    case: &Case,
    found: &Found,
    world: &SimpleCommunicator,
    warnings: &mut Vec<String>,
) -> (Vec<record::PairSummary>, Vec<PairTables>) {
    let names = |contact: &ContactCase| {
        [0, 1]
            .map(|s| format!("{}.{}", case.body_name(contact.surfaces[s].body), contact.surfaces[s].surface))
    };
    let mut tables: Vec<PairTables> = case
        .contacts
        .iter()
        .map(|c| PairTables {
            name: c.name.clone(),
            surfaces: names(c),
            law: c.law,
            varies: c.over_temperature.is_some(),
            sides: [None, None],
        })
        .collect();
    let mut sums = vec![[0.0; SUMS]; case.contacts.len()];
    let mut maxima = vec![[0.0_f64; MAXIMA]; case.contacts.len()];
    for end in &found.ends {
        add(end, &mut sums[end.pair], &mut maxima[end.pair]);
        tables[end.pair].sides[end.side] = Some(end.table.clone());
    }
    let sums = parallel::sum(world, sums.as_flattened());
    let maxima = parallel::max(world, maxima.as_flattened());
    // Of a pair that carries round-off every ratio is one of round-off.
    let round_off = SCENE * maxima.iter().skip(7).step_by(MAXIMA).copied().fold(0.0, larger);
    let pairs = case
        .contacts
        .iter()
        .enumerate()
        .map(|(p, contact)| {
            let (s, m) = (&sums[SUMS * p..][..SUMS], &maxima[MAXIMA * p..][..MAXIMA]);
            let size = |v: &[f64]| v.iter().map(|c| c * c).sum::<f64>().sqrt();
            let together: Vec<f64> = (0..3).map(|c| s[c] + s[3 + c]).collect();
            // The nodes' forces, not the sides' resultants, which vanish on closed surfaces.
            let scale = s[14];
            // A rigid surface has no nodes to take the reaction.
            let both = contact.surfaces.iter().all(|s| s.body.deformable().is_some());
            let force_imbalance = if both { ratio(size(&together), scale) } else { 0.0 };
            if s[10] > 0.0 {
                warnings.push(format!(
                    "contact '{}': the nodes of the two surfaces do not match; the pointwise transfer of nodal forces is \
                     wrong there (force imbalance {force_imbalance:.2e}): use transfer = \"mortar\", or match the meshes",
                    contact.name
                ));
            }
            warnings.extend(unresolved(&contact.name, s[8] as u64, s[9] as u64).filter(|w| !warnings.contains(w)));
            // Of a rigid side A the force is the reaction to side B's.
            let own = contact.surfaces[0].body.deformable().is_some();
            let resultant = |c: usize| if own { s[c] } else { -s[3 + c] };
            let history = found.history.iter().filter_map(|row| row.pairs.get(p));
            record::PairSummary {
                name: contact.name.clone(),
                normal_force: s[6],
                resultant: vec![resultant(0), resultant(1)],
                moment: if own { s[11] } else { -s[12] },
                multiplier_side: if s[13] > 0.0 { PairSide::B } else { PairSide::A },
                max_pressure: m[0],
                error_estimate: None,
                contact_length: s[7],
                max_penetration: m[1],
                force_imbalance,
                complementarity: if contact.law == Law::Tied { 0.0 } else { ratio(m[2], m[0] * m[3]) },
                friction: contact.law.is_frictional().then(|| record::FrictionSummary {
                    law: contact.law.describe(contact.over_temperature.is_some()),
                    force: s[15],
                    dissipated: s[16],
                    stick_length: s[17],
                    slip_length: s[18],
                    sticking: s[19] as u64,
                    slipping: s[20] as u64,
                    max_slip: m[4],
                    beyond_bound: ratio(m[5], larger(m[7], round_off)),
                    wrong_slip: ratio(m[6], larger(m[4], m[8])),
                }),
                contraction: mean_contraction(history.map(|row| row.contraction)),
                active: s[8] as u64,
                open: (s[9] - s[8]) as u64,
                candidates: s[9] as u64,
            }
        })
        .collect();
    (pairs, tables)
}

/// What is said of a pair that too few nodes carry; one all of whose nodes are in contact has its pressure at any number.
fn unresolved(pair: &str, active: u64, candidates: u64) -> Option<String> {
    let few = (1..record::RESOLVED_NODES).contains(&active) && active < candidates;
    few.then(|| {
        format!(
            "contact '{pair}': only {active} node{} in contact: the pressure and the length are those of the mesh, and grow or \
             shrink with it; refine there until at least {} are in contact",
            if active == 1 { " is" } else { "s are" },
            record::RESOLVED_NODES
        )
    })
}

fn add(end: &EndFound, sum: &mut [f64; SUMS], max: &mut [f64; MAXIMA]) {
    for (x, f) in std::iter::zip(&end.table.x, &end.table.force) {
        (0..3).for_each(|c| sum[3 * end.side + c] += f[c]);
        sum[14] += f.iter().map(|c| c * c).sum::<f64>().sqrt();
        sum[11 + end.side] += x[0] * f[1] - x[1] * f[0];
    }
    if end.counts {
        sum[6] += end.normal_force;
        sum[7] += end.length;
        max[0] = end.table.pressure.iter().copied().fold(max[0], larger);
    }
    if end.multiplier {
        sum[13] += end.side as f64;
    }
    sum[8] += end.active as f64;
    sum[9] += end.candidates as f64;
    sum[10] += end.unmatched as f64;
    max[1] = larger(max[1], end.penetration);
    max[2] = larger(max[2], end.complementarity[0]);
    max[3] = larger(max[3], end.complementarity[1]);
    max[8] = larger(max[8], end.approach);
    if let Some(rubbing) = &end.rubbing {
        let [stick, slip] = rubbing.lengths;
        let [sticking, slipping] = rubbing.nodes.map(|n| n as f64);
        let sums = [rubbing.force, rubbing.dissipated, stick, slip, sticking, slipping];
        std::iter::zip(&mut sum[15..], sums).for_each(|(sum, v)| *sum += v);
        let maxima = [rubbing.slip, rubbing.beyond, rubbing.astray, rubbing.scale];
        std::iter::zip(&mut max[4..], maxima).for_each(|(max, v)| *max = larger(*max, v));
    }
}
