//! Bodies in contact that turn together, `geometry = "updated"`: turning is no slip, and slip is carried along.
use super::friction::STEEL;
use super::{gapped, near, rectangle, solve_all, value};
use kontakt::record::{IN_CONTACT, PairTables, SideTable};
use serde_json::Value;

/// Pressure on the block, how far a wall pushes it along the slab, and where it goes back to, m.
const PRESSURE: f64 = 2e7;
const ALONG: f64 = 2e-3;
const BACK: f64 = 1e-3;

/// A block that its load presses on a slab, and that a smooth wall pushes along and leaves there. Then the slab is turned about the origin
/// by its support, u = w (-y, x), and takes the block along by friction alone.
fn scene(push: f64, turn: f64, increments: usize) -> String {
    let block = rectangle(
        "block",
        "steel",
        "quad4",
        (0.0, 0.02, 13),
        (0.0, 0.01, 7),
        &format!("load = [{{ surface = \"top\", traction = [0, -{PRESSURE}] }}]"),
    );
    let slab = rectangle(
        "slab",
        "steel",
        "quad4",
        (-0.02, 0.04, 47),
        (-0.02, 0.0, 9),
        &format!(
            "support = [{{ surface = \"bottom\", x = \"-{turn}*y\", y = \"{turn}*x\", path = \"turn\" }}]"
        ),
    );
    format!(
        "analysis = \"plane strain\"\n{STEEL}{block}{slab}\
         [[body]]\nname = \"wall\"\nrigid = {{ plane = {{ through = [-1e-4, 0], normal = [1, 0] }}, x = 1, path = \"wall\" }}\n\
         [[contact]]\nname = \"pair\"\nsurfaces = [\"block.bottom\", \"slab.top\"]\nfriction = 0.5\ngeometry = \"updated\"\n\
         [[contact]]\nname = \"wall\"\nsurfaces = [\"block.left\", \"wall.surface\"]\n\
         [[probe]]\nname = \"left\"\nbody = \"block\"\nat = [0, 0.01]\n[[probe]]\nname = \"right\"\nbody = \"block\"\nat = [0.02, 0.01]\n\
         [[step]]\npaths = {{ wall = 0 }}\n[[step]]\npaths = {{ wall = {} }}\nsteps = 2\n[[step]]\npaths = {{ wall = -{BACK} }}\n\
         [[step]]\npaths = {{ turn = 1 }}\nsteps = {increments}\n",
        push + 1e-4,
    )
}

fn of(summary: &Value, step: usize, key: &str) -> f64 {
    value(&summary["steps"][step], &format!("pairs.{key}"))
}

#[test]
fn a_block_is_taken_along_by_a_turning_slab() {
    let load = PRESSURE * 0.02;
    // One degree, either way.
    for turn in [0.017455065_f64, -0.017455065] {
        for push in [0.0, ALONG] {
            for increments in [1, 5] {
                let (summary, results) = solve_all(&scene(push, turn, increments), 1, &[]);
                let what = format!("turned by {turn} in {increments}, pushed by {push}");
                // The load keeps its direction: what lies on a slope.
                let (s, c) = turn.atan().sin_cos();
                near(of(&summary, 3, "pair.resultant.1"), load, 1e-9 * load, &what);
                near(of(&summary, 3, "pair.normal_force"), load * c, 1e-4 * load, &what);
                near(of(&summary, 3, "pair.friction.force"), load * s, 1e-4 * load, &what);
                // It goes where a rigid body on the slab goes from where it was.
                for (k, x) in [[0.0, 0.01], [0.02, 0.01]].into_iter().enumerate() {
                    let at = |step: usize, c: usize| {
                        value(&summary["steps"][step], &format!("probes.{k}.displacement.{c}"))
                    };
                    let [x, y] = [x[0] + at(2, 0), x[1] + at(2, 1)];
                    // What the friction strains: T over the modulus.
                    near(at(3, 0) - at(2, 0), -turn * y, 5e-8, &what);
                    near(at(3, 1) - at(2, 1), turn * x, 5e-8, &what);
                }
                // What sticks has not slipped by turning, and has its slip of before.
                let [before, after] = [&results.before[2].pairs[..], &results.pairs[..]].map(side);
                let [old, new] = [&before, &after].map(|t| t.tangential.as_ref().expect("a law"));
                let stuck: Vec<usize> =
                    (0..after.s.len()).filter(|&i| after.status[i] == IN_CONTACT).collect();
                assert!(stuck.len() >= 13, "{what}: {stuck:?}");
                for i in stuck {
                    near(new.slip[i], old.slip[i], 1e-14 * ALONG, &what);
                }
                if push == 0.0 {
                    assert_eq!(
                        (
                            of(&summary, 3, "pair.friction.max_slip"),
                            of(&summary, 3, "pair.friction.dissipated")
                        ),
                        (0.0, 0.0)
                    );
                }
                let lost =
                    of(&summary, 3, "pair.friction.dissipated") - of(&summary, 2, "pair.friction.dissipated");
                near(of(&summary, 3, "pair.friction.max_slip"), push, 1e-3 * ALONG, &what);
                // But for what slips at the edges, since T is new.
                assert!(lost >= 0.0 && lost <= 1e-5 * 0.5 * load * ALONG, "{what}: {lost:e}");
            }
        }
    }
}

/// The side with the multipliers of the first pair.
fn side(pairs: &[PairTables]) -> SideTable {
    gapped(&pairs[0]).clone()
}
