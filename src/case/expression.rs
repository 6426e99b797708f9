//! Expressions of the coordinates: `max(600 - 16000*x, 200)`.
//!
//! Compiled once into a postfix program on a small stack. The usual rules hold: `-x^2` is `-(x^2)`, `2^3^2`
//! is `2^(3^2)`, `a/b*c` is `(a/b)*c`, `1e-3` is a number.
use super::nearest;
use crate::vector::{larger, smaller};

/// A parsed expression of `x`, `y`, `z`.
#[derive(Debug, Clone)]
pub struct Expression {
    text: String,
    program: Vec<Op>,
    frame: Frame,
}

/// The coordinates may be turned, moved and scaled, the result scaled: `value * f(length * R(-angle) (x - shift))`.
#[derive(Debug, Clone, Copy)]
struct Frame {
    angle: f64,
    sin: f64,
    cos: f64,
    shift: [f64; 3],
    length: f64,
    value: f64,
}

#[derive(Debug, Clone, Copy)]
enum Op {
    Number(f64),
    Variable(usize),
    Negate,
    Binary(fn(f64, f64) -> f64),
    Unary(fn(f64) -> f64),
}

const VARIABLES: [&str; 3] = ["x", "y", "z"];
const CONSTANTS: [(&str, f64); 1] = [("pi", std::f64::consts::PI)];
type Function = (&'static str, fn(f64) -> f64);
type FunctionOfTwo = (&'static str, fn(f64, f64) -> f64);
/// Functions of one argument.
pub(super) const FUNCTIONS: [Function; 14] = [
    ("abs", f64::abs),
    ("sqrt", f64::sqrt),
    ("exp", f64::exp),
    ("ln", f64::ln),
    ("log10", f64::log10),
    ("sin", f64::sin),
    ("cos", f64::cos),
    ("tan", f64::tan),
    ("asin", f64::asin),
    ("acos", f64::acos),
    ("atan", f64::atan),
    ("sinh", f64::sinh),
    ("cosh", f64::cosh),
    ("tanh", f64::tanh),
];
/// Functions of two arguments.
pub(super) const FUNCTIONS_OF_TWO: [FunctionOfTwo; 3] =
    [("min", smaller), ("max", larger), ("atan2", f64::atan2)];
/// Deepest stack a program may need, and deepest nesting of brackets.
const DEPTH: usize = 32;

impl Expression {
    /// Compiles `text`; the error says what is wrong and near which word.
    pub fn parse(text: &str) -> Result<Self, String> {
        let mut parser = Parser { rest: text, program: Vec::new(), nesting: 0 };
        parser.sum()?;
        if let Some(c) = parser.peek() {
            return Err(format!("'{c}' is not expected before '{}'", parser.rest.trim()));
        }
        if stack_depth(&parser.program) > DEPTH {
            return Err("too deeply nested".into());
        }
        let frame = Frame { angle: 0.0, sin: 0.0, cos: 1.0, shift: [0.0; 3], length: 1.0, value: 1.0 };
        Ok(Expression { text: text.to_string(), program: parser.program, frame })
    }

    /// Value at a point.
    pub fn at(&self, x: &[f64; 3]) -> f64 {
        let Frame { sin, cos, shift, length, value, .. } = self.frame;
        let x = [0, 1, 2].map(|i| x[i] - shift[i]);
        let x = [length * (cos * x[0] + sin * x[1]), length * (cos * x[1] - sin * x[0]), length * x[2]];
        value * run(&self.program, &x)
    }

    /// As written.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// The same field on a body turned by `angle` (radians) about the origin.
    pub fn rotated(&self, angle: f64) -> Self {
        let mut turned = self.clone();
        turned.frame.angle += angle;
        (turned.frame.sin, turned.frame.cos) = turned.frame.angle.sin_cos();
        let (sin, cos) = angle.sin_cos();
        let [x, y, z] = self.frame.shift;
        turned.frame.shift = [cos * x - sin * y, sin * x + cos * y, z];
        turned
    }

    /// The same field on a body moved by `shift`, m.
    pub fn translated(&self, shift: [f64; 3]) -> Self {
        let mut moved = self.clone();
        std::iter::zip(&mut moved.frame.shift, shift).for_each(|(sum, d)| *sum += d);
        moved
    }

    /// The same field with lengths and values given as multiples of other units (`length` = 1e3: m to mm).
    pub fn rescaled(&self, length: f64, value: f64) -> Self {
        let mut scaled = self.clone();
        scaled.frame.length /= length;
        scaled.frame.shift = scaled.frame.shift.map(|d| d * length);
        scaled.frame.value *= value;
        scaled
    }

    /// True if no coordinate occurs in it.
    pub fn is_constant(&self) -> bool {
        !self.program.iter().any(|op| matches!(op, Op::Variable(_)))
    }
}

fn run(program: &[Op], x: &[f64; 3]) -> f64 {
    let mut stack = [0.0; DEPTH + 1];
    let mut top = 0; // stack[top] is the result so far; stack[0] is never read
    for op in program {
        match *op {
            Op::Number(value) => {
                top += 1;
                stack[top] = value;
            }
            Op::Variable(i) => {
                top += 1;
                stack[top] = x[i];
            }
            Op::Negate => stack[top] = -stack[top],
            Op::Unary(f) => stack[top] = f(stack[top]),
            Op::Binary(f) => {
                top -= 1;
                stack[top] = f(stack[top], stack[top + 1]);
            }
        }
    }
    stack[top]
}

fn stack_depth(program: &[Op]) -> usize {
    let mut depth: usize = 0;
    program.iter().fold(0, |deepest, op| {
        match op {
            Op::Number(_) | Op::Variable(_) => depth += 1,
            Op::Binary(_) => depth -= 1,
            Op::Negate | Op::Unary(_) => {}
        }
        deepest.max(depth)
    })
}

/// Recursive descent: sum -> product -> sign -> power -> atom.
struct Parser<'a> {
    rest: &'a str,
    program: Vec<Op>,
    nesting: usize,
}

type Parsed = Result<(), String>;

impl<'a> Parser<'a> {
    fn peek(&mut self) -> Option<char> {
        self.rest = self.rest.trim_start();
        self.rest.chars().next()
    }

    fn eat(&mut self, c: char) -> bool {
        let found = self.peek() == Some(c);
        if found {
            self.rest = &self.rest[c.len_utf8()..];
        }
        found
    }

    fn expect(&mut self, c: char, why: &str) -> Parsed {
        match self.eat(c) {
            true => Ok(()),
            false => Err(format!("'{c}' is missing {why}, before '{}'", self.rest)),
        }
    }

    fn sum(&mut self) -> Parsed {
        self.nesting += 1;
        if self.nesting > DEPTH {
            return Err("too deeply nested".into());
        }
        self.product()?;
        loop {
            let f: fn(f64, f64) -> f64 = match self.peek() {
                Some('+') => |a, b| a + b,
                Some('-') => |a, b| a - b,
                _ => break,
            };
            self.rest = &self.rest[1..];
            self.product()?;
            self.program.push(Op::Binary(f));
        }
        self.nesting -= 1;
        Ok(())
    }

    fn product(&mut self) -> Parsed {
        self.signed()?;
        loop {
            let f: fn(f64, f64) -> f64 = match self.peek() {
                Some('*') => |a, b| a * b,
                Some('/') => |a, b| a / b,
                _ => return Ok(()),
            };
            self.rest = &self.rest[1..];
            self.signed()?;
            self.program.push(Op::Binary(f));
        }
    }

    fn signed(&mut self) -> Parsed {
        let mut negative = false;
        while let Some(c @ ('+' | '-')) = self.peek() {
            negative ^= c == '-';
            self.rest = &self.rest[1..];
        }
        self.atom()?;
        if self.eat('^') {
            self.nesting += 1;
            if self.nesting > DEPTH {
                return Err("too deeply nested".into());
            }
            self.signed()?;
            self.nesting -= 1;
            self.program.push(Op::Binary(f64::powf));
        }
        if negative {
            self.program.push(Op::Negate);
        }
        Ok(())
    }

    fn atom(&mut self) -> Parsed {
        match self.peek() {
            Some('(') => {
                self.eat('(');
                self.sum()?;
                self.expect(')', "after a bracket")
            }
            Some(c) if c.is_ascii_digit() || c == '.' => {
                let (value, rest) =
                    number(self.rest).ok_or_else(|| format!("no number at '{}'", self.rest))?;
                self.rest = rest;
                self.program.push(Op::Number(value));
                Ok(())
            }
            Some(c) if c.is_alphabetic() || c == '_' => self.word(),
            Some(_) => Err(format!("a number, x, y, z, a function or '(' is expected at '{}'", self.rest)),
            None => Err("a number, x, y, z, a function or '(' is expected at the end".into()),
        }
    }

    fn word(&mut self) -> Parsed {
        let end = self.rest.find(|c: char| !c.is_alphanumeric() && c != '_').unwrap_or(self.rest.len());
        let (word, rest) = self.rest.split_at(end);
        self.rest = rest;
        if let Some(i) = VARIABLES.iter().position(|name| *name == word) {
            self.program.push(Op::Variable(i));
        } else if let Some((_, value)) = CONSTANTS.iter().find(|(name, _)| *name == word) {
            self.program.push(Op::Number(*value));
        } else if let Some((_, f)) = FUNCTIONS.iter().find(|(name, _)| *name == word) {
            self.arguments(word, 1)?;
            self.program.push(Op::Unary(*f));
        } else if let Some((_, f)) = FUNCTIONS_OF_TWO.iter().find(|(name, _)| *name == word) {
            self.arguments(word, 2)?;
            self.program.push(Op::Binary(*f));
        } else if self.peek() == Some('(') {
            let names: Vec<&str> =
                FUNCTIONS.iter().map(|f| f.0).chain(FUNCTIONS_OF_TWO.iter().map(|f| f.0)).collect();
            return Err(format!("unknown function '{word}'; {}", nearest::hint(word, &names).trim_end()));
        } else {
            return Err(format!("unknown variable '{word}'; an expression may use x, y and z"));
        }
        Ok(())
    }

    fn arguments(&mut self, function: &str, count: usize) -> Parsed {
        self.expect('(', &format!("after {function}"))?;
        self.sum()?;
        for _ in 1..count {
            self.expect(',', &format!("in {function}, which takes {count} arguments"))?;
            self.sum()?;
        }
        self.expect(')', &format!("after the {count} argument(s) of {function}"))
    }
}

/// The number at the start of `text`, without a sign, and what follows it.
pub(super) fn number(text: &str) -> Option<(f64, &str)> {
    let digits = |from: usize| text[from..].bytes().take_while(u8::is_ascii_digit).count();
    let mut end = digits(0);
    if text[end..].starts_with('.') {
        end += 1 + digits(end + 1);
    }
    if text[end..].starts_with(['e', 'E']) {
        let sign = usize::from(text[end + 1..].starts_with(['+', '-']));
        let exponent = digits(end + 1 + sign);
        if exponent > 0 {
            end += 1 + sign + exponent;
        }
    }
    Some((text[..end].parse().ok()?, &text[end..]))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn value(text: &str) -> f64 {
        Expression::parse(text).unwrap_or_else(|e| panic!("{text}: {e}")).at(&[3.0, 5.0, 7.0])
    }

    #[test]
    fn values() {
        for (text, expected) in [
            ("600 - 16000*x", 600.0 - 48000.0),
            ("max(600 - 16000*x, 200)", 200.0),
            ("1e8*(1 + x/0.04)", 76e8),
            ("1.5e-3*x", 4.5e-3),
            ("-x^2", -9.0),
            ("(-x)^2", 9.0),
            ("2^3^2", 512.0),
            ("2^-1", 0.5),
            ("2*-x", -6.0),
            ("8/2*4", 16.0),
            ("8/2/2", 2.0),
            ("1 - 2 - 3", -4.0),
            ("5 - -x", 8.0),
            ("min(max(x, 1), 2)^2 + z*y", 39.0),
            ("sin(pi/2) + atan2(0, 1)", 1.0),
            (".5*x + 1.", 2.5),
            ("sqrt(abs(-y - 4))", 3.0),
        ] {
            assert!((value(text) - expected).abs() <= 1e-14 * expected.abs(), "{text}: {}", value(text));
        }
    }

    #[test]
    fn errors_name_the_word() {
        for (text, message) in [
            ("600 - 16000*t", "unknown variable 't'; an expression may use x, y and z"),
            ("2*X", "unknown variable 'X'"),
            ("sine(x)", "unknown function 'sine'; did you mean 'sin'?"),
            ("2 x", "'x' is not expected"),
            ("x +", "expected at the end"),
            ("(x + 1", "')' is missing after a bracket"),
            ("max(x)", "',' is missing in max, which takes 2 arguments"),
            ("max(x, 1, 2)", "')' is missing after the 2 argument(s) of max"),
            ("sin x", "'(' is missing after sin"),
            ("x ; y", "';' is not expected"),
            ("1 + é", "unknown variable 'é'"),
            (".", "no number at '.'"),
            ("", "expected at the end"),
        ] {
            let error = Expression::parse(text).unwrap_err();
            assert!(error.contains(message), "{text}: {error}");
        }
        assert!(Expression::parse(&"(".repeat(100_000)).unwrap_err().contains("nested"));
        assert!(Expression::parse(&"2^".repeat(100_000)).unwrap_err().contains("nested"));
    }

    #[test]
    fn frames() {
        let field = Expression::parse("x + 10*y").unwrap();
        let turned = field.rotated(std::f64::consts::FRAC_PI_2);
        // The point (1, 2) goes to (-2, 1).
        assert!((turned.at(&[-2.0, 1.0, 0.0]) - field.at(&[1.0, 2.0, 0.0])).abs() < 1e-14);
        let scaled = field.rescaled(1e3, 2.0);
        assert!((scaled.at(&[1e3, 2e3, 0.0]) - 42.0).abs() < 1e-12);
        let moved = field.translated([5.0, -3.0, 0.0]);
        assert!((moved.at(&[6.0, -1.0, 0.0]) - 21.0).abs() < 1e-13);
        // (1, 2) goes to (6, -1), turned to (1, 6), then to mm.
        let all = moved.rotated(std::f64::consts::FRAC_PI_2).rescaled(1e3, 2.0);
        assert!((all.at(&[1e3, 6e3, 0.0]) - 42.0).abs() < 1e-11);
    }
}
