//! The program as a command in a shell's pipe.

use q3rays::output::{exr_file, png_file};
use std::io::{BufRead, BufReader, Read};
use std::path::Path;
use std::process::{Command, Output, Stdio};

/// A reader that closes the pipe after the first line (`| head -1`, `| grep -q`) is no failure.
#[test]
fn a_reader_may_leave_early() {
    for arguments in [&["maps"][..], &["info", "showcase"], &["info", "showcase", "--json"]] {
        // Enough runs that the pipe is closed before the program writes in some of them.
        for _ in 0..5 {
            let mut child = Command::new(env!("CARGO_BIN_EXE_q3rays"))
                .args(arguments)
                .stdout(Stdio::piped())
                .stderr(Stdio::piped())
                .spawn()
                .expect("program starts");
            let mut out = BufReader::new(child.stdout.take().expect("piped"));
            if arguments[0] == "maps" {
                let mut line = String::new();
                out.read_line(&mut line).expect("a line");
                assert!(line.starts_with(char::is_alphanumeric), "{line:?}");
            }
            // Elsewhere the reader leaves before anything is written.
            drop(out);
            let status = child.wait().expect("program ends");
            let mut said = String::new();
            child
                .stderr
                .take()
                .expect("piped")
                .read_to_string(&mut said)
                .expect("text");
            assert!(status.success(), "{arguments:?}: {said}");
            assert!(!said.contains("panicked"), "{said}");
        }
    }
}

/// What could not be written is an error with a sentence, not a panic.
#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_is_reported() {
    let full = std::fs::OpenOptions::new()
        .write(true)
        .open("/dev/full")
        .expect("device");
    let done = Command::new(env!("CARGO_BIN_EXE_q3rays"))
        .args(["info", "showcase"])
        .stdout(full)
        .output()
        .expect("program starts");
    let said = String::from_utf8_lossy(&done.stderr);
    assert_eq!(done.status.code(), Some(1), "{said}");
    assert!(said.contains("space") && !said.contains("panicked"), "{said}");
}

fn render(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_q3rays"))
        .args(["render", "showcase", "--size", "64x36", "--out"])
        .args(arguments)
        .current_dir(folder)
        .output()
        .expect("program starts")
}

/// `rt_view` shows what a frame is made of, also without a window; where there is none of it, that is told.
#[test]
fn views_are_rendered() {
    let folder = tempfile::tempdir().expect("a folder");
    let view = ["+set", "rt_view", "normal", "+set", "rt_antialiasing", "0"];
    let device = ["--backend", "bvh", "--frames", "2"];
    let done = render(
        folder.path(),
        &[&["view.png", "--aov", "aov"][..], &device, &view].concat(),
    );
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    let (_, _, shown) = png_file::read(&folder.path().join("view.png")).expect("the view");
    let path = folder.path().join("aov/normal.exr");
    let (_, _, planes) = exr_file::read(&path).expect("the normals");
    let values = |name: &str| &planes.iter().find(|(n, _)| n == name).expect("a channel").1;
    let normals = [values("X"), values("Y"), values("Z")];
    let as_shown = |i: usize| (0..3).all(|k| (shown[i][k] - (normals[k][i] * 0.5 + 0.5)).abs() < 0.01);
    let same = (0..64 * 36).filter(|&i| as_shown(i)).count();
    assert!(same > 64 * 36 * 95 / 100, "{same} pixels of {}", 64 * 36);

    for (arguments, code) in [
        (&["view.exr", "--backend", "bvh", "--frames", "2"][..], 2),
        (&["view.png", "--backend", "bvh", "--spp", "2"], 2),
        (&["view.png", "--backend", "cpu", "--frames", "2"], 1),
    ] {
        let done = render(folder.path(), &[arguments, &view].concat());
        let said = String::from_utf8_lossy(&done.stderr);
        assert_eq!(done.status.code(), Some(code), "{said}");
        assert!(said.contains("rt_view shows") && said.contains("--aov"), "{said}");
    }
}
