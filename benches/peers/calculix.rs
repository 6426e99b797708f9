//! CalculiX: deck, start, peak pressure.
use super::decks::{ELASTIC, Pair};
use kontakt::vector::larger;
use kontakt::{Error, Result};
use std::{fmt::Write, path::Path, process::Command};

/// Penalty in units of Young's modulus over the size of the elements in contact, by unknowns: what gives the least error of
/// the peak pressure. Ten times less closes too far, ten times more needs twice the iterations.
const PENALTIES: [(f64, f64); 4] = [(5e3, 3.5), (20e3, 8.0), (77e3, 20.0), (308e3, 25.0)];

pub const SETTING: &str = "- CalculiX: CPE4, surface-to-surface contact, linear pressure-overclosure with the penalty that gives the least error of the peak \
                           pressure at each\n  \
                           size, SPOOLES (Debian's build has no other direct solver), one increment; its mortar contact refuses plane elements.\n";

/// The penalty for about so many unknowns.
pub fn penalty(dofs: f64) -> f64 {
    let off = |entry: &&(f64, f64)| (dofs / entry.0).ln().abs();
    PENALTIES.iter().min_by(|a, b| off(a).total_cmp(&off(b))).expect("there are penalties").1
}

pub fn prepare(pair: &Pair, dofs: f64, directory: &Path) -> Result<()> {
    let penalty = penalty(dofs) * ELASTIC[0] / pair.contact_size();
    std::fs::write(directory.join("calculix.inp"), deck(pair, penalty)).map_err(Error::internal)
}

pub fn command(directory: &Path) -> Command {
    let mut command = Command::new("ccx");
    command.arg("calculix").current_dir(directory);
    command
}

/// Largest contact pressure, Pa, of the table of contact stresses: element, face, pressure, two shear stresses.
pub fn peak(directory: &Path) -> Option<f64> {
    let text = std::fs::read_to_string(directory.join("calculix.dat")).ok()?;
    let table = text.lines().skip_while(|line| !line.contains("contact stress"));
    let pressures = table.filter_map(|line| {
        let numbers: Vec<f64> = line.split_whitespace().map_while(|word| word.parse().ok()).collect();
        (numbers.len() == 5).then(|| numbers[2])
    });
    pressures.reduce(larger)
}

/// Plane strain, one linear step. CalculiX reads 20 characters of a number.
fn deck(pair: &Pair, penalty: f64) -> String {
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
        let _ = writeln!(text, "*NSET, NSET=AXIS{b}\n{}", first_node[b] + pair.axis[b]);
    }
    let _ = writeln!(text, "*MATERIAL, NAME=STEEL\n*ELASTIC\n{:e},{}", ELASTIC[0], ELASTIC[1]);
    for b in [0, 1] {
        let _ = writeln!(text, "*SOLID SECTION, ELSET=BODY{b}, MATERIAL=STEEL\n1");
    }
    let _ = writeln!(
        text,
        "*SURFACE INTERACTION, NAME=CONTACT\n*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR\n{penalty:.6e}\n\
         *CONTACT PAIR, INTERACTION=CONTACT, TYPE=SURFACE TO SURFACE\nARC0,ARC1\n\
         *STEP\n*STATIC, SOLVER=SPOOLES\n1,1\n*BOUNDARY"
    );
    for b in [0, 1] {
        let _ = writeln!(text, "FLAT{b},2,2,{:e}\nAXIS{b},1,1,0", pair.lift[b]);
    }
    text += "*NODE OUTPUT\nU\n*ELEMENT OUTPUT\nS,E\n*CONTACT PRINT\nCSTR\n*END STEP\n";
    text
}
