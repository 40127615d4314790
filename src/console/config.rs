//! The configuration file: kept variables and keys, as a script of the console's own commands.

use super::cvars::Cvars;
use super::shell::{Action, Scripts, Shell};
use super::table::CVARS;
use super::tokens::quoted;
use crate::output::atomic;
use std::path::{Path, PathBuf};

/// Name of the file in the configuration folder.
pub const FILE: &str = "q3rays.cfg";
/// Script that is run after it, where there is one.
pub const AUTOEXEC: &str = "autoexec.cfg";

/// The file, and what the command line set for one run alone.
pub struct Config {
    path: PathBuf,
    /// Variable, what it was in the file, and what the command line set.
    overrides: Vec<(&'static str, String, String)>,
    /// It could not be read: what it holds must not be lost.
    unread: bool,
}

/// Nothing that a configuration file may call.
struct NoScripts;

impl Scripts for NoScripts {
    fn script(&self, name: &str) -> Result<Option<String>, String> {
        Err(format!("a configuration file cannot run \"{name}\""))
    }
}

impl Config {
    /// Reads the file of a folder into variables and keys. One message tells what is wrong with it, where anything is; what can be
    /// understood is taken, and a file that cannot all be is kept beside its place.
    pub fn load(folder: &Path, shell: &mut Shell) -> (Self, Option<String>) {
        let path = folder.join(FILE);
        let config = |path, unread| Self {
            path,
            overrides: Vec::new(),
            unread,
        };
        let bytes = match std::fs::read(&path) {
            Ok(bytes) => bytes,
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => return (config(path, false), None),
            Err(e) => {
                let message = format!("cannot read {} ({e}): starting with the defaults", path.display());
                return (config(path, true), Some(message));
            }
        };
        let (understood, wrong) = match std::str::from_utf8(&bytes) {
            Ok(text) => read(text),
            Err(_) => (Shell::default(), vec!["it is no text".to_owned()]),
        };
        shell.cvars = understood.cvars;
        shell.binds = understood.binds;
        let message = wrong.first().map(|first| {
            let aside = path.with_extension("cfg.broken");
            let kept = match std::fs::rename(&path, &aside) {
                Ok(()) => format!("kept as {}", aside.display()),
                Err(e) => format!("and it cannot be put aside ({e})"),
            };
            format!("{} is damaged: {first}; {kept}, the rest of it is used", path.display())
        });
        (config(path, false), message)
    }

    /// Sets a variable for this run: the file keeps what it had unless the variable is changed again.
    ///
    /// # Errors
    /// One sentence for an unknown name or a wrong value.
    pub fn set_for_this_run(&mut self, shell: &mut Shell, name: &str, value: &str) -> Result<Option<String>, String> {
        let cvars = &mut shell.cvars;
        let before = cvars.get(name);
        let note = cvars.set(name, value).map_err(|e| e.to_string())?;
        if let (Some(c), Some(before), Some(now)) = (super::cvars::cvar(name), before, cvars.get(name)) {
            let first = self
                .overrides
                .iter()
                .find(|(n, ..)| *n == c.name)
                .map(|(_, before, _)| before.clone());
            self.overrides.retain(|(n, ..)| *n != c.name);
            self.overrides.push((c.name, first.unwrap_or(before), now));
            shell.touched.remove(c.name);
        }
        Ok(note)
    }

    /// Writes the file.
    ///
    /// # Errors
    /// One sentence naming the file.
    pub fn write(&self, shell: &Shell) -> Result<(), String> {
        if self.unread {
            return Err(format!(
                "{} could not be read and is left as it is",
                self.path.display()
            ));
        }
        if std::fs::metadata(&self.path).is_ok_and(|m| m.permissions().readonly()) {
            return Err(format!("{} may only be read", self.path.display()));
        }
        let mut cvars = shell.cvars.clone();
        for (name, before, set) in &self.overrides {
            if cvars.get(name).as_ref() == Some(set) && !shell.touched.contains(name) {
                cvars.set(name, before).map_err(|e| e.to_string())?;
            }
        }
        // Some keep a link to it elsewhere.
        let path = self.path.canonicalize().unwrap_or_else(|_| self.path.clone());
        write_to(&path, &cvars, shell)
    }

    /// Where the file lies.
    pub fn path(&self) -> &Path {
        &self.path
    }
}

/// Writes variables and keys to any file.
///
/// # Errors
/// One sentence naming the file.
pub fn write_to(path: &Path, cvars: &Cvars, shell: &Shell) -> Result<(), String> {
    atomic::create_parent(path).map_err(|e| e.to_string())?;
    atomic::write(path, text(cvars, shell).as_bytes()).map_err(|e| e.to_string())
}

/// The file's text.
fn text(cvars: &Cvars, shell: &Shell) -> String {
    let mut out =
        String::from("// Written by q3rays when it ends. Put commands of your own into autoexec.cfg.\nunbindall\n");
    for (key, command) in shell.binds.iter() {
        let key = if key == ";" { "SEMICOLON" } else { key };
        out.push_str(&format!("bind {} {}\n", quoted(key), quoted(command)));
    }
    for c in CVARS.iter().filter(|c| c.kept) {
        let value = cvars.get(c.name).unwrap_or_default();
        if value != c.default_text() {
            out.push_str(&format!("seta {} {}\n", c.name, quoted(&value)));
        }
    }
    out
}

/// Variables and keys of a file's text, and what was wrong with it.
fn read(text: &str) -> (Shell, Vec<String>) {
    let mut shell = Shell::default();
    let mut actions: Vec<Action> = Vec::new();
    // An empty file is what a full disk leaves behind.
    if text.trim().is_empty() {
        return (shell, vec!["it is empty".to_owned()]);
    }
    shell.push(text);
    while shell.is_busy() {
        actions.extend(shell.run(&NoScripts));
    }
    let mut wrong: Vec<String> = shell
        .log
        .lines()
        .filter(|l| l.starts_with("^3"))
        .map(super::log::plain)
        .collect();
    wrong.extend(actions.first().map(|a| format!("it asks for {a:?}")));
    (shell, wrong)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn folder() -> tempfile::TempDir {
        tempfile::tempdir().expect("a temporary folder")
    }

    #[test]
    fn what_is_kept_comes_back() {
        let folder = folder();
        let mut shell = Shell::default();
        let (config, message) = Config::load(folder.path(), &mut shell);
        assert_eq!(message, None, "no file is no error");
        shell.set("rt_exposure", "0.125");
        shell.set("rt_tonemap", "reinhard");
        shell.set("rt_view", "normal");
        shell.binds.set("x".into(), "echo a; echo \"b\"");
        shell.binds.set(";".into(), "quit");
        config.write(&shell).expect("written");
        let mut again = Shell::default();
        let (_, message) = Config::load(folder.path(), &mut again);
        assert_eq!(message, None);
        assert_eq!(again.cvars.get("rt_exposure").as_deref(), Some("0.125"));
        assert_eq!(again.cvars.get("rt_tonemap").as_deref(), Some("reinhard"));
        assert_eq!(again.cvars.get("rt_view").as_deref(), Some("final"), "of one run alone");
        assert!(again.binds.get("x").is_some());
    }

    #[test]
    fn the_command_line_counts_for_one_run() {
        let folder = folder();
        let mut shell = Shell::default();
        let (mut config, _) = Config::load(folder.path(), &mut shell);
        shell.set("rt_exposure", "2");
        let set = config.set_for_this_run(&mut shell, "rt_exposure", "9");
        assert!(set.is_ok());
        assert!(config.set_for_this_run(&mut shell, "cg_fov", "70").is_ok());
        shell.set("cg_fov", "100");
        assert!(config.set_for_this_run(&mut shell, "rt_taaGamma", "3").is_ok());
        shell.set("rt_taaGamma", "3");
        config.write(&shell).expect("written");
        let mut again = Shell::default();
        Config::load(folder.path(), &mut again);
        assert_eq!(again.cvars.get("rt_exposure").as_deref(), Some("2"));
        assert_eq!(
            again.cvars.get("rt_taaGamma").as_deref(),
            Some("3"),
            "chosen again by hand"
        );
        assert_eq!(again.cvars.get("cg_fov").as_deref(), Some("100"));
    }

    #[test]
    fn what_may_only_be_read_is_left_alone() {
        let folder = folder();
        let path = folder.path().join(FILE);
        std::fs::write(&path, "seta cg_fov 80\n").expect("written");
        let mut permissions = std::fs::metadata(&path).expect("its rights").permissions();
        permissions.set_readonly(true);
        std::fs::set_permissions(&path, permissions).expect("its rights");
        let mut shell = Shell::default();
        let (config, message) = Config::load(folder.path(), &mut shell);
        assert_eq!((message, shell.cvars.number("cg_fov")), (None, 80.0));
        shell.set("cg_fov", "100");
        assert!(config.write(&shell).is_err_and(|e| e.contains("may only be read")));
        assert_eq!(std::fs::read(&path).ok().as_deref(), Some(&b"seta cg_fov 80\n"[..]));
    }

    #[test]
    fn garbage_is_reported_once_and_kept_aside() {
        for garbage in [
            &b"\xff\xfe\x00"[..],
            b"rt_exposre 1\nnonsense\nseta cg_fov 80\n",
            b"",
            b"quit\n",
            b"exec x\n",
        ] {
            let folder = folder();
            std::fs::write(folder.path().join(FILE), garbage).expect("written");
            let mut shell = Shell::default();
            let (config, message) = Config::load(folder.path(), &mut shell);
            let message = message.unwrap_or_else(|| panic!("{garbage:?} was taken"));
            assert!(message.contains("damaged") && !message.contains('\n'), "{message}");
            assert_eq!(
                std::fs::read(folder.path().join("q3rays.cfg.broken")).ok().as_deref(),
                Some(garbage)
            );
            if garbage.contains(&b'8') {
                assert_eq!(shell.cvars.number("cg_fov"), 80.0, "what is right is used");
            }
            assert!(config.write(&shell).is_ok());
            assert_eq!(Config::load(folder.path(), &mut shell).1, None);
        }
    }
}
