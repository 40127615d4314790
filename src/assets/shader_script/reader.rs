//! Line-oriented access to the tokens of one definition, with the collecting of warnings.

use super::number::leading_number;
use super::prescan::Span;
use super::token::{Comments, Token, Tokens};
use super::warning::Warning;
use super::wave::{Wave, WaveFunction};
use glam::Vec3;
use std::sync::Arc;

/// Cursor over the body of one definition.
pub(super) struct Reader<'a> {
    tokens: Vec<Token<'a>>,
    next: usize,
    /// Line of the last token handed out.
    line: u32,
    file: Arc<str>,
    shader: &'a str,
    pub warnings: Vec<Warning>,
    /// Something was found on which ioquake3 gives up on the definition.
    pub rejected: bool,
}

impl<'a> Reader<'a> {
    pub fn new(file: &Arc<str>, span: &Span<'a>) -> Self {
        Self {
            tokens: Tokens::new(span.body, span.body_line, Comments::Anywhere).collect(),
            next: 0,
            line: span.body_line,
            file: Arc::clone(file),
            shader: span.name,
            warnings: Vec::new(),
            rejected: false,
        }
    }

    pub fn line(&self) -> u32 {
        self.line
    }

    /// Records a fault at the current line.
    pub fn warn(&mut self, message: impl Into<String>) {
        self.warnings.push(Warning {
            file: Arc::clone(&self.file),
            line: self.line,
            shader: self.shader.to_owned(),
            message: message.into(),
        });
    }

    /// Records a fault on which ioquake3 drops the whole definition.
    pub fn reject(&mut self, message: impl Into<String>) {
        self.rejected = true;
        self.warn(message);
    }

    /// The next token on whatever line.
    pub fn keyword(&mut self) -> Option<Token<'a>> {
        let token = *self.tokens.get(self.next)?;
        self.next += 1;
        self.line = token.line;
        Some(token)
    }

    /// The last token came after another directive on the same line: the map compiler, which reads one directive a
    /// line, has skipped it.
    pub fn is_behind_directive(&self) -> bool {
        match self.next.checked_sub(2) {
            Some(before) => !self.tokens[self.next - 1].first_on_line && !is_brace(self.tokens[before].text),
            None => false,
        }
    }

    /// The next token if it is on the current line. Braces are no arguments: taking them would lose the structure.
    pub fn argument(&mut self) -> Option<&'a str> {
        let token = *self.tokens.get(self.next)?;
        if token.first_on_line || is_brace(token.text) {
            return None;
        }
        self.next += 1;
        self.line = token.line;
        Some(token.text).filter(|text| !text.is_empty())
    }

    /// Like [`Self::argument`], with a warning where there is none.
    pub fn required(&mut self, what: &str) -> Option<&'a str> {
        let argument = self.argument();
        if argument.is_none() {
            self.warn(format!("{what}: missing parameter"));
        }
        argument
    }

    /// Everything left on the current line. Balanced braces are part of it, as in the game; at any other brace it
    /// stops, where the game would lose its place.
    pub fn rest_of_line(&mut self) -> Vec<&'a str> {
        let line: Vec<&'a str> = self.tokens[self.next..]
            .iter()
            .take_while(|token| !token.first_on_line)
            .map(|token| token.text)
            .collect();
        let taken = if is_balanced(&line) {
            line.len()
        } else {
            self.reject("a brace shares the line with a directive that runs to the end of the line");
            line.iter().position(|text| is_brace(text)).unwrap_or(line.len())
        };
        self.next += taken;
        line[..taken].to_vec()
    }

    /// Skips to behind the brace that closes the one last read.
    pub fn skip_block(&mut self) {
        let mut depth = 1_u32;
        while depth > 0
            && let Some(token) = self.keyword()
        {
            match token.text {
                "{" => depth += 1,
                "}" => depth -= 1,
                _ => {}
            }
        }
    }

    /// Records a keyword that means nothing here and skips the rest of its line, up to a brace.
    pub fn reject_unknown(&mut self, place: &str, token: &Token<'_>) {
        if token.first_on_line {
            self.reject(format!("unknown {place} directive {:?}", token.text));
        } else {
            self.reject(format!("unexpected {:?} behind a {place} directive", token.text));
        }
        while self.argument().is_some() {}
    }

    /// How many arguments the current line still has.
    pub fn arguments_left(&self) -> usize {
        self.tokens[self.next..]
            .iter()
            .take_while(|token| !token.first_on_line && !is_brace(token.text))
            .count()
    }

    /// A number; text that is none reads as zero with a warning, no text gives nothing with a warning.
    pub fn number(&mut self, what: &str) -> Option<f32> {
        let text = self.required(what)?;
        Some(self.value(what, text))
    }

    /// `N` numbers, or nothing and a warning where the line has fewer.
    pub fn numbers<const N: usize>(&mut self, what: &str) -> Option<[f32; N]> {
        if self.arguments_left() < N {
            self.warn(format!("{what}: needs {N} numbers"));
            return None;
        }
        let mut numbers = [0.0; N];
        for number in &mut numbers {
            *number = self.number(what)?;
        }
        Some(numbers)
    }

    /// `( x y z )`. Parentheses that touch a number or are missing are taken with a warning; the second value says
    /// whether the game would have taken it too.
    pub fn vector(&mut self, what: &str) -> Option<(Vec3, bool)> {
        let mut strict = self.take_parenthesis("(");
        let mut numbers = [0.0; 3];
        for number in &mut numbers {
            let text = self.required(what)?;
            let inner = text.trim_start_matches('(').trim_end_matches(')');
            *number = self.value(what, inner);
            if inner.len() != text.len() {
                strict = false;
                if text.ends_with(')') {
                    self.warn(format!("{what}: a blank is missing at a parenthesis"));
                    return Some((Vec3::from_array(numbers), false));
                }
            }
        }
        strict &= self.take_parenthesis(")");
        if !strict {
            self.warn(format!("{what}: a parenthesis is missing"));
        }
        Some((Vec3::from_array(numbers), strict))
    }

    /// `func base amplitude phase frequency`. As in the game, missing numbers are zero and an unknown function is a
    /// sine; both with a warning.
    pub fn wave(&mut self, what: &str) -> Wave {
        let mut wave = Wave::default();
        let Some(name) = self.required(what) else { return wave };
        wave.function = WaveFunction::from_name(name).unwrap_or_else(|| {
            self.warn(format!("{what}: unknown wave function {name:?}"));
            WaveFunction::Sine
        });
        for field in [
            &mut wave.base,
            &mut wave.amplitude,
            &mut wave.phase,
            &mut wave.frequency,
        ] {
            match self.number(what) {
                Some(number) => *field = number,
                None => break,
            }
        }
        wave
    }

    fn value(&mut self, what: &str, text: &str) -> f32 {
        let (value, whole) = leading_number(text);
        if !whole {
            self.warn(format!("{what}: {text:?} is no number, read as {value}"));
        }
        value
    }

    fn take_parenthesis(&mut self, parenthesis: &str) -> bool {
        let found = self
            .tokens
            .get(self.next)
            .is_some_and(|token| !token.first_on_line && token.text == parenthesis);
        self.next += usize::from(found);
        found
    }
}

fn is_brace(text: &str) -> bool {
    text == "{" || text == "}"
}

fn is_balanced(line: &[&str]) -> bool {
    let mut depth = 0_u32;
    for text in line {
        match *text {
            "{" => depth += 1,
            "}" if depth == 0 => return false,
            "}" => depth -= 1,
            _ => {}
        }
    }
    depth == 0
}

#[cfg(test)]
mod tests {
    use super::super::prescan::Span;
    use super::Reader;
    use glam::Vec3;
    use std::sync::Arc;

    fn reader(body: &str) -> Reader<'_> {
        Reader::new(
            &Arc::from("f"),
            &Span {
                name: "s",
                line: 1,
                body,
                body_line: 1,
            },
        )
    }

    #[test]
    fn arguments_end_with_their_line() {
        let mut r = reader("a b\nc");
        assert_eq!(r.keyword().unwrap().text, "a");
        assert_eq!((r.argument(), r.argument()), (Some("b"), None));
        assert_eq!(r.keyword().unwrap().text, "c");
        assert!(r.keyword().is_none() && r.warnings.is_empty());
    }

    #[test]
    fn the_rest_of_a_line_takes_balanced_braces_only() {
        let mut r = reader("a b { c } d\ne f }");
        r.keyword();
        assert_eq!(r.rest_of_line(), ["b", "{", "c", "}", "d"]);
        r.keyword();
        assert_eq!(r.rest_of_line(), ["f"]);
        assert!(r.rejected);
    }

    #[test]
    fn vectors_with_and_without_blanks() {
        for (body, strict) in [("v ( 1 2 3 )", true), ("v (1 2 3)", false), ("v 1 2 3", false)] {
            let mut r = reader(body);
            r.keyword();
            assert_eq!(r.vector("v"), Some((Vec3::new(1.0, 2.0, 3.0), strict)), "{body}");
            assert_eq!(r.warnings.is_empty(), strict, "{body}");
            assert!(r.keyword().is_none(), "{body}");
        }
    }

    #[test]
    fn a_short_wave_is_filled_with_zeros() {
        let mut r = reader("w triangle 1 2");
        r.keyword();
        let wave = r.wave("w");
        assert_eq!(
            (wave.base, wave.amplitude, wave.phase, wave.frequency),
            (1.0, 2.0, 0.0, 0.0)
        );
        assert_eq!(r.warnings.len(), 1);
    }
}
