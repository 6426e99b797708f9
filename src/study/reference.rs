//! What the errors of a quantity are measured against: the exact value, or the limit that is known best.
use super::quantity::{difference, norm};
use super::richardson::{Behaviour, Limit};
use crate::vector::{larger, least, smaller};

/// Finest values whose own sequences leave at most this many times the error of the best are as good as that one: they have
/// to agree with the reference.
const AS_GOOD: f64 = 10.0;

/// The sequence of one choice.
#[derive(Debug, Clone)]
pub(super) struct Sequence {
    /// Index into the labels.
    pub choice: usize,
    pub limit: Limit,
    /// Value on the finest level.
    pub finest: Vec<f64>,
}

/// What the errors of a quantity are measured against.
#[derive(Debug, Clone)]
pub(super) struct Reference {
    pub unit: &'static str,
    pub values: Vec<f64>,
    /// True: `[exact]`; false: the limit below.
    pub exact: bool,
    /// Limit of the choice that knows it best, and its index.
    pub limit: Option<(usize, Limit)>,
    /// Errors below this say nothing.
    pub known_to: f64,
    /// Where other choices contradict the limit: the choice that is furthest off, and by how much, relative.
    pub conflict: Option<(usize, f64)>,
}

impl Sequence {
    /// How far the finest value may be from the truth by its own sequence, relative.
    fn error_of_finest(&self) -> f64 {
        distance(&self.finest, &self.limit.values) + self.limit.uncertainty
    }
}

/// Distance of two values, relative to the second.
fn distance(a: &[f64], b: &[f64]) -> f64 {
    norm(&difference(a, b)) / norm(b)
}

impl Reference {
    /// Of an exact value, or else of sequences; none where there is neither, or all is zero.
    pub fn new(known: Option<&Vec<f64>>, sequences: &[Sequence], unit: &'static str) -> Option<Reference> {
        let best = sequences.iter().min_by(|a, b| a.limit.uncertainty.total_cmp(&b.limit.uncertainty));
        let agreed = best.map(|best| agreed(best, sequences));
        let limit = best.zip(agreed.as_ref()).map(|(best, (limit, _))| (best.choice, limit.clone()));
        let values = match (known, &limit) {
            (Some(known), _) => known.clone(),
            (None, Some((_, limit))) => limit.values.clone(),
            (None, None) => return None,
        };
        if norm(&values) == 0.0 {
            return None;
        }
        let known_to = match (known, &limit) {
            (None, Some((_, limit))) => limit.uncertainty,
            // A closed form that the meshes do not tend to is no better than its distance from their limit.
            (Some(known), Some((_, limit))) if limit.behaviour == Behaviour::Asymptotic => {
                let away = distance(&limit.values, known);
                if away > limit.uncertainty { away } else { 0.0 }
            }
            _ => 0.0,
        };
        let conflict = agreed.and_then(|(_, conflict)| conflict).filter(|_| known.is_none());
        Some(Reference { unit, values, exact: known.is_some(), limit, known_to, conflict })
    }
}

/// The best limit, no better known than the others leave it: elements of different kinds have one limit. Another limit that
/// is further off than both claim moves it by what their claims do not cover; finest values as good as the best one
/// ([`AS_GOOD`]) widen it to where they lie.
fn agreed(best: &Sequence, sequences: &[Sequence]) -> (Limit, Option<(usize, f64)>) {
    let best_of_all = least(sequences.iter().map(Sequence::error_of_finest));
    let (mut uncertainty, mut conflict) = (best.limit.uncertainty, None::<(usize, f64)>);
    for other in sequences.iter().filter(|other| other.choice != best.choice) {
        let finest = distance(&other.finest, &best.limit.values);
        let away = distance(&other.limit.values, &best.limit.values);
        let uncovered = smaller(finest, away) - other.limit.uncertainty;
        let claim = if other.error_of_finest() <= AS_GOOD * best_of_all {
            larger(finest, uncovered)
        } else {
            uncovered
        };
        uncertainty = larger(uncertainty, claim);
        let contradicts = away > best.limit.uncertainty + other.limit.uncertainty;
        if contradicts && conflict.is_none_or(|(_, most)| away > most) {
            conflict = Some((other.choice, away));
        }
    }
    (Limit { uncertainty, ..best.limit.clone() }, conflict)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sequence(choice: usize, limit: f64, uncertainty: f64, finest: f64) -> Sequence {
        let behaviour = Behaviour::Asymptotic;
        let limit =
            Limit { values: vec![limit], uncertainty, order: Some(2.0), behaviour, change: uncertainty };
        Sequence { choice, limit, finest: vec![finest] }
    }

    /// A force whose cleanest sequence is that of the worst element: it claims 0.016 % and is wrong by 0.031 %, while three
    /// better elements agree to 0.01 %.
    #[test]
    fn a_clean_sequence_of_a_poor_element_does_not_win() {
        let others = [
            sequence(1, 1.00000, 5e-5, 1.00002),
            sequence(2, 1.00001, 8e-5, 1.00004),
            sequence(3, 0.99998, 2e-4, 0.99990),
        ];
        let poor = sequence(0, 1.00031, 1.6e-4, 0.990);
        let all = [&[poor][..], &others[..]].concat();
        let reference = Reference::new(None, &all, "N").unwrap();
        assert_eq!(reference.limit.as_ref().unwrap().0, 1);
        assert!(reference.known_to >= 1e-4 && reference.known_to < 3e-4, "{}", reference.known_to);
        assert_eq!(reference.conflict.map(|(choice, _)| choice), Some(0));
        // Claiming most, it is the reference, but known no better than the others' finest values lie from it.
        let bold = sequence(0, 1.00031, 1e-6, 0.990);
        let all = [&[bold][..], &others[..]].concat();
        let reference = Reference::new(None, &all, "N").unwrap();
        assert!((reference.values[0] - 1.0).abs() <= reference.known_to, "{}", reference.known_to);
        assert!(reference.conflict.is_some());
    }

    #[test]
    fn a_coarse_element_beside_a_fine_one_does_no_harm() {
        let all = [sequence(0, 1.0, 1e-6, 1.00001), sequence(1, 1.0005, 1e-3, 1.01)];
        let reference = Reference::new(None, &all, "N").unwrap();
        assert_eq!((reference.known_to, reference.conflict), (1e-6, None));
    }
}
