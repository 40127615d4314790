//! The entity lump: `{ "key" "value" … }` blocks.

use glam::Vec3;
use std::collections::BTreeMap;

/// One entity. Keys are lower-cased; of a repeated key the first one counts, as in the original.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Entity {
    pub keys: BTreeMap<String, String>,
}

impl Entity {
    /// Value of `key` (lower case).
    pub fn get(&self, key: &str) -> Option<&str> {
        self.keys.get(key).map(String::as_str)
    }

    /// The class name, or the empty string.
    pub fn class(&self) -> &str {
        self.get("classname").unwrap_or("")
    }

    /// A number as C's `atof` reads it (leading number, rest ignored); `None` where the key is missing.
    pub fn number(&self, key: &str) -> Option<f32> {
        self.get(key).map(leading_number)
    }

    /// Three numbers; missing ones are 0. `None` where the key is missing.
    pub fn vector(&self, key: &str) -> Option<Vec3> {
        self.get(key).map(|text| {
            let mut numbers = text.split_whitespace().map(leading_number);
            let mut next = || numbers.next().unwrap_or(0.0);
            Vec3::new(next(), next(), next())
        })
    }

    /// Bits of `spawnflags`.
    pub fn spawnflags(&self) -> i32 {
        self.number("spawnflags").unwrap_or(0.0) as i32
    }

    /// Position in world units; the world's origin where there is none.
    pub fn origin(&self) -> Vec3 {
        self.vector("origin").unwrap_or(Vec3::ZERO)
    }
}

/// The longest numeric prefix of `text`, 0 where there is none; never infinite or NaN.
pub fn leading_number(text: &str) -> f32 {
    let text = text.trim_start();
    let mut end = 0;
    let mut best = 0.0;
    let bytes = text.as_bytes();
    while end < bytes.len() && end < 64 {
        end += 1;
        if !matches!(bytes[end - 1], b'0'..=b'9' | b'.' | b'-' | b'+' | b'e' | b'E') {
            break;
        }
        if let Some(Ok(value)) = text.get(..end).map(str::parse::<f32>)
            && value.is_finite()
        {
            best = value;
        }
    }
    best
}

/// Parses the lump. Damage never fails: what cannot be read is left out and told in the second value.
pub fn parse(lump: &[u8]) -> (Vec<Entity>, Vec<String>) {
    let end = lump.iter().position(|&b| b == 0).unwrap_or(lump.len());
    let text = String::from_utf8_lossy(&lump[..end]);
    let mut tokens = Tokens { rest: &text };
    let (mut entities, mut warnings) = (Vec::new(), Vec::new());
    while let Some(token) = tokens.next() {
        if token != "{" {
            warnings.push(format!("entity text: expected '{{', found {token:?}"));
            continue;
        }
        let mut entity = Entity::default();
        loop {
            let Some(key) = tokens.next() else {
                warnings.push(format!("entity {}: the text ends inside it", entities.len()));
                break;
            };
            if key == "}" {
                break;
            }
            match tokens.next() {
                Some(value) if value != "}" => {
                    entity
                        .keys
                        .entry(key.to_ascii_lowercase())
                        .or_insert_with(|| value.to_owned());
                }
                _ => {
                    warnings.push(format!("entity {}: key {key:?} has no value", entities.len()));
                    break;
                }
            }
        }
        entities.push(entity);
    }
    (entities, warnings)
}

struct Tokens<'a> {
    rest: &'a str,
}

impl<'a> Iterator for Tokens<'a> {
    type Item = &'a str;

    fn next(&mut self) -> Option<&'a str> {
        loop {
            self.rest = self.rest.trim_start_matches(|c: char| c <= ' ');
            if let Some(after) = self.rest.strip_prefix("//") {
                self.rest = after.find('\n').map_or("", |n| &after[n..]);
            } else {
                break;
            }
        }
        if self.rest.is_empty() {
            return None;
        }
        if let Some(quoted) = self.rest.strip_prefix('"') {
            let end = quoted.find('"').unwrap_or(quoted.len());
            let token = &quoted[..end];
            self.rest = quoted.get(end + 1..).unwrap_or("");
            return Some(token);
        }
        let first = self.rest.chars().next()?;
        let end = if first == '{' || first == '}' {
            1
        } else {
            self.rest
                .find(|c: char| c <= ' ' || c == '{' || c == '}' || c == '"')
                .unwrap_or(self.rest.len())
        };
        let (token, rest) = self.rest.split_at(end);
        self.rest = rest;
        Some(token)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_read_as_atof_does() {
        for (text, value) in [
            ("12", 12.0),
            (" -3.5abc", -3.5),
            ("1e3 4", 1000.0),
            ("abc", 0.0),
            ("", 0.0),
            ("1e999", 0.0),
        ] {
            let read = leading_number(text);
            if text == "1e999" {
                assert!(read.is_finite());
            } else {
                assert_eq!(read, value, "{text:?}");
            }
        }
    }

    #[test]
    fn blocks_keys_and_damage() {
        let (entities, warnings) =
            parse(b"{ \"ClassName\" \"worldspawn\" }\n{ \"a\" \"1\" \"a\" \"2\" \"origin\" \"1 2 3\" }\0junk");
        assert!(warnings.is_empty());
        assert_eq!(entities.len(), 2);
        assert_eq!(entities[0].class(), "worldspawn");
        assert_eq!(entities[1].get("a"), Some("1"));
        assert_eq!(entities[1].origin(), Vec3::new(1.0, 2.0, 3.0));
        let (entities, warnings) = parse(b"{ \"a\" }");
        assert_eq!((entities.len(), warnings.len()), (1, 1));
        let (_, warnings) = parse(b"} {");
        assert_eq!(warnings.len(), 2);
    }
}
