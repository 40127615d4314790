//! A display without a screen, the program's window on it, and somebody who types and looks.

use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// Longest wait for something to happen: software rendering on busy machines takes its time.
const PATIENCE: Duration = Duration::from_secs(120);

/// The display, the program, and where both write.
pub struct Desk {
    xvfb: Child,
    program: Child,
    display: String,
    window: String,
    /// The program's `--home`.
    pub home: tempfile::TempDir,
    log: PathBuf,
    /// Pictures of the steps.
    pub pictures: PathBuf,
    /// Bytes of the log that have been waited for.
    read: usize,
    /// Questions asked, so that each has an answer of its own.
    asked: u32,
}

fn run(display: &str, program: &str, arguments: &[&str]) -> String {
    let out = Command::new(program)
        .args(arguments)
        .env("DISPLAY", display)
        .output()
        .unwrap_or_else(|e| panic!("{program}: {e}; run tests/setup.sh"));
    String::from_utf8_lossy(&out.stdout).into_owned()
}

impl Desk {
    /// Opens the program's window with its arguments; `prepare` may put files into its home first.
    pub fn open(name: &str, arguments: &[&str], prepare: impl FnOnce(&Path)) -> Self {
        let home = tempfile::tempdir().expect("a temporary folder");
        prepare(home.path());
        let number = home.path().join("display");
        let mut xvfb = Command::new("Xvfb")
            // It would begin anew whenever its last client leaves, and turn away who comes meanwhile.
            .args([
                "-displayfd",
                "1",
                "-noreset",
                "-screen",
                "0",
                "1024x768x24",
                "-nolisten",
                "tcp",
            ])
            .stdout(std::fs::File::create(&number).expect("a file"))
            .stderr(Stdio::null())
            .spawn()
            .unwrap_or_else(|e| panic!("Xvfb: {e}; run tests/setup.sh"));
        let display = wait_for("a display", || {
            assert!(xvfb.try_wait().is_ok_and(|ended| ended.is_none()), "Xvfb ended");
            let text = std::fs::read_to_string(&number).unwrap_or_default();
            text.ends_with('\n').then(|| format!(":{}", text.trim()))
        });
        let log = home.path().join("program.log");
        let file = std::fs::File::create(&log).expect("a file");
        let program = Command::new(env!("CARGO_BIN_EXE_q3rays"))
            .args(arguments)
            .arg("--home")
            .arg(home.path())
            .env("DISPLAY", &display)
            .env_remove("WAYLAND_DISPLAY")
            .env("RUST_LOG", "console=info,q3rays=warn")
            .env("NO_COLOR", "1")
            .env("VK_INSTANCE_LAYERS", "VK_LAYER_KHRONOS_validation")
            .stdout(file.try_clone().expect("a file"))
            .stderr(file)
            .spawn()
            .expect("the program starts");
        let pictures = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(name);
        std::fs::create_dir_all(&pictures).expect("a folder");
        let mut desk = Self {
            xvfb,
            program,
            display,
            window: String::new(),
            home,
            log,
            pictures,
            read: 0,
            asked: 0,
        };
        desk.window = wait_for("the window", || {
            let found = run(&desk.display, "xdotool", &["search", "--name", "q3rays"]);
            found.lines().next().map(str::to_owned)
        });
        desk.window_command("windowfocus", &[]);
        desk.check_layer();
        desk
    }

    /// The validation layer is in the program: without it nothing that is wrong would be told.
    fn check_layer(&self) {
        let maps = format!("/proc/{}/maps", self.program.id());
        wait_for("the validation layer", || {
            let loaded = std::fs::read_to_string(&maps).unwrap_or_default();
            loaded.contains("VkLayer_khronos_validation").then_some(())
        });
    }

    /// An xdotool command on the window.
    pub fn window_command(&self, command: &str, arguments: &[&str]) {
        run(
            &self.display,
            "xdotool",
            &[&[command, &self.window], arguments].concat(),
        );
    }

    /// Presses and lets go of keys, one after another.
    pub fn key(&self, keys: &[&str]) {
        run(&self.display, "xdotool", &[&["key", "--delay", "40"], keys].concat());
    }

    /// Holds a key for some time.
    pub fn hold(&self, key: &str, seconds: f32) {
        run(&self.display, "xdotool", &["keydown", key]);
        std::thread::sleep(Duration::from_secs_f32(seconds));
        run(&self.display, "xdotool", &["keyup", key]);
    }

    /// Types text into what has the keys, and Enter after it.
    pub fn enter(&self, text: &str) {
        run(&self.display, "xdotool", &["type", "--delay", "25", text]);
        self.key(&["Return"]);
    }

    /// What is done meanwhile comes to the program between two frames, as where frames take long.
    pub fn between_frames(&self, doing: impl FnOnce(&Self)) {
        let signal = |name: &str| {
            let sent = Command::new("kill")
                .args([name, &self.program.id().to_string()])
                .status();
            assert!(sent.is_ok_and(|status| status.success()), "kill {name}");
        };
        signal("-STOP");
        doing(self);
        signal("-CONT");
    }

    /// Opens the console, enters lines and closes it. The last must say something that ends in `answer`.
    pub fn console(&mut self, lines: &[&str], answer: &str) -> String {
        self.key(&["grave"]);
        std::thread::sleep(Duration::from_millis(400));
        lines.iter().for_each(|line| self.enter(line));
        let said = self.wait(answer);
        self.key(&["grave"]);
        std::thread::sleep(Duration::from_millis(400));
        said
    }

    /// Waits until the console has said something new that contains a text, and returns that line.
    pub fn wait(&mut self, text: &str) -> String {
        let (log, read) = (self.log.clone(), self.read);
        let program = &mut self.program;
        let (end, line) = wait_for(text, || {
            let all = std::fs::read_to_string(&log).unwrap_or_default();
            let new = &all[read.min(all.len())..];
            if let Some(at) = new.find(text) {
                let end = new[at..].find('\n').map_or(new.len(), |n| at + n);
                let start = new[..at].rfind('\n').map_or(0, |n| n + 1);
                return Some((read + end, new[start..end].to_owned()));
            }
            if let Ok(Some(status)) = program.try_wait() {
                panic!("the program ended ({status}) before it said {text:?}:\n{all}");
            }
            None
        });
        self.read = end;
        line
    }

    /// A picture of the whole display.
    pub fn picture(&self, name: &str) -> image::RgbImage {
        let path = self.pictures.join(format!("{name}.png"));
        run(&self.display, "import", &["-window", "root", &path.to_string_lossy()]);
        image::open(&path)
            .unwrap_or_else(|e| panic!("{}: {e}", path.display()))
            .into_rgb8()
    }

    /// The first picture of the whole display of which something is true: frames may take long.
    pub fn seen(&self, name: &str, is: impl Fn(&image::RgbImage) -> bool) -> image::RgbImage {
        wait_for(name, || Some(self.picture(name)).filter(&is))
    }

    /// Where the eye is: x, y, z, yaw, pitch.
    pub fn view(&mut self) -> [f32; 5] {
        self.asked += 1;
        let (begin, end) = (format!("begin{}", self.asked), format!("end{}", self.asked));
        self.console(&[&format!("echo {begin}; viewpos; echo {end}")], &format!("{end}\n"));
        let all = self.text();
        let told = all.split(&format!("{begin}\n")).last().unwrap_or_default();
        let line = told.lines().find_map(|l| {
            let numbers: Vec<f32> = l.split_whitespace().filter_map(|w| w.parse().ok()).collect();
            <[f32; 5]>::try_from(numbers).ok()
        });
        line.expect("a position")
    }

    /// All that the program has said.
    pub fn text(&self) -> String {
        std::fs::read_to_string(&self.log).unwrap_or_default()
    }

    /// Ends the program through its console, which is closed.
    pub fn quit(&mut self) {
        self.key(&["grave"]);
        std::thread::sleep(Duration::from_millis(600));
        self.enter("quit");
        assert_eq!(self.ended(), Some(0));
    }

    /// Waits for the end of the program and returns its exit code.
    pub fn ended(&mut self) -> Option<i32> {
        let program = &mut self.program;
        wait_for("the end", || program.try_wait().ok().flatten()).code()
    }
}

impl Drop for Desk {
    fn drop(&mut self) {
        // Both may have ended by themselves.
        for child in [&mut self.program, &mut self.xvfb] {
            let _ = child.kill();
            let _ = child.wait();
        }
        if std::thread::panicking() {
            eprintln!("{}", self.text());
        }
    }
}

fn wait_for<T>(what: &str, mut found: impl FnMut() -> Option<T>) -> T {
    let begin = Instant::now();
    loop {
        if let Some(found) = found() {
            return found;
        }
        assert!(begin.elapsed() < PATIENCE, "waited too long for {what:?}");
        std::thread::sleep(Duration::from_millis(50));
    }
}
