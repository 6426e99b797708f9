//! Rigid motions that the supports leave to a body, or to a piece of its mesh.
use super::Constraints;
use crate::mesh::{Mesh, components};
use nalgebra::{Matrix3, SymmetricEigen, Vector3};

/// An eigenvalue of the support matrix below this, relative to the largest, is a free motion.
const FREE: f64 = 1e-12;

/// Names of the rigid motions the supports do not restrain: "translation x", "rotation about (0.1, 0.2)", ...
///
/// Per connected piece of the mesh, the support rows r = (d, d x (x - c) / L) act on the motions (t_x, t_y, L theta);
/// the null space of sum r r' is free.
pub fn free_motions(mesh: &Mesh, constraints: &Constraints) -> Vec<String> {
    let (component, count) = components(mesh);
    let mut names = Vec::new();
    for piece in 0..count {
        let nodes = || (0..mesh.points.len()).filter(|&i| component[i] as usize == piece);
        let n = nodes().count() as f64;
        let center =
            nodes().fold([0.0; 2], |c, i| [c[0] + mesh.points[i][0] / n, c[1] + mesh.points[i][1] / n]);
        let arm = |i: usize| [mesh.points[i][0] - center[0], mesh.points[i][1] - center[1]];
        let length = nodes().map(|i| arm(i)[0].hypot(arm(i)[1])).fold(f64::MIN_POSITIVE, f64::max);
        let mut gram = Matrix3::zeros();
        for i in nodes() {
            let Some(constraint) = constraints.0.get(&(i as u32)) else { continue };
            for c in (0..mesh.dim).filter(|&c| constraint.prescribed[c].is_some()) {
                let d = constraint.direction(c);
                let row = Vector3::new(d[0], d[1], (arm(i)[0] * d[1] - arm(i)[1] * d[0]) / length);
                gram += row * row.transpose();
            }
        }
        let eigen = SymmetricEigen::new(gram);
        let largest = eigen.eigenvalues.max();
        let free: Vec<Vector3<f64>> = (0..3)
            .filter(|&k| eigen.eigenvalues[k] <= FREE * largest)
            .map(|k| eigen.eigenvectors.column(k).into_owned())
            .collect();
        let of_piece = if count > 1 {
            format!(" of the piece around ({:.4e}, {:.4e})", center[0], center[1])
        } else {
            String::new()
        };
        names.extend(describe(free, center, length).into_iter().map(|name| name + &of_piece));
    }
    names
}

/// Names a basis of free motions, translations first.
fn describe(mut free: Vec<Vector3<f64>>, center: [f64; 2], length: f64) -> Vec<String> {
    if free.len() == 3 {
        return ["translation x", "translation y", "rotation"].map(String::from).to_vec();
    }
    // With two free motions one combination has no rotation.
    if let [a, b] = &free[..] {
        let (translation, rotation) = (a * b.z - b * a.z, a * a.z + b * b.z);
        let scale = translation.norm();
        free = if scale > 1e-9 { vec![translation / scale, rotation] } else { vec![*a, *b] };
    }
    free.iter()
        .map(|m| {
            let size = m.norm().max(f64::MIN_POSITIVE);
            let (x, y, theta) = (m.x / size, m.y / size, m.z / size / length);
            if (theta * length).abs() > 1e-6 {
                // u = t + theta e_z x (x - c) vanishes here.
                let at = [center[0] - y / theta, center[1] + x / theta];
                let tidy = |v: f64| if v.abs() < 1e-9 * length { 0.0 } else { v };
                return format!("rotation about ({:.4}, {:.4})", tidy(at[0]), tidy(at[1]));
            }
            match (x.abs() > 1e-6, y.abs() > 1e-6) {
                (true, false) => "translation x".into(),
                (false, true) => "translation y".into(),
                _ => format!("translation along ({x:.4}, {y:.4})"),
            }
        })
        .collect()
}
