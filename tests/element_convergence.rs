//! Convergence orders of every element on a smooth manufactured solution.
//!
//! Plane strain, unit square, cells bent by a smooth map: L2 error of the displacement O(h^(p+1)), energy
//! norm O(h^p) with p = 1 for tri3 and quad4, 2 for tri6 and quad8.
mod fe;

use fe::*;
use kontakt::element::{ElementKind, Formulation, PointGeometry, SolidElement, load_rule};
use nalgebra::Complex;

const E: f64 = 2.1e11;
const NU: f64 = 0.3;

/// u = 1e-3 (sin(3 x + 1) cos(2 y), cos(2 x) sin(4 y + 1/2)).
struct Exact {
    u: [f64; 2],
    /// du_i/dx_j.
    gradient: [[f64; 2]; 2],
    /// -div sigma.
    body_force: [f64; 3],
}

fn exact(p: &[f64; 3]) -> Exact {
    let [x, y, _] = *p;
    let (s1, c1, s2, c2) = ((3. * x + 1.).sin(), (3. * x + 1.).cos(), (2. * y).sin(), (2. * y).cos());
    let (s3, c3, s4, c4) = ((2. * x).sin(), (2. * x).cos(), (4. * y + 0.5).sin(), (4. * y + 0.5).cos());
    let (u, v) = (1e-3 * s1 * c2, 1e-3 * c3 * s4);
    let (u_xx, u_yy, u_xy) = (-9. * u, -4. * u, -6e-3 * c1 * s2);
    let (v_xx, v_yy, v_xy) = (-4. * v, -16. * v, -8e-3 * s3 * c4);
    let mu = E / (2. * (1. + NU));
    let lambda = E * NU / ((1. + NU) * (1. - 2. * NU));
    // Navier: div sigma = (lambda + mu) grad div u + mu laplace u.
    Exact {
        u: [u, v],
        gradient: [[3e-3 * c1 * c2, -2e-3 * s1 * s2], [-2e-3 * s3 * s4, 4e-3 * c3 * c4]],
        body_force: [
            -(lambda + mu) * (u_xx + v_xy) - mu * (u_xx + u_yy),
            -(lambda + mu) * (u_xy + v_yy) - mu * (v_xx + v_yy),
            0.,
        ],
    }
}

fn strain(g: &[[f64; 2]; 2]) -> [f64; 3] {
    [g[0][0], g[1][1], g[0][1] + g[1][0]]
}

/// Errors in L2 and in the energy norm on n x n cells.
fn errors(element: SolidElement, n: usize) -> [f64; 2] {
    use std::f64::consts::PI;
    let bend = |s: f64, t: f64| 0.06 * (PI * s).sin() * (PI * t).sin();
    let mesh = Mesh::grid(element, n, n, |s, t| [s + bend(s, t), t - bend(s, 2. * t) + 0.5 * bend(s, t)]);
    let law = material(E, NU, PLANE_STRAIN).law(None);
    let mut system = System::new(&mesh, |_| law);
    system.body_load(|x| exact(x).body_force);
    let right = |x: &[f64; 3]| x[0] > 1. - 1e-9;
    system.traction(right, |x, n| {
        let [xx, yy, xy] = law.stress(strain(&exact(x).gradient));
        [xx * n[0] + xy * n[1], xy * n[0] + yy * n[1], 0.]
    });
    let held = |x: &[f64; 3]| x[0].min(x[1]) < 1e-9 || x[1] > 1. - 1e-9;
    let nodes = (0..mesh.nodes.len()).filter(|&node| held(&mesh.nodes[node]));
    let prescribed: Vec<_> =
        nodes.flat_map(|node| [0, 1].map(|i| (2 * node + i, exact(&mesh.nodes[node]).u[i]))).collect();
    let u = system.solve(&prescribed);

    let (mut l2, mut energy) = (0., 0.);
    for cell in &mesh.cells {
        let (x, u) = (mesh.coordinates(cell), mesh.local(cell, &u));
        for point in load_rule(element.kind()) {
            let g = PointGeometry::new(element.kind(), &x, point).unwrap();
            let Exact { u: mut error, gradient: mut gradient_error, .. } = exact(&g.x);
            for (a, u) in u.chunks(2).enumerate() {
                for i in 0..2 {
                    error[i] -= g.n[a] * u[i];
                    gradient_error[i][0] -= g.gradient[a][0] * u[i];
                    gradient_error[i][1] -= g.gradient[a][1] * u[i];
                }
            }
            l2 += g.area * (error[0].powi(2) + error[1].powi(2));
            let e = strain(&gradient_error);
            let s = law.h.map(|row| row[0] * e[0] + row[1] * e[1] + row[2] * e[2]);
            energy += g.area * (e[0] * s[0] + e[1] * s[1] + e[2] * s[2]);
        }
    }
    [l2.sqrt(), energy.sqrt()]
}

#[test]
fn displacement_and_energy_converge_at_the_optimal_order() {
    // The body force of this solution is not for the enhanced tri6, see below.
    let enhanced =
        |e: &SolidElement| e.kind() == ElementKind::Tri6 && e.formulation() == Formulation::Enhanced;
    for element in all_elements().into_iter().filter(|e| !enhanced(e)) {
        let degree = if element.kind().n_nodes() > 4 { 2. } else { 1. };
        let errors = [4, 8, 16, 32].map(|n| errors(element, n));
        for (norm, expected) in [(0, degree + 1.), (1, degree)] {
            let orders: Vec<f64> = errors.windows(2).map(|e| (e[0][norm] / e[1][norm]).log2()).collect();
            println!("{element:?} {}: orders {orders:.3?}", ["L2", "energy"][norm]);
            let last = orders[orders.len() - 1];
            assert!((last - expected).abs() < 0.2, "{element:?}: orders {orders:?}, expected {expected}");
        }
    }
}

/// Displacement and its gradient of a state without body force, by Kolosov's formula with phi = sin z, psi = 0:
/// 2 G (u + i v) = kappa phi - z conj(phi'), kappa = 3 - 4 nu in plane strain.
fn kolosov(p: &[f64; 3], nu: f64) -> ([f64; 2], [[f64; 2]; 2]) {
    let (z, i, kappa) = (Complex::new(p[0], p[1]), Complex::new(0., 1.), 3. - 4. * nu);
    let (phi, first, second) = (z.sin(), z.cos(), -z.sin());
    let scale = 1e-3;
    let w = (phi * kappa - z * first.conj()) * scale;
    let along_x = (first * kappa - first.conj() - z * second.conj()) * scale;
    let along_y = (i * first * kappa - i * first.conj() + i * z * second.conj()) * scale;
    ([w.re, w.im], [[along_x.re, along_y.re], [along_x.im, along_y.im]])
}

/// Errors of the displacement at the nodes and of the stress, in L2 and relative, on n x n cells.
fn nearly_incompressible_errors(element: SolidElement, nu: f64, n: usize) -> [f64; 2] {
    use std::f64::consts::PI;
    let bend = |s: f64, t: f64| 0.06 * (PI * s).sin() * (PI * t).sin();
    let mesh = Mesh::grid(element, n, n, |s, t| [s + bend(s, t), t - bend(s, 2. * t) + 0.5 * bend(s, t)]);
    let law = material(E, nu, PLANE_STRAIN).law(None);
    let mut system = System::new(&mesh, |_| law);
    system.traction(
        |x| x[0] > 1. - 1e-9,
        |x, n| {
            let [xx, yy, xy] = law.stress(strain(&kolosov(x, nu).1));
            [xx * n[0] + xy * n[1], xy * n[0] + yy * n[1], 0.]
        },
    );
    let held = |x: &[f64; 3]| x[0].min(x[1]) < 1e-9 || x[1] > 1. - 1e-9;
    let nodes = (0..mesh.nodes.len()).filter(|&node| held(&mesh.nodes[node]));
    let prescribed: Vec<_> =
        nodes.flat_map(|node| [0, 1].map(|i| (2 * node + i, kolosov(&mesh.nodes[node], nu).0[i]))).collect();
    let u = system.solve(&prescribed);
    let (mut errors, mut norms) = ([0.; 2], [0.; 2]);
    for cell in &mesh.cells {
        let (x, u, rule) = (mesh.coordinates(cell), mesh.local(cell, &u), load_rule(element.kind()));
        let mut strains = vec![];
        element.strains_at(rule, &x, &u, |_, _| law, &mut strains).unwrap();
        for (point, found) in rule.iter().zip(strains) {
            let g = PointGeometry::new(element.kind(), &x, point).unwrap();
            let (exact_u, gradient) = kolosov(&g.x, nu);
            let (stress, exact_stress) = (law.stress(found), law.stress(strain(&gradient)));
            for i in 0..3 {
                errors[1] += g.area * (stress[i] - exact_stress[i]).powi(2);
                norms[1] += g.area * exact_stress[i].powi(2);
            }
            for i in 0..2 {
                let nodal: f64 = (0..u.len() / 2).map(|a| g.n[a] * u[2 * a + i]).sum();
                errors[0] += g.area * (nodal - exact_u[i]).powi(2);
                norms[0] += g.area * exact_u[i].powi(2);
            }
        }
    }
    [0, 1].map(|i| (errors[i] / norms[i]).sqrt())
}

#[test]
fn an_enhanced_tri6_converges_at_the_optimal_order_up_to_incompressibility() {
    let element = SolidElement::new(ElementKind::Tri6, Some(Formulation::Enhanced)).unwrap();
    for nu in [0.3, 0.4999, 0.499999] {
        let errors = [4, 8, 16, 32].map(|n| nearly_incompressible_errors(element, nu, n));
        println!("nu {nu}: errors {errors:?}");
        for (i, least) in [(0, 2.7), (1, 1.8)] {
            let order = (errors[2][i] / errors[3][i]).log2();
            assert!(order > least, "nu {nu}: {errors:?}, order {order}");
        }
        assert!(errors[2][1] < 2e-3, "nu {nu}: stress {errors:?}");
    }
}
