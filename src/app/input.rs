//! Keys and mouse, independent of the window library's events except for key codes.

use winit::keyboard::KeyCode;

/// What a held key does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Action {
    Forward,
    Back,
    Left,
    Right,
    Up,
    Down,
    Fast,
}

/// Keys by action.
const BINDINGS: [(KeyCode, Action); 13] = [
    (KeyCode::KeyW, Action::Forward),
    (KeyCode::ArrowUp, Action::Forward),
    (KeyCode::KeyS, Action::Back),
    (KeyCode::ArrowDown, Action::Back),
    (KeyCode::KeyA, Action::Left),
    (KeyCode::ArrowLeft, Action::Left),
    (KeyCode::KeyD, Action::Right),
    (KeyCode::ArrowRight, Action::Right),
    (KeyCode::Space, Action::Up),
    (KeyCode::KeyC, Action::Down),
    (KeyCode::ControlLeft, Action::Down),
    (KeyCode::ShiftLeft, Action::Fast),
    (KeyCode::ShiftRight, Action::Fast),
];

/// What is held down now, and how far the mouse has moved.
#[derive(Default)]
pub struct Input {
    held: Vec<KeyCode>,
    mouse: (f32, f32),
}

impl Input {
    /// A key went down or up.
    pub fn key(&mut self, code: KeyCode, down: bool) {
        self.held.retain(|k| *k != code);
        if down {
            self.held.push(code);
        }
    }

    /// The mouse moved by counts, y down.
    pub fn mouse(&mut self, dx: f64, dy: f64) {
        self.mouse.0 += dx as f32;
        self.mouse.1 += dy as f32;
    }

    /// Mouse counts since the last call.
    pub fn take_mouse(&mut self) -> (f32, f32) {
        std::mem::take(&mut self.mouse)
    }

    /// Whether a key of the action is down.
    pub fn held(&self, action: Action) -> bool {
        BINDINGS.iter().any(|(key, a)| *a == action && self.held.contains(key))
    }

    /// Lets go of everything, as when the window loses the focus.
    pub fn release_all(&mut self) {
        self.held.clear();
        self.mouse = (0.0, 0.0);
    }
}
