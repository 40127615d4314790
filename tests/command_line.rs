//! The program as a command in a shell's pipe.

use std::io::{BufRead, BufReader, Read};
use std::process::{Command, Stdio};

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
