//! Rigid motions that the supports leave to a body, or to a piece of its mesh, and what holds them meanwhile.
use super::{Constraints, Fixing, NodeConstraint};
use crate::tolerances::FREE_OF_SUPPORTS;
use crate::vector::{in_figures, larger};
use crate::{
    contact::vector::dot,
    mesh::{Mesh, components},
};
use nalgebra::{Matrix3, SymmetricEigen, Vector3};

/// A fixing on a node to avoid is chosen only if the others reach less than this share of its leverage (squared).
const AVOID: f64 = 1e-3;

/// A rigid motion u = t + theta e_z x (x - c) of one piece of a mesh.
///
/// (t, theta L) is a unit vector, L being the largest distance of the piece's nodes from c, their centroid: the same
/// motion in every frame and unit.
#[derive(Debug, Clone, PartialEq)]
pub struct RigidMode {
    /// "translation x", "rotation about (0.1, 0.2)", ..., with "of the piece around ..." if there are several.
    pub name: String,
    /// Connected component of the mesh.
    pub piece: u32,
    /// t.
    pub translation: [f64; 3],
    /// theta, 1/m.
    pub rotation: f64,
    /// c, m.
    pub center: [f64; 3],
}

impl RigidMode {
    /// Displacement at a point of the piece.
    pub fn at(&self, x: &[f64; 3]) -> [f64; 3] {
        let [t, c] = [&self.translation, &self.center];
        [t[0] - self.rotation * (x[1] - c[1]), t[1] + self.rotation * (x[0] - c[0]), 0.0]
    }
}

/// The free rigid motions of a body.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct FreeModes {
    /// Piece by piece, translations first.
    pub modes: Vec<RigidMode>,
    /// Piece of each node of the mesh; empty if there is no mode.
    pub piece: Vec<u32>,
}

impl FreeModes {
    /// The null space of the supports.
    ///
    /// Per connected piece of the mesh, the support rows r = (d, d x (x - c) / L) act on the motions
    /// (t_x, t_y, L theta); the null space of sum r r' is free. Fixings are no supports.
    pub fn new(mesh: &Mesh, constraints: &Constraints) -> FreeModes {
        let (piece, count) = components(mesh);
        let mut modes = Vec::new();
        for p in 0..count {
            let nodes = || (0..mesh.points.len()).filter(|&i| piece[i] as usize == p);
            let n = nodes().count() as f64;
            let center =
                nodes().fold([0.0; 2], |c, i| [c[0] + mesh.points[i][0] / n, c[1] + mesh.points[i][1] / n]);
            let arm = |i: usize| [mesh.points[i][0] - center[0], mesh.points[i][1] - center[1]];
            let length = nodes().map(|i| arm(i)[0].hypot(arm(i)[1])).fold(f64::MIN_POSITIVE, larger);
            let mut gram = Matrix3::zeros();
            for (&node, constraint) in
                constraints.0.iter().filter(|(node, _)| piece[**node as usize] == p as u32)
            {
                let arm = arm(node as usize);
                for c in (0..mesh.dim).filter(|&c| constraint.prescribed[c].is_some()) {
                    let d = constraint.direction(c);
                    let row = Vector3::new(d[0], d[1], (arm[0] * d[1] - arm[1] * d[0]) / length);
                    gram += row * row.transpose();
                }
            }
            let of_piece = if count > 1 {
                format!(" of the piece around ({}, {})", in_figures(center[0]), in_figures(center[1]))
            } else {
                String::new()
            };
            modes.extend(null_space(&gram).into_iter().map(|m| RigidMode {
                name: describe(&m, center, length) + &of_piece,
                piece: p as u32,
                translation: [m.x, m.y, 0.0],
                rotation: m.z / length,
                center: [center[0], center[1], 0.0],
            }));
        }
        let piece = if modes.is_empty() { Vec::new() } else { piece };
        FreeModes { modes, piece }
    }

    /// Displacement of a node of the mesh at `x` in mode `k`.
    pub fn at(&self, k: usize, node: u32, x: &[f64; 3]) -> [f64; 3] {
        let mode = &self.modes[k];
        if self.piece[node as usize] == mode.piece { mode.at(x) } else { [0.0; 3] }
    }

    /// A statically determinate set of further zero constraints that holds the modes, one per mode, away from the nodes to `avoid` where that is not much worse. Every rank finds the same.
    ///
    /// Greedy: the node and direction that moves most in what is still free comes next (pivoted Gram-Schmidt). Nodes
    /// without support are held away from the centre or around it: the same fixings in every frame.
    pub fn fixings(&self, mesh: &Mesh, constraints: &Constraints, avoid: &[u32]) -> Vec<Fixing> {
        let mut avoided = vec![false; mesh.points.len()];
        avoid.iter().for_each(|&node| avoided[node as usize] = true);
        // What holds a slave would hold its masters.
        let mut slave = vec![false; mesh.points.len()];
        mesh.slaves().iter().for_each(|s| slave[s.node as usize] = true);
        let mut fixings = Vec::new();
        let mut start = 0;
        while start < self.modes.len() {
            let piece = self.modes[start].piece;
            let of_piece = self.modes[start..].iter().take_while(|m| m.piece == piece).count();
            let modes = &self.modes[start..start + of_piece];
            start += of_piece;
            let mut candidates = Vec::new();
            for (i, x) in
                mesh.points.iter().enumerate().filter(|(i, _)| self.piece[*i] == piece && !slave[*i])
            {
                let own = constraints.0.get(&(i as u32));
                let frame = if own.is_none() { polar(x, &modes[0].center) } else { None };
                let constraint = &own.cloned().unwrap_or(NodeConstraint { frame, ..NodeConstraint::free() });
                for c in (0..mesh.dim).filter(|&c| constraint.prescribed[c].is_none()) {
                    let d = constraint.direction(c);
                    let fixing = Fixing { node: i as u32, component: c, direction: d, frame, point: *x };
                    candidates.push((fixing, row(modes.iter().map(|mode| dot(&mode.at(x), &d)))));
                }
            }
            for _ in modes {
                let best = |among: &dyn Fn(u32) -> bool| {
                    let mut best: Option<(usize, f64)> = None;
                    for (k, (fixing, row)) in candidates.iter().enumerate() {
                        let size = dot(row, row);
                        // Ties go to the first, whatever the round-off.
                        if among(fixing.node) && best.is_none_or(|(_, most)| size > most * (1.0 + 1e-9)) {
                            best = Some((k, size));
                        }
                    }
                    best
                };
                let Some(any) = best(&|_| true) else { break };
                let away = best(&|node| !avoided[node as usize]).filter(|(_, size)| *size > AVOID * any.1);
                let (fixing, pivot) = candidates.swap_remove(away.unwrap_or(any).0);
                let pivot = pivot.map(|v| v / dot(&pivot, &pivot).sqrt());
                for (_, row) in &mut candidates {
                    let along = dot(row, &pivot);
                    (0..3).for_each(|i| row[i] -= along * pivot[i]);
                }
                fixings.push(fixing);
            }
        }
        fixings
    }
}

/// The directions away from the centre and around it, which turn with the body; the axes at the centre.
fn polar(x: &[f64; 3], center: &[f64; 3]) -> Option<[[f64; 3]; 3]> {
    let arm = [x[0] - center[0], x[1] - center[1]];
    let length = arm[0].hypot(arm[1]);
    let [cos, sin] = arm.map(|a| a / length);
    (cos.is_finite() && sin.is_finite()).then_some([[cos, sin, 0.0], [-sin, cos, 0.0], [0.0, 0.0, 1.0]])
}

/// Values of up to three modes.
fn row(values: impl Iterator<Item = f64>) -> [f64; 3] {
    let mut row = [0.0; 3];
    values.zip(&mut row).for_each(|(v, r)| *r = v);
    row
}

/// Names of the rigid motions the supports do not restrain.
pub fn free_motions(mesh: &Mesh, constraints: &Constraints) -> Vec<String> {
    FreeModes::new(mesh, constraints).modes.into_iter().map(|mode| mode.name).collect()
}

/// Orthonormal motions (t_x, t_y, L theta) that the supports do not see, translations first.
fn null_space(gram: &Matrix3<f64>) -> Vec<Vector3<f64>> {
    let eigen = SymmetricEigen::new(*gram);
    let largest = eigen.eigenvalues.max();
    let mut free: Vec<Vector3<f64>> = (0..3)
        .filter(|&k| eigen.eigenvalues[k] <= FREE_OF_SUPPORTS * largest)
        .map(|k| eigen.eigenvectors.column(k).into_owned())
        .collect();
    match &free[..] {
        [_, _, _] => free = vec![Vector3::x(), Vector3::y(), Vector3::z()],
        // With two free motions one combination has no rotation.
        [a, b] => {
            let (translation, rotation) = (a * b.z - b * a.z, a * a.z + b * b.z);
            let scale = translation.norm();
            if scale > 1e-9 {
                free = vec![translation / scale, rotation / rotation.norm()];
            }
        }
        _ => {}
    }
    // The sign is nobody's choice: the largest component is positive.
    free.iter().map(|m| if m[m.iamax()] < 0.0 { -m } else { *m }).collect()
}

pub(super) fn describe(m: &Vector3<f64>, center: [f64; 2], length: f64) -> String {
    let (x, y, theta) = (m.x, m.y, m.z / length);
    if m.z.abs() > 1e-6 {
        // u = t + theta e_z x (x - c) vanishes here.
        let at = [center[0] - y / theta, center[1] + x / theta];
        let tidy = |v: f64| in_figures(if v.abs() < 1e-9 * length { 0.0 } else { v });
        return format!("rotation about ({}, {})", tidy(at[0]), tidy(at[1]));
    }
    match (x.abs() > 1e-6, y.abs() > 1e-6) {
        (true, false) => "translation x".into(),
        (false, true) => "translation y".into(),
        _ => format!("translation along ({x:.4}, {y:.4})"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        case::{Grading, Shape},
        element::ElementKind,
        mesh::generate,
    };
    use nalgebra::DMatrix;

    fn block(shift: [f64; 2], angle: f64) -> Mesh {
        let x = Grading { at: vec![0.0, 1.0, 2.0, 3.0] };
        let y = Grading { at: vec![0.0, 0.5, 1.0] };
        generate(&Shape::Rectangle { x, y }, ElementKind::Quad8, angle, shift).unwrap()
    }

    fn support(node: u32, prescribed: [Option<f64>; 3]) -> (u32, NodeConstraint) {
        (node, NodeConstraint { prescribed, ..NodeConstraint::free() })
    }

    #[test]
    fn names_say_what_is_free() {
        let mesh = block([0.0; 2], 0.0);
        let names =
            |rows: Vec<(u32, NodeConstraint)>| free_motions(&mesh, &Constraints(rows.into_iter().collect()));
        let at = |x: f64, y: f64| mesh.points.iter().position(|p| p[0] == x && p[1] == y).unwrap() as u32;
        assert_eq!(names(vec![]), ["translation x", "translation y", "rotation about (1.5, 0.5)"]);
        let pin = support(at(3.0, 0.0), [Some(0.0), Some(1e-3), None]);
        assert_eq!(names(vec![pin.clone()]), ["rotation about (3, 0)"]);
        let guided = [at(0.0, 0.0), at(0.0, 1.0)].map(|n| support(n, [Some(0.0), None, None]));
        assert_eq!(names(guided.to_vec()), ["translation y"]);
        assert!(names(vec![pin, guided[1].clone()]).is_empty());
        let one = names(vec![guided[0].clone()]);
        assert_eq!(one[0], "translation y");
        assert!(one[1].starts_with("rotation about (") && one.len() == 2);
        let mut two = mesh.clone();
        two.append(&block([10.0, 0.0], 0.0));
        let names = free_motions(&two, &Constraints::default());
        assert_eq!(names.len(), 6);
        assert_eq!(names[3], "translation x of the piece around (11.5, 0.5)");
    }

    #[test]
    fn modes_turn_with_the_frame() {
        let constraints = Constraints::default();
        let (plain, turned) = (block([0.0; 2], 0.0), block([7.0, -3.0], 0.4));
        let modes = [&plain, &turned].map(|mesh| FreeModes::new(mesh, &constraints));
        let (s, c) = 0.4_f64.sin_cos();
        for (i, (x, y)) in std::iter::zip(&plain.points, &turned.points).enumerate() {
            let (a, b) = (modes[0].at(2, i as u32, x), modes[1].at(2, i as u32, y));
            assert!((c * a[0] - s * a[1] - b[0]).abs() + (s * a[0] + c * a[1] - b[1]).abs() < 1e-14);
        }
    }

    #[test]
    fn fixings_hold_what_is_free_and_nothing_else() {
        let mut mesh = block([0.0; 2], 0.3);
        mesh.append(&block([10.0, 0.0], 0.0));
        let (cos, sin) = (0.8, 0.6);
        let inclined = NodeConstraint {
            frame: Some([[cos, sin, 0.0], [-sin, cos, 0.0], [0.0, 0.0, 1.0]]),
            prescribed: [Some(0.0), None, None],
            fixed: [false; 3],
        };
        for supports in [vec![], vec![(4, inclined)], vec![support(2, [Some(0.0), Some(0.0), None])]] {
            let mut constraints = Constraints(supports.into_iter().collect());
            let free = FreeModes::new(&mesh, &constraints);
            let avoid: Vec<u32> = (0..20).collect();
            let fixings = free.fixings(&mesh, &constraints, &avoid);
            assert_eq!(fixings.len(), free.modes.len());
            assert!(fixings.iter().all(|fixing| fixing.node >= 20));
            constraints.fix(&fixings);
            assert_eq!(FreeModes::new(&mesh, &constraints), free, "a fixing is no support");
            let n = fixings.len();
            let held = DMatrix::from_fn(n, n, |i, k| {
                let Fixing { node, direction, point, .. } = &fixings[i];
                dot(&free.at(k, *node, point), direction)
            });
            assert!(held.singular_values().min() > 0.2, "{}", held.singular_values());
        }
    }
}
