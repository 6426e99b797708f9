//! The load paths in words.
use crate::case::{Case, PathCase, PathTable};

/// A line on each path: its factors, and what follows it.
pub(super) fn path_lines(case: &Case) -> Vec<String> {
    case.paths
        .iter()
        .enumerate()
        .map(|(i, path)| {
            format!("path {}: {}; followed by {}", path.name, factors(case, i, path), followers(case, i))
        })
        .collect()
}

/// Rows or steps that are listed; of more the first ones.
const LISTED: usize = 8;

fn factors(case: &Case, index: usize, path: &PathCase) -> String {
    let listed = |values: &mut dyn Iterator<Item = f64>| {
        let mut texts: Vec<String> = values.take(LISTED + 1).map(|value| value.to_string()).collect();
        if texts.len() > LISTED {
            texts[LISTED] = "...".into();
        }
        texts.join(", ")
    };
    match &path.table {
        Some(PathTable { at, factor }) => {
            format!("factor {} at {}", listed(&mut factor.iter().copied()), listed(&mut at.iter().copied()))
        }
        None => {
            format!("factor {} after the steps", listed(&mut case.steps.iter().map(|step| step.paths[index])))
        }
    }
}

fn followers(case: &Case, index: usize) -> String {
    let own = Some(index);
    let of_bodies =
        |count: &dyn Fn(&crate::case::BodyCase) -> usize| case.bodies.iter().map(count).sum::<usize>();
    let counts = [
        ("load", of_bodies(&|body| body.loads.iter().filter(|load| load.path == own).count())),
        ("support", of_bodies(&|body| body.supports.iter().filter(|support| support.path == own).count())),
        ("temperature", of_bodies(&|body| usize::from(body.temperature_path == own))),
        ("rigid motion", case.rigid.iter().filter(|rigid| rigid.path == own).count()),
    ];
    let texts = counts.into_iter().filter(|(_, n)| *n > 0);
    let texts = texts.map(|(what, n)| format!("{n} {what}{}", if n > 1 { "s" } else { "" }));
    texts.collect::<Vec<_>>().join(", ")
}
