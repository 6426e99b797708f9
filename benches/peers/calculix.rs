//! CalculiX: deck, start, results.
use super::decks::{ELASTIC, Pair, YIELD};
use kontakt::vector::larger;
use kontakt::{Error, Result};
use std::{collections::BTreeMap, fmt::Write, path::Path, process::Command};

/// Penalty in units of Young's modulus over the size of the elements in contact, by unknowns: what gives the least error of
/// the peak pressure. Ten times less closes too far, ten times more needs twice the iterations.
const PENALTIES: [(f64, f64); 4] = [(5e3, 3.5), (20e3, 8.0), (77e3, 20.0), (308e3, 25.0)];

pub const SETTING: &str = "- CalculiX: CPE4, surface-to-surface contact, linear pressure-overclosure with the penalty that gives the least error of the peak \
                           pressure at each\n  \
                           size, SPOOLES (Debian's build has no other direct solver), one increment; its mortar contact refuses plane elements.\n";

pub const FRICTION_SETTING: &str = "- CalculiX: CPE4, node-to-surface contact, linear pressure-overclosure and stick with the penalties that give the least error of q at each size,\n  \
                           SPOOLES, one increment for each step. It presses without friction, the upper body held on its axis: with friction, which has nothing to carry\n  \
                           in that step, it takes the normals of one surface, along which the approach of the surfaces is slip, needs up to 18 increments and five to\n  \
                           seven times the CPU seconds, and was off by 5 % in q at 40 000 unknowns. Surface-to-surface contact was off by 6 % or more there at its best\n  \
                           penalties: it puts slivers of faces between matching nodes.\n";

pub const PLASTICITY_SETTING: &str = "- CalculiX: CPE4, node-to-surface contact, linear pressure-overclosure with a penalty of E/h, which makes the force less by 0.4 %\n  \
                                      on the coarsest mesh and by 0.1 % from 20 000 unknowns on (3 E/h needs 5 to 10 % more iterations), SPOOLES. The first tenth of the way in\n  \
                                      parts, the first of them a quarter: in one it is cut after twelve iterations. Its tolerance of forces is its own, 0.5 %; all others have 1e-8.\n  \
                                      Surface-to-surface contact needs nearly twice the iterations, a step for each tenth up to a fifth more; CPE4R stays off by 0.9 % and needs cuts.\n";

/// Where the bodies yield, in the same units: the force is less by 0.4 % on the coarsest mesh, by less on finer ones.
const PLASTIC_PENALTY: f64 = 1.0;

/// With friction: penalty, and stiffness of stick, in the same units. Some others need several increments.
const FRICTION_PENALTIES: [(f64, [f64; 2]); 2] = [(40e3, [8.0, 20.0]), (160e3, [14.0, 40.0])];
/// Hardly any: the first step's, where the surfaces have a law of friction from the start.
const NO_FRICTION: f64 = 1e-9;

/// The entry of a table for about so many unknowns.
fn entry<V: Copy>(table: &[(f64, V)], dofs: f64) -> V {
    let off = |entry: &&(f64, V)| (dofs / entry.0).ln().abs();
    table.iter().min_by(|a, b| off(a).total_cmp(&off(b))).expect("a table has entries").1
}

/// The penalty for about so many unknowns.
pub fn penalty(dofs: f64) -> f64 {
    entry(&PENALTIES, dofs)
}

/// With friction: penalty and stiffness of stick.
pub fn friction_penalties(dofs: f64) -> [f64; 2] {
    entry(&FRICTION_PENALTIES, dofs)
}

pub fn prepare(pair: &Pair, dofs: f64, directory: &Path) -> Result<()> {
    let [penalty, stick] = match (&pair.shear, pair.plastic) {
        (Some(_), _) => friction_penalties(dofs),
        (None, Some(_)) => [PLASTIC_PENALTY, 0.0],
        (None, None) => [penalty(dofs), 0.0],
    };
    let unit = ELASTIC[0] / pair.contact_size();
    let deck = deck(pair, penalty * unit, stick * unit);
    std::fs::write(directory.join("calculix.inp"), deck).map_err(Error::internal)
}

pub fn command(directory: &Path) -> Command {
    let mut command = Command::new("ccx");
    command.arg("calculix").current_dir(directory);
    command
}

/// Largest contact pressure, Pa, of the points of the faces: element, face, pressure, two shear stresses.
pub fn peak(directory: &Path) -> Option<f64> {
    stresses::<5>(directory)?.iter().map(|row| row[2]).reduce(larger)
}

/// Force on the upper body's flat along y, N.
pub fn force(directory: &Path) -> Option<f64> {
    let text = std::fs::read_to_string(directory.join("calculix.dat")).ok()?;
    let (_, table) = text.rsplit_once("total force")?;
    table.lines().nth(2)?.split_whitespace().nth(1)?.parse().ok()
}

/// Factorisations, which are the iterations of all increments.
pub fn factorisations(directory: &Path) -> usize {
    let log = std::fs::read_to_string(directory.join("CalculiX.log")).unwrap_or_default();
    log.lines().filter(|line| line.starts_with(" iteration ")).count()
}

/// Rows of the last table of contact stresses.
fn stresses<const N: usize>(directory: &Path) -> Option<Vec<[f64; N]>> {
    let text = std::fs::read_to_string(directory.join("calculix.dat")).ok()?;
    let (_, table) = text.rsplit_once("contact stress")?;
    let row = |line: &str| {
        let numbers: Vec<f64> = line.split_whitespace().map_while(|word| word.parse().ok()).collect();
        numbers.try_into().ok()
    };
    Some(table.lines().filter_map(row).collect())
}

/// Tangential tractions, Pa, of the nodes in contact by their x; the table has node, pressure, two shear stresses. The nodes are those
/// of the solid that CalculiX makes of the plane: two of each, of whose places only the file of results knows.
pub fn tractions(directory: &Path) -> Option<Vec<(f64, f64)>> {
    const HEAD: &[u8] = b"\n    2C";
    let file = std::fs::read(directory.join("calculix.frd")).ok()?;
    let head = file.windows(HEAD.len()).position(|bytes| bytes == HEAD)? + HEAD.len();
    let line = file[head..].split(|byte| *byte == b'\n').next()?;
    let count: usize = std::str::from_utf8(line).ok()?.split_whitespace().next()?.parse().ok()?;
    // A record is a node, 4 bytes, and three coordinates, 8 bytes each.
    let records = file[head + line.len() + 1..].chunks_exact(28).take(count);
    let place = |record: &[u8]| {
        let node = u32::from_le_bytes(record[..4].try_into().ok()?);
        Some((node, f64::from_le_bytes(record[4..12].try_into().ok()?)))
    };
    let x: BTreeMap<u32, f64> = records.map_while(place).collect();
    stresses::<4>(directory)?.iter().map(|row| Some((*x.get(&(row[0] as u32))?, row[2]))).collect()
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
        let axis = pair.axis[b].unwrap_or_else(|| pair.middle(b));
        let _ = writeln!(text, "*NSET, NSET=AXIS{b}\n{}", first_node[b] + axis);
    }
    let _ = writeln!(text, "*MATERIAL, NAME=STEEL\n*ELASTIC\n{:e},{}", ELASTIC[0], ELASTIC[1]);
    if pair.plastic.is_some() {
        // Linear to a strain of 1, which nothing reaches.
        let _ = writeln!(text, "*PLASTIC\n{:e},0\n{:e},1", YIELD[0], YIELD[0] + YIELD[1]);
    }
    for b in [0, 1] {
        let _ = writeln!(text, "*SOLID SECTION, ELSET=BODY{b}, MATERIAL=STEEL\n1");
    }
    let _ = writeln!(
        text,
        "*SURFACE INTERACTION, NAME=CONTACT\n*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR\n{penalty:.6e}"
    );
    if pair.shear.is_some() {
        let _ = writeln!(text, "*FRICTION\n{NO_FRICTION:e},{stick:.6e}");
    }
    let kind = if pair.shear.is_some() || pair.plastic.is_some() { "NODE" } else { "SURFACE" };
    let _ = writeln!(text, "*CONTACT PAIR, INTERACTION=CONTACT, TYPE={kind} TO SURFACE\nARC0,ARC1");
    let supports = |held: [bool; 2]| {
        let mut lines = String::new();
        for b in [0, 1] {
            let _ = writeln!(lines, "FLAT{b},2,2,{:e}", pair.lift[b]);
            if held[b] {
                let _ = writeln!(lines, "AXIS{b},1,1,0");
            }
        }
        lines
    };
    let Some(shear) = &pair.shear else {
        let increments = pair.plastic.unwrap_or(1);
        step(&mut text, increments, "", &format!("*BOUNDARY\n{}", supports([true; 2])), "");
        return text;
    };
    // The places of the solid's nodes.
    let output = ", OUTPUT=3D";
    step(&mut text, 1, "", &format!("*BOUNDARY\n{}", supports([true; 2])), output);
    let mut acts = format!("*BOUNDARY, OP=NEW\n{}*CLOAD\n", supports(pair.axis.map(|axis| axis.is_some())));
    for b in [0, 1] {
        for (n, force) in pair.pulled(b, shear.pull[b]) {
            let _ = writeln!(acts, "{},1,{force:.12e}", first_node[b] + n as usize);
        }
    }
    let law = format!("*CHANGE FRICTION, INTERACTION=CONTACT\n*FRICTION\n{},{stick:.6e}\n", shear.friction);
    step(&mut text, 1, &law, &acts, output);
    text
}

/// So many equal increments, which may be cut, the first of several in parts that grow; the results of the last.
fn step(text: &mut String, increments: usize, law: &str, acts: &str, output: &str) {
    const PARTS: f64 = 4.0;
    let most = 1.0 / increments as f64;
    let first = if increments > 1 { most / PARTS } else { most };
    let _ = write!(
        text,
        "*STEP, INC=1000\n{law}*STATIC, SOLVER=SPOOLES\n{first},1,1e-5,{most}\n{acts}*NODE OUTPUT{output}, FREQUENCY=1000\nU\n\
         *ELEMENT OUTPUT, FREQUENCY=1000\nS,E\n*CONTACT PRINT, FREQUENCY=1000\nCSTR\n\
         *NODE PRINT, NSET=FLAT0, TOTALS=ONLY, FREQUENCY=1000\nRF\n*END STEP\n"
    );
}
