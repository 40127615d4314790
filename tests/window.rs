//! The window as somebody uses it: keys through the display server, pictures of the screen, and what is left on disk.

mod common;

use common::desk::Desk;
use common::installed;
use glam::Vec3;
use q3rays::assets::entities::parse;
use q3rays::game::collision::CollisionWorld;
use q3rays::game::triggers::{Effect, triggers};
use q3rays::scene::Scene;
use std::path::Path;
use std::time::Duration;

/// Small frames: what is tested is the program, not the picture.
const SMALL: [&str; 6] = ["+set", "rt_scale", "0.25", "+set", "cg_drawGun", "0"];
/// A map with doors, jump pads and teleporters.
const MAP: &str = "oacmpdm3";

/// Mean brightness of a part of a picture, 0..255.
fn brightness(picture: &image::RgbImage, [x0, y0, x1, y1]: [u32; 4]) -> f64 {
    let mut sum = 0.0;
    for y in y0..y1 {
        for x in x0..x1 {
            sum += picture.get_pixel(x, y).0.iter().map(|c| f64::from(*c)).sum::<f64>() / 3.0;
        }
    }
    sum / f64::from((x1 - x0) * (y1 - y0))
}

/// Share of the pixels of a part that differ by more than a little.
fn difference(a: &image::RgbImage, b: &image::RgbImage, [x0, y0, x1, y1]: [u32; 4]) -> f64 {
    let mut differ = 0;
    for y in y0..y1 {
        for x in x0..x1 {
            let (p, q) = (a.get_pixel(x, y).0, b.get_pixel(x, y).0);
            differ += u32::from(p.iter().zip(&q).any(|(p, q)| p.abs_diff(*q) > 24));
        }
    }
    f64::from(differ) / f64::from((x1 - x0) * (y1 - y0))
}

/// The window's inside on the display, and its upper and middle parts.
const INSIDE: [u32; 4] = [0, 0, 640, 360];
const UPPER: [u32; 4] = [300, 70, 640, 150];
const MIDDLE: [u32; 4] = [200, 60, 440, 300];

fn eye(view: [f32; 5]) -> Vec3 {
    Vec3::new(view[0], view[1], view[2])
}

/// Somebody new walks through a door, rides a jump pad and a teleporter, uses the console, the menu and the settings, changes the map,
/// takes a picture, records times and their way, resizes the window and quits.
#[test]
fn somebody_plays() {
    let arguments = [&["play", "showcase"][..], &SMALL].concat();
    let mut desk = Desk::open("somebody_plays", &arguments, |_| {});
    desk.wait("showcase loaded");
    std::thread::sleep(Duration::from_secs(1));
    let start = desk.picture("1_start");
    assert!(brightness(&start, INSIDE) > 25.0, "the map is seen");

    // The sliding door lies at x = -502, between the atrium and the corridor, and opens for who comes.
    desk.console(&["setviewpos -330 0 51 180; echo there"], "there\n");
    let before_door = desk.picture("2_before_the_door");
    // A frame lets no more than a part of a second go by, however long it takes.
    let there = (0..10)
        .map(|_| {
            desk.hold("w", 4.0);
            desk.view()
        })
        .find(|there| there[0] < -530.0)
        .expect("through the door");
    desk.picture("3_through_the_door");
    assert!(there[1].abs() < 64.0, "through the door: {there:?}");
    assert!(difference(&before_door, &start, MIDDLE) > 0.2);

    // Keys that come faster than frames are for what is open by then: of these the last alone is the player's.
    desk.between_frames(|desk| {
        desk.key(&["grave"]);
        desk.enter("echo n");
        desk.enter("echo typed at once");
        desk.key(&["grave", "n"]);
    });
    desk.wait("walking through walls");
    desk.wait(": typed at once\n");
    desk.console(&["noclip"], "walking\n");
    let all = desk.text();
    let said = |line: &str| all.lines().filter(|l| l.ends_with(line)).count();
    assert_eq!(
        (
            said("]echo n"),
            said(": n"),
            said("walking through walls"),
            said(": walking")
        ),
        (1, 1, 1, 1),
        "{all}"
    );

    // The console: completion by Tab, values, and a dark shade behind the text.
    let closed = desk.picture("4_closed");
    desk.key(&["grave"]);
    let console = desk.seen("5_console", |open| {
        brightness(open, UPPER) < 0.6 * brightness(&closed, UPPER)
    });
    desk.key(&["r", "t", "underscore", "c", "u", "l", "Tab"]);
    desk.enter("2");
    desk.enter("rt_cullLights");
    desk.wait("\"rt_cullLights\" is \"2\"");
    desk.key(&["r", "t", "underscore", "Tab"]);
    std::thread::sleep(Duration::from_millis(800));
    desk.picture("6_candidates");
    desk.key(&["ctrl+a", "BackSpace"]);
    desk.enter("rt_cullLigths 1");
    desk.wait("did you mean rt_cullLights?");
    desk.key(&["Up", "Up"]);
    desk.key(&["Return"]);
    desk.wait("\"rt_cullLights\" is \"2\"");

    // Another map, with its name completed.
    desk.enter("stats times");
    desk.key(&[
        "m", "a", "p", "space", "o", "a", "c", "m", "p", "d", "m", "3", "Tab", "Return",
    ]);
    desk.wait(&format!("{MAP} loaded"));
    desk.key(&["grave"]);
    desk.seen("7_another_map", |map| {
        let anew = difference(map, &start, MIDDLE) > 0.3 && difference(map, &console, UPPER) > 0.3;
        anew && brightness(map, INSIDE) > 8.0
    });

    // A jump pad throws upwards, a teleporter puts elsewhere.
    let files = installed().focused_on(MAP);
    let scene = Scene::load(&files, MAP).expect("the map");
    let world = CollisionWorld::new(&scene.bsp);
    let found = triggers(&parse(&scene.bsp.entities).0, &world);
    let place = |wanted: fn(&Effect) -> bool| {
        let trigger = found.iter().find(|t| wanted(&t.effect)).expect("a trigger");
        let bounds = world.bounds(trigger.placed.model).expect("its bounds");
        (bounds.centre(), trigger.effect.clone())
    };
    let (pad, _) = place(|e| matches!(e, Effect::Push(v) if v.z > 500.0));
    desk.console(&["record way"], "recording");
    desk.console(
        &[&format!(
            "setviewpos {} {} {} 0 30; echo there",
            pad.x,
            pad.y,
            pad.z + 60.0
        )],
        "a jump pad throws you\n",
    );
    desk.picture("8_jump_pad");
    let (gate, effect) = place(|e| matches!(e, Effect::Teleport { .. }));
    desk.console(
        &[&format!(
            "setviewpos {} {} {} 0; echo there",
            gate.x,
            gate.y,
            gate.z + 10.0
        )],
        "you are somewhere else\n",
    );
    let arrived = eye(desk.view());
    desk.picture("9_teleporter");
    let Effect::Teleport { to, .. } = *effect else {
        panic!("no teleporter");
    };
    assert!(
        arrived.distance(to) < 700.0 && arrived.distance(gate) > 64.0,
        "{arrived} is not at {to}"
    );
    desk.console(&["stoprecord"], "way.json");

    // Times, a picture with what it was taken with, another size.
    desk.console(&["screenshot shot"], "shot.png\n");
    desk.console(&["stats"], "times.csv");
    desk.window_command("windowsize", &["800", "450"]);
    std::thread::sleep(Duration::from_secs(1));
    desk.console(&["screenshot larger"], "larger.png\n");
    desk.console(&["screenshotEXR radiance"], "radiance.exr\n");
    let size =
        |name: &str| image::image_dimensions(desk.home.path().join("screenshots").join(name)).expect("a picture");
    assert_eq!((size("shot.png"), size("larger.png")), ((160, 90), (200, 113)));
    for file in ["stats/times.json", "stats/times.csv", "screenshots/radiance.exr"] {
        assert!(
            desk.home.path().join(file).metadata().is_ok_and(|m| m.len() > 500),
            "{file}"
        );
    }
    let png = std::fs::read(desk.home.path().join("screenshots/shot.png")).expect("a picture");
    let holds = |text: &str| png.windows(text.len()).any(|w| w == text.as_bytes());
    assert!(
        holds("oacmpdm3") && holds("\"rt_cullLights\":2"),
        "the picture tells how it was made"
    );

    // What somebody finds who has read nothing: the menu on Escape, and from there maps and settings. Each panel covers its place and
    // nothing else.
    desk.console(&["rt_pause 1; echo paused"], "paused\n");
    std::thread::sleep(Duration::from_secs(6));
    let plain = desk.picture("10_plain");
    let corner = [580, 385, 790, 440];
    let panel = |keys: &[&str], name: &str, place: [u32; 4]| {
        desk.key(keys);
        desk.seen(name, |shown| {
            difference(shown, &plain, place) > 0.4 && difference(shown, &plain, corner) < 0.1
        });
    };
    panel(&["Escape"], "11_menu", [290, 140, 510, 280]);
    panel(&["Escape", "F2"], "12_settings", [400, 60, 760, 250]);
    panel(&["Escape", "F4"], "13_times", [12, 12, 330, 100]);
    desk.key(&["F4", "F3"]);
    let list = [120, 90, 680, 330];
    desk.seen("14_maps", |maps| difference(maps, &plain, list) > 0.6);
    desk.key(&["Escape"]);
    desk.seen("15_closed", |closed| difference(closed, &plain, list) < 0.1);
    desk.console(&["rt_pause 0; echo on"], "on\n");

    // The way that was recorded, shown again.
    desk.console(&["timedemo way"], "frames, median");
    desk.key(&["grave"]);
    std::thread::sleep(Duration::from_millis(500));
    desk.enter("vid_restart");
    desk.wait("oacmpdm3 loaded");
    let again = eye(desk.view());
    assert!(again.distance(arrived) < 64.0, "one stays where one was: {again}");
    desk.key(&["grave"]);
    std::thread::sleep(Duration::from_millis(500));
    desk.enter("quit");
    assert_eq!(desk.ended(), Some(0));
    let config = std::fs::read_to_string(desk.home.path().join("q3rays.cfg")).expect("the configuration");
    assert!(
        config.contains("seta rt_cullLights 2") && !config.contains("rt_scale"),
        "{config}"
    );
    clean(&desk);
}

/// Nothing that the validation layers complain of.
fn clean(desk: &Desk) {
    let text = desk.text();
    assert!(!text.contains("Validation Error") && !text.contains("VUID"), "{text}");
    assert!(!text.contains("panicked"), "{text}");
}

/// A configuration that is garbage or cannot be written is survived with one message.
#[test]
fn broken_configurations_are_survived() {
    let arguments = [&["play", "showcase"][..], &SMALL].concat();
    let prepare = |home: &Path| std::fs::write(home.join("q3rays.cfg"), b"\xff\xfegarbage").expect("written");
    let mut desk = Desk::open("garbage", &arguments, prepare);
    desk.wait("showcase loaded");
    desk.quit();
    assert_eq!(
        desk.text().matches("is damaged").count(),
        2,
        "on the terminal and in the console: {}",
        desk.text()
    );
    assert!(desk.home.path().join("q3rays.cfg.broken").is_file());
    clean(&desk);

    // A folder in the file's place can be neither read nor replaced, whoever one is.
    let prepare = |home: &Path| std::fs::create_dir_all(home.join("q3rays.cfg/x")).expect("a folder");
    let mut desk = Desk::open("folder", &arguments, prepare);
    desk.wait("showcase loaded");
    desk.quit();
    assert!(desk.text().contains("cannot read"), "{}", desk.text());
    assert_eq!(
        desk.text().matches("settings are not kept").count(),
        1,
        "{}",
        desk.text()
    );
    clean(&desk);
}

/// Commands of the command line and of `autoexec.cfg` run, a map that is not there is told and the window stays.
#[test]
fn scripts_run_without_anybody() {
    let arguments = [&["play"][..], &SMALL, &["+map", "nomap", "+wait", "3", "+exec", "more"]].concat();
    let mut desk = Desk::open("scripts", &arguments, |home| {
        std::fs::write(home.join("autoexec.cfg"), "echo first").expect("written");
        std::fs::write(
            home.join("more.cfg"),
            "map showcase; wait 5; echo second; wait 200; quit",
        )
        .expect("written");
    });
    desk.wait("first");
    desk.wait("no map named \"nomap\"");
    desk.wait("second");
    assert_eq!(desk.ended(), Some(0));
    clean(&desk);
}

/// What the window itself is made of changes again and again while frames go on.
#[test]
fn the_window_is_made_anew_again_and_again() {
    let commands = [
        "r_mode 640x360",
        "r_fullscreen 1",
        "rt_scale 0.3",
        "togglemenu",
        "r_mode 640x480",
        "con_scale 2",
        "r_fullscreen 0",
        "maps",
        "r_swapInterval 1",
        "rt_printPerfStats 2",
        "vid_restart",
        "settings",
        "rt_scale 0.25",
        "r_mode 800x600",
        "con_scale 0.5",
        "toggleconsole",
        "rt_refine 1",
        "wait 12",
        "screenshot still",
        "rt_accumulate 1",
        "map showcase",
        "rt_accumulate 0",
        "rt_refine 0",
        "r_swapInterval 0",
        "bind x quit",
        "reset r_mode",
        "kill",
        "fly",
        "noclip",
        "record a",
        "wait 9",
        "stoprecord",
        "playback a",
        "stopplayback",
        "video a 5 2",
        "reloadshaders",
        "condump all",
        "writeconfig copy",
        "rt_backend rayquery",
        "vid_restart",
    ];
    // Each step says that it is over, and is waited for by itself: shaders are compiled five times on the way, and a
    // processor that draws may take minutes for the whole.
    let step = |(n, c): (usize, &&str)| format!("{c}\nwait 4\necho step {n} over\n");
    let script: String = commands.iter().enumerate().map(step).collect();
    let arguments = [&["play", "showcase"][..], &SMALL, &["+exec", "all"]].concat();
    let mut desk = Desk::open("anew", &arguments, |home| {
        std::fs::write(home.join("all.cfg"), script + "wait 30\nquit\n").expect("written");
    });
    for n in 0..commands.len() {
        desk.wait(&format!("step {n} over"));
    }
    assert_eq!(desk.ended(), Some(0));
    clean(&desk);
    let home = desk.home.path();
    for file in [
        "screenshots/still.png",
        "recordings/a.json",
        "console/all.txt",
        "copy.cfg",
    ] {
        assert!(home.join(file).is_file(), "{file}: {}", desk.text());
    }
    let films = std::fs::read_dir(home.join("films")).map(Iterator::count);
    assert!(films.is_ok_and(|n| n > 0), "{}", desk.text());
}
