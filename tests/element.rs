//! Solid elements: rigid modes, rank, patch test, bending, near incompressibility, initial strain.
mod fe;

use fe::*;
use kontakt::case::Formulation;
use kontakt::element::{ElementKind, PointLaw, SolidElement};
use kontakt::vector::larger;
use nalgebra::DMatrix;

fn element(kind: ElementKind, formulation: Formulation) -> SolidElement {
    SolidElement::new(kind, Some(formulation)).unwrap()
}

/// Smooth distortion of the unit square that keeps its boundary straight; interior nodes and mid-sides move.
fn distorted(s: f64, t: f64) -> [f64; 2] {
    let bump = s * (1. - s) * t * (1. - t);
    [2. * s + (1.6 - 0.9 * t + 2. * s) * bump, t - (1.1 + 0.7 * s) * bump]
}

/// One element without any symmetry, sides of the quadratic kinds curved.
fn single(element: SolidElement) -> Vec<[f64; 3]> {
    let map = |p: &[f64; 3]| {
        let (s, t) = (p[0], p[1]);
        [0.2 + 1.3 * s - 0.2 * t + 0.15 * s * t, 0.1 + 0.3 * s + 0.9 * t + 0.2 * s * t - 0.05 * s * s, 0.]
    };
    element.kind().node_coordinates().iter().map(map).collect()
}

fn stiffness(element: SolidElement, x: &[[f64; 3]], law: PointLaw) -> (DMatrix<f64>, Vec<f64>) {
    let n = 2 * x.len();
    let (mut k, mut f) = (vec![0.; n * n], vec![0.; n]);
    element.stiffness(x, 0.7, |_, _| law, &mut k, &mut f).unwrap();
    (DMatrix::from_row_slice(n, n, &k), f)
}

fn n_zero(k: DMatrix<f64>) -> usize {
    let eigenvalues = k.symmetric_eigenvalues();
    let largest = eigenvalues.amax();
    assert!(eigenvalues.min() > -1e-13 * largest);
    eigenvalues.iter().filter(|e| e.abs() < 1e-10 * largest).count()
}

#[test]
fn rigid_motions_cost_no_force_and_nothing_else_is_free() {
    let law = material(2.1e11, 0.3, PLANE_STRAIN).law(None);
    for element in all_elements() {
        let x = single(element);
        let (k, _) = stiffness(element, &x, law);
        for m in 0..3 {
            let motion = |p: &[f64; 3]| [[1., 0.], [0., 1.], [-p[1], p[0]]][m];
            let u = nalgebra::DVector::from_iterator(2 * x.len(), x.iter().flat_map(motion));
            assert!((&k * u).amax() < 1e-13 * k.amax(), "{element:?}");
        }
        // 2 x 2 points give a quad8 at most rank 12: one more mode, which no two neighbours can share (next
        // test).
        let spurious = usize::from(element.formulation() == Formulation::Reduced);
        assert_eq!(n_zero(k), 3 + spurious, "{element:?}");
    }
}

#[test]
fn two_by_one_cells_have_three_zero_modes_even_with_reduced_integration() {
    let law = material(2.1e11, 0.3, PLANE_STRAIN).law(None);
    for element in all_elements() {
        let mesh = Mesh::grid(element, 2, 1, |s, t| [2. * s + 0.1 * t, t * (1. + 0.2 * s)]);
        let n = 2 * mesh.nodes.len();
        let mut total = DMatrix::zeros(n, n);
        for cell in &mesh.cells {
            let (k, _) = stiffness(element, &mesh.coordinates(cell), law);
            let dofs: Vec<usize> = cell.iter().flat_map(|&a| [2 * a, 2 * a + 1]).collect();
            for (i, &row) in dofs.iter().enumerate() {
                for (j, &column) in dofs.iter().enumerate() {
                    total[(row, column)] += k[(i, j)];
                }
            }
        }
        assert_eq!(n_zero(total), 3, "{element:?}");
    }
}

#[test]
fn internal_force_of_the_stresses_is_k_u_minus_f() {
    let steel = material(2.1e11, 0.4999, PLANE_STRAIN);
    for element in all_elements() {
        let x = single(element);
        let n = 2 * x.len();
        let u: Vec<f64> = (0..n).map(|i| 1e-3 * ((7 * i * i + 3 * i) % 11) as f64 / 11.).collect();
        // Nodal temperatures, interpolated: another law at each point.
        let law = |_: usize, n: &[f64]| {
            steel.law(Some(
                n.iter().zip([300., 420., 370., 350., 310., 380., 400., 330.]).map(|(n, t)| n * t).sum(),
            ))
        };
        let (mut k, mut f) = (vec![0.; n * n], vec![0.; n]);
        element.stiffness(&x, 0.7, law, &mut k, &mut f).unwrap();
        let (mut geometry, mut strains) = (vec![], vec![]);
        element.geometry(&x, &mut geometry).unwrap();
        element.strains(&x, &geometry, &u, law, &mut strains).unwrap();
        let points = element.points().iter().zip(&strains).enumerate();
        let stress: Vec<_> =
            points.map(|(i, (p, e))| law(i, &element.kind().shape(&p.xi).n[..n / 2]).stress(*e)).collect();
        let mut internal = vec![0.; n];
        element.internal_force(&geometry, 0.7, &stress, &mut internal);
        let scale = k.iter().fold(0., |m, k| larger(m, k.abs())) * 1e-3;
        for i in 0..n {
            let expected: f64 = (0..n).map(|j| k[i * n + j] * u[j]).sum::<f64>() - f[i];
            assert!((internal[i] - expected).abs() < 1e-13 * scale, "{element:?} dof {i}");
        }
    }
}

#[test]
fn patch_test_with_prescribed_boundary() {
    let law = material(2.1e11, 0.3, PLANE_STRESS).law(None);
    let [xx, yy, xy] = [1.2e-3, -0.4e-3, 0.7e-3];
    let field = |p: &[f64; 3]| [xx * p[0] + 0.2 * xy * p[1] + 1e-4, 0.8 * xy * p[0] + yy * p[1]];
    for element in all_elements() {
        let mesh = Mesh::grid(element, 3, 3, distorted);
        let mut nodes = mesh.boundary().concat();
        nodes.sort_unstable();
        nodes.dedup();
        assert!(nodes.len() < mesh.nodes.len());
        let value = |&node: &usize| [0, 1].map(|i| (2 * node + i, field(&mesh.nodes[node])[i]));
        let u = System::new(&mesh, |_| law).solve(&nodes.iter().flat_map(value).collect::<Vec<_>>());
        for (node, x) in mesh.nodes.iter().enumerate() {
            for (u, exact) in u[2 * node..].iter().zip(field(x)) {
                assert!((u - exact).abs() < 1e-12 * 2.4e-3, "{element:?}: node {node}");
            }
        }
        assert_constant(&System::new(&mesh, |_| law), &u, law.stress([xx, yy, xy]));
    }
}

#[test]
fn patch_test_with_tractions() {
    let law = material(2.1e11, 0.3, PLANE_STRAIN).law(None);
    let [xx, yy, xy] = [2e8, -0.5e8, 1e8];
    for element in all_elements() {
        let mesh = Mesh::grid(element, 3, 3, distorted);
        let mut system = System::new(&mesh, |_| law);
        system.traction(|_| true, |_, n| [xx * n[0] + xy * n[1], xy * n[0] + yy * n[1], 0.]);
        let (a, b) = (mesh.at(0., 0.), mesh.at(2., 0.));
        let u = system.solve(&[(2 * a, 0.), (2 * a + 1, 0.), (2 * b + 1, 0.)]);
        assert_constant(&System::new(&mesh, |_| law), &u, [xx, yy, xy]);
    }
}

fn assert_constant<L: Fn(&[f64; 3]) -> PointLaw>(system: &System<L>, u: &[f64], expected: [f64; 3]) {
    let scale = expected.iter().fold(0., |m, s| larger(m, s.abs()));
    for [_, _, stress] in system.strains_and_stresses(u) {
        for i in 0..3 {
            let error = (stress[i] - expected[i]).abs();
            assert!(error < 1e-12 * scale.max(1e8), "{:?}: {stress:?}", system.mesh.element);
        }
    }
}

/// Tip deflection of a beam (10 x 1, one row of 5 cells) under an end moment over that of the beam formula M
/// L^2/(2 E I).
fn bending(element: SolidElement) -> f64 {
    let mesh = Mesh::grid(element, 5, 1, |s, t| [10. * s, t - 0.5]);
    let law = material(2.1e11, 0.3, PLANE_STRESS).law(None);
    let mut system = System::new(&mesh, |_| law);
    // sigma_xx = -M y / I with M / I = 1e6.
    system.traction(|x| x[0] > 10. - 1e-9, |x, _| [-1e6 * x[1], 0., 0.]);
    let left = (0..mesh.nodes.len()).filter(|&n| mesh.nodes[n][0] < 1e-9);
    let mut prescribed: Vec<_> = left.map(|n| (2 * n, 0.)).collect();
    prescribed.push((2 * mesh.at(0., -0.5) + 1, 0.));
    let u = system.solve(&prescribed);
    u[2 * mesh.at(10., -0.5) + 1] / (1e6 * 100. / (2. * 2.1e11))
}

#[test]
fn one_row_of_quadrilaterals_bends_like_a_beam() {
    use Formulation::{Enhanced, Reduced, Standard};
    for (kind, formulation) in
        [(ElementKind::Quad4, Enhanced), (ElementKind::Quad8, Reduced), (ElementKind::Quad8, Standard)]
    {
        let ratio = bending(element(kind, formulation));
        assert!((ratio - 1.).abs() < 1e-10, "{kind:?} {formulation:?}: {ratio}");
    }
    let locked = bending(element(ElementKind::Quad4, Standard));
    assert!(locked < 0.8, "standard quad4: {locked}");
}

/// u_r(a) over the exact value for a thick cylinder under internal pressure (Lame), modelled by a quarter
/// ring.
fn cylinder(element: SolidElement, n_radial: usize, n_around: usize, nu: f64) -> f64 {
    let (a, b, p, young) = (0.05_f64, 0.1_f64, 1e8, 2.1e11);
    let mesh = Mesh::grid(element, n_radial, n_around, |s, t| {
        let (r, angle) = (a + (b - a) * s, t * std::f64::consts::FRAC_PI_2);
        [r * angle.cos(), r * angle.sin()]
    });
    let law = material(young, nu, PLANE_STRAIN).law(None);
    let mut system = System::new(&mesh, |_| law);
    system.traction(|x| x[0].hypot(x[1]) < a * (1. + 1e-9), |_, n| [-p * n[0], -p * n[1], 0.]);
    // Symmetry planes: u_i = 0 where x_i = 0.
    let dofs = 0..2 * mesh.nodes.len();
    let prescribed: Vec<_> =
        dofs.filter(|dof| mesh.nodes[dof / 2][dof % 2].abs() < 1e-12).map(|dof| (dof, 0.)).collect();
    let u = system.solve(&prescribed);
    let exact = (1. + nu) * p * a * a / (young * (b * b - a * a)) * ((1. - 2. * nu) * a + b * b / a);
    u[2 * mesh.at(a, 0.)] / exact
}

#[test]
fn a_nearly_incompressible_cylinder_does_not_lock() {
    for nu in [0.3, 0.4999, 0.499999] {
        for (kind, formulation) in [
            (ElementKind::Quad4, Formulation::Enhanced),
            (ElementKind::Quad8, Formulation::Reduced),
            (ElementKind::Tri6, Formulation::Enhanced),
        ] {
            let ratio = cylinder(element(kind, formulation), 16, 8, nu);
            assert!((ratio - 1.).abs() < 0.01, "{kind:?} {formulation:?} nu = {nu}: {ratio}");
        }
    }
}

/// Reference values from an independent program: they show that the mesh above would reveal locking.
#[test]
fn standard_quadrilaterals_lock_as_known() {
    for (kind, n_radial, expected) in [
        (ElementKind::Quad4, 16, [0.9993, 0.990, 0.908, 0.496, 0.0098]),
        (ElementKind::Quad8, 4, [1.0, 0.999, 0.990, 0.910, 0.092]),
    ] {
        for (nu, expected) in [0.3, 0.49, 0.499, 0.4999, 0.499999].into_iter().zip(expected) {
            let ratio = cylinder(element(kind, Formulation::Standard), n_radial, n_radial, nu);
            let text = format!("{kind:?} standard, nu = {nu}: {ratio:.5}, reference {expected}");
            assert!((ratio - expected).abs() < 1e-3, "{text}");
        }
    }
}

#[test]
fn initial_strain_moves_a_free_body_and_stresses_a_held_one() {
    let steel = material(2e11, 0.3, PLANE_STRESS);
    let law = steel.law(Some(393.));
    let strain = 1e-5 * 100.;
    for element in all_elements() {
        let mesh = Mesh::grid(element, 3, 3, distorted);
        let (a, b) = (mesh.at(0., 0.), mesh.at(2., 0.));
        let hold = [(2 * a, 0.), (2 * a + 1, 0.), (2 * b + 1, 0.)];
        let u = System::new(&mesh, |_| law).solve(&hold);
        assert_constant(&System::new(&mesh, |_| law), &u, [0.; 3]);
        assert!((u[2 * b] - 2. * strain).abs() < 1e-14);

        // Both ends held along x: sigma_xx = -E alpha dT.
        let ends = (0..mesh.nodes.len()).filter(|&n| mesh.nodes[n][0].min(2. - mesh.nodes[n][0]) < 1e-9);
        let held: Vec<_> = ends.map(|n| (2 * n, 0.)).chain([(2 * a + 1, 0.)]).collect();
        let u = System::new(&mesh, |_| law).solve(&held);
        assert_constant(&System::new(&mesh, |_| law), &u, [-2e11 * strain, 0., 0.]);
    }
}

#[test]
fn nodal_values_are_exact_for_linear_fields_and_means_are_means() {
    for element in all_elements() {
        let linear = |xi: &[f64; 3]| [2. + 3. * xi[0] - xi[1], 4.];
        let at_points: Vec<_> = element.points().iter().map(|p| linear(&p.xi)).collect();
        let mut at_nodes = vec![[0.; 2]; element.kind().n_nodes()];
        element.to_nodes(&at_points, &mut at_nodes);
        let center = linear(&element.kind().center());
        for (value, xi) in at_nodes.iter().zip(element.kind().node_coordinates()) {
            let expected = if element.kind() == ElementKind::Tri3 { center } else { linear(xi) };
            assert!((value[0] - expected[0]).abs() < 1e-14 && (value[1] - 4.).abs() < 1e-14, "{element:?}");
        }
        let x = element.kind().node_coordinates();
        let mut geometry = vec![];
        element.geometry(x, &mut geometry).unwrap();
        assert!((SolidElement::mean(&geometry, &at_points)[0] - center[0]).abs() < 1e-14);
        let area: f64 = geometry.iter().map(|g| g.area).sum();
        assert!((0.5 * area - element.volume(x, 0.5).unwrap()).abs() < 1e-15);
    }
}
