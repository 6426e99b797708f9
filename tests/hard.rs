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
