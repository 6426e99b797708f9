//! The quick hard cases on 1 and 2 ranks; all of them: scripts/hard.
mod common;
#[path = "common/hard/mod.rs"]
mod hard;

#[test]
fn quick_cases() {
    let rows: Vec<hard::Row> =
        hard::items(true, "").iter().map(|item| hard::check(item, Some(&[1, 2]))).collect();
    assert!(rows.len() > 50, "the quick subset is there");
    let wrong: Vec<String> = rows.iter().filter(|row| !row.ok).map(hard::Row::line).collect();
    assert!(wrong.is_empty(), "{} of {} wrong:\n{}", wrong.len(), rows.len(), wrong.join("\n"));
}

/// What is peculiar to surfaces that are followed: clamps that slip, pins and discs that spin, strains that cannot be followed.
#[test]
fn quick_cases_with_updated_geometry() {
    const CASES: [&str; 7] =
        ["disc-on-plane", "free-pin", "leaves", "out-of-range", "patch", "stack-of-five", "wedge"];
    let of = |item: &hard::Item| CASES.iter().any(|case| item.name.split(['/', ' ']).next() == Some(case));
    let items: Vec<hard::Item> = hard::updated(hard::items(false, "")).into_iter().filter(of).collect();
    assert!(CASES.len() < items.len(), "variants are there, too");
    let rows: Vec<hard::Row> = items.iter().map(|item| hard::check(item, Some(&[1, 2]))).collect();
    let wrong: Vec<String> = rows.iter().filter(|row| !row.ok).map(hard::Row::line).collect();
    assert!(wrong.is_empty(), "{} of {} wrong:\n{}", wrong.len(), rows.len(), wrong.join("\n"));
}

#[test]
fn every_variant_states_what_to_expect() {
    let unmatched = hard::unmatched();
    assert!(unmatched.is_empty(), "{}", unmatched.join("\n"));
}

#[test]
fn every_case_reads() {
    let unreadable = hard::unreadable();
    assert!(unreadable.is_empty(), "{}", unreadable.join("\n"));
}
