//! Console text to words: the original's rules.

/// Most commands that one text may hold; a loop of scripts ends there at the latest.
pub const MOST_COMMANDS: usize = 65_536;

/// Splits text into commands of words. A command ends at a line's end or at `;` outside quotes; words end at white space; quotes keep
/// it; `//` to the line's end and `/* … */` are comments. Unclosed quotes end with the line, unclosed comments with the text.
pub fn commands(text: &str) -> Vec<Vec<String>> {
    let mut out: Vec<Vec<String>> = Vec::new();
    let mut words: Vec<String> = Vec::new();
    let mut rest = text.chars().peekable();
    let end = |words: &mut Vec<String>, out: &mut Vec<Vec<String>>| {
        if !words.is_empty() && out.len() < MOST_COMMANDS {
            out.push(std::mem::take(words));
        }
    };
    while let Some(c) = rest.next() {
        match c {
            '\n' | '\r' | ';' => end(&mut words, &mut out),
            c if c.is_whitespace() => {}
            '/' if rest.peek() == Some(&'/') => while rest.next_if(|c| *c != '\n').is_some() {},
            '/' if rest.peek() == Some(&'*') => {
                rest.next();
                let mut last = ' ';
                for c in rest.by_ref() {
                    if last == '*' && c == '/' {
                        break;
                    }
                    last = c;
                }
            }
            '"' => {
                let mut word = String::new();
                while let Some(c) = rest.next_if(|c| *c != '\n') {
                    if c == '"' {
                        break;
                    }
                    word.push(c);
                }
                words.push(word);
            }
            c => {
                let mut word = String::from(c);
                while let Some(c) = rest.next_if(|c| !c.is_whitespace() && *c != ';' && *c != '"') {
                    // A comment ends a word; an address such as a//b does, too, as in the original.
                    if c == '/' && matches!(rest.peek(), Some('/' | '*')) {
                        if rest.peek() == Some(&'/') {
                            while rest.next_if(|c| *c != '\n').is_some() {}
                        } else {
                            word.push(c);
                            continue;
                        }
                        break;
                    }
                    word.push(c);
                }
                words.push(word);
            }
        }
    }
    end(&mut words, &mut out);
    out
}

/// A word as it must be written to be read back as one.
pub fn quoted(word: &str) -> String {
    let clean: String = word.chars().filter(|c| !matches!(c, '"' | '\n' | '\r')).collect();
    let plain = |c: char| !c.is_whitespace() && c != ';' && c != '/';
    if !clean.is_empty() && clean.chars().all(plain) {
        clean
    } else {
        format!("\"{clean}\"")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn words(text: &str) -> Vec<Vec<String>> {
        commands(text)
    }

    #[test]
    fn commands_end_at_lines_and_semicolons_but_not_in_quotes() {
        assert_eq!(
            words("set a 1; bind x \"set b 2; map y\" // comment ; quit\n\n/* echo\n no */ echo ok"),
            [
                vec!["set", "a", "1"],
                vec!["bind", "x", "set b 2; map y"],
                vec!["echo", "ok"]
            ]
        );
        assert_eq!(words("echo \"open\nquit"), [vec!["echo", "open"], vec!["quit"]]);
        assert!(words("/* open").is_empty());
        assert_eq!(words("exec a/b.cfg"), [vec!["exec", "a/b.cfg"]]);
    }

    #[test]
    fn quoted_words_are_read_back() {
        for word in ["a", "a b", "a;b", "", "//x", "^1red"] {
            assert_eq!(words(&format!("set x {}", quoted(word))), [vec!["set", "x", word]]);
        }
    }
}
