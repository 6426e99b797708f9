//! GetFEM: meshes, start, results. What it does is in with_getfem.py, friction_with_getfem.py and plasticity_with_getfem.py.
use super::decks::{Pair, YIELD};
use kontakt::{Error, Result};
use std::{fmt::Write, path::Path, process::Command};

pub const SETTING: &str = "- GetFEM: FEM_QK(2,1), nodal contact brick (the meshes match), symmetric augmented Lagrangian with r = 0.1 E, MUMPS. Its line \
                           search is told to take\n  \
                           full Newton steps: with its defaults it damps them and is not done after 50. Its integral contact brick gave \
                           peak pressures\n  \
                           that grow with each refinement here (2.7, 5.6, 9.7 GPa), and is not used for that.\n";

pub const FRICTION_SETTING: &str = "- GetFEM: FEM_QK(2,1), basic contact brick on opposite nodes with the mean normal of both surfaces, augmented Lagrangian that is symmetric but for\n  \
                           the coupling of pressure and friction, r = 0.1 E (0.01 E to E need as many steps), MUMPS, full Newton steps as without friction, started from\n  \
                           the bodies moved with their flats, which saves two. The non-symmetric augmentation needs a tolerance of 1e-10 and one step more for the same\n  \
                           solution; the other two ended elsewhere or did not converge. The nodal contact brick takes the normals of one surface, along which the\n  \
                           approach of the surfaces is slip, and was off by 6 % in q at 40 000 unknowns.\n";

pub const PLASTICITY_SETTING: &str = "- GetFEM: FEM_QK(2,1), plane strain Prandtl Reuss with linear hardening in displacements only (the multiplier eliminated at the points),\n  \
                                      basic contact brick on opposite nodes, symmetric augmented Lagrangian with r = 0.1 E, MUMPS, full Newton steps. The first step starts from\n  \
                                      the elastic solution (from the bodies moved with what moves them it does not converge), the second from the end of the first, the others\n  \
                                      from the last one repeated, which saves a sixth of the iterations; the second does not converge from there at 77 000 unknowns.\n";

/// By how much the second body is put lower where both are one mesh: GetFEM joins points that coincide.
const APART: f64 = 1e-3;

pub fn prepare(pair: &Pair, directory: &Path) -> Result<()> {
    let write =
        |file: &str, text: String| std::fs::write(directory.join(file), text).map_err(Error::internal);
    if together(pair) {
        return write("bodies.mesh", mesh(pair, &[0, 1]));
    }
    write("body0.mesh", mesh(pair, &[0]))?;
    write("body1.mesh", mesh(pair, &[1]))
}

pub fn command(pair: &Pair, directory: &Path) -> Command {
    // Debian's Python: another one before it in the path does not see Debian's packages.
    let mut command = Command::new("/usr/bin/python3");
    let program = match (&pair.shear, pair.plastic) {
        (Some(_), _) => "friction_with_getfem.py",
        (None, Some(_)) => "plasticity_with_getfem.py",
        (None, None) => "with_getfem.py",
    };
    command.arg(crate::common::root().join("benches/peers").join(program)).arg(directory);
    let mut numbers = pair.lift.to_vec();
    if together(pair) {
        numbers.insert(0, APART);
    }
    if let Some(increments) = pair.plastic {
        numbers.extend(YIELD);
        numbers.push(increments as f64);
    }
    if let Some(shear) = &pair.shear {
        numbers.extend(shear.pull);
        numbers.push(shear.friction);
    }
    let axis = std::iter::zip(&pair.axis, &pair.meshes);
    numbers.extend(axis.filter_map(|(node, mesh)| Some(mesh.points[(*node)?][1])));
    command.args(numbers.iter().map(|v| format!("{v:e}")));
    command
}

/// True if both bodies are in one mesh.
fn together(pair: &Pair) -> bool {
    pair.shear.is_some() || pair.plastic.is_some()
}

/// Force of the contact along y, N.
pub fn force(directory: &Path) -> Option<f64> {
    word(directory, "force")
}

/// Tangential tractions, Pa, of the nodes in contact by their x.
pub fn tractions(directory: &Path) -> Option<Vec<(f64, f64)>> {
    let text = std::fs::read_to_string(directory.join("traction.txt")).ok()?;
    let line = |line: &str| {
        let (x, q) = line.split_once(' ')?;
        Some((x.parse().ok()?, q.parse().ok()?))
    };
    text.lines().map(line).collect()
}

/// Largest contact pressure, Pa.
pub fn peak(directory: &Path) -> Option<f64> {
    word(directory, "peak pressure")
}

/// Newton steps.
pub fn steps(directory: &Path) -> f64 {
    word(directory, "steps").unwrap_or(f64::NAN)
}

/// The number after a word in what was printed.
fn word(directory: &Path, key: &str) -> Option<f64> {
    let text = std::fs::read_to_string(directory.join("GetFEM.log")).ok()?;
    text.lines().rev().find_map(|line| line.strip_prefix(key)?.trim().parse().ok())
}

/// GetFEM's own mesh file of bodies; regions of each: the flat, the arc where it can touch, counted from 1.
fn mesh(pair: &Pair, bodies: &[usize]) -> String {
    // GetFEM numbers the nodes of a quadrilateral row by row, and its sides x = 1, x = 0, y = 1, y = 0.
    const NODES: [usize; 4] = [0, 1, 3, 2];
    const SIDES: [u8; 4] = [3, 0, 2, 1];
    let mut text = String::from("% GETFEM MESH FILE\n% GETFEM VERSION 5.4\n\nBEGIN POINTS LIST\n\n");
    let mut first = vec![(0, 0)];
    for (i, mesh) in bodies.iter().map(|&b| &pair.meshes[b]).enumerate() {
        let (points, cells) = first[i];
        for (n, p) in mesh.points.iter().enumerate() {
            let y = p[1] - i as f64 * APART;
            let _ = writeln!(text, "  POINT  {}  {:.16e}  {y:.16e}", points + n, p[0]);
        }
        first.push((points + mesh.points.len(), cells + mesh.cells.len()));
    }
    text += "\nEND POINTS LIST\n\nBEGIN MESH STRUCTURE DESCRIPTION\n\n";
    for (&(points, cells), &b) in std::iter::zip(&first, bodies) {
        for (c, cell) in pair.meshes[b].cells.iter().enumerate() {
            let _ = write!(text, "CONVEX {}    'GT_QK(2,1)'     ", cells + c);
            for i in NODES {
                let _ = write!(text, " {}", points + cell.nodes()[i] as usize);
            }
            text.push('\n');
        }
    }
    text += "\nEND MESH STRUCTURE DESCRIPTION\n";
    let regions = std::iter::zip(&first, bodies)
        .flat_map(|(&(_, cells), &b)| [(cells, pair.flat_facets(b).to_vec()), (cells, pair.facets(b))]);
    for (i, (cells, facets)) in regions.enumerate() {
        let _ = writeln!(text, "BEGIN REGION {}", i + 1);
        for f in facets {
            let _ = writeln!(text, "{}/{}", cells + f.cell as usize, SIDES[f.side as usize]);
        }
        let _ = writeln!(text, "END REGION {}", i + 1);
    }
    text
}
