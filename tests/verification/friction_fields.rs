//! Tangential tractions, slips and status at the nodes of the grid: those of the tables along the surfaces, and nothing elsewhere.
use super::{
    friction::{A_OVER_B, discs},
    multipliers, solve_all,
};
use kontakt::{
    output::{Field, Piece, Results},
    record::{IN_CONTACT, PairTables, SLIPS},
    vector::largest,
};
use std::collections::BTreeMap;

/// Traction, slip and status at a node, by body and place: bodies that touch have nodes at one place.
type Nodes = BTreeMap<(usize, [u64; 2]), [f64; 7]>;

fn place(body: usize, x: &[f64; 3]) -> (usize, [u64; 2]) {
    // Either nought is the same place.
    (body, [(x[0] + 0.0).to_bits(), (x[1] + 0.0).to_bits()])
}

/// Of the grid. What several ranks have must be the same on all of them.
fn nodes(piece: &Piece, fields: &[Field]) -> Nodes {
    let field = |name: &str, unit: &str, components: usize| {
        let field = fields.iter().find(|f| f.name == name).expect("a case with friction has it");
        assert_eq!((field.unit, field.components), (unit, components), "{name}");
        &field.values
    };
    let (t, g) = (field("tangential_traction", "Pa", 3), field("slip", "m", 3));
    let status = field("contact_status", "-", 1);
    let mut nodes = Nodes::new();
    for (cell, &body) in std::iter::zip(&piece.cells, &piece.cell_bodies) {
        for &n in cell.nodes() {
            let n = n as usize;
            let (t, g) = (&t[3 * n..][..3], &g[3 * n..][..3]);
            let values = [t[0], t[1], t[2], g[0], g[1], g[2], status[n]];
            let known = nodes.entry(place(body as usize, &piece.points[n])).or_insert(values);
            assert_eq!(*known, values, "node at {:?}", piece.points[n]);
        }
    }
    nodes
}

/// The nodes of the grid against the tables of the only pair of bodies 0 and 1; nodes that slip.
fn compare(found: &Nodes, pair: &PairTables) -> usize {
    let (mut rest, mut slipping) = (found.clone(), 0);
    for (body, side) in pair.sides.iter().flatten().enumerate() {
        let along = side.tangential.as_ref().expect("a law");
        for i in 0..side.s.len() {
            let [x, y, _] = side.normal[i];
            let (q, g) = (along.traction[i], along.slip[i]);
            let expected = [-q * y, q * x, 0.0, -g * y, g * x, 0.0, f64::from(side.status[i])];
            assert_eq!(rest.remove(&place(body, &side.x[i])), Some(expected), "body {body}, {:?}", side.x[i]);
            slipping += usize::from(side.status[i] == SLIPS);
        }
    }
    assert!(rest.len() > 100 && rest.values().all(|values| *values == [0.0; 7]), "away from the surfaces");
    slipping
}

#[test]
fn the_grid_has_what_the_tables_have_after_each_step() {
    for surfaces in [A_OVER_B, "\"lower.arc\", \"upper.arc\""] {
        let (_, results) = solve_all(&discs(0.3, 10.0, surfaces, &[0.0, 0.6, 0.2]), 1, &[]);
        // Upper is body 0.
        let ordered = |pair: &PairTables| {
            let mut pair = pair.clone();
            if surfaces != A_OVER_B {
                pair.sides.swap(0, 1);
            }
            pair
        };
        let piece = &results.piece;
        let states = results.before.iter().map(|state| (&state.point_fields, &state.pairs));
        let states = states.chain([(&piece.point_fields, &results.pairs)]);
        let slipping: Vec<usize> =
            states.map(|(fields, pairs)| compare(&nodes(piece, fields), &ordered(&pairs[0]))).collect();
        assert!(slipping[0] == 0 && slipping[1] > 4 && slipping[2] > 0, "{slipping:?}");
        // The upper body goes to the right: on it friction acts to the left, and it slips to the right, by what is expected
        // of the lower one to the left.
        let last = nodes(piece, &results.before[1].point_fields);
        let slips = |body: usize| last.iter().filter(move |(at, v)| at.0 == body && v[6] == f64::from(SLIPS));
        assert!(slips(0).count() > 1 && slips(0).all(|(_, v)| v[0] < 0.0 && v[3] > 0.0));
        assert!(slips(1).count() > 1 && slips(1).all(|(_, v)| v[0] > 0.0 && v[3] < 0.0));
    }
}

#[test]
fn ranks_agree_on_the_grid() {
    let of = |ranks: usize| -> (Nodes, Results) {
        let (_, results) = solve_all(&discs(0.3, 12.0, A_OVER_B, &[0.0, 0.6]), ranks, &[]);
        (nodes(&results.piece, &results.piece.point_fields), results)
    };
    let (one, results) = of(1);
    let table = multipliers(&results, 0);
    let along = table.tangential.as_ref().expect("a law");
    let scales = [largest(&along.traction), largest(&along.slip)];
    for ranks in [2, 4] {
        let (other, results) = of(ranks);
        compare(&other, &results.pairs[0]);
        assert!(one.keys().eq(other.keys()), "{ranks} ranks");
        for (a, b) in std::iter::zip(one.values(), other.values()) {
            let near = |range: std::ops::Range<usize>, scale: f64| {
                std::iter::zip(&a[range.clone()], &b[range]).all(|(a, b)| (a - b).abs() < 1e-8 * scale)
            };
            assert!(near(0..3, scales[0]) && near(3..6, scales[1]), "{ranks} ranks: {a:?} and {b:?}");
            assert_eq!(a[6], b[6], "{ranks} ranks");
        }
    }
}

/// A block bonded to another that it also leans on without friction: a node of both pairs has the traction of the one, and the
/// smooth surface a status alone.
#[test]
fn a_smooth_pair_beside_one_with_a_law_has_a_status_alone() {
    let body = |name: &str, x: [f64; 2], y: [f64; 2], rest: &str| {
        format!(
            "[[body]]\nname = \"{name}\"\nmaterial = \"m\"\nmesh.rectangle = {{ x = {{ from = {}, to = {}, cells = 8 }}, \
             y = {{ from = {}, to = {}, cells = 8 }} }}\n{rest}\n",
            x[0], x[1], y[0], y[1]
        )
    };
    let text = format!(
        "analysis = \"plane strain\"\nmaterial.m = {{ young = 2.1e11, poisson = 0.3 }}\n{}{}{}\
         [[contact]]\nname = \"glue\"\nsurfaces = [\"block.bottom\", \"floor.top\"]\nlaw = \"tied\"\n\
         [[contact]]\nname = \"smooth\"\nsurfaces = [\"block.right\", \"wall.left\"]\n",
        body("block", [0.0, 0.02], [0.0, 0.02], "load = [{ surface = \"left\", pressure = 1e8 }]"),
        body("floor", [0.0, 0.02], [-0.02, 0.0], "support = [{ surface = \"bottom\", x = 0, y = 0 }]"),
        body("wall", [0.02, 0.04], [0.0, 0.02], "support = [{ surface = \"right\", x = 0, y = 0 }]"),
    );
    let (_, results) = solve_all(&text, 2, &[]);
    let found = nodes(&results.piece, &results.piece.point_fields);
    let at = |body: usize, x: f64, y: f64| found[&place(body, &[x, y, 0.0])];
    let touches = f64::from(IN_CONTACT);
    let table = multipliers(&results, 0);
    let along = &table.tangential.as_ref().expect("a law").traction;
    assert!(largest(along) > 1e6, "the load is carried along the floor, too");
    let bonded = at(0, 0.01, 0.0);
    assert!(bonded[0] < -1e6 && bonded[6] == touches, "{bonded:?}");
    assert_eq!(at(2, 0.02, 0.01), [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, touches]);
    // In both.
    let corner = at(0, 0.02, 0.0);
    assert!(
        corner[0] != 0.0 && corner[1].abs() < 1e-9 * corner[0].abs() && corner[6] == touches,
        "{corner:?}"
    );
    // The law is in the file.
    let laws: Vec<&str> = results.pairs.iter().map(|pair| pair.law.name()).collect();
    assert_eq!(laws, ["tied", "frictionless"]);
}
