//! What a case does not ask for costs nothing: unknowns, factorisations, solves, messages, fields in the file.
mod common;
#[path = "../benches/common/scene.rs"]
mod scene;

use common::{run, summary};
use scene::{Contact, Heat, Scene};
use serde_json::Value;

/// What a run has cost, and what its file has.
#[derive(Debug, PartialEq)]
struct Cost {
    unknowns: u64,
    factorisations: u64,
    /// Of the dense interface operators.
    interface: u64,
    solves: u64,
    alternations: u64,
    force_steps: u64,
    messages: u64,
    bytes_sent: u64,
    point_fields: Vec<String>,
    /// Groups of the file: contact tables, time series, table of steps.
    groups: Vec<String>,
    file_bytes: u64,
}

fn cost(scene: Scene, ranks: usize) -> (Cost, Value) {
    cost_with(scene, ranks, &[])
}

/// With settings.
fn cost_with(scene: Scene, ranks: usize, settings: &[&str]) -> (Cost, Value) {
    let directory = tempfile::tempdir().unwrap();
    let (case, out) = (directory.path().join("case.toml"), directory.path().join("out"));
    std::fs::write(&case, scene.text()).unwrap();
    let output = run(ranks, &case, &out, settings);
    assert_eq!(output.status.code(), Some(0), "{scene:?}: {}", String::from_utf8_lossy(&output.stderr));
    let found = summary(&out);
    common::check_invariants(&found, &format!("{scene:?} on {ranks} ranks"));
    let bodies = found["bodies"].as_array().unwrap();
    let sum = |key: &str| bodies.iter().map(|b| b[key].as_u64().unwrap()).sum();
    let number = |path: &str| found.pointer(path).and_then(Value::as_u64).unwrap();
    let path = out.join("result.vtkhdf");
    let file = hdf5::File::open(&path).unwrap();
    let mut point_fields = file.group("VTKHDF/PointData").unwrap().member_names().unwrap();
    point_fields.sort();
    let named = ["contact", "VTKHDF/Steps", "steps", "rigid"];
    let groups = named.into_iter().filter(|name| file.group(name).is_ok_and(|g| !g.is_empty()));
    let cost = Cost {
        unknowns: sum("dofs"),
        factorisations: sum("factorisations"),
        interface: sum("interface_factorisations"),
        solves: sum("solves"),
        alternations: number("/alternations"),
        force_steps: number("/force_steps"),
        messages: number("/exchange/messages"),
        bytes_sent: number("/exchange/bytes"),
        point_fields,
        groups: groups.map(String::from).collect(),
        file_bytes: std::fs::metadata(&path).unwrap().len(),
    };
    (cost, found)
}

const BASE: Scene = Scene {
    contact: Contact::Closed,
    rigid: false,
    heat: Heat::None,
    geometry: None,
    steps: None,
    size: 2.0,
};

#[test]
fn one_rank_sends_nothing_and_two_send_only_at_the_interface() {
    let (one, _) = cost(BASE, 1);
    assert_eq!((one.messages, one.bytes_sent), (0, 0));
    assert_eq!(one.factorisations, 2, "once for each body");
    let (two, found) = cost(BASE, 2);
    assert!(two.messages > 0, "two bodies on two ranks must exchange");
    // An exchange is a vector along the surface, never the interior: its length does not exceed the nodes of an arc times
    // the values that describe one.
    let interface: u64 =
        found["bodies"].as_array().unwrap().iter().map(|b| b["interface_dofs"].as_u64().unwrap()).sum();
    assert!(
        two.bytes_sent / two.messages < 8 * 16 * interface,
        "{two:?}, {interface} unknowns of interfaces"
    );
    // As many messages again at four times the unknowns, but for the alternations that are more.
    let (fine, _) = cost(Scene { size: 1.0, ..BASE }, 2);
    assert!(fine.messages <= 2 * two.messages, "{} messages, then {}", two.messages, fine.messages);
}

#[test]
fn without_contact_each_body_is_solved_once_and_nothing_is_exchanged() {
    for ranks in [1, 2] {
        let (alone, found) = cost(Scene { contact: Contact::None, ..BASE }, ranks);
        assert_eq!(found["reason"], "no_contact");
        assert_eq!((alone.alternations, alone.force_steps, alone.interface), (0, 0, 0));
        assert_eq!((alone.factorisations, alone.solves), (2, 2), "one of each for each body, {ranks} ranks");
        assert_eq!((alone.messages, alone.bytes_sent), (0, 0), "{ranks} ranks");
        assert_eq!(alone.groups, Vec::<String>::new());
    }
}

#[test]
fn without_temperature_there_is_no_heat_anywhere() {
    let (cold, _) = cost(BASE, 2);
    assert!(!cold.point_fields.iter().any(|name| name.contains("temperature")), "{:?}", cold.point_fields);
    // Expansion that nothing calls for.
    let (expansion, _) = cost(Scene { heat: Heat::Expansion, ..BASE }, 2);
    assert_eq!(Cost { file_bytes: cold.file_bytes, ..expansion }, cold);
    let (hot, _) = cost(Scene { heat: Heat::Uniform, ..BASE }, 2);
    assert!(hot.point_fields.iter().any(|name| name.contains("temperature")), "{:?}", hot.point_fields);
    // Heat has no unknowns here, and the temperature is known beforehand: no factorisation for it.
    assert_eq!((hot.unknowns, hot.factorisations), (cold.unknowns, cold.factorisations));
    assert!(hot.file_bytes > cold.file_bytes);
}

#[test]
fn without_friction_nothing_of_it_is_at_the_nodes() {
    let (smooth, _) = cost(BASE, 2);
    assert_eq!(smooth.point_fields, ["displacement", "strain", "stress", "von_mises"]);
    // A law without strength is none.
    let (nought, _) = cost_with(BASE, 2, &["--set", "contact.contact.friction=0"]);
    assert_eq!(Cost { file_bytes: smooth.file_bytes, ..nought }, smooth);
    let (rough, _) = cost_with(BASE, 2, &["--set", "contact.contact.friction=0.1"]);
    let more =
        ["contact_status", "displacement", "slip", "strain", "stress", "tangential_traction", "von_mises"];
    assert_eq!(rough.point_fields, more);
    assert!(rough.file_bytes > smooth.file_bytes);
}

/// A modulus over temperature is looked up at each point, once.
#[test]
fn a_table_over_temperature_costs_no_factorisation() {
    let (constant, _) = cost(Scene { heat: Heat::Uniform, ..BASE }, 1);
    let (table, found) = cost(Scene { heat: Heat::Table { falling: false }, ..BASE }, 1);
    assert_eq!(Cost { file_bytes: constant.file_bytes, ..table }, constant);
    let (falling, softer) = cost(Scene { heat: Heat::Table { falling: true }, ..BASE }, 1);
    assert_eq!((falling.unknowns, falling.factorisations), (constant.unknowns, constant.factorisations));
    let force = |found: &Value| found["pairs"][0]["normal_force"].as_f64().unwrap();
    assert!(force(&softer) < 0.95 * force(&found), "the table is used");
}

#[test]
fn the_initial_geometry_is_searched_once_the_updated_one_alternates_again() {
    let (absent, _) = cost(BASE, 1);
    let (initial, _) = cost(Scene { geometry: Some("initial"), ..BASE }, 1);
    assert_eq!(
        Cost { file_bytes: absent.file_bytes, ..initial },
        absent,
        "the key at its default costs nothing"
    );
    let (updated, _) = cost(Scene { geometry: Some("updated"), ..BASE }, 1);
    assert!(updated.alternations > absent.alternations, "{} alternations", updated.alternations);
    assert_eq!((updated.unknowns, updated.factorisations), (absent.unknowns, absent.factorisations));
}

#[test]
fn a_rigid_body_has_no_unknowns_and_no_messages() {
    let (elastic, _) = cost(BASE, 1);
    for ranks in [1, 2] {
        let (rigid, _) = cost(Scene { rigid: true, ..BASE }, ranks);
        assert_eq!(
            (2 * rigid.unknowns, rigid.factorisations),
            (elastic.unknowns, 1),
            "half of the unknowns, {ranks} ranks"
        );
        assert_eq!((rigid.messages, rigid.bytes_sent), (0, 0), "{ranks} ranks");
        assert!(rigid.groups.contains(&"rigid".to_string()));
    }
    assert!(!elastic.groups.contains(&"rigid".to_string()));
}

#[test]
fn without_steps_the_file_has_no_time_series() {
    let (absent, found) = cost(BASE, 1);
    assert_eq!(absent.groups, ["contact"]);
    assert!(found.get("steps").is_none());
    let (four, found) = cost(Scene { steps: Some(4), ..BASE }, 1);
    assert_eq!(found["steps"].as_array().unwrap().len(), 4);
    assert!(four.groups.contains(&"VTKHDF/Steps".to_string()) && four.groups.contains(&"steps".to_string()));
    // The stiffness does not change from step to step.
    assert_eq!((four.unknowns, four.factorisations), (absent.unknowns, absent.factorisations));
}
