//! What bodies have yielded, as fields and in numbers.
use crate::{
    body::{Balance, Body, Fields, PlasticFields},
    case::Case,
    output::{Field, Piece},
    parallel,
    record::{BodyPlasticity, PlasticitySummary},
    scene::Plan,
    step::Found,
    vector::{larger, ratio},
};
use std::iter::repeat_n;

/// Numbers of a body that are the same on all ranks.
const TOLD: usize = 6;

/// Adds plastic strain, equivalent plastic strain, and of cells the plastic work and the share of the points that yield, to this
/// rank's piece: nought in bodies that cannot yield.
pub(super) fn add_plastic(piece: &mut Piece, bodies: &[Body], recovered: &[Fields]) {
    let field = |name: &str, unit: &'static str, components: usize| Field {
        name: name.into(),
        unit,
        components,
        values: Vec::new(),
    };
    let mut points = [field("plastic_strain", "-", 6), field("equivalent_plastic_strain", "-", 1)];
    let mut cells = [
        field("plastic_strain", "-", 6),
        field("equivalent_plastic_strain", "-", 1),
        field("plastic_work", "J/m3", 1),
        field("yielding", "-", 1),
    ];
    for (body, fields) in std::iter::zip(bodies, recovered) {
        let Some(plastic) = &fields.plastic else {
            points.iter_mut().for_each(|f| f.values.extend(repeat_n(0.0, f.components * body.part.n_local)));
            cells
                .iter_mut()
                .for_each(|f| f.values.extend(repeat_n(0.0, f.components * body.part.n_own_cells)));
            continue;
        };
        points[0].values.extend(plastic.strain.as_flattened());
        points[1].values.extend(&plastic.equivalent);
        cells[0].values.extend(plastic.cell_strain.as_flattened());
        cells[1].values.extend(&plastic.cell_equivalent);
        cells[2].values.extend(&plastic.cell_work);
        cells[3].values.extend(&plastic.cell_yields);
    }
    piece.point_fields.extend(points);
    piece.cell_fields.extend(cells);
}

/// `balances`: of this rank's bodies, the same on all ranks of the group. Collective.
pub(super) fn summarise(
    case: &Case,
    plan: &Plan,
    bodies: &[Body],
    (recovered, balances): (&[Fields], &[Balance]),
    found: &Found,
) -> PlasticitySummary {
    let groups = &plan.groups;
    let n = case.bodies.len();
    let mut told = vec![[0.0; TOLD]; n];
    let of_bodies = bodies.iter().zip(recovered).zip(balances).zip(groups.bodies());
    for (((body, fields), balance), &index) in of_bodies {
        let Some(plastic) = &fields.plastic else { continue };
        let PlasticFields { volume, largest, cell_yields, .. } = plastic;
        let yields = cell_yields.iter().filter(|share| **share > 0.0).count();
        let own = [volume[0], volume[1], yields as f64, cell_yields.len() as f64];
        let sums = parallel::sum(&groups.group, &own);
        let largest = parallel::max(&groups.group, &[*largest])[0];
        // The same on all ranks of the group.
        if groups.is_root() {
            told[index] =
                [ratio(sums[0], sums[1]), largest, balance.plastic, sums[2], sums[3], body.zone_fraction()];
        }
    }
    let told = parallel::sum(&groups.world, told.as_flattened());
    let mut summary = PlasticitySummary {
        iterations: parallel::from_first(&groups.world, found.iterations as f64) as u64,
        residuals: found.residuals.clone(),
        ..PlasticitySummary::default()
    };
    let own = bodies.iter().map(|body| body.cost().factorisations as f64).sum::<f64>();
    let factorisations = if groups.is_root() { own } else { 0.0 };
    summary.factorisations = parallel::sum(&groups.world, &[factorisations])[0] as u64;
    let mut cells = [0.0; 2];
    for (body, told) in std::iter::zip(&case.bodies, told.as_chunks::<TOLD>().0) {
        let &[plastic_volume, max_plastic_strain, work, yields, all, zone_fraction] = told;
        cells[0] += yields;
        cells[1] += all;
        summary.max_plastic_strain = larger(summary.max_plastic_strain, max_plastic_strain);
        if body.yields() {
            summary.bodies.push(BodyPlasticity {
                name: body.name.clone(),
                plastic_volume,
                max_plastic_strain,
                work,
                plastic_fraction: ratio(yields, all),
                zone_fraction,
            });
        }
    }
    summary.plastic_fraction = ratio(cells[0], cells[1]);
    summary
}
