//! Numbers and lines of a Gmsh file, ASCII or binary, with the place for messages.
use crate::error::{Error, Result};

/// Reads a file from front to back.
///
/// Memory grows only with what was really read, so a wrong count in the file cannot ask for a huge
/// allocation.
#[derive(Debug)]
pub struct Scanner<'a> {
    file: &'a str,
    bytes: &'a [u8],
    at: usize,
    /// 1-based.
    line: usize,
    section: String,
    binary: bool,
}

impl<'a> Scanner<'a> {
    pub fn new(file: &'a str, bytes: &'a [u8]) -> Self {
        Scanner { file, bytes, at: 0, line: 1, section: String::new(), binary: false }
    }

    /// An error at the present place.
    pub fn error(&self, message: impl std::fmt::Display) -> Error {
        let place = if self.binary { format!("byte {}", self.at) } else { format!("line {}", self.line) };
        let section = if self.section.is_empty() { String::new() } else { format!(" in ${}", self.section) };
        Error::input(format!("{}: {place}{section}: {message}", self.file))
    }

    /// True after [`Scanner::binary`].
    pub fn is_binary(&self) -> bool {
        self.binary
    }

    /// From here on numbers are binary; reads the integer 1 that shows the byte order.
    pub fn binary(&mut self) -> Result<()> {
        self.binary = true;
        match self.int()? {
            1 => Ok(()),
            0x0100_0000 => {
                Err(self.error("the file is big-endian; save it again on this kind of machine, or as ASCII"))
            }
            other => {
                Err(self.error(format!("expected the integer 1 that shows the byte order, found {other}")))
            }
        }
    }

    /// The rest of the present line, without its end, whatever the mode.
    pub fn line(&mut self) -> Result<String> {
        if self.at >= self.bytes.len() {
            return Err(self.error("the file ends too early"));
        }
        let rest = &self.bytes[self.at..];
        let length = rest.iter().position(|&b| b == b'\n').unwrap_or(rest.len());
        let text = String::from_utf8_lossy(&rest[..length]).trim_end_matches('\r').to_string();
        self.at += (length + 1).min(rest.len());
        self.line += 1;
        Ok(text)
    }

    /// Moves behind the next line `$Name` and returns the name; `None` at the end of the file.
    pub fn next_section(&mut self) -> Result<Option<String>> {
        self.section.clear();
        self.skip_blank();
        if self.at >= self.bytes.len() {
            return Ok(None);
        }
        let line = self.line()?;
        match line.trim().strip_prefix('$') {
            Some(name) if !name.is_empty() && !name.starts_with("End") => {
                self.section = name.to_string();
                Ok(Some(name.to_string()))
            }
            _ => {
                // `line` has moved on to the next one.
                self.line -= 1;
                let shown: String = line.chars().take(40).collect();
                Err(self.error(format!("expected the start of a section ($Name), found {shown:?}")))
            }
        }
    }

    /// Expects `$EndName` of the present section.
    pub fn end_section(&mut self) -> Result<()> {
        self.skip_blank();
        let expected = format!("$End{}", self.section);
        if !self.bytes[self.at..].starts_with(expected.as_bytes()) {
            return Err(self.error(format!("expected {expected}; a count above it may be wrong")));
        }
        self.line()?;
        Ok(())
    }

    /// Moves behind `$EndName` of a section that is not read.
    pub fn skip_section(&mut self) -> Result<()> {
        let end = format!("$End{}", self.section);
        loop {
            if self.at >= self.bytes.len() {
                return Err(self.error(format!("the file ends without {end}")));
            }
            let rest = &self.bytes[self.at..];
            let length = rest.iter().position(|&b| b == b'\n').unwrap_or(rest.len());
            // Binary data may stand right before the end.
            let found = rest[..length].windows(end.len()).any(|w| w == end.as_bytes());
            self.at += (length + 1).min(rest.len());
            self.line += 1;
            if found {
                return Ok(());
            }
        }
    }

    fn skip_blank(&mut self) {
        while self.at < self.bytes.len() && self.bytes[self.at].is_ascii_whitespace() {
            self.line += usize::from(self.bytes[self.at] == b'\n');
            self.at += 1;
        }
    }

    /// The next word of an ASCII file.
    fn word(&mut self, expected: &str) -> Result<&'a str> {
        self.skip_blank();
        let rest = &self.bytes[self.at..];
        let length = rest.iter().position(u8::is_ascii_whitespace).unwrap_or(rest.len());
        let word = std::str::from_utf8(&rest[..length]).unwrap_or("");
        if word.is_empty() || word.starts_with('$') {
            let found = if length == 0 { "the end of the file" } else { word };
            return Err(self.error(format!("expected {expected}, found {found:?}")));
        }
        self.at += length;
        Ok(word)
    }

    fn number<T: std::str::FromStr>(&mut self, expected: &str) -> Result<T> {
        let word = self.word(expected)?;
        word.parse().map_err(|_| self.error(format!("expected {expected}, found {word:?}")))
    }

    fn raw<const N: usize>(&mut self, expected: &str) -> Result<[u8; N]> {
        match self.bytes[self.at..].first_chunk::<N>() {
            Some(chunk) => {
                self.at += N;
                Ok(*chunk)
            }
            None => Err(self.error(format!("the file ends where {expected} was expected"))),
        }
    }

    /// A 4-byte integer.
    pub fn int(&mut self) -> Result<i32> {
        let expected = "an integer";
        if self.binary { Ok(i32::from_le_bytes(self.raw(expected)?)) } else { self.number(expected) }
    }

    /// A 4-byte integer that counts or numbers something.
    pub fn count(&mut self) -> Result<u64> {
        let value = self.int()?;
        u64::try_from(value).map_err(|_| self.error(format!("expected a count or a tag, found {value}")))
    }

    /// An 8-byte count or tag.
    pub fn size(&mut self) -> Result<u64> {
        let expected = "a count or a tag";
        if self.binary { Ok(u64::from_le_bytes(self.raw(expected)?)) } else { self.number(expected) }
    }

    /// A real number.
    pub fn real(&mut self) -> Result<f64> {
        let expected = "a real number";
        if self.binary { Ok(f64::from_le_bytes(self.raw(expected)?)) } else { self.number(expected) }
    }

    /// Three coordinates.
    pub fn point(&mut self) -> Result<[f64; 3]> {
        Ok([self.real()?, self.real()?, self.real()?])
    }
}
