//! What is pressed: buttons by the keys that hold them, the mouse's way, a gamepad's sticks.

use crate::console::commands::Button;

/// Sticks of a gamepad, −1..1 each: up and right are positive.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sticks {
    pub walk: [f32; 2],
    pub look: [f32; 2],
}

/// What is held down now, and how far the mouse has moved.
#[derive(Default)]
pub struct Input {
    /// Buttons with the keys that hold them; several keys may hold one.
    held: Vec<(Button, String)>,
    /// Pressed since the last step: a tap shorter than a frame counts.
    tapped: Vec<Button>,
    mouse: (f32, f32),
    pub sticks: Sticks,
}

impl Input {
    /// A key begins to hold a button.
    pub fn press(&mut self, button: Button, key: &str) {
        self.release(button, key);
        self.held.push((button, key.to_owned()));
        self.tapped.push(button);
    }

    /// A key holds a button no longer.
    pub fn release(&mut self, button: Button, key: &str) {
        self.held.retain(|(b, k)| (*b, k.as_str()) != (button, key));
    }

    /// A key went up, whatever it held.
    pub fn release_key(&mut self, key: &str) {
        self.held.retain(|(_, k)| k != key);
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

    /// Whether a button is down, or was since the last step.
    pub fn held(&self, button: Button) -> bool {
        self.tapped.contains(&button) || self.held.iter().any(|(b, _)| *b == button)
    }

    /// 1 where the first button is down, −1 where the other is, 0 where both or neither are.
    pub fn along(&self, plus: Button, minus: Button) -> f32 {
        f32::from(self.held(plus)) - f32::from(self.held(minus))
    }

    /// Nobody acts on what was pressed and moved.
    pub fn forget(&mut self) {
        self.take_mouse();
        self.seen();
    }

    /// A step of time has seen what was pressed.
    pub fn seen(&mut self) {
        self.tapped.clear();
    }

    /// Lets go of everything, as when the window loses the focus.
    pub fn release_all(&mut self) {
        *self = Self::default();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_button_is_down_while_any_key_holds_it() {
        let mut input = Input::default();
        input.press(Button::Forward, "w");
        input.press(Button::Forward, "UPARROW");
        input.seen();
        input.release_key("w");
        assert!(input.held(Button::Forward));
        input.release_key("UPARROW");
        assert!(!input.held(Button::Forward));
        input.press(Button::MoveUp, "SPACE");
        input.release_key("SPACE");
        assert!(input.held(Button::MoveUp), "a tap lasts until a step has seen it");
        input.seen();
        assert!(!input.held(Button::MoveUp));
    }
}
