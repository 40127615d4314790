//! Finds the definitions of a file by their braces alone, as ioquake3 does before it trusts a file.

use super::token::{Comments, Token, Tokens};
use thiserror::Error;

/// A definition before it is read: its name and the text between its braces.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Span<'a> {
    pub name: &'a str,
    /// Line of the name, from 1.
    pub line: u32,
    pub body: &'a str,
    /// Line on which `body` starts.
    pub body_line: u32,
}

/// Why the game skips a whole file.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub(super) enum BraceError {
    #[error("missing opening brace (found {found:?} on line {found_line}): the whole file is skipped")]
    NotOpened {
        name: String,
        line: u32,
        found: String,
        found_line: u32,
    },
    #[error("missing closing brace: the whole file is skipped")]
    NotClosed { name: String, line: u32 },
}

impl BraceError {
    /// Name and line of the definition whose braces are wrong.
    pub fn place(&self) -> (&str, u32) {
        match self {
            Self::NotOpened { name, line, .. } | Self::NotClosed { name, line } => (name, *line),
        }
    }
}

/// All definitions of `text` in order.
///
/// # Errors
/// [`BraceError`] where a name isn't followed by `{` or a brace isn't closed.
pub(super) fn definitions(text: &str) -> Result<Vec<Span<'_>>, BraceError> {
    let mut tokens = Tokens::new(text, 1, Comments::BetweenTokens);
    let mut spans = Vec::new();
    // An empty quoted token looks like the end of the file to the game.
    while let Some(name) = tokens.next().filter(|token| !token.text.is_empty()) {
        let open = tokens.next();
        let Some(open) = open.filter(|token| token.text == "{") else {
            return Err(BraceError::NotOpened {
                name: name.text.to_owned(),
                line: name.line,
                found: open.map_or(String::new(), |token| token.text.to_owned()),
                found_line: open.map_or(name.line, |token| token.line),
            });
        };
        let close = closing_brace(&mut tokens).ok_or_else(|| BraceError::NotClosed {
            name: name.text.to_owned(),
            line: name.line,
        })?;
        spans.push(Span {
            name: name.text,
            line: name.line,
            body: &text[open.end..close.start],
            body_line: open.line,
        });
    }
    Ok(spans)
}

fn closing_brace<'a>(tokens: &mut Tokens<'a>) -> Option<Token<'a>> {
    let mut depth = 1_u32;
    tokens.find(|token| {
        match token.text {
            "{" => depth += 1,
            "}" => depth -= 1,
            _ => {}
        }
        depth == 0
    })
}

#[cfg(test)]
mod tests {
    use super::{BraceError, definitions};

    #[test]
    fn names_and_bodies() {
        let spans = definitions("a { x }\n\"b c\"\n{\n { y }\n}\n").unwrap();
        let found: Vec<_> = spans
            .iter()
            .map(|s| (s.name, s.line, s.body.trim(), s.body_line))
            .collect();
        assert_eq!(found, [("a", 1, "x", 1), ("b c", 2, "{ y }", 3)]);
    }

    #[test]
    fn a_name_without_a_brace_spoils_the_file() {
        assert!(matches!(
            definitions("a { }\nb c { }"),
            Err(BraceError::NotOpened {
                line: 2,
                found_line: 2,
                ..
            })
        ));
        assert!(matches!(definitions("a"), Err(BraceError::NotOpened { .. })));
        // Without a blank the brace belongs to the name.
        assert!(matches!(definitions("a{ }"), Err(BraceError::NotOpened { .. })));
    }

    #[test]
    fn an_unclosed_brace_spoils_the_file() {
        let error = definitions("a { { }\nb { }").unwrap_err();
        assert_eq!(error.place(), ("a", 1));
        assert!(definitions("a { }//x").is_err(), "ioquake3 takes }}//x for a word");
    }
}
