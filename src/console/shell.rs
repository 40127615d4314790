//! Runs console text: what it can do by itself it does, the rest it asks the program for.

use super::binds::{Binds, key_name};
use super::commands::{self, BUTTONS, Button, COMMANDS, button};
use super::complete::Names;
use super::cvars::{Cvars, cvar};
use super::log::Log;
use super::table::{CVARS, Kind};
use super::tokens::{self, MOST_COMMANDS};
use std::collections::{BTreeSet, VecDeque};

/// Most commands that run in one frame: scripts that call themselves end there.
const MOST_AT_ONCE: usize = 10_000;

/// A part of the overlay.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Panel {
    Console,
    Menu,
    Settings,
    Maps,
}

impl Panel {
    /// The panel that a command opens and closes.
    pub fn of_command(name: &str) -> Option<Self> {
        Some(match name.to_ascii_lowercase().as_str() {
            "toggleconsole" => Self::Console,
            "togglemenu" => Self::Menu,
            "settings" => Self::Settings,
            "maps" => Self::Maps,
            _ => return None,
        })
    }
}

/// What a text asks the program for.
#[derive(Clone, Debug, PartialEq)]
pub enum Action {
    Map(String),
    Screenshot {
        name: Option<String>,
        /// Linear radiance instead of the display's picture.
        radiance: bool,
    },
    Record(Option<String>),
    StopRecord,
    Playback {
        name: String,
        /// Every frame, as fast as can be.
        timed: bool,
    },
    StopPlayback,
    Video {
        name: String,
        fps: f64,
        samples: u32,
    },
    Stats(Option<String>),
    NoClip,
    Fly,
    Kill,
    SetView {
        eye: [f32; 3],
        yaw: f32,
        pitch: f32,
    },
    ViewPos,
    ReloadShaders,
    Restart,
    Toggle(Panel),
    Condump(String),
    WriteConfig(Option<String>),
    Button {
        button: Button,
        down: bool,
    },
    Quit,
}

/// Where `exec` finds its files.
pub trait Scripts {
    /// Text of a script; `Ok(None)` where there is none of that name.
    ///
    /// # Errors
    /// One sentence where there is one that cannot be read.
    fn script(&self, name: &str) -> Result<Option<String>, String>;
}

/// Variables, keys, the console's text, and commands that are still to run.
#[derive(Default)]
pub struct Shell {
    pub cvars: Cvars,
    pub binds: Binds,
    pub log: Log,
    pub names: Names,
    /// Variables that were set by hand.
    pub touched: BTreeSet<&'static str>,
    queue: VecDeque<Vec<String>>,
    /// Commands that wait for a map.
    held: VecDeque<Vec<String>>,
    /// Frames until the next command.
    waiting: u32,
    /// Commands that may still run in this frame.
    left: usize,
}

impl Shell {
    /// Adds text to what is still to run.
    pub fn push(&mut self, text: &str) {
        self.queue.extend(tokens::commands(text));
        self.queue.truncate(MOST_COMMANDS);
    }

    /// What is still to run waits until [`Self::release`]: what stands behind `map` in a script is meant for that map. What is typed
    /// meanwhile runs at once.
    pub fn hold(&mut self) {
        self.held.append(&mut self.queue);
        self.waiting = 0;
    }

    /// What was held runs now.
    pub fn release(&mut self) {
        self.held.append(&mut self.queue);
        std::mem::swap(&mut self.held, &mut self.queue);
    }

    /// A frame begins: waits are a frame shorter, and as many commands may run as in any.
    pub fn begin_frame(&mut self) {
        self.waiting = self.waiting.saturating_sub(1);
        self.left = MOST_AT_ONCE;
    }

    /// Runs the next command and returns what it asks for; `None` where there is none, or it is to wait.
    pub fn step(&mut self, scripts: &dyn Scripts) -> Option<Vec<Action>> {
        if self.waiting > 0 {
            return None;
        }
        if self.left == 0 && !self.queue.is_empty() {
            self.queue.clear();
            self.log.warn(format!(
                "more than {MOST_AT_ONCE} commands at once: the rest is dropped"
            ));
        }
        let words = self.queue.pop_front()?;
        self.left = self.left.saturating_sub(1);
        let mut actions = Vec::new();
        self.command(&words, scripts, &mut actions);
        Some(actions)
    }

    /// Runs a frame's commands, up to the next `wait`.
    pub fn run(&mut self, scripts: &dyn Scripts) -> Vec<Action> {
        self.begin_frame();
        std::iter::from_fn(|| self.step(scripts)).flatten().collect()
    }

    /// Runs a text at once and returns what it asks for.
    pub fn execute(&mut self, text: &str, scripts: &dyn Scripts) -> Vec<Action> {
        self.push(text);
        self.run(scripts)
    }

    /// Whether commands are still to run.
    pub fn is_busy(&self) -> bool {
        !self.queue.is_empty() || !self.held.is_empty() || self.waiting > 0
    }

    fn command(&mut self, words: &[String], scripts: &dyn Scripts, actions: &mut Vec<Action>) {
        let words: Vec<&str> = words.iter().map(String::as_str).collect();
        let Some((name, arguments)) = words.split_first() else {
            return;
        };
        let name = name.trim_start_matches(['/', '\\']);
        if let Some(info) = commands::find(name) {
            if let Err(message) = self.known(info.name, arguments, scripts, actions) {
                self.log.warn(message);
            }
            return;
        }
        if let Some((sign, down)) = name.chars().next().filter(|c| "+-".contains(*c)).map(|c| (c, c == '+'))
            && let Some(button) = button(name.trim_start_matches(sign))
        {
            actions.push(Action::Button { button, down });
            return;
        }
        match (cvar(name), arguments) {
            (Some(_), []) => self.tell(name),
            (Some(_), values) => self.set(name, &values.join(" ")),
            (None, _) => {
                let hint = commands::meant(name)
                    .map(|n| format!(" (did you mean {n}?)"))
                    .unwrap_or_default();
                self.log.warn(format!("unknown command or variable \"{name}\"{hint}"));
            }
        }
    }

    /// A command of the table. What is wrong with its arguments comes back as a sentence.
    fn known(
        &mut self,
        name: &'static str,
        arguments: &[&str],
        scripts: &dyn Scripts,
        actions: &mut Vec<Action>,
    ) -> Result<(), String> {
        let usage = || {
            let usage = commands::find(name).map(|c| c.usage).unwrap_or_default();
            format!("usage: {name} {usage}")
        };
        let first = arguments.first().map(|a| (*a).to_owned());
        let needed = || first.clone().ok_or_else(usage);
        match name {
            "set" | "seta" => match arguments {
                [name, value @ ..] if !value.is_empty() => self.set(name, &value.join(" ")),
                _ => return Err(usage()),
            },
            "toggle" => self.toggle(&needed()?, &arguments[1..])?,
            "reset" => {
                let name = needed()?;
                self.cvars.reset(&name).map_err(|e| e.to_string())?;
                self.tell(&name);
            }
            "bind" => self.bind(arguments, usage)?,
            "unbind" => {
                let key = key_name(&needed()?).ok_or_else(usage)?;
                self.binds.set(key, "");
            }
            "unbindall" => self.binds.clear(),
            "bindlist" => {
                for (key, command) in self
                    .binds
                    .iter()
                    .map(|(k, c)| (k.to_owned(), c.to_owned()))
                    .collect::<Vec<_>>()
                {
                    self.log.say(format!("{key:12} \"{command}\""));
                }
            }
            "exec" => {
                let file = needed()?;
                let text = scripts
                    .script(&file)?
                    .ok_or_else(|| format!("there is no script \"{file}\""))?;
                self.log.say(format!("running {file}"));
                // Its commands come before what is still to run.
                for words in tokens::commands(&text).into_iter().rev() {
                    self.queue.push_front(words);
                }
                self.queue.truncate(MOST_COMMANDS);
            }
            "wait" => {
                let frames = first.as_deref().map_or(Ok(1), str::parse::<u32>).map_err(|_| usage())?;
                self.waiting = frames.min(1_000_000);
            }
            "echo" => self.log.say(arguments.join(" ")),
            "clear" => self.log.clear(),
            "help" => self.help(first.as_deref()),
            "cvarlist" => self.list_cvars(first.as_deref().unwrap_or("")),
            "cmdlist" => self.list_commands(first.as_deref().unwrap_or("")),
            "maplist" => {
                let part = first.unwrap_or_default().to_lowercase();
                let found: Vec<_> = self.names.maps.iter().filter(|m| m.contains(&part)).cloned().collect();
                self.log.say(found.join("\n"));
                self.log.say(format!("{} maps", found.len()));
            }
            "map" | "devmap" => actions.push(Action::Map(needed()?.to_lowercase())),
            "screenshot" | "screenshotEXR" => actions.push(Action::Screenshot {
                name: first,
                radiance: name == "screenshotEXR",
            }),
            "record" => actions.push(Action::Record(first)),
            "stoprecord" => actions.push(Action::StopRecord),
            "playback" | "timedemo" => actions.push(Action::Playback {
                name: needed()?,
                timed: name == "timedemo",
            }),
            "stopplayback" => actions.push(Action::StopPlayback),
            "video" => {
                let number = |at: usize, default: f64| match arguments.get(at) {
                    Some(text) => text
                        .parse::<f64>()
                        .ok()
                        .filter(|n| n.is_finite() && *n > 0.0)
                        .ok_or_else(usage),
                    None => Ok(default),
                };
                actions.push(Action::Video {
                    name: needed()?,
                    fps: number(1, 30.0)?.clamp(1.0, 1000.0),
                    samples: number(2, 1.0)?.clamp(1.0, 65_536.0) as u32,
                });
            }
            "stats" => actions.push(Action::Stats(first)),
            "noclip" => actions.push(Action::NoClip),
            "fly" => actions.push(Action::Fly),
            "kill" => actions.push(Action::Kill),
            "setviewpos" => {
                let numbers: Vec<f32> = arguments
                    .iter()
                    .map(|a| a.parse::<f32>().ok().filter(|n| n.is_finite()))
                    .collect::<Option<_>>()
                    .ok_or_else(usage)?;
                let (eye, yaw, pitch) = match numbers[..] {
                    [x, y, z, yaw] => ([x, y, z], yaw, 0.0),
                    [x, y, z, yaw, pitch] => ([x, y, z], yaw, pitch),
                    _ => return Err(usage()),
                };
                actions.push(Action::SetView { eye, yaw, pitch });
            }
            "viewpos" => actions.push(Action::ViewPos),
            "reloadshaders" => actions.push(Action::ReloadShaders),
            "vid_restart" => actions.push(Action::Restart),
            "condump" => actions.push(Action::Condump(needed()?)),
            "writeconfig" => actions.push(Action::WriteConfig(first)),
            "quit" => actions.push(Action::Quit),
            _ => match Panel::of_command(name) {
                Some(panel) => actions.push(Action::Toggle(panel)),
                None => return Err(format!("{name} does nothing yet: please report this as a bug")),
            },
        }
        Ok(())
    }

    /// Sets a variable and says what there is to say about it.
    pub fn set(&mut self, name: &str, value: &str) {
        let before = self.cvars.get(name);
        match self.cvars.set(name, value) {
            Ok(note) => {
                self.touched.extend(cvar(name).map(|c| c.name));
                note.into_iter().for_each(|n| self.log.warn(n));
                if cvar(name).is_some_and(|c| c.on_load) && self.cvars.get(name) != before {
                    let when = if name.eq_ignore_ascii_case("rt_backend") {
                        "vid_restart"
                    } else {
                        "the next map"
                    };
                    self.log.say(format!("{name} shows after {when}"));
                }
            }
            Err(e) => self.log.warn(e),
        }
    }

    fn tell(&mut self, name: &str) {
        if let Some(c) = cvar(name) {
            let value = self.cvars.get(name).unwrap_or_default();
            let (default, range) = (c.default_text(), c.range());
            self.log
                .say(format!("\"{}\" is \"{value}^7\" (default {default}; {range})", c.name));
            self.log.say(format!("  {}", c.help));
        }
    }

    fn toggle(&mut self, name: &str, values: &[&str]) -> Result<(), String> {
        let now = self
            .cvars
            .get(name)
            .ok_or_else(|| format!("unknown variable \"{name}\""))?;
        let next = match (values, cvar(name).map(|c| c.kind)) {
            ([], Some(Kind::Choice(words))) => {
                let at = words
                    .iter()
                    .position(|w| *w == now)
                    .map_or(0, |i| (i + 1) % words.len());
                words[at].to_owned()
            }
            ([], _) => if now == "0" { "1" } else { "0" }.to_owned(),
            (values, _) => {
                let at = values
                    .iter()
                    .position(|v| v.eq_ignore_ascii_case(&now))
                    .map_or(0, |i| (i + 1) % values.len());
                values[at].to_owned()
            }
        };
        self.set(name, &next);
        let shown = self.cvars.get(name).unwrap_or_default();
        self.log.say(format!("{name} {shown}"));
        Ok(())
    }

    fn bind(&mut self, arguments: &[&str], usage: impl Fn() -> String) -> Result<(), String> {
        let (key, command) = arguments.split_first().ok_or_else(&usage)?;
        let key = key_name(key).ok_or_else(|| format!("there is no key \"{key}\""))?;
        if command.is_empty() {
            let bound = self.binds.get(&key).unwrap_or("").to_owned();
            self.log.say(format!("\"{key}\" = \"{bound}\""));
        } else {
            self.binds.set(key, &command.join(" "));
        }
        Ok(())
    }

    fn help(&mut self, name: Option<&str>) {
        match name {
            None => self.log.say(
                "Tab completes commands, variables and maps; help NAME tells what one does; cmdlist and cvarlist list them; F1 opens the \
                 menu",
            ),
            Some(name) => {
                if let Some(c) = commands::find(name) {
                    self.log.say(format!("{} {}: {}", c.name, c.usage, c.help));
                } else if cvar(name).is_some() {
                    self.tell(name);
                } else {
                    self.log.warn(format!("nothing is called \"{name}\""));
                }
            }
        }
    }

    fn list_cvars(&mut self, part: &str) {
        let part = part.to_lowercase();
        let found: Vec<_> = CVARS.iter().filter(|c| c.name.to_lowercase().contains(&part)).collect();
        for c in &found {
            let value = self.cvars.get(c.name).unwrap_or_default();
            let mark = if value == c.default_text() { ' ' } else { '*' };
            self.log.say(format!("{mark} {:20} \"{value}\"", c.name));
        }
        self.log
            .say(format!("{} variables; * are not at their default", found.len()));
    }

    fn list_commands(&mut self, part: &str) {
        let part = part.to_lowercase();
        let found: Vec<_> = COMMANDS
            .iter()
            .filter(|c| c.name.to_lowercase().contains(&part))
            .collect();
        for c in &found {
            self.log.say(format!("{} {}", c.name, c.usage));
        }
        for (_, name, _) in BUTTONS.iter().filter(|(_, b, _)| b.contains(&part)) {
            self.log.say(format!("+{name}"));
        }
        self.log.say(format!("{} commands", found.len()));
    }
}
