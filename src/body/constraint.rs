//! Supports: which displacement components of which nodes are prescribed, in which frame.
use super::region::find_nodes;
use crate::{
    case::BodyCase,
    contact::vector::{dot, norm},
    error::Result,
    mesh::{Mesh, MeshPart},
};
use std::collections::BTreeMap;

/// A further zero constraint that holds a free motion in the stiffness matrix. It carries no force at equilibrium.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fixing {
    /// Node of the mesh.
    pub node: u32,
    /// Which direction of its frame, not a support's.
    pub component: usize,
    /// That direction.
    pub direction: [f64; 3],
    /// The frame, `None` for that of the node's support.
    pub frame: Option<[[f64; 3]; 3]>,
    /// Coordinates of the node, m.
    pub point: [f64; 3],
}

/// The support of one node.
#[derive(Debug, Clone, PartialEq)]
pub struct NodeConstraint {
    /// Orthonormal directions, one per component; `None`: the coordinate axes.
    pub frame: Option<[[f64; 3]; 3]>,
    /// Prescribed displacement along each direction, m; `None`: free.
    pub prescribed: [Option<f64>; 3],
    /// Directions held at zero only to make the stiffness matrix of a free body regular: a fixing carries no force
    /// once the forces on the body balance, and is no support.
    pub fixed: [bool; 3],
}

impl NodeConstraint {
    /// Nothing held, in the coordinate axes.
    pub fn free() -> Self {
        NodeConstraint { frame: None, prescribed: [None; 3], fixed: [false; 3] }
    }

    /// Displacement along direction `c` if it is no unknown: prescribed by a support, or zero by a fixing.
    pub fn held(&self, c: usize) -> Option<f64> {
        self.prescribed[c].or(self.fixed[c].then_some(0.0))
    }

    /// The supports, at zero displacement, and further `directions` held at zero, linearly dependent ones left out.
    pub fn and_held(&self, directions: &[[f64; 3]], dim: usize) -> NodeConstraint {
        let supports = (0..dim).filter(|&c| self.prescribed[c].is_some()).map(|c| self.direction(c));
        let rows: Vec<Condition> = supports
            .chain(directions.iter().copied())
            .map(|direction| Condition { direction, value: 0.0, path: None })
            .collect();
        node_constraint(&rows, dim)
    }

    /// Part of a vector along directions without a support, as a vector.
    pub fn free_part(&self, v: &[f64; 3], dim: usize) -> [f64; 3] {
        let mut free = [0.0; 3];
        for c in (0..dim).filter(|&c| self.prescribed[c].is_none()) {
            let direction = self.direction(c);
            let along = dot(v, &direction);
            (0..3).for_each(|i| free[i] += along * direction[i]);
        }
        free
    }

    /// Direction of component `c`.
    pub fn direction(&self, c: usize) -> [f64; 3] {
        match &self.frame {
            Some(frame) => frame[c],
            None => std::array::from_fn(|i| f64::from(u8::from(i == c))),
        }
    }
}

/// The supports of a body's nodes, by node number (of the mesh, or of a part).
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Constraints(pub BTreeMap<u32, NodeConstraint>);

/// A prescribed displacement along a direction.
struct Condition {
    direction: [f64; 3],
    value: f64,
    /// Path that it follows.
    path: Option<usize>,
}

/// Two directions are the same if the sine of their angle is below this.
const PARALLEL: f64 = 1e-9;

impl Constraints {
    /// Collects the supports of a body over its whole mesh. Two supports of one node in the same direction must
    /// agree; in different directions they add up, oblique ones too.
    ///
    /// The displacements that follow a path count as zero: [`Constraints::of_path`] has them.
    pub fn new(case: &BodyCase, mesh: &Mesh) -> Result<Constraints> {
        Constraints::of_path(case, mesh, None)
    }

    /// The same with the displacements that follow this path, all others zero: of all factors, the sum over the paths.
    pub fn of_path(case: &BodyCase, mesh: &Mesh, path: Option<usize>) -> Result<Constraints> {
        let mut rows: BTreeMap<u32, Vec<Condition>> = BTreeMap::new();
        for support in &case.supports {
            let (sin, cos) = support.angle.sin_cos();
            let axes = [[cos, sin, 0.0], [-sin, cos, 0.0], [0.0, 0.0, 1.0]];
            for node in find_nodes(mesh, &case.name, &support.region, &support.origin)? {
                let x = &mesh.points[node as usize];
                for (direction, scalar) in std::iter::zip(axes, &support.displacement).take(mesh.dim) {
                    let Some(scalar) = scalar else { continue };
                    let value = scalar.at(x);
                    if !value.is_finite() {
                        let text = format!("the displacement at ({}, {}) is not finite", x[0], x[1]);
                        return Err(support.origin.error(text));
                    }
                    let rows = rows.entry(node).or_default();
                    add_row(rows, Condition { direction, value, path: support.path })
                        .map_err(|text| support.origin.error(format!("{text} at ({}, {})", x[0], x[1])))?;
                }
            }
        }
        let of_node = |(node, mut rows): (u32, Vec<Condition>)| {
            rows.iter_mut().filter(|row| row.path != path).for_each(|row| row.value = 0.0);
            (node, node_constraint(&rows, mesh.dim))
        };
        Ok(Constraints(rows.into_iter().map(of_node).collect()))
    }

    /// The supports of the nodes of a part, under their local numbers.
    pub fn of_part(&self, part: &MeshPart) -> Constraints {
        self.of_nodes(&part.original)
    }

    /// Adds fixings.
    pub fn fix(&mut self, fixings: &[Fixing]) {
        for fixing in fixings {
            let free = || NodeConstraint { frame: fixing.frame, ..NodeConstraint::free() };
            let node = self.0.entry(fixing.node).or_insert_with(free);
            node.fixed[fixing.component] = true;
        }
    }

    /// The constraints of `nodes` under their position in the list.
    pub fn of_nodes(&self, nodes: &[u32]) -> Constraints {
        let nodes = nodes.iter().enumerate();
        Constraints(nodes.filter_map(|(i, node)| Some((i as u32, self.0.get(node)?.clone()))).collect())
    }

    /// Nodal vectors in global axes to the nodes' frames, held components set to zero.
    pub fn to_frames(&self, values: &[f64], dim: usize) -> Vec<f64> {
        let mut out = values.to_vec();
        for (&node, constraint) in self.0.iter().take_while(|(n, _)| (**n as usize + 1) * dim <= values.len())
        {
            let range = node as usize * dim..(node as usize + 1) * dim;
            let mut v = [0.0; 3];
            v[..dim].copy_from_slice(&values[range.clone()]);
            for (c, value) in out[range].iter_mut().enumerate() {
                let unknown = constraint.held(c).is_none();
                *value = if unknown { dot(&v, &constraint.direction(c)) } else { 0.0 };
            }
        }
        out
    }

    /// Nodal vectors in the nodes' frames to global axes.
    pub fn from_frames(&self, values: &[f64], dim: usize) -> Vec<f64> {
        let mut out = values.to_vec();
        for (&node, constraint) in self.0.iter().take_while(|(n, _)| (**n as usize + 1) * dim <= values.len())
        {
            if constraint.frame.is_none() {
                continue;
            }
            let range = node as usize * dim..(node as usize + 1) * dim;
            let local = values[range.clone()].to_vec();
            for (i, value) in out[range].iter_mut().enumerate() {
                *value = (0..dim).map(|c| constraint.direction(c)[i] * local[c]).sum();
            }
        }
        out
    }
}

/// Adds a row unless it repeats another; an error if it contradicts one.
fn add_row(rows: &mut Vec<Condition>, row: Condition) -> std::result::Result<(), String> {
    for known in rows.iter() {
        let cos = dot(&known.direction, &row.direction);
        if 1.0 - cos.abs() < PARALLEL * PARALLEL + f64::EPSILON {
            let value = row.value * cos.signum();
            let scale = known.value.abs().max(value.abs());
            let same_path = known.path == row.path || scale == 0.0;
            if same_path && (known.value - value).abs() <= 1e-12 * scale {
                return Ok(());
            }
            if !same_path {
                return Err(
                    "two supports prescribe displacements in the same direction that follow different paths"
                        .into(),
                );
            }
            return Err(format!(
                "two supports prescribe {} m and {} m in the same direction",
                known.value, value
            ));
        }
    }
    rows.push(row);
    Ok(())
}

/// Orthonormal frame whose first directions span the rows, and the values along them.
fn node_constraint(rows: &[Condition], dim: usize) -> NodeConstraint {
    let fixed = [false; 3];
    let axis = |d: &[f64; 3]| (0..dim).find(|&c| d[c].abs() == 1.0);
    if let Some(axes) = rows.iter().map(|r| axis(&r.direction)).collect::<Option<Vec<_>>>() {
        let mut prescribed = [None; 3];
        for (c, row) in std::iter::zip(axes, rows) {
            prescribed[c] = Some(row.value * row.direction[c]);
        }
        return NodeConstraint { frame: None, prescribed, fixed };
    }
    // Gram-Schmidt on the rows, values carried along; then the axes fill the rest.
    let mut basis: Vec<([f64; 3], Option<f64>)> = Vec::new();
    let axes = (0..dim).map(|c| (std::array::from_fn(|i| f64::from(u8::from(i == c))), None));
    for (mut d, mut value) in rows.iter().map(|r| (r.direction, Some(r.value))).chain(axes) {
        for (b, known) in &basis {
            let along = dot(&d, b);
            (0..3).for_each(|i| d[i] -= along * b[i]);
            value = value.map(|v| v - along * known.unwrap_or(0.0));
        }
        let length = norm(&d);
        if length > 1e-6 && basis.len() < dim {
            basis.push((d.map(|c| c / length), value.map(|v| v / length)));
        }
    }
    let mut frame = [[0.0; 3]; 3];
    let mut prescribed = [None; 3];
    for (c, (direction, value)) in basis.into_iter().enumerate() {
        (frame[c], prescribed[c]) = (direction, value);
    }
    NodeConstraint { frame: Some(frame), prescribed, fixed }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(angle: f64, value: f64) -> Condition {
        Condition { direction: [angle.cos(), angle.sin(), 0.0], value, path: None }
    }

    #[test]
    fn oblique_rows_meet_in_one_point() {
        let (rows, u) = ([row(0.3, 0.0), row(1.2, 0.0)], [2e-3, -1e-3, 0.0]);
        let rows = rows.map(|r| Condition { value: dot(&r.direction, &u), ..r });
        let c = node_constraint(&rows, 2);
        for (i, u) in u.iter().enumerate().take(2) {
            let back: f64 = (0..2).map(|k| c.direction(k)[i] * c.prescribed[k].unwrap()).sum();
            assert!((back - u).abs() < 1e-15);
        }
    }

    #[test]
    fn one_inclined_row_leaves_the_other_direction_free() {
        let c = node_constraint(&[row(0.3, 1e-3)], 2);
        assert_eq!(c.prescribed, [Some(1e-3), None, None]);
        let free = c.free_part(&[1.0, 0.0, 0.0], 2);
        assert!(dot(&free, &row(0.3, 0.0).direction).abs() < 1e-15 && norm(&free) > 0.2);
    }

    #[test]
    fn contradiction_is_refused_and_repetition_is_not() {
        let mut rows = vec![row(0.3, 1e-3)];
        assert!(add_row(&mut rows, row(0.3, 1e-3)).is_ok());
        assert!(add_row(&mut rows, row(0.3 + std::f64::consts::PI, -1e-3)).is_ok());
        assert_eq!(rows.len(), 1);
        assert!(add_row(&mut rows, row(0.3, 2e-3)).is_err());
    }

    #[test]
    fn supports_of_different_paths_meet_in_different_directions_only() {
        let on = |path, row| Condition { path: Some(path), ..row };
        let mut rows = vec![on(0, row(0.3, 1e-3))];
        assert!(add_row(&mut rows, on(0, row(0.3, 1e-3))).is_ok());
        let error = add_row(&mut rows, on(1, row(0.3, 1e-3))).unwrap_err();
        assert!(error.contains("follow different paths"), "{error}");
        assert!(add_row(&mut rows, row(0.3, 1e-3)).is_err());
        assert!(add_row(&mut rows, on(1, row(1.2, 1e-3))).is_ok());
        // What is held at zero is so at any factor.
        let mut rows = vec![on(0, row(0.3, 0.0))];
        assert!(add_row(&mut rows, on(1, row(0.3, 0.0))).is_ok() && rows.len() == 1);
    }
}
