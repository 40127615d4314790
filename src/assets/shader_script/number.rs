//! Numbers as C's `atof` reads them, which is what the game does.

/// The number that `text` starts with, and whether all of `text` belongs to it. Without a number: zero.
///
/// Always finite: scripts are untrusted, and one infinity would spread through every picture it touches.
pub(super) fn leading_number(text: &str) -> (f32, bool) {
    let length = numeric_prefix(text.as_bytes());
    match text[..length].parse::<f32>() {
        Ok(value) if value.is_finite() => (value, length == text.len()),
        _ => (0.0, false),
    }
}

/// Length of the longest prefix of the form `[+-]digits[.digits][e[+-]digits]`.
fn numeric_prefix(bytes: &[u8]) -> usize {
    let digits = |from: usize| {
        from + bytes[from.min(bytes.len())..]
            .iter()
            .take_while(|byte| byte.is_ascii_digit())
            .count()
    };
    let sign = |at: usize| at + usize::from(matches!(bytes.get(at), Some(b'+' | b'-')));
    let start = sign(0);
    let whole = digits(start);
    let end = if bytes.get(whole) == Some(&b'.') {
        digits(whole + 1)
    } else {
        whole
    };
    if end - start == usize::from(end > whole) {
        return 0;
    }
    if matches!(bytes.get(end), Some(b'e' | b'E')) {
        let exponent = sign(end + 1);
        let exponent_end = digits(exponent);
        if exponent_end > exponent {
            return exponent_end;
        }
    }
    end
}

#[cfg(test)]
mod tests {
    use super::leading_number;

    #[test]
    fn whole_numbers_are_read_exactly() {
        for (text, value) in [
            ("1", 1.0),
            ("-.5", -0.5),
            ("+2.", 2.0),
            ("1e3", 1000.0),
            ("2.5E-1", 0.25),
            ("007", 7.0),
        ] {
            assert_eq!(leading_number(text), (value, true), "{text}");
        }
    }

    #[test]
    fn rubbish_after_a_number_is_told_and_ignored() {
        for (text, value) in [
            ("1.5f", 1.5),
            ("0.1.2", 0.1),
            ("3e", 3.0),
            ("4)", 4.0),
            ("sin", 0.0),
            (".", 0.0),
            ("-", 0.0),
            ("", 0.0),
        ] {
            assert_eq!(leading_number(text), (value, false), "{text}");
        }
    }

    #[test]
    fn the_result_is_always_finite() {
        for text in ["1e999", "nan", "inf", "-1e39"] {
            assert_eq!(leading_number(text), (0.0, false), "{text}");
        }
    }
}
