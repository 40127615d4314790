//! Completion of what is being typed.

use super::binds::KEY_NAMES;
use super::commands::{Argument, COMMANDS, find};
use super::cvars::cvar;
use super::table::{CVARS, Kind};
use super::tokens::quoted;

/// Names that only the program knows.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Names {
    pub maps: Vec<String>,
    pub scripts: Vec<String>,
    pub recordings: Vec<String>,
}

/// Something that the word could be.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Candidate {
    pub text: String,
    pub help: &'static str,
}

/// A line as far as it can be completed, and what its last word could be.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Completion {
    pub line: String,
    pub candidates: Vec<Candidate>,
}

/// Completes the last word of a line.
pub fn complete(line: &str, names: &Names) -> Completion {
    let start = line.rfind(';').map_or(0, |at| at + 1);
    let (before, last) = line.split_at(start);
    let body = last.trim_start();
    let lead = &last[..last.len() - body.len()];
    // The game lets commands begin with a slash.
    let slash = if body.starts_with(['/', '\\']) { &body[..1] } else { "" };
    let body = &body[slash.len()..];
    let mut words: Vec<&str> = body.split_whitespace().collect();
    let typed = if body.ends_with(char::is_whitespace) {
        ""
    } else {
        words.pop().unwrap_or("")
    };
    let kept = &body[..body.len() - typed.len()];
    let lower = typed.trim_start_matches('"').to_lowercase();
    let mut candidates: Vec<Candidate> = wanted(&words, names)
        .into_iter()
        .filter(|c| c.text.to_lowercase().starts_with(&lower))
        .collect();
    candidates.sort_by_key(|c| c.text.to_lowercase());
    candidates.dedup();
    let word = match &candidates[..] {
        [] => typed.to_owned(),
        [only] => quoted(&only.text) + " ",
        several => common_start(several),
    };
    Completion {
        line: format!("{before}{lead}{slash}{kept}{word}"),
        candidates,
    }
}

/// What the word after these could be.
fn wanted(words: &[&str], names: &Names) -> Vec<Candidate> {
    let plain = |names: &[String]| {
        let of = |name: &String| Candidate {
            text: name.clone(),
            help: "",
        };
        names.iter().map(of).collect()
    };
    let cvars = || {
        CVARS.iter().map(|c| Candidate {
            text: c.name.to_owned(),
            help: c.help,
        })
    };
    let commands = || {
        COMMANDS.iter().map(|c| Candidate {
            text: c.name.to_owned(),
            help: c.help,
        })
    };
    match words {
        [] => commands().chain(cvars()).collect(),
        [name] => match find(name) {
            Some(c) => match c.argument {
                Argument::None => Vec::new(),
                Argument::Map => plain(&names.maps),
                Argument::Script => plain(&names.scripts),
                Argument::Recording => plain(&names.recordings),
                Argument::Key => plain(&KEY_NAMES.iter().map(|k| (*k).to_owned()).collect::<Vec<_>>()),
                Argument::Cvar if c.name == "help" => commands().chain(cvars()).collect(),
                Argument::Cvar => cvars().collect(),
            },
            None => values(name),
        },
        ["bind", _] => commands().chain(cvars()).collect(),
        ["set" | "seta" | "toggle", name, ..] => values(name),
        _ => Vec::new(),
    }
}

/// Words that a variable takes.
fn values(name: &str) -> Vec<Candidate> {
    match cvar(name).map(|c| c.kind) {
        Some(Kind::Choice(words)) => words
            .iter()
            .map(|w| Candidate {
                text: (*w).to_owned(),
                help: "",
            })
            .collect(),
        _ => Vec::new(),
    }
}

/// What all candidates begin with, case aside, spelled as the first.
fn common_start(candidates: &[Candidate]) -> String {
    let Some((first, others)) = candidates.split_first() else {
        return String::new();
    };
    let shared = |other: &Candidate| {
        let pairs = first.text.chars().zip(other.text.chars());
        pairs.take_while(|(a, b)| a.to_lowercase().eq(b.to_lowercase())).count()
    };
    let length = others.iter().map(shared).min().unwrap_or(0);
    first.text.chars().take(length).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names() -> Names {
        Names {
            maps: vec!["oa_dm1".into(), "oa_dm2".into(), "showcase".into()],
            ..Names::default()
        }
    }

    #[test]
    fn words_are_completed_by_what_stands_before_them() {
        let names = names();
        let line = |text: &str| complete(text, &names).line;
        assert_eq!(line("rt_cu"), "rt_cullLights ");
        assert_eq!(line("/rt_cu"), "/rt_cullLights ");
        assert_eq!(line("map s"), "map showcase ");
        assert_eq!(line("map OA"), "map oa_dm");
        assert_eq!(line("echo a; devmap sh"), "echo a; devmap showcase ");
        assert_eq!(line("set rt_tonemap re"), "set rt_tonemap reinhard ");
        assert_eq!(line("rt_view atrous"), "rt_view atrous");
        assert_eq!(line("bind F1"), "bind F1");
        assert_eq!(line("nothing"), "nothing");
        assert_eq!(complete("map oa", &names).candidates.len(), 2);
        assert!(complete("", &names).candidates.len() > 80);
    }
}
