//! Console commands: one table for help, completion and docs.

use super::nearest::nearest;

/// What an argument names, for completion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Argument {
    None,
    Map,
    Cvar,
    Key,
    Script,
    Recording,
}

/// A row of the table.
#[derive(Clone, Copy, Debug)]
pub struct CommandInfo {
    pub name: &'static str,
    /// Its arguments as they are told to the user.
    pub usage: &'static str,
    pub help: &'static str,
    /// What its first argument names.
    pub argument: Argument,
}

const fn row(name: &'static str, usage: &'static str, help: &'static str, argument: Argument) -> CommandInfo {
    CommandInfo {
        name,
        usage,
        help,
        argument,
    }
}

/// Every command.
pub const COMMANDS: &[CommandInfo] = &[
    row("map", "NAME", "walks in another map", Argument::Map),
    row(
        "devmap",
        "NAME",
        "the same: nothing here counts as cheating",
        Argument::Map,
    ),
    row("maplist", "[PART]", "lists the maps found", Argument::None),
    row("cvarlist", "[PART]", "lists variables and their values", Argument::None),
    row("cmdlist", "[PART]", "lists commands", Argument::None),
    row(
        "help",
        "[NAME]",
        "tells what a command or variable does",
        Argument::Cvar,
    ),
    row("set", "NAME VALUE", "sets a variable", Argument::Cvar),
    row("seta", "NAME VALUE", "sets a variable, as set does", Argument::Cvar),
    row(
        "toggle",
        "NAME [VALUE…]",
        "switches a variable between 0 and 1, or through the values given",
        Argument::Cvar,
    ),
    row("reset", "NAME", "sets a variable to its default", Argument::Cvar),
    row(
        "bind",
        "KEY [COMMAND]",
        "makes a key do something, or tells what it does",
        Argument::Key,
    ),
    row("unbind", "KEY", "makes a key do nothing", Argument::Key),
    row("unbindall", "", "makes all keys do nothing", Argument::None),
    row("bindlist", "", "lists what keys do", Argument::None),
    row("exec", "FILE", "runs the commands of a file", Argument::Script),
    row(
        "wait",
        "[FRAMES]",
        "lets frames go by before the next command",
        Argument::None,
    ),
    row("echo", "TEXT", "prints a text", Argument::None),
    row(
        "writeconfig",
        "[FILE]",
        "writes variables and keys to a file",
        Argument::Script,
    ),
    row("screenshot", "[NAME]", "writes the picture as PNG", Argument::None),
    row(
        "screenshotEXR",
        "[NAME]",
        "writes the picture's radiance as EXR: linear, before exposure",
        Argument::None,
    ),
    row(
        "record",
        "[NAME]",
        "records the way through the map: views, keys and what moved",
        Argument::Recording,
    ),
    row("stoprecord", "", "ends the recording and writes it", Argument::None),
    row(
        "playback",
        "NAME",
        "shows a recording at its own speed",
        Argument::Recording,
    ),
    row(
        "timedemo",
        "NAME",
        "shows every frame of a recording as fast as can be, and writes the frame times",
        Argument::Recording,
    ),
    row("stopplayback", "", "ends a playback", Argument::None),
    row(
        "video",
        "NAME [FPS] [SAMPLES]",
        "makes a film of a recording in the background: mp4 where ffmpeg is found, else numbered PNG files",
        Argument::Recording,
    ),
    row(
        "stats",
        "[NAME]",
        "begins to write down frame times; again: ends it and writes CSV and JSON",
        Argument::None,
    ),
    row("noclip", "", "walks through walls, or no longer", Argument::None),
    row("fly", "", "flies, but not through walls, or no longer", Argument::None),
    row("kill", "", "goes back to a spawn", Argument::None),
    row(
        "setviewpos",
        "X Y Z YAW [PITCH]",
        "puts the eye somewhere: units, degrees",
        Argument::None,
    ),
    row("viewpos", "", "tells where the eye is", Argument::None),
    row(
        "reloadshaders",
        "",
        "compiles changed shaders and uses them (builds with the feature `compile-shaders`)",
        Argument::None,
    ),
    row(
        "vid_restart",
        "",
        "opens the device anew and loads the map again",
        Argument::None,
    ),
    row("toggleconsole", "", "opens or closes the console", Argument::None),
    row("togglemenu", "", "opens or closes the menu", Argument::None),
    row("settings", "", "opens or closes the settings", Argument::None),
    row("maps", "", "opens or closes the list of maps", Argument::None),
    row("condump", "FILE", "writes the console's text to a file", Argument::None),
    row("clear", "", "empties the console", Argument::None),
    row("quit", "", "ends the program", Argument::None),
];

/// What is done as long as a key is held: `+name` presses, `-name` lets go.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Button {
    Forward,
    Back,
    MoveLeft,
    MoveRight,
    MoveUp,
    MoveDown,
    Left,
    Right,
    LookUp,
    LookDown,
    Speed,
}

/// Buttons with their names without sign, and what they do.
pub const BUTTONS: &[(Button, &str, &str)] = &[
    (Button::Forward, "forward", "walks forward"),
    (Button::Back, "back", "walks back"),
    (Button::MoveLeft, "moveleft", "walks to the left"),
    (Button::MoveRight, "moveright", "walks to the right"),
    (Button::MoveUp, "moveup", "jumps, swims or flies up"),
    (Button::MoveDown, "movedown", "crouches, dives or flies down"),
    (Button::Left, "left", "turns to the left"),
    (Button::Right, "right", "turns to the right"),
    (Button::LookUp, "lookup", "looks up"),
    (Button::LookDown, "lookdown", "looks down"),
    (Button::Speed, "speed", "goes three times as fast through walls"),
];

/// A button by its name without sign.
pub fn button(name: &str) -> Option<Button> {
    let found = BUTTONS.iter().find(|(_, b, _)| b.eq_ignore_ascii_case(name));
    found.map(|(button, ..)| *button)
}

/// A command by name.
pub fn find(name: &str) -> Option<&'static CommandInfo> {
    COMMANDS.iter().find(|c| c.name.eq_ignore_ascii_case(name))
}

/// The nearest of all names of commands and variables, for those who mistype.
pub fn meant(name: &str) -> Option<&'static str> {
    let commands = COMMANDS.iter().map(|c| c.name);
    let cvars = super::table::CVARS.iter().map(|c| c.name);
    nearest(name, commands.chain(cvars))
}

/// The table as Markdown, for `docs/cvars.md`.
pub fn markdown() -> String {
    let mut out = String::from(
        "\n# Console commands\n\nMade from the table in `src/console/commands.rs`.\n\n| command | what it does |\n|---|---|\n",
    );
    for c in COMMANDS {
        let call = format!("{} {}", c.name, c.usage);
        out.push_str(&format!("| `{}` | {} |\n", call.trim_end(), c.help));
    }
    for (_, name, help) in BUTTONS {
        out.push_str(&format!("| `+{name}`, `-{name}` | {help} while held |\n"));
    }
    out
}
