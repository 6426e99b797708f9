//! Fields of the result file and values at probes.
use crate::scene::Plan;
use crate::{
    body::{Body, Fields},
    case::Case,
    error::Result,
    estimate::BodyError,
    material::von_mises,
    mesh::{self, Locator},
    output::{Field, Piece},
    parallel::{self, agree},
    record,
};
use mpi::topology::SimpleCommunicator;

pub(super) fn start_fields(piece: &mut Piece, heated: bool) {
    let field =
        |name: &str, unit, components| Field { name: name.into(), unit, components, values: Vec::new() };
    piece.point_fields = vec![
        field("displacement", "m", 3),
        field("stress", "Pa", 6),
        field("strain", "-", 6),
        field("von_mises", "Pa", 1),
    ];
    if heated {
        piece.point_fields.push(field("temperature", "K", 1));
    }
    piece.cell_fields = vec![
        field("stress", "Pa", 6),
        field("strain", "-", 6),
        field("von_mises", "Pa", 1),
        field("error_density", "J/m3", 1),
    ];
}

/// Adds a body's own cells and local nodes to this rank's piece.
pub(super) fn append(
    piece: &mut Piece,
    body: &Body,
    fields: &Fields,
    error: Option<&BodyError>,
    index: usize,
    heated: bool,
) {
    let first = piece.points.len() as u32;
    piece.points.extend(&body.part.points[..body.part.n_local]);
    for cell in &body.part.cells[..body.part.n_own_cells] {
        let nodes: Vec<u32> = cell.nodes().iter().map(|n| n + first).collect();
        piece.cells.push(mesh::Cell::new(cell.kind, &nodes));
        piece.cell_bodies.push(index as i32);
    }
    let mises = |stress: &[[f64; 6]]| stress.iter().map(|s| von_mises(*s)).collect::<Vec<_>>();
    let points = &mut piece.point_fields;
    points[0].values.extend(fields.displacement.as_flattened());
    points[1].values.extend(fields.stress.as_flattened());
    points[2].values.extend(fields.strain.as_flattened());
    points[3].values.extend(mises(&fields.stress));
    if heated {
        match &fields.temperature {
            Some(t) => points[4].values.extend(t),
            None => points[4].values.extend(std::iter::repeat_n(f64::NAN, body.part.n_local)),
        }
    }
    piece.cell_fields[0].values.extend(fields.cell_stress.as_flattened());
    piece.cell_fields[1].values.extend(fields.cell_strain.as_flattened());
    piece.cell_fields[2].values.extend(mises(&fields.cell_stress));
    let density = &mut piece.cell_fields[3].values;
    match error {
        Some(error) => density.extend(error.cells.iter().map(|cell| cell.energy2 / cell.volume)),
        // Not estimated.
        None => density.extend(std::iter::repeat_n(f64::NAN, body.part.n_own_cells)),
    }
}

/// Values at the probes. Collective.
pub(super) fn probe(
    case: &Case,
    plan: &Plan,
    bodies: &[Body],
    fields: &[Fields],
    world: &SimpleCommunicator,
) -> Result<Vec<record::ProbeSummary>> {
    let mut out = Vec::new();
    for probe in &case.probes {
        // found, displacement, stress, temperature; from the one rank that owns the cell
        let mut values = [0.0; 9];
        let mut missing = Ok(());
        if let Some(i) = plan.groups.bodies().iter().position(|&b| b == probe.body) {
            let mesh = &plan.meshes[i];
            match Locator::new(&mesh.points, &mesh.cells).find(&probe.at) {
                None => {
                    let body = &case.bodies[probe.body].name;
                    missing = Err(probe.origin.error(format!("the point is not in body '{body}'")));
                }
                Some((cell, xi)) => {
                    let part = &bodies[i].part;
                    let own = &part.original_cells[..part.n_own_cells];
                    if let Some(local) = own.iter().position(|&c| c as usize == cell) {
                        values = interpolate(part, &fields[i], local, &xi);
                    }
                }
            }
        }
        agree(world, missing)?;
        let v = parallel::sum(world, &values);
        let heated = case.bodies[probe.body].temperature.is_some();
        out.push(record::ProbeSummary {
            name: probe.name.clone(),
            body: case.bodies[probe.body].name.clone(),
            x: probe.at[..2].to_vec(),
            displacement: v[1..3].to_vec(),
            stress: record::StressSummary { xx: v[4], yy: v[5], zz: v[6], xy: v[7] },
            temperature: heated.then_some(v[8]),
        });
    }
    Ok(out)
}

fn interpolate(part: &mesh::MeshPart, fields: &Fields, cell: usize, xi: &[f64; 3]) -> [f64; 9] {
    let cell = &part.cells[cell];
    let shape = cell.kind.shape(xi);
    let mut v = [0.0; 9];
    v[0] = 1.0;
    for (&node, n) in std::iter::zip(cell.nodes(), shape.n) {
        let node = node as usize;
        (0..3).for_each(|c| v[1 + c] += n * fields.displacement[node][c]);
        (0..4).for_each(|c| v[4 + c] += n * fields.stress[node][c]);
        v[8] += n * fields.temperature.as_ref().map_or(0.0, |t| t[node]);
    }
    v
}
