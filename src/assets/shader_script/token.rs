//! Cuts script text into tokens the way id's parser does.

/// One word of a script; quotes are taken off.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Token<'a> {
    pub text: &'a str,
    /// Line in the file, from 1.
    pub line: u32,
    /// A line break lies between this token and the one before.
    pub first_on_line: bool,
    /// Byte range in the text, quotes included.
    pub start: usize,
    pub end: usize,
}

/// Where a comment may start.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Comments {
    /// Only where a token could start: `}//x` is one word. So does ioquake3's check of the braces.
    BetweenTokens,
    /// Anywhere: `}//x` is a brace. So does the game when it reads definitions, as it strips comments first.
    Anywhere,
}

/// Iterator over the tokens of a text. Every byte up to the space and from 128 on separates tokens, since the game
/// compares signed characters; so a byte order mark at the start of a file does no harm.
#[derive(Clone, Debug)]
pub(super) struct Tokens<'a> {
    text: &'a str,
    position: usize,
    line: u32,
    comments: Comments,
}

impl<'a> Tokens<'a> {
    /// Tokens of `text`, whose first line has number `line`.
    pub fn new(text: &'a str, line: u32, comments: Comments) -> Self {
        Self {
            text,
            position: 0,
            line,
            comments,
        }
    }

    fn byte(&self, ahead: usize) -> Option<u8> {
        self.text.as_bytes().get(self.position + ahead).copied()
    }

    fn advance(&mut self) {
        if self.byte(0) == Some(b'\n') {
            self.line += 1;
        }
        self.position += 1;
    }

    fn at_comment(&self) -> bool {
        self.byte(0) == Some(b'/') && matches!(self.byte(1), Some(b'/' | b'*'))
    }

    /// Skips blanks and comments; true where a line break was among them. A lone carriage return breaks a line as
    /// in the game, but doesn't end a `//` comment; breaks inside `/* */` don't count.
    fn skip_blanks(&mut self) -> bool {
        let mut broken = false;
        while let Some(byte) = self.byte(0) {
            if self.at_comment() {
                self.skip_comment();
            } else if is_blank(byte) {
                broken |= matches!(byte, b'\n' | b'\r');
                self.advance();
            } else {
                break;
            }
        }
        broken
    }

    fn skip_comment(&mut self) {
        let block = self.byte(1) == Some(b'*');
        if self.comments == Comments::BetweenTokens {
            // Only the game's comment stripper takes `/*/` for a whole comment.
            self.position += 2;
        }
        while let Some(byte) = self.byte(0) {
            if block && byte == b'*' && self.byte(1) == Some(b'/') {
                self.position += 2;
                return;
            }
            if !block && byte == b'\n' {
                return;
            }
            self.advance();
        }
    }
}

impl<'a> Iterator for Tokens<'a> {
    type Item = Token<'a>;

    fn next(&mut self) -> Option<Token<'a>> {
        let first_on_line = self.skip_blanks() || self.position == 0;
        let line = self.line;
        let start = self.position;
        let text = if self.byte(0)? == b'"' {
            self.advance();
            while self.byte(0).is_some_and(|byte| byte != b'"') {
                self.advance();
            }
            let content = &self.text[start + 1..self.position];
            if self.byte(0).is_some() {
                self.advance();
            }
            content
        } else {
            self.advance();
            while self.byte(0).is_some_and(|byte| !is_blank(byte))
                && !(self.comments == Comments::Anywhere && self.at_comment())
            {
                self.advance();
            }
            &self.text[start..self.position]
        };
        Some(Token {
            text,
            line,
            first_on_line,
            start,
            end: self.position,
        })
    }
}

fn is_blank(byte: u8) -> bool {
    byte <= b' ' || !byte.is_ascii()
}

#[cfg(test)]
mod tests {
    use super::{Comments, Tokens};

    fn words(text: &str, comments: Comments) -> Vec<(&str, u32, bool)> {
        Tokens::new(text, 1, comments)
            .map(|token| (token.text, token.line, token.first_on_line))
            .collect()
    }

    #[test]
    fn lines_and_quotes() {
        assert_eq!(
            words("a b\n\"c d\"e\r\nf", Comments::Anywhere),
            [
                ("a", 1, true),
                ("b", 1, false),
                ("c d", 2, true),
                ("e", 2, false),
                ("f", 3, true)
            ]
        );
        assert_eq!(words("a\rb", Comments::Anywhere), [("a", 1, true), ("b", 1, true)]);
        assert_eq!(words("\"open\nend", Comments::Anywhere), [("open\nend", 1, true)]);
    }

    #[test]
    fn comments_are_blanks() {
        assert_eq!(
            words("a // b\nc /* d\n */ e", Comments::Anywhere),
            [("a", 1, true), ("c", 2, true), ("e", 3, false)]
        );
        assert_eq!(words("/* open", Comments::Anywhere), []);
        assert_eq!(words("/*/x", Comments::Anywhere), [("x", 1, false)]);
        assert_eq!(words("/*/ x */", Comments::BetweenTokens), []);
    }

    #[test]
    fn a_comment_against_a_token_depends_on_the_reader() {
        assert_eq!(words("}//x", Comments::Anywhere), [("}", 1, true)]);
        assert_eq!(words("}//x", Comments::BetweenTokens), [("}//x", 1, true)]);
    }

    #[test]
    fn bytes_outside_ascii_separate() {
        assert_eq!(words("\u{feff}a\u{e9}b", Comments::Anywhere).len(), 2);
    }
}
