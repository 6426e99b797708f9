//! GetFEM: meshes, start, peak pressure. What it does is in with_getfem.py.
use super::decks::Pair;
use kontakt::{Error, Result};
use std::{fmt::Write, path::Path, process::Command};

pub const SETTING: &str = "- GetFEM: FEM_QK(2,1), nodal contact brick (the meshes match), symmetric augmented Lagrangian with r = 0.1 E, MUMPS. Its line \
                           search is told to take\n  \
                           full Newton steps: with its defaults it damps them and is not done after 50. Its integral contact brick gave \
                           peak pressures\n  \
                           that grow with each refinement here (2.7, 5.6, 9.7 GPa), and is not used for that.\n";

pub fn prepare(pair: &Pair, directory: &Path) -> Result<()> {
    for b in [0, 1] {
        let file = directory.join(format!("body{b}.mesh"));
        std::fs::write(file, mesh(pair, b)).map_err(Error::internal)?;
    }
    Ok(())
}

pub fn command(pair: &Pair, directory: &Path) -> Command {
    // Debian's Python: another one before it in the path does not see Debian's packages.
    let mut command = Command::new("/usr/bin/python3");
    command.arg(crate::common::root().join("benches/peers/with_getfem.py")).arg(directory);
    command.args(pair.lift.map(|y| format!("{y:e}")));
    command.args(pair.axis.iter().enumerate().map(|(b, &n)| pair.meshes[b].points[n][1].to_string()));
    command
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

/// GetFEM's own mesh file of a body; regions: 1 the flat, 2 the arc where it can touch.
fn mesh(pair: &Pair, body: usize) -> String {
    // GetFEM numbers the nodes of a quadrilateral row by row, and its sides x = 1, x = 0, y = 1, y = 0.
    const NODES: [usize; 4] = [0, 1, 3, 2];
    const SIDES: [u8; 4] = [3, 0, 2, 1];
    let mesh = &pair.meshes[body];
    let mut text = String::from("% GETFEM MESH FILE\n% GETFEM VERSION 5.4\n\nBEGIN POINTS LIST\n\n");
    for (n, p) in mesh.points.iter().enumerate() {
        let _ = writeln!(text, "  POINT  {n}  {:.16e}  {:.16e}", p[0], p[1]);
    }
    text += "\nEND POINTS LIST\n\nBEGIN MESH STRUCTURE DESCRIPTION\n\n";
    for (c, cell) in mesh.cells.iter().enumerate() {
        let _ = write!(text, "CONVEX {c}    'GT_QK(2,1)'     ");
        for i in NODES {
            let _ = write!(text, " {}", cell.nodes()[i]);
        }
        text.push('\n');
    }
    text += "\nEND MESH STRUCTURE DESCRIPTION\n";
    for (region, facets) in [(1, mesh.surfaces["flat"].clone()), (2, pair.facets(body))] {
        let _ = writeln!(text, "BEGIN REGION {region}");
        for f in facets {
            let _ = writeln!(text, "{}/{}", f.cell, SIDES[f.side as usize]);
        }
        let _ = writeln!(text, "END REGION {region}");
    }
    text
}
