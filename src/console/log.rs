//! What the console shows: lines with the game's colour codes.

use std::collections::VecDeque;

/// Lines kept for scrolling back.
pub const MOST_LINES: usize = 1024;

/// Lines of the console, oldest first.
#[derive(Clone, Debug, Default)]
pub struct Log {
    lines: VecDeque<String>,
    /// Lines ever added; tells that there is something new.
    added: u64,
}

impl Log {
    /// Adds text, line by line.
    pub fn say(&mut self, text: impl AsRef<str>) {
        for line in text.as_ref().lines() {
            if self.lines.len() == MOST_LINES {
                self.lines.pop_front();
            }
            self.lines.push_back(line.to_owned());
            self.added += 1;
        }
    }

    /// Adds what went wrong, in yellow.
    pub fn warn(&mut self, text: impl std::fmt::Display) {
        for line in text.to_string().lines() {
            self.say(format!("^3{line}"));
        }
    }

    /// All lines, oldest first, with their codes.
    pub fn lines(&self) -> impl ExactSizeIterator<Item = &str> + DoubleEndedIterator {
        self.lines.iter().map(String::as_str)
    }

    /// Lines ever added.
    pub fn added(&self) -> u64 {
        self.added
    }

    /// Forgets all lines.
    pub fn clear(&mut self) {
        self.lines.clear();
    }

    /// All lines without their codes.
    pub fn plain(&self) -> String {
        self.lines.iter().map(|l| plain(l) + "\n").collect()
    }
}

/// Parts of a line with the number of their colour, 0..=7; 7, white, until told otherwise. `^` and a letter or digit is a code, `^^` a
/// circumflex that starts none.
pub fn runs(line: &str) -> Vec<(u8, String)> {
    let mut out: Vec<(u8, String)> = Vec::new();
    let mut colour = 7;
    let mut rest = line.chars().peekable();
    while let Some(c) = rest.next() {
        if c == '^'
            && let Some(code) = rest.next_if(char::is_ascii_alphanumeric)
        {
            // The game takes letters as well: by the low bits of their code.
            colour = (code as u8).wrapping_sub(b'0') & 7;
            continue;
        }
        match out.last_mut() {
            Some((last, text)) if *last == colour => text.push(c),
            _ => out.push((colour, c.to_string())),
        }
    }
    out
}

/// A line without its codes.
pub fn plain(line: &str) -> String {
    runs(line).into_iter().map(|(_, text)| text).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_colour_what_follows() {
        assert_eq!(
            runs("a^1red^7 b"),
            [(7, "a".to_owned()), (1, "red".to_owned()), (7, " b".to_owned())]
        );
        assert_eq!(plain("^3x ^ y^"), "x ^ y^");
        assert_eq!(plain("^1^2"), "");
    }

    #[test]
    fn old_lines_go() {
        let mut log = Log::default();
        for i in 0..MOST_LINES + 5 {
            log.say(i.to_string());
        }
        assert_eq!(log.lines().len(), MOST_LINES);
        assert_eq!(log.lines().next(), Some("5"));
        log.warn("one\ntwo");
        assert_eq!(log.lines().next_back(), Some("^3two"));
        assert!(log.plain().ends_with("one\ntwo\n"));
    }
}
