//! Units, ticks and their labels.
use crate::case::Units;

/// A unit to label numbers with, and what to divide SI numbers by.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Unit {
    /// Divisor.
    pub factor: f64,
    /// Name; empty for the user's own units.
    pub name: &'static str,
}

impl Unit {
    /// For lengths up to `size`, m.
    pub fn length(units: Units, size: f64) -> Self {
        Self::choose(units, size, &[(2.0, 1.0, "m"), (2e-3, 1e-3, "mm"), (0.0, 1e-6, "µm")])
    }

    /// For stresses up to `size`, Pa.
    pub fn stress(units: Units, size: f64) -> Self {
        Self::choose(
            units,
            size,
            &[(1e10, 1e9, "GPa"), (1e5, 1e6, "MPa"), (1e2, 1e3, "kPa"), (0.0, 1.0, "Pa")],
        )
    }

    /// For strains up to `size`, whatever the units of the case.
    pub fn strain(size: f64) -> Self {
        Self::choose(Units::Si, size, &[(1e-4, 1e-2, "%"), (0.0, 1e-6, "10⁻⁶")])
    }

    /// The first whose smallest size is not above `size`.
    fn choose(units: Units, size: f64, list: &[(f64, f64, &'static str)]) -> Self {
        match list.iter().find(|(from, ..)| size >= *from) {
            Some(&(_, factor, name)) if units == Units::Si => Unit { factor, name },
            _ => Unit { factor: 1.0, name: "" },
        }
    }

    /// `what (unit)`, or `what` alone.
    pub fn label(&self, what: &str) -> String {
        if self.name.is_empty() { what.to_owned() } else { format!("{what} ({})", self.name) }
    }
}

/// Round numbers in a range.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Ticks {
    /// The numbers.
    pub at: Vec<f64>,
    step: f64,
}

impl Ticks {
    /// About `count` of them, none outside the range.
    pub fn new(low: f64, high: f64, count: usize) -> Self {
        let step = round_up((high - low).abs().max(f64::MIN_POSITIVE) / count.max(1) as f64);
        let first = (low / step - 1e-9).ceil();
        let n = ((high / step + 1e-9).floor() - first).clamp(-1.0, 100.0);
        let at = (0..=n as i64).filter(|_| n >= 0.0).map(|i| (first + i as f64) * step).collect();
        Ticks { at, step }
    }

    /// All with the same number of decimals.
    pub fn label(&self, value: f64) -> String {
        number(value, self.step)
    }
}

/// A number to the precision of `step`.
pub(super) fn number(value: f64, step: f64) -> String {
    let value = if value.abs() < 1e-6 * step { 0.0 } else { value };
    let decimals = (-step.log10().floor()).max(0.0) as usize;
    let text = if decimals > 4 || value.abs() >= 1e6 {
        if value == 0.0 { "0".into() } else { format!("{value:.1e}") }
    } else {
        format!("{value:.decimals$}")
    };
    // Rounded to zero, a number has no sign.
    let zero = !text.bytes().any(|c| c.is_ascii_digit() && c != b'0');
    if zero { text.replace('-', "") } else { text.replace('-', "\u{2212}") }
}

/// The next of 1, 2, 5, 10 times a power of ten.
pub(super) fn round_up(x: f64) -> f64 {
    let power = 10f64.powf(x.log10().floor());
    let digit = [1.0, 2.0, 5.0].into_iter().find(|d| x <= d * power * (1.0 + 1e-9)).unwrap_or(10.0);
    digit * power
}

/// The nearest of 1, 2, 5, 10 times a power of ten.
pub(super) fn round_near(x: f64) -> f64 {
    let power = 10f64.powf(x.log10().floor());
    let off = |candidate: &f64| (x / candidate).ln().abs();
    let candidates = [1.0, 2.0, 5.0, 10.0].map(|d| d * power);
    candidates.into_iter().min_by(|a, b| off(a).total_cmp(&off(b))).unwrap_or(power)
}

/// `10⁻⁸` for 1e-8.
pub(super) fn power_of_ten(value: f64) -> String {
    const DIGITS: [char; 10] = ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'];
    let exponent = value.log10().round() as i64;
    let superscript = exponent.unsigned_abs().to_string();
    let superscript = superscript.bytes().map(|d| DIGITS[usize::from(d - b'0')]);
    format!("10{}{}", if exponent < 0 { "⁻" } else { "" }, superscript.collect::<String>())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_inside() {
        assert_eq!(Ticks::new(-0.31, 1.02, 5).at, [0.0, 0.5, 1.0]);
        let ticks = Ticks::new(-120.0, 40.0, 5);
        assert_eq!(ticks.at, [-100.0, -50.0, 0.0]);
        assert_eq!(ticks.label(-50.0), "−50");
        assert_eq!(number(-0.04, 0.1), "0.0");
        assert_eq!(Ticks::new(0.0, 0.05, 5).label(0.03), "0.03");
        assert!(Ticks::new(1.0, 1.0, 5).at.len() < 101);
    }

    #[test]
    fn magnifications_are_round() {
        for (x, near) in
            [(1.1, 1.0), (1.8, 2.0), (3.0, 2.0), (3.5, 5.0), (470.0, 500.0), (0.08, 0.1), (8.0, 10.0)]
        {
            assert!((round_near(x) / near - 1.0).abs() < 1e-9, "{x}: {}", round_near(x));
        }
    }

    #[test]
    fn units_follow_the_case() {
        assert_eq!(Unit::stress(Units::Si, 3e8), Unit { factor: 1e6, name: "MPa" });
        assert_eq!(Unit::stress(Units::Si, 50.0).label("p"), "p (Pa)");
        assert_eq!(Unit::length(Units::Si, 0.1).name, "mm");
        assert_eq!(Unit::length(Units::Consistent, 0.1).label("x"), "x");
        assert_eq!(power_of_ten(1e-12), "10⁻¹²");
    }
}
