//! How a body answers contact: condensed and by its solver, free and held, on 1, 2 and 3 ranks.
use kontakt::vector::larger;
use kontakt::{
    body::{Accuracy, Body, BodyRow, LoadFactors, Response, ResponseKind, find_facets},
    case::{self, Case, Origin},
    contact::Surface,
    mesh::Mesh,
    scene::build_mesh,
    schwarz::Respond,
};
use mpi::{topology::SimpleCommunicator, traits::*};
use ranks::on_ranks;
use std::path::Path;

mod common;
#[path = "common/ranks.rs"]
mod ranks;

const RANKS: [usize; 3] = [1, 2, 3];

/// A body of a case, with its mesh.
struct Scene {
    name: &'static str,
    case: Case,
    mesh: Mesh,
    /// Nodes of the contact surfaces, one after the other: a node of two of them occurs twice.
    interface: Vec<u32>,
    normals: Vec<[f64; 3]>,
    modes: usize,
}

/// `body`: keys of `[[body]]`; `copies`: pieces of its mesh, side by side.
fn scene(name: &'static str, body: &str, surfaces: &[&str], copies: usize, modes: usize) -> Scene {
    let directory = tempfile::tempdir().unwrap();
    let file = directory.path().join("case.toml");
    let text = format!(
        "analysis = \"plane strain\"\n[material.m]\nyoung = \"200 GPa\"\npoisson = 0.3\nexpansion = 1.2e-5\n\
         reference_temperature = 293\n[[body]]\nname = \"b\"\nmaterial = \"m\"\n{body}"
    );
    std::fs::write(&file, text).unwrap();
    let case = case::read(Path::new(&file), None, &[]).unwrap();
    let mut mesh = build_mesh(&case.bodies[0].geometry).unwrap();
    let one = mesh.clone();
    for i in 1..copies {
        let mut other = one.clone();
        other.points.iter_mut().for_each(|p| p[0] += 3.0 * i as f64);
        mesh.append(&other);
    }
    let (mut interface, mut normals) = (Vec::new(), Vec::new());
    for surface in surfaces {
        let facets = find_facets(&mesh, "b", surface, None, &Origin::default()).unwrap();
        let surface = Surface::new(&mesh, &facets, 1.0);
        interface.extend(&surface.nodes);
        normals.extend(&surface.normals);
    }
    Scene { name, case, mesh, interface, normals, modes }
}

fn scenes() -> Vec<Scene> {
    let rectangle =
        "mesh.rectangle = { x = { from = 0, to = 2, cells = 9 }, y = { from = 0, to = 1, cells = 6 } }\n";
    let loads =
        "load = [{ surface = \"left\", traction = [\"x*1e6 + 2e6\", 1e6] }, { body_force = [1e5, -3e5] }]\n";
    let held = format!(
        "{rectangle}element = \"quad4\"\ntemperature = \"293 + 100*y\"\n{loads}\
         support = [{{ surface = \"bottom\", x = 1e-5, y = -2e-5 }}, {{ surface = \"right\", x = 1e-5 }}]\n"
    );
    let free = format!("{rectangle}element = \"quad8\"\nmesh.rotate = 0.4\n{loads}");
    let inclined = format!(
        "{rectangle}element = \"tri6\"\nmesh.rotate = 0.4\n{loads}\
         support = [{{ surface = \"bottom\", angle = 0.4, y = 1e-5 }}]\n"
    );
    let pieces =
        format!("{rectangle}element = \"tri3\"\n{loads}support = [{{ point = [0, 0], x = 0, y = 1e-5 }}]\n");
    let ring = "mesh.ring = { center = [1, 2], radius = { from = 1, to = 2, cells = 4 }, \
                angle = { from = 0, to = 1.5707963267948966, cells = 10 } }\nelement = \"quad8\"\n\
                support = [{ surface = \"start\", y = 0 }, { surface = \"end\", x = 0 }]\n";
    vec![
        scene("held", &held, &["top", "right"], 1, 0),
        scene("free", &free, &["top", "right"], 1, 3),
        scene("inclined", &inclined, &["top", "right"], 1, 1),
        scene("pieces", &pieces, &["top", "right"], 2, 4),
        // Nothing of it feels a translation along its flat top.
        scene("flat", &free, &["top"], 1, 3),
        scene("ring", ring, &["inner", "outer"], 1, 0),
        scene("thin", &free.replace("cells = 6", "cells = 1"), &["top", "bottom", "left", "right"], 1, 3),
    ]
}

impl Scene {
    fn body(&self, group: &SimpleCommunicator, response: ResponseKind) -> Body {
        let case = &self.case;
        let body = Body::new(&case.bodies[0], case, &self.mesh, group, &self.interface, response);
        let body = body.unwrap();
        assert_eq!(body.free.modes.len(), self.modes, "{}: {:?}", self.name, body.free.modes);
        assert_eq!(body.is_condensed(), response == ResponseKind::Condensed);
        body
    }

    /// A row of one node each; with `spread` of three nodes, as on a mortar side.
    fn rows(&self, spread: bool) -> Vec<BodyRow> {
        let n = self.interface.len();
        let term = |i: usize, n: [f64; 3], c: f64| (i, n.map(|v| c * v));
        (0..n)
            .map(|i| match spread && i % 3 == 1 && i + 1 < n {
                true => {
                    let normal = self.normals[i];
                    BodyRow {
                        terms: vec![
                            term(i, normal, 0.7),
                            term(i - 1, normal, 0.4),
                            term(i + 1, normal, -0.1),
                        ],
                        tangential: false,
                    }
                }
                false => BodyRow { terms: vec![term(i, self.normals[i], 1.0)], tangential: false },
            })
            .collect()
    }
}

/// Runs `work` on the first rank, the others serving.
fn drive(group: &SimpleCommunicator, response: &mut Response, work: impl FnOnce(&mut Response)) {
    if group.rank() == 0 {
        work(response);
        response.finish();
    } else {
        response.serve().unwrap();
    }
}

/// Numbers without a pattern.
fn noise(n: usize, seed: f64) -> Vec<f64> {
    (0..n).map(|i| ((i as f64 + 1.0) * 12.9898 + seed * 78.233).sin() * 43758.5453 % 1.0).collect()
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    std::iter::zip(a, b).map(|(a, b)| a * b).sum()
}

#[track_caller]
fn assert_close(a: &[f64], b: &[f64], relative: f64, what: &str) {
    assert_eq!(a.len(), b.len(), "{what}");
    let scale = a.iter().chain(b).fold(1e-300, |m, v| larger(m, v.abs()));
    let off = std::iter::zip(a, b).fold(0.0, |m, (a, b)| larger(m, (a - b).abs()));
    assert!(off <= relative * scale, "{what}: {off:.1e} of {scale:.1e}");
}

/// Forces that the modes do not feel: v - G (G'G)^-1 G'v by Gram-Schmidt, twice.
fn self_balanced(mut v: Vec<f64>, modes: &[Vec<f64>]) -> Vec<f64> {
    let mut basis: Vec<Vec<f64>> = Vec::new();
    let without = |mut v: Vec<f64>, basis: &[Vec<f64>]| {
        for _ in 0..2 {
            for b in basis {
                let along = dot(&v, b) / dot(b, b);
                std::iter::zip(&mut v, b).for_each(|(v, b)| *v -= along * b);
            }
        }
        v
    };
    for mode in modes {
        let rest = without(mode.clone(), &basis);
        if dot(&rest, &rest) > 1e-20 * dot(mode, mode) {
            basis.push(rest);
        }
    }
    v = without(v, &basis);
    v
}

/// Forces that balance the loads: Z'R = e.
fn balancing(modes: &[Vec<f64>], work: &[f64]) -> Vec<f64> {
    let n = modes.len();
    if n == 0 {
        return Vec::new();
    }
    let gram = nalgebra::DMatrix::from_fn(n, n, |k, l| dot(&modes[k], &modes[l]));
    let beta =
        gram.lu().solve(&nalgebra::DVector::from_column_slice(work)).expect("the modes reach the rows");
    (0..modes[0].len()).map(|j| (0..n).map(|k| beta[k] * modes[k][j]).sum()).collect()
}

#[test]
fn condensed_and_solver_agree() {
    on_ranks("condensed_and_solver_agree", &RANKS, |group| {
        for scene in scenes() {
            let mut bodies =
                [ResponseKind::Condensed, ResponseKind::Solver].map(|kind| scene.body(group, kind));
            for spread in [false, true] {
                let mut rows = if group.rank() == 0 { scene.rows(spread) } else { Vec::new() };
                let n = scene.interface.len();
                let mut out: [Vec<Vec<f64>>; 2] = Default::default();
                for (body, out) in std::iter::zip(&mut bodies, &mut out) {
                    let mut response = body.respond(group, rows.clone()).unwrap();
                    drive(group, &mut response, |r| {
                        out.push(r.free().to_vec());
                        out.extend(r.modes().iter().cloned());
                        out.push(r.mode_work().to_vec());
                        for seed in 0..2 {
                            out.push(r.force_step(&noise(n, f64::from(seed))).unwrap());
                        }
                        let alpha = noise(r.modes().len(), 3.0);
                        out.push(r.interface_displacements(&noise(n, 0.5), &alpha).unwrap().into_flattened());
                    });
                    let (force, alpha) = (noise(n, 0.5), noise(scene.modes, 3.0));
                    let contact = body.contact_forces(&response, &force);
                    let u = body.displacements(group, &contact, &alpha, Accuracy::Refined).unwrap();
                    if group.rank() == 0 {
                        // The whole body's displacements are those of its interface.
                        let at: Vec<f64> = scene
                            .interface
                            .iter()
                            .flat_map(|&node| {
                                let i = body.numbering.new_of_old[node as usize] as usize;
                                [u[2 * i], u[2 * i + 1], 0.0]
                            })
                            .collect();
                        assert_close(&at, out.last().unwrap(), 1e-11, scene.name);
                    }
                    out.push(u);
                }
                for (a, b) in std::iter::zip(&out[0], &out[1]) {
                    assert_close(a, b, 1e-10, scene.name);
                }
                rows.clear();
            }
            let cost = bodies[0].cost();
            assert_eq!(cost.factorisations, 1);
        }
    });
}

#[test]
fn displacement_steps_invert_force_steps() {
    on_ranks("displacement_steps_invert_force_steps", &RANKS, |group| {
        for scene in scenes() {
            for kind in [ResponseKind::Condensed, ResponseKind::Solver] {
                let mut body = scene.body(group, kind);
                let mut rows = if group.rank() == 0 { scene.rows(false) } else { Vec::new() };
                // Vectors need not be of length 1.
                rows.iter_mut().step_by(2).for_each(|row| row.terms[0].1 = row.terms[0].1.map(|v| 1.3 * v));
                let mut response = body.respond(group, rows).unwrap();
                let condensed = kind == ResponseKind::Condensed;
                drive(group, &mut response, |r| {
                    let n = r.n_rows();
                    // Rows that supports hold, and a node's second row in the same direction, have no inverse.
                    let unit: Vec<f64> = (0..n)
                        .map(|j| {
                            let mut e = vec![0.0; n];
                            e[j] = 1.0;
                            r.force_step(&e).unwrap()[j]
                        })
                        .collect();
                    let largest = unit.iter().copied().fold(0.0, larger);
                    let mut seen = std::collections::HashSet::new();
                    let usable: Vec<bool> =
                        (0..n).map(|j| unit[j] > 0.02 * largest && seen.insert(scene.interface[j])).collect();
                    let subset: Vec<bool> = (0..n).map(|j| usable[j] && j % 3 != 0).collect();
                    // By the solver every row is prescribed, active or not: exact where all are active.
                    for active in [usable, subset].into_iter().take(if condensed { 2 } else { 1 }) {
                        let modes: Vec<Vec<f64>> = r.modes().iter().map(|mode| mask(mode, &active)).collect();
                        let force = self_balanced(mask(&noise(n, 1.0), &active), &modes);
                        let mut inward = r.force_step(&force).unwrap();
                        // A rigid motion costs no force.
                        for (k, mode) in r.modes().iter().enumerate() {
                            let a = 1e-11 * (1.0 + k as f64);
                            std::iter::zip(&mut inward, mode).for_each(|(u, m)| *u += a * m);
                        }
                        if condensed || scene.modes == 0 && scene.name != "held" {
                            let back = r.displacement_step(&inward, &active).unwrap();
                            assert_close(&back, &force, 1e-7, &format!("{} {kind:?}", scene.name));
                        }
                        // Symmetric, positive semi-definite, no force on the modes.
                        let (x, y) = (mask(&noise(n, 2.0), &active), mask(&noise(n, 3.0), &active));
                        let (px, py) = (
                            r.displacement_step(&x, &active).unwrap(),
                            r.displacement_step(&y, &active).unwrap(),
                        );
                        let scale = (dot(&x, &px) * dot(&y, &py)).sqrt();
                        assert!(
                            (dot(&x, &py) - dot(&y, &px)).abs() < 1e-8 * scale,
                            "{} {kind:?}",
                            scene.name
                        );
                        assert!(dot(&x, &px) > 0.0);
                        for mode in &modes {
                            let work = dot(mode, &px).abs();
                            let size = (dot(mode, mode) * dot(&px, &px)).sqrt();
                            assert!(work <= 1e-9 * size, "{} {kind:?}: {work:.1e} {size:.1e}", scene.name);
                        }
                    }
                });
                drop(response);
                let cost = body.cost();
                assert_eq!(cost.factorisations, if condensed { 1 } else { 2 });
                assert_eq!(cost.interface_factorisations, if condensed && group.rank() == 0 { 2 } else { 0 });
            }
        }
    });
}

fn mask(v: &[f64], active: &[bool]) -> Vec<f64> {
    std::iter::zip(v, active).map(|(v, a)| if *a { *v } else { 0.0 }).collect()
}

/// The displacement step of rows over several nodes: symmetric and semi-definite.
#[test]
fn displacement_steps_of_spread_rows_are_symmetric() {
    on_ranks("displacement_steps_of_spread_rows_are_symmetric", &RANKS, |group| {
        for scene in scenes() {
            for kind in [ResponseKind::Condensed, ResponseKind::Solver] {
                let mut body = scene.body(group, kind);
                let rows = if group.rank() == 0 { scene.rows(true) } else { Vec::new() };
                let mut response = body.respond(group, rows).unwrap();
                drive(group, &mut response, |r| {
                    let n = r.n_rows();
                    let active: Vec<bool> = (0..n).map(|i| i % 4 != 0).collect();
                    let [x, y] = [1.0, 2.0].map(|seed| mask(&noise(n, seed), &active));
                    let [px, py] = [&x, &y].map(|x| r.displacement_step(x, &active).unwrap());
                    let scale = (dot(&x, &px) * dot(&y, &py)).sqrt();
                    let off = (dot(&x, &py) - dot(&y, &px)).abs();
                    assert!(off < 1e-7 * scale, "{} {kind:?}: {off:.1e} {scale:.1e}", scene.name);
                    assert!(dot(&x, &px) > 0.0 && dot(&y, &py) > 0.0);
                    assert!(px.iter().zip(&active).all(|(p, a)| *a || *p == 0.0));
                });
            }
        }
    });
}

/// Forces that balance the loads leave no force on the fixings and no residual, however the body has moved.
#[test]
fn fixings_carry_nothing_at_equilibrium() {
    on_ranks("fixings_carry_nothing_at_equilibrium", &RANKS, |group| {
        for scene in scenes().into_iter().filter(|scene| scene.name != "flat") {
            for kind in [ResponseKind::Condensed, ResponseKind::Solver] {
                let mut body = scene.body(group, kind);
                let rows = if group.rank() == 0 { scene.rows(true) } else { Vec::new() };
                let mut response = body.respond(group, rows).unwrap();
                let mut force = vec![0.0; scene.interface.len()];
                drive(group, &mut response, |r| {
                    let balanced = self_balanced(noise(force.len(), 1.0), r.modes());
                    let balance = balancing(r.modes(), r.mode_work());
                    force = balanced.iter().map(|f| 1e5 * f).collect();
                    std::iter::zip(&mut force, balance).for_each(|(f, b)| *f += b);
                });
                let contact = body.contact_forces(&response, &force);
                let alpha: Vec<f64> = noise(scene.modes, 5.0).iter().map(|a| 1e-6 * a).collect();
                let owned = body.displacements(group, &contact, &alpha, Accuracy::Refined).unwrap();
                let u = body.with_ghosts(group, &owned).unwrap();
                let (_, balance, _) = body.recover(&u, &contact, &[]).unwrap();
                let parts = [&balance.residual2[..], &balance.resultant, &balance.reaction].concat();
                let sums = kontakt::parallel::sum(group, &parts);
                let ratio = (sums[0] / sums[1]).sqrt();
                assert!(ratio < 1e-10, "{} {kind:?}: residual {ratio:.1e}", scene.name);
                let scale = sums[1].sqrt();
                assert!(sums[2].hypot(sums[3]) < 1e-9 * scale, "{} {kind:?}: {sums:?}", scene.name);
                if scene.modes == 3 {
                    assert!(sums[5].hypot(sums[6]) < 1e-10 * scale, "no supports, no reaction: {sums:?}");
                }
            }
        }
    });
}

#[test]
fn loads_supports_and_temperature_superpose() {
    on_ranks("loads_supports_and_temperature_superpose", &RANKS, |group| {
        for scene in scenes() {
            for kind in [ResponseKind::Condensed, ResponseKind::Solver] {
                let mut body = scene.body(group, kind);
                let mut rows = Some(if group.rank() == 0 { scene.rows(false) } else { Vec::new() });
                let mut response = None;
                let mut free = Vec::new();
                let f = |loads, supports, temperature| LoadFactors {
                    loads,
                    supports,
                    temperature,
                    ..LoadFactors::NONE
                };
                for factors in [f(1.0, 0.0, 0.0), f(0.0, 1.0, 0.0), f(0.0, 0.0, 1.0), f(0.7, -2.0, 0.3)] {
                    body.set_load(&factors, group).unwrap();
                    match &mut response {
                        None => response = Some(body.respond(group, rows.take().unwrap()).unwrap()),
                        Some(response) => body.reload(group, response).unwrap(),
                    }
                    free.push(response.as_ref().unwrap().free().to_vec());
                }
                let sum: Vec<f64> = (0..free[0].len())
                    .map(|i| 0.7 * free[0][i] - 2.0 * free[1][i] + 0.3 * free[2][i])
                    .collect();
                assert_close(&sum, &free[3], 1e-10, &format!("{} {kind:?}", scene.name));
                assert_eq!(body.cost().factorisations, 1);
            }
        }
    });
}

/// PETSc options of the body reach its factor; a solver of the user's choice is kept, and answers the same.
#[test]
fn options_of_the_body_count() {
    on_ranks("options_of_the_body_count", &RANKS, |group| {
        let scenes = scenes();
        let build = |scene: &Scene, kind| {
            let case = &scene.case;
            Body::new(&case.bodies[0], case, &scene.mesh, group, &scene.interface, kind).unwrap()
        };
        let unused = || kontakt::petsc::option_prefixes_left("body_b_").unwrap();
        kontakt::petsc::set_options("-body_b_mat_mumps_icntl_7 0").unwrap();
        assert_eq!(unused().len(), 1);
        let scene = &scenes[0];
        let mut condensed = build(scene, ResponseKind::Automatic);
        assert!(condensed.is_condensed() && unused().is_empty(), "{:?}", unused());
        kontakt::petsc::set_options("-body_b_ksp_type cg -body_b_pc_type gamg -body_b_ksp_rtol 1e-12")
            .unwrap();
        let mut by_solver = build(scene, ResponseKind::Automatic);
        assert!(!by_solver.is_condensed());
        let mut answers = Vec::new();
        for body in [&mut condensed, &mut by_solver] {
            let rows = if group.rank() == 0 { scene.rows(false) } else { Vec::new() };
            let mut response = body.respond(group, rows).unwrap();
            drive(group, &mut response, |r| {
                let n = r.n_rows();
                answers.push(r.force_step(&noise(n, 1.0)).unwrap());
                assert!(r.displacement_step(&noise(n, 1.0), &vec![true; n]).is_ok());
            });
        }
        if group.rank() == 0 {
            assert_close(&answers[0], &answers[1], 1e-9, "CG with GAMG");
        }
    });
}

/// Material data over temperature: the stiffness follows the factor.
#[test]
fn a_hotter_step_has_another_stiffness() {
    on_ranks("a_hotter_step_has_another_stiffness", &RANKS, |group| {
        let text = "material = { young = { temperature = [293, 493], value = [\"200 GPa\", \"100 GPa\"] }, \
                    poisson = 0.3, expansion = 1e-5, reference_temperature = 293 }\n\
                    mesh.rectangle = { x = { from = 0, to = 2, cells = 5 }, y = { from = 0, to = 1, cells = 4 } }\n\
                    temperature = 493\nelement = \"quad4\"\nsupport = [{ surface = \"bottom\", x = 0, y = 0 }]\n";
        let directory = tempfile::tempdir().unwrap();
        let file = directory.path().join("case.toml");
        std::fs::write(&file, format!("analysis = \"plane stress\"\n[[body]]\nname = \"b\"\n{text}"))
            .unwrap();
        let case = case::read(&file, None, &[]).unwrap();
        let mesh = build_mesh(&case.bodies[0].geometry).unwrap();
        let facets = find_facets(&mesh, "b", "top", None, &Origin::default()).unwrap();
        let surface = Surface::new(&mesh, &facets, 1.0);
        for kind in [ResponseKind::Condensed, ResponseKind::Solver] {
            let mut body = Body::new(&case.bodies[0], &case, &mesh, group, &surface.nodes, kind).unwrap();
            let rows = || -> Vec<BodyRow> {
                let n = if group.rank() == 0 { surface.nodes.len() } else { 0 };
                (0..n).map(|i| BodyRow { terms: vec![(i, surface.normals[i])], tangential: false }).collect()
            };
            let force = noise(surface.nodes.len(), 1.0);
            let mut response = body.respond(group, rows()).unwrap();
            let mut pushed = Vec::new();
            let mut free = vec![response.free().to_vec()];
            drive(group, &mut response, |r| pushed.push(r.force_step(&force).unwrap()));
            body.set_load(&LoadFactors { temperature: 0.0, ..LoadFactors::FULL }, group).unwrap();
            body.reload(group, &mut response).unwrap();
            drive(group, &mut response, |r| pushed.push(r.force_step(&force).unwrap()));
            free.push(response.free().to_vec());
            if group.rank() == 0 {
                let half: Vec<f64> = pushed[0].iter().map(|w| 0.5 * w).collect();
                assert_close(&half, &pushed[1], 1e-12, "half as stiff when hot");
                assert!(free[0].iter().all(|w| *w > 1e-4) && free[1].iter().all(|w| w.abs() < 1e-15));
            }
            assert_eq!(body.cost().factorisations, 2);
        }
    });
}

/// How far rows have moved is the length of a displacement, whatever its direction; at rows of several nodes of their mean.
#[test]
fn rows_know_how_far_they_have_moved() {
    on_ranks("rows_know_how_far_they_have_moved", &RANKS, |group| {
        let scenes = scenes();
        let scene = scenes.iter().find(|scene| scene.name == "ring").unwrap();
        for kind in [ResponseKind::Condensed, ResponseKind::Solver] {
            let mut body = scene.body(group, kind);
            let rows = if group.rank() == 0 { scene.rows(false) } else { Vec::new() };
            let mut response = body.respond(group, rows).unwrap();
            drive(group, &mut response, |r| {
                let force = noise(scene.interface.len(), 1.0);
                let u = r.interface_displacements(&force, &[]).unwrap();
                let lengths: Vec<f64> = u.iter().map(|u| dot(u, u).sqrt()).collect();
                assert_close(&r.distances(&force).unwrap(), &lengths, 1e-12, "single nodes");
            });
        }
    });
}
