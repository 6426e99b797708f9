//! Text of files and users as it may reach a terminal or a picture: what would act there is shown instead.

/// True for a character that shows itself. Others steer terminals (the controls of ISO 6429), turn the direction of what
/// follows (Unicode Annex 9), or may not stand in XML.
pub(crate) fn is_plain(c: char) -> bool {
    let turns =
        matches!(c, '\u{200e}' | '\u{200f}' | '\u{061c}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}');
    let in_xml = !matches!(c, '\u{fffe}' | '\u{ffff}');
    !c.is_control() && !turns && in_xml
}

/// The text with every character that is not plain as its code, `\u{1b}`; line ends and tabs stay.
pub fn plain_text(text: &str) -> String {
    let shown = |c: char| match c {
        '\n' | '\t' => c.to_string(),
        c if is_plain(c) => c.to_string(),
        c => c.escape_unicode().to_string(),
    };
    text.chars().map(shown).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_would_act_is_shown() {
        assert_eq!(plain_text("a\u{1b}[2Jb\tc\nd\u{7}"), "a\\u{1b}[2Jb\tc\nd\\u{7}");
        assert_eq!(plain_text("\u{9b}31m\u{202e}x"), "\\u{9b}31m\\u{202e}x");
        assert_eq!(plain_text("Prüfling <1> 接触"), "Prüfling <1> 接触");
    }
}
