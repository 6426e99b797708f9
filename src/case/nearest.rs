//! The nearest valid name, for messages.

/// `did you mean 'x'? ` or `one of: a, b, c `; empty if there is nothing to choose from.
pub(super) fn hint(given: &str, valid: &[&str]) -> String {
    match nearest(given, valid) {
        Some(name) => format!("did you mean '{name}'? "),
        None if valid.is_empty() => String::new(),
        None => format!("there is: {} ", valid.join(", ")),
    }
}

/// The valid name that differs least, if it is near enough to be a slip of the pen.
fn nearest<'a>(given: &str, valid: &[&'a str]) -> Option<&'a str> {
    let distance = |name: &str| strsim::damerau_levenshtein(&given.to_lowercase(), &name.to_lowercase());
    let best = valid.iter().min_by_key(|name| distance(name))?;
    (distance(best) <= 1 + given.chars().count().max(best.chars().count()) / 4).then_some(best)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slips_are_found_and_strangers_listed() {
        assert_eq!(hint("yong", &["poisson", "young"]), "did you mean 'young'? ");
        assert_eq!(hint("Young", &["poisson", "young"]), "did you mean 'young'? ");
        assert_eq!(hint("density", &["poisson", "young"]), "there is: poisson, young ");
        assert_eq!(hint("density", &[]), "");
    }
}
