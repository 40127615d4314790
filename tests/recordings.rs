//! Recordings: keys played again give the same way, and films of them the same frames.

mod common;

use common::installed;
use q3rays::console::Cvars;
use q3rays::game::movement::Command;
use q3rays::game::play::Play;
use q3rays::game::recording::{RecordedFrame, Recording};
use q3rays::scene::Scene;
use q3rays::scene::camera::Camera;
use q3rays::scene::clock::Clock;
use std::path::Path;
use std::process::{Command as Process, Output};

/// Somebody who walks about by chance for some frames of uneven length.
fn record(map: &str, frames: u32) -> (Recording, Scene) {
    let scene = Scene::load(&installed().focused_on(map), map).expect("the map");
    let mut play = Play::new(&scene.bsp, &scene.entities, &scene.spawns);
    let mut recording = Recording::new(map, Cvars::default().all());
    let mut camera = Camera::new(play.body.eye(), scene.spawns[0].angle, 90.0);
    let (mut at, mut random) = (0.0, 12345u32);
    let mut next = || {
        random = random.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
        f32::from((random >> 16) as u16) / 65_535.0
    };
    let mut command = Command::default();
    for i in 0..frames {
        let seconds = 0.004 + 0.04 * next();
        at += f64::from(seconds);
        if i % 20 == 0 {
            (command.forward, command.right) = (1.0 - next(), next() * 2.0 - 1.0);
            command.up = f32::from(next() > 0.7);
        }
        camera.yaw = (camera.yaw + next() * 9.0 - 4.0).rem_euclid(360.0);
        (command.yaw, command.pitch) = (camera.yaw, camera.pitch);
        let start = (i == 0 || i == frames / 2).then(|| {
            if i > 0 {
                play.body.velocity.z = 400.0;
            }
            play.state()
        });
        let clock = Clock::from_seconds(at);
        for event in play.advance(seconds, clock, false, &command) {
            if let q3rays::game::play::Event::Turned(yaw) = event {
                (camera.yaw, camera.pitch) = (yaw.rem_euclid(360.0), 0.0);
            }
        }
        camera.eye = play.body.eye().into();
        let frame = RecordedFrame {
            at,
            seconds,
            clock,
            frozen: false,
            command,
            camera,
            entities: None,
            start,
        };
        assert!(recording.push(frame, &play.states()));
    }
    (recording, scene)
}

#[test]
fn keys_played_again_give_the_same_way() {
    for map in ["showcase", "oacmpdm3", "ce1m7"] {
        let (recording, scene) = record(map, 3000);
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("way.json");
        recording.write(&path).expect("written");
        let mut read = Recording::read(&path).expect("read");
        assert_eq!(read, recording);
        let mut play = Play::new(&scene.bsp, &scene.entities, &scene.spawns);
        assert_eq!(read.replay(&mut play), None, "{map}");
        // One key otherwise, and the way is another.
        read.frames[10].command.forward -= 0.5;
        assert!(read.replay(&mut play).is_some());
    }
}

fn film(path: &Path, size: &str, more: &[&str], out: &Path) -> Output {
    let out = Process::new(env!("CARGO_BIN_EXE_q3rays"))
        .args(["render", "showcase", "--backend", "bvh", "--size", size, "--path"])
        .arg(path)
        .args(more)
        .arg("--out")
        .arg(out)
        .output()
        .expect("the program starts");
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    out
}

fn files(folder: &Path) -> Vec<(String, Vec<u8>)> {
    let mut out: Vec<_> = std::fs::read_dir(folder)
        .expect("a folder")
        .flatten()
        .map(|e| {
            (
                e.file_name().to_string_lossy().into_owned(),
                std::fs::read(e.path()).expect("a file"),
            )
        })
        .collect();
    out.sort();
    out
}

#[test]
fn films_come_out_the_same_each_time() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("way.json");
    let (mut recording, _) = record("showcase", 120);
    recording.frames.truncate(24);
    recording.write(&path).expect("written");
    let make = |name: &str, size: &str, more: &[&str]| {
        let to = folder.path().join(name);
        film(&path, size, more, &to.join("f.png"));
        files(&to)
    };
    let stats = folder.path().join("stats.json");
    let first = make("a", "64x36", &["--stats", stats.to_str().expect("a path")]);
    assert_eq!(first.len(), 24);
    assert!(first == make("b", "64x36", &[]), "bit for bit");
    assert!(first[0].1 != first[23].1);
    let json: serde_json::Value = serde_json::from_slice(&std::fs::read(&stats).expect("statistics")).expect("JSON");
    assert_eq!(json["frames"].as_array().map(Vec::len), Some(24));

    // Another size follows the same way: what is seen is the same but for its pixels.
    let normals = ["+set", "rt_view", "normal", "+set", "rt_antialiasing", "0"];
    let (small, large) = (make("c", "64x36", &normals), make("d", "192x108", &normals));
    for (i, (small, large)) in small.iter().zip(&large).enumerate() {
        let decode = |bytes: &[u8]| image::load_from_memory(bytes).expect("a picture").into_rgb8();
        let (small, large) = (decode(&small.1), decode(&large.1));
        // The middle of three by three pixels is where the small picture has its own.
        let same = small
            .enumerate_pixels()
            .filter(|(x, y, p)| large.get_pixel(x * 3 + 1, y * 3 + 1) == *p)
            .count();
        assert!(
            same * 100 > small.pixels().len() * 97,
            "frame {i}: {same} pixels are the same"
        );
    }

    // Fixed steps of time, averaged samples, the shutter open.
    let length = recording.length();
    let more = ["--fps", "50", "--spp", "4", "+set", "rt_motionblur", "0.5"];
    let averaged = make("e", "64x36", &more);
    assert_eq!(averaged.len(), (length * 50.0).floor() as usize + 1);
    assert!(averaged == make("f", "64x36", &more), "bit for bit");
}

/// A stand-in for ffmpeg keeps what it is given: every frame's pixels come through, and what goes wrong there is told.
#[cfg(unix)]
#[test]
fn ffmpeg_gets_every_frame() {
    use std::os::unix::fs::PermissionsExt;
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("way.json");
    let (mut recording, _) = record("showcase", 60);
    recording.frames.truncate(8);
    recording.write(&path).expect("written");
    let program = folder.path().join("ffmpeg");
    let run = |script: &str| {
        std::fs::write(&program, script).expect("written");
        std::fs::set_permissions(&program, std::fs::Permissions::from_mode(0o755)).expect("its rights");
        Process::new(env!("CARGO_BIN_EXE_q3rays"))
            .args([
                "render",
                "showcase",
                "--backend",
                "bvh",
                "--size",
                "32x18",
                "--out",
                "way.mp4",
                "--path",
            ])
            .arg(&path)
            .env("PATH", format!("{}:/usr/bin:/bin", folder.path().display()))
            .current_dir(folder.path())
            .output()
            .expect("the program starts")
    };
    let out = run("#!/bin/sh\nfor last; do :; done\ncat > \"$last\"\n");
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    let raw = std::fs::read(folder.path().join("way.mp4")).expect("the film");
    assert_eq!(raw.len(), 8 * 32 * 18 * 3);
    assert!(raw.iter().any(|b| *b > 100));
    let out = run("#!/bin/sh\necho no codec >&2\nexit 1\n");
    let said = String::from_utf8_lossy(&out.stderr);
    assert!(out.status.code() == Some(1) && said.contains("no codec"), "{said}");
    let left: Vec<_> = std::fs::read_dir(folder.path()).expect("a folder").flatten().collect();
    assert_eq!(left.len(), 3, "no file of ffmpeg's words is left: {left:?}");
}

#[test]
fn bad_recordings_are_told() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("bad.json");
    for (text, reason) in [
        ("", "EOF"),
        ("{}", "missing field"),
        (
            "{\"version\":99,\"map\":\"x\",\"settings\":{},\"frames\":[]}",
            "version 99",
        ),
    ] {
        std::fs::write(&path, text).expect("written");
        let out = Process::new(env!("CARGO_BIN_EXE_q3rays"))
            .args(["render", "showcase", "--out", "x.png", "--path"])
            .arg(&path)
            .current_dir(folder.path())
            .output()
            .expect("the program starts");
        let said = String::from_utf8_lossy(&out.stderr);
        assert_eq!(out.status.code(), Some(1));
        assert!(said.contains(reason) && said.trim().lines().count() == 1, "{said}");
    }
    assert!(Recording::read(&folder.path().join("nothing.json")).is_err());
}
