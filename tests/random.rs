//! The first twenty random scenes of one seed; more of them: scripts/random.
mod common;
#[path = "common/random/mod.rs"]
mod random;

#[test]
fn twenty_scenes_are_right() {
    let rows: Vec<random::Row> = (0..20).map(|number| random::check(1, number)).collect();
    let failed: Vec<String> =
        rows.iter().filter(|row| row.verdict != random::Verdict::Right).map(random::Row::line).collect();
    assert!(failed.is_empty(), "{} of {}:\n{}", failed.len(), rows.len(), failed.join("\n"));
    assert!(rows.iter().any(|row| row.compared == "dense"), "the dense solution is compared with");
}
