//! Strings with a unit: `"210 GPa"`, `"12e-6 1/K"`, `"5 kN/m^3"`. All become SI; angles become degrees.
use super::expression::number;
use super::nearest;

/// A dimension: powers of metre, kilogram, second, kelvin and degree of arc.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Dimension([i8; 5]);

impl Dimension {
    /// A pure number.
    pub const NUMBER: Dimension = Dimension([0, 0, 0, 0, 0]);
    /// Length, m.
    pub const LENGTH: Dimension = Dimension([1, 0, 0, 0, 0]);
    /// Pressure, stress, modulus, Pa.
    pub const PRESSURE: Dimension = Dimension([-1, 1, -2, 0, 0]);
    /// Force, N.
    pub const FORCE: Dimension = Dimension([1, 1, -2, 0, 0]);
    /// Force per volume, N/m3.
    pub const FORCE_PER_VOLUME: Dimension = Dimension([-2, 1, -2, 0, 0]);
    /// Absolute temperature, K.
    pub const TEMPERATURE: Dimension = Dimension([0, 0, 0, 1, 0]);
    /// Expansion coefficient, 1/K.
    pub const EXPANSION: Dimension = Dimension([0, 0, 0, -1, 0]);
    /// Angle, degrees.
    pub const ANGLE: Dimension = Dimension([0, 0, 0, 0, 1]);

    /// Name with article, SI unit, and the units to suggest.
    fn description(self) -> Option<(&'static str, &'static str, &'static str)> {
        Some(match self {
            Dimension::NUMBER => ("a pure number", "–", "no unit"),
            Dimension::LENGTH => ("a length", "m", "m, mm, um ..."),
            Dimension::PRESSURE => ("a pressure", "Pa", "Pa, MPa, GPa ..."),
            Dimension::FORCE => ("a force", "N", "N, kN, MN ..."),
            Dimension::FORCE_PER_VOLUME => ("a force per volume", "N/m3", "N/m3, kN/m3 ..."),
            Dimension::TEMPERATURE => ("a temperature", "K", "K, degC"),
            Dimension::EXPANSION => ("an expansion coefficient", "1/K", "1/K"),
            Dimension::ANGLE => ("an angle", "deg", "deg, rad"),
            _ => return None,
        })
    }

    /// The unit of plain numbers, for the reference page.
    pub fn unit(self) -> &'static str {
        self.description().map_or("", |d| d.1)
    }

    /// "a pressure (Pa, MPa, GPa ...)".
    fn wanted(self) -> String {
        self.description().map_or(String::new(), |(name, _, units)| format!("{name} ({units})"))
    }

    fn times(self, other: Dimension, power: i32) -> Option<Dimension> {
        let mut sum = self.0;
        for (a, b) in sum.iter_mut().zip(other.0) {
            *a = i8::try_from(i32::from(*a) + i32::from(b) * power).ok()?;
        }
        Some(Dimension(sum))
    }
}

/// Unit symbols: name, factor to SI, dimension. `degC` and `°C` are absolute and treated apart.
pub(super) const UNITS: [(&str, f64, Dimension); 32] = [
    ("m", 1.0, Dimension::LENGTH),
    ("dm", 1e-1, Dimension::LENGTH),
    ("cm", 1e-2, Dimension::LENGTH),
    ("mm", 1e-3, Dimension::LENGTH),
    ("um", 1e-6, Dimension::LENGTH),
    ("µm", 1e-6, Dimension::LENGTH),
    ("nm", 1e-9, Dimension::LENGTH),
    ("km", 1e3, Dimension::LENGTH),
    ("in", 0.0254, Dimension::LENGTH),
    ("Pa", 1.0, Dimension::PRESSURE),
    ("kPa", 1e3, Dimension::PRESSURE),
    ("MPa", 1e6, Dimension::PRESSURE),
    ("GPa", 1e9, Dimension::PRESSURE),
    ("TPa", 1e12, Dimension::PRESSURE),
    ("bar", 1e5, Dimension::PRESSURE),
    ("psi", 6894.757293168361, Dimension::PRESSURE),
    ("N", 1.0, Dimension::FORCE),
    ("mN", 1e-3, Dimension::FORCE),
    ("kN", 1e3, Dimension::FORCE),
    ("MN", 1e6, Dimension::FORCE),
    ("GN", 1e9, Dimension::FORCE),
    ("K", 1.0, Dimension::TEMPERATURE),
    ("kg", 1.0, Dimension([0, 1, 0, 0, 0])),
    ("g", 1e-3, Dimension([0, 1, 0, 0, 0])),
    ("t", 1e3, Dimension([0, 1, 0, 0, 0])),
    ("s", 1.0, Dimension([0, 0, 1, 0, 0])),
    ("ms", 1e-3, Dimension([0, 0, 1, 0, 0])),
    ("deg", 1.0, Dimension::ANGLE),
    ("°", 1.0, Dimension::ANGLE),
    ("rad", 180.0 / std::f64::consts::PI, Dimension::ANGLE),
    ("%", 1e-2, Dimension::NUMBER),
    ("1", 1.0, Dimension::NUMBER),
];

/// Splits `"210 GPa"` into 210 and `GPa`; `None` if it does not begin with a number that a unit follows.
pub(super) fn split(text: &str) -> Option<(f64, &str)> {
    let text = text.trim();
    let (sign, digits) = match text.strip_prefix('-') {
        Some(rest) => (-1.0, rest.trim_start()),
        None => (1.0, text.strip_prefix('+').unwrap_or(text).trim_start()),
    };
    let (value, rest) = number(digits)?;
    let unit = rest.trim();
    let begins_unit = |c: char| c.is_alphabetic() || c == '°' || c == '%' || c == '1';
    unit.starts_with(begins_unit).then_some((sign * value, unit))
}

/// Converts a number with a unit to the SI unit (angles: degrees) of the dimension that is wanted.
/// The error begins with the string itself.
pub(super) fn convert(text: &str, wanted: Dimension, key: &str) -> Result<f64, String> {
    let (value, unit) = split(text)
        .ok_or_else(|| format!("'{text}' is not a number with a unit; {key} needs {}", wanted.wanted()))?;
    if matches!(unit, "degC" | "°C") {
        return match wanted {
            Dimension::TEMPERATURE => Ok(value + 273.15),
            _ => Err(format!("'{text}' is a temperature; {key} needs {}", wanted.wanted())),
        };
    }
    let (factor, dimension) = parse_unit(unit).map_err(|e| format!("'{text}': {e}"))?;
    if dimension == wanted {
        return Ok(scale(value, factor));
    }
    Err(match dimension.description() {
        Some((name, _, _)) => format!("'{text}' is {name}; {key} needs {}", wanted.wanted()),
        None => format!("'{text}' has the wrong dimension; {key} needs {}", wanted.wanted()),
    })
}

/// `value * factor`, rounded once where the factor is a negative power of ten ("25 mm" is 0.025).
fn scale(value: f64, factor: f64) -> f64 {
    let inverse = (1.0 / factor).round();
    match factor < 1.0 && 1.0 / inverse == factor {
        true => value / inverse,
        false => value * factor,
    }
}

/// Factor to SI and dimension of a product of units: `kN/m^2`, `N/m3`, `N*mm`, `1/K`.
fn parse_unit(text: &str) -> Result<(f64, Dimension), String> {
    let (mut factor, mut dimension) = (1.0, Dimension::NUMBER);
    let (mut sign, mut rest) = (1, text);
    loop {
        let end = rest.find(['*', '/', '·', ' ']).unwrap_or(rest.len());
        let (word, after) = rest.split_at(end);
        let (symbol, power) = split_power(word.trim())?;
        let Some((_, unit_factor, unit_dimension)) = UNITS.iter().find(|(name, ..)| *name == symbol) else {
            if matches!(symbol, "degC" | "°C") {
                return Err("degC is an absolute temperature and stands alone; use K here".into());
            }
            let names: Vec<&str> = UNITS.iter().map(|u| u.0).filter(|name| name.is_ascii()).collect();
            return Err(format!("unknown unit '{symbol}'; {}", nearest::hint(symbol, &names).trim_end()));
        };
        factor *= unit_factor.powi(sign * power);
        dimension = dimension.times(*unit_dimension, sign * power).ok_or("the power is too large")?;
        let operator = after.trim_start();
        sign = match operator.chars().next() {
            None => return Ok((factor, dimension)),
            Some('/') => -1,
            Some(_) => 1,
        };
        rest = operator.trim_start_matches(['*', '·']).trim_start();
        rest = rest.strip_prefix('/').unwrap_or(rest).trim_start();
    }
}

/// `m3`, `m^3`, `m^-3` -> symbol and power.
fn split_power(word: &str) -> Result<(&str, i32), String> {
    if word == "1" {
        return Ok((word, 1));
    }
    let symbol =
        word.trim_end_matches(|c: char| c.is_ascii_digit()).trim_end_matches('-').trim_end_matches('^');
    let power = word[symbol.len()..].trim_start_matches('^');
    match power {
        "" if symbol.len() == word.len() => Ok((symbol, 1)),
        _ => match power.parse() {
            Ok(power @ -9..=9) => Ok((symbol, power)),
            _ => Err(format!("'{word}' is not a unit")),
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn conversions() {
        for (text, dimension, expected) in [
            ("210 GPa", Dimension::PRESSURE, 210e9),
            ("100MPa", Dimension::PRESSURE, 100e6),
            ("25 mm", Dimension::LENGTH, 0.025),
            ("-0.05 mm", Dimension::LENGTH, -5e-5),
            ("12e-6 1/K", Dimension::EXPANSION, 12e-6),
            ("12e-6 K^-1", Dimension::EXPANSION, 12e-6),
            ("5 kN", Dimension::FORCE, 5e3),
            ("20 deg", Dimension::ANGLE, 20.0),
            ("300 K", Dimension::TEMPERATURE, 300.0),
            ("27 degC", Dimension::TEMPERATURE, 300.15),
            ("76.5 kN/m3", Dimension::FORCE_PER_VOLUME, 76.5e3),
            ("2 kN/m^2", Dimension::PRESSURE, 2e3),
            ("3 N/mm2", Dimension::PRESSURE, 3e6),
            ("7850 kg/m3*m/s2", Dimension::FORCE_PER_VOLUME, 7850.0),
            ("1 N/mm/mm", Dimension::PRESSURE, 1e6),
        ] {
            let value = convert(text, dimension, "k").unwrap_or_else(|e| panic!("{text}: {e}"));
            assert!((value - expected).abs() <= 4e-16 * expected.abs(), "{text}: {value:e}");
        }
        assert_eq!(convert("25 mm", Dimension::LENGTH, "k"), Ok(0.025));
        assert_eq!(convert("0.1 mm", Dimension::LENGTH, "k"), Ok(1e-4));
        let half_turn = convert("3.141592653589793 rad", Dimension::ANGLE, "k").unwrap();
        assert!((half_turn - 180.0).abs() < 1e-12);
    }

    #[test]
    fn errors() {
        for (text, dimension, message) in [
            ("25 mm", Dimension::PRESSURE, "'25 mm' is a length; k needs a pressure (Pa, MPa, GPa ...)"),
            ("210 Gpa", Dimension::PRESSURE, "'210 Gpa': unknown unit 'Gpa'; did you mean 'GPa'?"),
            ("20 degC", Dimension::LENGTH, "'20 degC' is a temperature; k needs a length"),
            ("12 1/degC", Dimension::EXPANSION, "use K here"),
            ("3 kg", Dimension::FORCE, "'3 kg' has the wrong dimension; k needs a force"),
            ("3 m^99", Dimension::FORCE, "'m^99' is not a unit"),
            ("3 m/", Dimension::LENGTH, "unknown unit ''"),
            ("many", Dimension::LENGTH, "'many' is not a number with a unit; k needs a length"),
        ] {
            let error = convert(text, dimension, "k").unwrap_err();
            assert!(error.contains(message), "{text}: {error}");
        }
    }

    #[test]
    fn expressions_are_not_taken_for_units() {
        for text in ["600 - 16000*x", "1e8*(1 + x/0.04)", "x", "max(600 - 16000*x, 200)", "600", "-5"] {
            assert_eq!(split(text), None, "{text}");
        }
    }
}
