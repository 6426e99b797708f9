//! Temperatures of a body at its nodes.
use super::mesh_extent;
use crate::{
    case::Temperature,
    error::{Error, Result},
};
use rstar::{RTree, primitives::GeomWithData};

/// Temperature at points, K.
pub(super) fn temperatures(temperature: &Temperature, points: &[[f64; 3]]) -> Result<Vec<f64>> {
    match temperature {
        Temperature::Field(scalar) => points
            .iter()
            .map(|x| {
                let value = scalar.at(x);
                if value.is_finite() {
                    return Ok(value);
                }
                Err(Error::input(format!("the temperature at ({}, {}) is not finite", x[0], x[1])))
            })
            .collect(),
        Temperature::Nodal { values, origin } => {
            let given = values.iter().map(|&(x, value)| GeomWithData::new(x, value)).collect();
            let extent = mesh_extent(points);
            let tree = RTree::bulk_load(given);
            points
                .iter()
                .map(|x| match tree.nearest_neighbor_iter_with_distance_2(x).next() {
                    Some((node, d2)) if d2.sqrt() <= 1e-6 * extent => Ok(node.data),
                    _ => Err(origin.error(format!("no temperature for the node at ({}, {})", x[0], x[1]))),
                })
                .collect()
        }
    }
}
