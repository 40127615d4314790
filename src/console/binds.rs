//! Which key does what.

use std::collections::BTreeMap;

/// Names of keys that are no single character, upper case: the original's where it has one.
pub const KEY_NAMES: &[&str] = &[
    "TAB",
    "ENTER",
    "ESCAPE",
    "SPACE",
    "BACKSPACE",
    "UPARROW",
    "DOWNARROW",
    "LEFTARROW",
    "RIGHTARROW",
    "ALT",
    "CTRL",
    "SHIFT",
    "CAPSLOCK",
    "INS",
    "DEL",
    "PGDN",
    "PGUP",
    "HOME",
    "END",
    "PAUSE",
    "F1",
    "F2",
    "F3",
    "F4",
    "F5",
    "F6",
    "F7",
    "F8",
    "F9",
    "F10",
    "F11",
    "F12",
    "KP_HOME",
    "KP_UPARROW",
    "KP_PGUP",
    "KP_LEFTARROW",
    "KP_5",
    "KP_RIGHTARROW",
    "KP_END",
    "KP_DOWNARROW",
    "KP_PGDN",
    "KP_ENTER",
    "KP_INS",
    "KP_DEL",
    "KP_SLASH",
    "KP_MINUS",
    "KP_PLUS",
    "MOUSE1",
    "MOUSE2",
    "MOUSE3",
    "MOUSE4",
    "MOUSE5",
    "MWHEELUP",
    "MWHEELDOWN",
    "SEMICOLON",
    "PAD0_A",
    "PAD0_B",
    "PAD0_X",
    "PAD0_Y",
    "PAD0_BACK",
    "PAD0_START",
    "PAD0_LEFTSHOULDER",
    "PAD0_RIGHTSHOULDER",
    "PAD0_LEFTTRIGGER",
    "PAD0_RIGHTTRIGGER",
    "PAD0_LEFTSTICK_CLICK",
    "PAD0_RIGHTSTICK_CLICK",
    "PAD0_DPAD_UP",
    "PAD0_DPAD_DOWN",
    "PAD0_DPAD_LEFT",
    "PAD0_DPAD_RIGHT",
];

/// What keys do where nothing else was said.
const DEFAULTS: &[(&str, &str)] = &[
    ("w", "+forward"),
    ("UPARROW", "+forward"),
    ("s", "+back"),
    ("DOWNARROW", "+back"),
    ("a", "+moveleft"),
    ("d", "+moveright"),
    ("LEFTARROW", "+left"),
    ("RIGHTARROW", "+right"),
    ("PGUP", "+lookup"),
    ("PGDN", "+lookdown"),
    ("SPACE", "+moveup"),
    ("c", "+movedown"),
    ("CTRL", "+movedown"),
    ("SHIFT", "+speed"),
    ("MOUSE2", "+moveup"),
    ("`", "toggleconsole"),
    ("~", "toggleconsole"),
    ("ESCAPE", "togglemenu"),
    ("F1", "togglemenu"),
    ("F2", "settings"),
    ("F3", "maps"),
    ("F4", "toggle rt_printPerfStats"),
    ("F5", "toggle rt_denoiser"),
    ("F6", "toggle rt_numRandomDL 1 0"),
    ("F7", "toggle rt_cullLights 0 1 2"),
    ("F8", "toggle rt_illumination"),
    ("F11", "toggle r_fullscreen"),
    ("F12", "screenshot"),
    ("n", "noclip"),
    ("p", "toggle rt_refine"),
    ("PAUSE", "toggle rt_pause"),
    ("f", "toggle rt_flashlight 0 300"),
    ("0", "rt_view final"),
    ("1", "rt_view albedo"),
    ("2", "rt_view normal"),
    ("3", "rt_view depth"),
    ("4", "rt_view direct"),
    ("5", "rt_view emission"),
    ("6", "rt_view cluster"),
    ("7", "rt_view history"),
    ("8", "rt_view variance"),
    ("9", "rt_view motion"),
    ("PAD0_A", "+moveup"),
    ("PAD0_B", "+movedown"),
    ("PAD0_START", "togglemenu"),
    ("PAD0_BACK", "toggleconsole"),
    ("PAD0_LEFTTRIGGER", "+movedown"),
    ("PAD0_RIGHTTRIGGER", "+moveup"),
];

/// Commands by key.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Binds(BTreeMap<String, String>);

impl Default for Binds {
    fn default() -> Self {
        Self(
            DEFAULTS
                .iter()
                .map(|(k, c)| ((*k).to_owned(), (*c).to_owned()))
                .collect(),
        )
    }
}

/// A key's name as it is kept: single characters in lower case, others in upper. `None` where there is no such key.
pub fn key_name(name: &str) -> Option<String> {
    let mut chars = name.chars();
    if let (Some(c), None) = (chars.next(), chars.next()) {
        return (!c.is_whitespace() && !c.is_control()).then(|| c.to_lowercase().collect());
    }
    let upper = name.to_ascii_uppercase();
    KEY_NAMES.contains(&upper.as_str()).then_some(upper)
}

impl Binds {
    /// Command of a key by its kept name.
    pub fn get(&self, key: &str) -> Option<&str> {
        self.0.get(key).map(String::as_str)
    }

    /// Gives a key, by its kept name, a command; an empty one: none.
    pub fn set(&mut self, key: String, command: &str) {
        if command.is_empty() {
            self.0.remove(&key);
        } else {
            self.0.insert(key, command.to_owned());
        }
    }

    /// Takes all commands away.
    pub fn clear(&mut self) {
        self.0.clear();
    }

    /// Keys and their commands.
    pub fn iter(&self) -> impl Iterator<Item = (&str, &str)> {
        self.0.iter().map(|(k, c)| (k.as_str(), c.as_str()))
    }

    /// A key of the keyboard that has this command, to tell people: function keys before others, a gamepad's only where there is no other.
    pub fn shown_key<'a>(&'a self, command: &'a str) -> Option<&'a str> {
        let rank = |key: &&str| {
            (
                key.starts_with("PAD"),
                !key.starts_with('F') || key.len() == 1,
                key.len(),
            )
        };
        self.keys_of(command).min_by_key(rank)
    }

    /// Keys that have this command.
    pub fn keys_of<'a>(&'a self, command: &'a str) -> impl Iterator<Item = &'a str> {
        self.iter()
            .filter(move |(_, c)| c.eq_ignore_ascii_case(command))
            .map(|(k, _)| k)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::console::commands::{button, find};
    use crate::console::cvars::cvar;
    use crate::console::tokens::commands;

    #[test]
    fn defaults_name_keys_and_commands_that_exist() {
        for (key, command) in DEFAULTS {
            assert_eq!(key_name(key).as_deref(), Some(*key));
            for words in commands(command) {
                let known = find(&words[0]).is_some()
                    || cvar(&words[0]).is_some()
                    || words[0].strip_prefix('+').is_some_and(|b| button(b).is_some());
                assert!(known, "{key}: {command}");
            }
        }
        assert_eq!(key_name("uparrow").as_deref(), Some("UPARROW"));
        assert_eq!(key_name("W").as_deref(), Some("w"));
        assert_eq!(key_name("nokey"), None);
    }
}
