//! The console as somebody types into it, without a window.

use q3rays::console::Shell;
use q3rays::console::commands::{BUTTONS, Button, COMMANDS};
use q3rays::console::shell::{Action, Panel, Scripts};
use q3rays::console::table::{CVARS, Kind};
use std::collections::HashMap;

#[derive(Default)]
struct Files(HashMap<&'static str, &'static str>);

impl Scripts for Files {
    fn script(&self, name: &str) -> Result<Option<String>, String> {
        Ok(self.0.get(name).map(|t| (*t).to_owned()))
    }
}

fn said(shell: &Shell) -> String {
    shell.log.plain()
}

#[test]
fn variables_are_set_told_toggled_and_reset() {
    let (mut shell, files) = (Shell::default(), Files::default());
    assert!(
        shell
            .execute("rt_exposure 2; set rt_tonemap reinhard; \\rt_maxDepth 3", &files)
            .is_empty()
    );
    assert_eq!(shell.cvars.get("rt_exposure").as_deref(), Some("2"));
    assert_eq!(shell.cvars.get("rt_tonemap").as_deref(), Some("reinhard"));
    assert_eq!(shell.cvars.get("rt_maxDepth").as_deref(), Some("3"));
    shell.execute(
        "toggle rt_taa; toggle rt_cullLights 0 1 2; toggle rt_cullLights 0 1 2; reset rt_exposure",
        &files,
    );
    assert_eq!(shell.cvars.number("rt_taa"), 0.0);
    assert_eq!(shell.cvars.number("rt_cullLights"), 0.0);
    assert_eq!(shell.cvars.number("rt_exposure"), 0.0);
    shell.execute("rt_numRandomDL 1000; rt_exposre 1; rt_taa maybe; rt_denoiser", &files);
    let said = said(&shell);
    for part in [
        "rt_numRandomDL clamped to 64",
        "did you mean rt_exposure?",
        "a whole number",
        "\"rt_denoiser\" is \"1\"",
    ] {
        assert!(said.contains(part), "{part} is not in:\n{said}");
    }
}

#[test]
fn what_the_shell_cannot_do_it_asks_for() {
    let (mut shell, files) = (Shell::default(), Files::default());
    let actions = shell.execute(
        "map OA_DM1; screenshot a; screenshotEXR; record; playback x; timedemo x; video x 25 8; setviewpos 1 -2 3 90 -5; +forward; \
         -forward; toggleconsole; quit",
        &files,
    );
    let screenshot = |name: Option<&str>, radiance| Action::Screenshot {
        name: name.map(str::to_owned),
        radiance,
    };
    let playback = |timed| Action::Playback {
        name: "x".into(),
        timed,
    };
    let button = |down| Action::Button {
        button: Button::Forward,
        down,
    };
    assert_eq!(
        actions,
        [
            Action::Map("oa_dm1".into()),
            screenshot(Some("a"), false),
            screenshot(None, true),
            Action::Record(None),
            playback(false),
            playback(true),
            Action::Video {
                name: "x".into(),
                fps: 25.0,
                samples: 8
            },
            Action::SetView {
                eye: [1.0, -2.0, 3.0],
                yaw: 90.0,
                pitch: -5.0
            },
            button(true),
            button(false),
            Action::Toggle(Panel::Console),
            Action::Quit,
        ]
    );
    assert!(said(&shell).is_empty());
    shell.execute(
        "setviewpos 1 2; setviewpos a b c d; setviewpos 1 2 3 nan; map; video x -1; wait x",
        &files,
    );
    assert_eq!(said(&shell).matches("usage:").count(), 6, "{}", said(&shell));
}

#[test]
fn every_command_does_something_and_tells_how_it_is_used() {
    for command in COMMANDS {
        let (mut shell, files) = (Shell::default(), Files(HashMap::from([("x", "echo in a script")])));
        shell.execute(&format!("{} x 1 2 3 4", command.name), &files);
        assert!(!said(&shell).contains("report this as a bug"), "{}", said(&shell));
        shell.execute(command.name, &files);
        assert!(!said(&shell).contains("unknown command"), "{}", said(&shell));
        assert!(!command.help.is_empty());
    }
    for (_, name, _) in BUTTONS {
        assert_eq!(
            Shell::default().execute(&format!("+{name}"), &Files::default()).len(),
            1
        );
    }
}

#[test]
fn keys_are_bound_told_and_unbound() {
    let (mut shell, files) = (Shell::default(), Files::default());
    shell.execute("bind g \"noclip; echo x\"; bind G; unbind w; bind nokey x", &files);
    assert_eq!(shell.binds.get("g"), Some("noclip; echo x"));
    assert_eq!(shell.binds.get("w"), None);
    assert!(said(&shell).contains("\"g\" = \"noclip; echo x\"") && said(&shell).contains("no key \"nokey\""));
    shell.execute("unbindall", &files);
    assert_eq!(shell.binds.iter().count(), 0);
}

#[test]
fn scripts_run_before_what_follows_and_end() {
    let files = Files(HashMap::from([
        ("a.cfg", "echo one\nexec b.cfg // comment\necho three"),
        ("b.cfg", "echo two"),
        ("loop", "exec loop; exec loop"),
    ]));
    let mut shell = Shell::default();
    shell.execute("exec a.cfg; echo four; exec nothing", &files);
    let said_now = said(&shell);
    let order: Vec<_> = ["one", "two", "three", "four"]
        .iter()
        .filter_map(|w| said_now.find(w))
        .collect();
    assert_eq!(order.len(), 4);
    assert!(order.is_sorted(), "{said_now}");
    assert!(said_now.contains("there is no script \"nothing\""));
    shell.execute("exec loop", &files);
    assert!(!shell.is_busy(), "a script that calls itself ends");
    assert!(said(&shell).contains("the rest is dropped"));
}

#[test]
fn wait_lets_frames_go_by() {
    let (mut shell, files) = (Shell::default(), Files::default());
    shell.push("noclip; wait 2; fly");
    assert_eq!(shell.run(&files), [Action::NoClip]);
    assert_eq!(shell.run(&files), []);
    assert_eq!(shell.run(&files), [Action::Fly]);
}

#[test]
fn what_stands_behind_a_map_waits_for_it() {
    let (mut shell, files) = (Shell::default(), Files::default());
    shell.push("map a; fly; kill");
    shell.begin_frame();
    assert_eq!(shell.step(&files), Some(vec![Action::Map("a".into())]));
    shell.hold();
    assert_eq!(
        shell.execute("noclip", &files),
        [Action::NoClip],
        "what is typed runs at once"
    );
    assert!(shell.is_busy());
    shell.push("quit");
    shell.release();
    assert_eq!(shell.run(&files), [Action::Fly, Action::Kill, Action::Quit]);
}

#[test]
fn any_text_is_survived() {
    use proptest::prelude::*;
    let words: Vec<&str> = COMMANDS
        .iter()
        .map(|c| c.name)
        .chain(CVARS.iter().map(|c| c.name))
        .collect();
    let word = prop_oneof![
        prop::sample::select(words),
        prop::sample::select(vec![
            "\"", ";", "//", "/*", "*/", "\n", "^1", "1", "-1", "1e99", "nan", "é", "+forward", "0"
        ]),
    ];
    proptest!(|(text in prop::collection::vec(word, 0..40), raw in "\\PC{0,80}")| {
        let mut shell = Shell::default();
        let files = Files::default();
        shell.execute(&text.join(" "), &files);
        shell.execute(&raw, &files);
        for c in CVARS {
            let value = shell.cvars.number(c.name);
            match c.kind {
                Kind::Int { min, max, .. } => prop_assert!((min as f64..=max as f64).contains(&value)),
                Kind::Float { min, max, .. } => prop_assert!((min..=max).contains(&value)),
                Kind::Choice(words) => prop_assert!((value as usize) < words.len()),
            }
        }
        q3rays::console::complete::complete(&raw, &shell.names);
    });
}
