//! Twenty random scenes of one seed, of every family; more of them, and those that are not right yet: scripts/random.
mod common;
#[path = "common/random/mod.rs"]
mod random;

/// Scenes of seed 1.
const SCENES: [u64; 20] = [2, 3, 4, 5, 6, 7, 9, 11, 16, 17, 20, 34, 37, 40, 44, 45, 48, 49, 52, 56];

#[test]
fn twenty_scenes_are_right() {
    let rows: Vec<random::Row> = SCENES.iter().map(|&number| random::check(1, number)).collect();
    let failed: Vec<String> =
        rows.iter().filter(|row| row.verdict != random::Verdict::Right).map(random::Row::line).collect();
    assert!(failed.is_empty(), "{} of {}:\n{}", failed.len(), rows.len(), failed.join("\n"));
    assert!(rows.iter().any(|row| row.compared == "dense"), "the dense solution is compared with");
}
