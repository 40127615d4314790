//! Gamepads: buttons by the names that keys are bound by, and two sticks.

use super::input::Sticks;
use gilrs::{Axis, Button, EventType, Gilrs};

/// All gamepads together.
pub struct Pads {
    gilrs: Option<Gilrs>,
}

impl Pads {
    /// Those that are there; more may come.
    pub fn new() -> Self {
        let gilrs = Gilrs::new().inspect_err(|e| tracing::warn!("no gamepads: {e}")).ok();
        Self { gilrs }
    }

    /// Buttons that went down or up since the last call.
    pub fn poll(&mut self) -> Vec<(&'static str, bool)> {
        let mut out = Vec::new();
        while let Some(event) = self.gilrs.as_mut().and_then(Gilrs::next_event) {
            let (button, down) = match event.event {
                EventType::ButtonPressed(button, _) => (button, true),
                EventType::ButtonReleased(button, _) => (button, false),
                _ => continue,
            };
            out.extend(name(button).map(|n| (n, down)));
        }
        out
    }

    /// Where the sticks of the first gamepad that is moved stand.
    pub fn sticks(&self) -> Sticks {
        let all = self.gilrs.iter().flat_map(|g| g.gamepads().map(|(_, pad)| pad));
        let of = |pad: &gilrs::Gamepad<'_>| Sticks {
            walk: [Axis::LeftStickX, Axis::LeftStickY].map(|axis| pad.value(axis)),
            look: [Axis::RightStickX, Axis::RightStickY].map(|axis| pad.value(axis)),
        };
        let moved = |s: &Sticks| s.walk.iter().chain(&s.look).any(|x| x.abs() > 0.05);
        all.map(|pad| of(&pad)).find(moved).unwrap_or_default()
    }
}

/// Name of a button.
fn name(button: Button) -> Option<&'static str> {
    Some(match button {
        Button::South => "PAD0_A",
        Button::East => "PAD0_B",
        Button::West => "PAD0_X",
        Button::North => "PAD0_Y",
        Button::Select => "PAD0_BACK",
        Button::Start => "PAD0_START",
        Button::LeftTrigger => "PAD0_LEFTSHOULDER",
        Button::RightTrigger => "PAD0_RIGHTSHOULDER",
        Button::LeftTrigger2 => "PAD0_LEFTTRIGGER",
        Button::RightTrigger2 => "PAD0_RIGHTTRIGGER",
        Button::LeftThumb => "PAD0_LEFTSTICK_CLICK",
        Button::RightThumb => "PAD0_RIGHTSTICK_CLICK",
        Button::DPadUp => "PAD0_DPAD_UP",
        Button::DPadDown => "PAD0_DPAD_DOWN",
        Button::DPadLeft => "PAD0_DPAD_LEFT",
        Button::DPadRight => "PAD0_DPAD_RIGHT",
        _ => return None,
    })
}
