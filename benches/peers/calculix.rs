//! CalculiX: deck, start, results.
use super::decks::{ELASTIC, Pair};
use kontakt::vector::{larger, smaller};
use kontakt::{Error, Result};
use std::{collections::BTreeMap, fmt::Write, path::Path, process::Command};

/// Penalty in units of Young's modulus over the size of the elements in contact, by unknowns: what gives the least error of
/// the peak pressure. Ten times less closes too far, ten times more needs twice the iterations.
const PENALTIES: [(f64, f64); 4] = [(5e3, 3.5), (20e3, 8.0), (77e3, 20.0), (308e3, 25.0)];

pub const SETTING: &str = "- CalculiX: CPE4, surface-to-surface contact, linear pressure-overclosure with the penalty that gives the least error of the peak \
                           pressure at each\n  \
                           size, SPOOLES (Debian's build has no other direct solver), one increment; its mortar contact refuses plane elements.\n";

pub const FRICTION_SETTING: &str = "- CalculiX: TODO.\n";

/// With friction, what gives the least error of the tangential traction at all sizes: penalty, and stiffness of stick, in the same
/// units.
pub const FRICTION_PENALTIES: [f64; 2] = [2.0, 1.0];

/// The penalty for about so many unknowns.
pub fn penalty(dofs: f64) -> f64 {
    let off = |entry: &&(f64, f64)| (dofs / entry.0).ln().abs();
    PENALTIES.iter().min_by(|a, b| off(a).total_cmp(&off(b))).expect("there are penalties").1
}

/// With friction the penalties do not depend on the unknowns.
pub fn prepare(pair: &Pair, dofs: f64, directory: &Path) -> Result<()> {
    let [penalty, stick] = if pair.shear.is_some() { FRICTION_PENALTIES } else { [penalty(dofs), 0.0] };
    let unit = ELASTIC[0] / pair.contact_size();
    let deck = deck(pair, penalty * unit, stick * unit);
    std::fs::write(directory.join("calculix.inp"), deck).map_err(Error::internal)
}

pub fn command(directory: &Path) -> Command {
    let mut command = Command::new("ccx");
    command.arg("calculix").current_dir(directory);
    command
}

/// Largest contact pressure, Pa.
pub fn peak(directory: &Path) -> Option<f64> {
    stresses(directory)?.iter().map(|row| row[2]).reduce(larger)
}

/// Rows of the last table of contact stresses, a point of a face each: element, face, pressure, two shear stresses.
fn stresses(directory: &Path) -> Option<Vec<[f64; 5]>> {
    let text = std::fs::read_to_string(directory.join("calculix.dat")).ok()?;
    let (_, table) = text.rsplit_once("contact stress")?;
    let row = |line: &str| {
        let numbers: Vec<f64> = line.split_whitespace().map_while(|word| word.parse().ok()).collect();
        numbers.try_into().ok()
    };
    Some(table.lines().filter_map(row).collect())
}

/// Tangential tractions, Pa, of the first body's nodes in contact by their x: the mean of the faces beside a node. The table does not
/// say where its points are; over a face stresses are linear, and midway between their extremes in its middle.
pub fn tractions(pair: &Pair, directory: &Path) -> Option<Vec<(f64, f64)>> {
    let mut faces: BTreeMap<u32, [f64; 2]> = BTreeMap::new();
    for [element, _, _, q, _] in stresses(directory)? {
        let ends = faces.entry(element as u32 - 1).or_insert([q, q]);
        *ends = [smaller(ends[0], q), larger(ends[1], q)];
    }
    let mut nodes: BTreeMap<u32, f64> = BTreeMap::new();
    for facet in pair.facets(0) {
        let [low, high] = faces.get(&facet.cell).copied().unwrap_or_default();
        let share = 0.25 * (low + high);
        pair.meshes[0].facet_nodes(facet).for_each(|n| *nodes.entry(n).or_insert(0.0) += share);
    }
    Some(nodes.into_iter().map(|(n, q)| (pair.meshes[0].points[n as usize][0], q)).collect())
}

/// Plane strain, a linear step to press, and another to shear. CalculiX reads 20 characters of a number.
fn deck(pair: &Pair, penalty: f64, stick: f64) -> String {
    let first_node = [1, 1 + pair.meshes[0].points.len()];
    let first_cell = [1, 1 + pair.meshes[0].cells.len()];
    let mut text = String::from("*NODE, NSET=ALL\n");
    for (mesh, first) in std::iter::zip(&pair.meshes, first_node) {
        for (n, p) in mesh.points.iter().enumerate() {
            let _ = writeln!(text, "{},{:.16},{:.16},0", first + n, p[0], p[1]);
        }
    }
    for b in [0, 1] {
        let _ = writeln!(text, "*ELEMENT, TYPE=CPE4, ELSET=BODY{b}");
        for (c, cell) in pair.meshes[b].cells.iter().enumerate() {
            let _ = write!(text, "{}", first_cell[b] + c);
            for n in cell.nodes() {
                let _ = write!(text, ",{}", first_node[b] + *n as usize);
            }
            text.push('\n');
        }
        let _ = writeln!(text, "*SURFACE, NAME=ARC{b}, TYPE=ELEMENT");
        for f in pair.facets(b) {
            let _ = writeln!(text, "{},S{}", first_cell[b] + f.cell as usize, f.side + 1);
        }
        let _ = writeln!(text, "*NSET, NSET=FLAT{b}");
        for n in pair.flat(b) {
            let _ = writeln!(text, "{}", first_node[b] + n as usize);
        }
        if let Some(axis) = pair.axis[b] {
            let _ = writeln!(text, "*NSET, NSET=AXIS{b}\n{}", first_node[b] + axis);
        }
    }
    let _ = writeln!(text, "*MATERIAL, NAME=STEEL\n*ELASTIC\n{:e},{}", ELASTIC[0], ELASTIC[1]);
    for b in [0, 1] {
        let _ = writeln!(text, "*SOLID SECTION, ELSET=BODY{b}, MATERIAL=STEEL\n1");
    }
    let _ = writeln!(
        text,
        "*SURFACE INTERACTION, NAME=CONTACT\n*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR\n{penalty:.6e}"
    );
    if let Some(shear) = &pair.shear {
        let _ = writeln!(text, "*FRICTION\n{},{stick:.6e}", shear.friction);
    }
    text += "*CONTACT PAIR, INTERACTION=CONTACT, TYPE=SURFACE TO SURFACE\nARC0,ARC1\n";
    let mut press = String::from("*BOUNDARY\n");
    for b in [0, 1] {
        let _ = writeln!(press, "FLAT{b},2,2,{:e}", pair.lift[b]);
        if pair.axis[b].is_some() {
            let _ = writeln!(press, "AXIS{b},1,1,0");
        }
    }
    step(&mut text, &press);
    if let Some(shear) = &pair.shear {
        let mut pull = String::from("*CLOAD\n");
        for b in [0, 1] {
            for (n, force) in pair.pulled(b, shear.pull[b]) {
                let _ = writeln!(pull, "{},1,{force:.12e}", first_node[b] + n as usize);
            }
        }
        step(&mut text, &pull);
    }
    text
}

/// One increment.
fn step(text: &mut String, acts: &str) {
    *text += "*STEP\n*STATIC, SOLVER=SPOOLES\n1,1\n";
    *text += acts;
    *text += "*NODE OUTPUT\nU\n*ELEMENT OUTPUT\nS,E\n*CONTACT PRINT\nCSTR\n*END STEP\n";
}
