//! Values of the console variables.

use super::nearest::nearest;
use super::table::{CVARS, Cvar, Kind};
use thiserror::Error;

/// A set of a variable that did not go as asked.
#[derive(Debug, Error, PartialEq)]
pub enum CvarError {
    #[error("unknown variable \"{name}\"{}", .nearest.map(|n| format!(" (did you mean {n}?)")).unwrap_or_default())]
    Unknown {
        name: String,
        nearest: Option<&'static str>,
    },
    #[error("{name} takes {expected}, not \"{value}\"")]
    Value {
        name: &'static str,
        value: String,
        expected: String,
    },
}

/// Value of a variable.
#[derive(Clone, Debug, PartialEq)]
enum Value {
    Int(i64),
    Float(f64),
    /// Index into the list of words.
    Choice(usize),
}

/// Current values of all variables.
#[derive(Clone, Debug, PartialEq)]
pub struct Cvars {
    values: Vec<Value>,
}

impl Default for Cvars {
    fn default() -> Self {
        Self {
            values: CVARS
                .iter()
                .map(|c| match c.kind {
                    Kind::Int { default, .. } => Value::Int(default),
                    Kind::Float { default, .. } => Value::Float(default),
                    Kind::Choice(_) => Value::Choice(0),
                })
                .collect(),
        }
    }
}

pub(super) fn find(name: &str) -> Option<usize> {
    CVARS.iter().position(|c| c.name.eq_ignore_ascii_case(name))
}

/// A row of the table by name.
pub fn cvar(name: &str) -> Option<&'static Cvar> {
    find(name).map(|at| &CVARS[at])
}

impl Cvars {
    /// Sets a variable from text. Out-of-range numbers are clamped; the message says so.
    ///
    /// # Errors
    /// [`CvarError`] for an unknown name (with the nearest one) or a value of the wrong kind.
    pub fn set(&mut self, name: &str, text: &str) -> Result<Option<String>, CvarError> {
        let Some(at) = find(name) else {
            return Err(CvarError::Unknown {
                name: name.to_owned(),
                nearest: nearest(name, CVARS.iter().map(|c| c.name)),
            });
        };
        let cvar = &CVARS[at];
        let wrong = |expected: String| CvarError::Value {
            name: cvar.name,
            value: text.to_owned(),
            expected,
        };
        let (value, message) = match cvar.kind {
            Kind::Int { min, max, .. } => {
                let number: f64 = text.parse().map_err(|_| wrong("a whole number".into()))?;
                if !number.is_finite() || number.fract() != 0.0 {
                    return Err(wrong("a whole number".into()));
                }
                let clamped = (number as i64).clamp(min, max);
                let note = (clamped as f64 != number).then(|| format!("{} clamped to {clamped}", cvar.name));
                (Value::Int(clamped), note)
            }
            Kind::Float { min, max, .. } => {
                let number: f64 = text.parse().map_err(|_| wrong("a number".into()))?;
                if number.is_nan() {
                    return Err(wrong("a number".into()));
                }
                let clamped = number.clamp(min, max);
                let note = (clamped != number).then(|| format!("{} clamped to {clamped}", cvar.name));
                (Value::Float(clamped), note)
            }
            Kind::Choice(words) => {
                let word = words
                    .iter()
                    .position(|w| w.eq_ignore_ascii_case(text))
                    .or_else(|| text.parse::<usize>().ok().filter(|&i| i < words.len()));
                (
                    Value::Choice(word.ok_or_else(|| wrong(format!("one of: {}", words.join(", "))))?),
                    None,
                )
            }
        };
        self.values[at] = value;
        Ok(message)
    }

    /// Text of a variable's value; `None` for an unknown name.
    pub fn get(&self, name: &str) -> Option<String> {
        let at = find(name)?;
        Some(match (&self.values[at], CVARS[at].kind) {
            (Value::Choice(i), Kind::Choice(words)) => words[*i].to_owned(),
            (Value::Int(i), _) => i.to_string(),
            (Value::Float(f), _) => f.to_string(),
            (Value::Choice(i), _) => i.to_string(),
        })
    }

    /// Sets a variable to its default.
    ///
    /// # Errors
    /// [`CvarError::Unknown`].
    pub fn reset(&mut self, name: &str) -> Result<(), CvarError> {
        let default = cvar(name).map(Cvar::default_text).unwrap_or_default();
        self.set(name, &default).map(|_| ())
    }

    /// A number of the table, by its exact name. Names are literals of this program; one that is not in the table reads
    /// as 0 and fails the test that reads all of [`crate::render::settings::Settings`].
    pub fn number(&self, name: &str) -> f64 {
        match find(name).map(|at| &self.values[at]) {
            Some(Value::Int(i)) => *i as f64,
            Some(Value::Float(f)) => *f,
            Some(Value::Choice(i)) => *i as f64,
            None => 0.0,
        }
    }

    /// Name and value of every variable, in table order.
    pub fn all(&self) -> serde_json::Map<String, serde_json::Value> {
        CVARS
            .iter()
            .zip(&self.values)
            .map(|(c, v)| {
                let value = match (v, c.kind) {
                    (Value::Int(i), _) => (*i).into(),
                    (Value::Float(f), _) => (*f).into(),
                    (Value::Choice(i), Kind::Choice(words)) => words[*i].into(),
                    (Value::Choice(i), _) => (*i).into(),
                };
                (c.name.to_owned(), value)
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_checked_clamped_and_read_back() {
        let mut cvars = Cvars::default();
        assert_eq!(cvars.set("RT_cullLights", "2"), Ok(None));
        assert_eq!(cvars.get("rt_cullLights").as_deref(), Some("2"));
        assert!(cvars.set("rt_numRandomDL", "1000").is_ok_and(|note| note.is_some()));
        assert_eq!(cvars.number("rt_numRandomDL"), 64.0);
        assert!(cvars.set("rt_exposure", "nan").is_err());
        assert!(cvars.set("rt_tonemap", "sepia").is_err());
        assert_eq!(
            cvars.set("rt_culllight", "1"),
            Err(CvarError::Unknown {
                name: "rt_culllight".into(),
                nearest: Some("rt_cullLights")
            })
        );
    }

    #[test]
    fn names_are_unique_and_defaults_in_range() {
        for (i, c) in CVARS.iter().enumerate() {
            assert_eq!(find(c.name), Some(i));
            match c.kind {
                Kind::Int { default, min, max } => assert!((min..=max).contains(&default)),
                Kind::Float { default, min, max } => assert!((min..=max).contains(&default)),
                Kind::Choice(words) => assert!(!words.is_empty()),
            }
        }
    }
}
