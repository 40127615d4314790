//! Periodic functions that drive colours, texture coordinates and deformations.

/// Shape of one period.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum WaveFunction {
    /// −1..1, starting at 0.
    #[default]
    Sine,
    /// −1..1, starting at 0.
    Triangle,
    /// 1 in the first half of the period, −1 in the second.
    Square,
    /// 0..1 rising.
    Sawtooth,
    /// 1..0 falling.
    InverseSawtooth,
    /// Random.
    Noise,
}

impl WaveFunction {
    /// By its name in scripts, in any case.
    pub fn from_name(name: &str) -> Option<Self> {
        Some(match name.to_ascii_lowercase().as_str() {
            "sin" => Self::Sine,
            "triangle" => Self::Triangle,
            "square" => Self::Square,
            "sawtooth" => Self::Sawtooth,
            "inversesawtooth" => Self::InverseSawtooth,
            "noise" => Self::Noise,
            _ => return None,
        })
    }
}

/// `base + amplitude · function(phase + t · frequency)`, t in seconds.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Wave {
    pub function: WaveFunction,
    pub base: f32,
    pub amplitude: f32,
    /// In periods.
    pub phase: f32,
    /// Periods per second.
    pub frequency: f32,
}

#[cfg(test)]
mod tests {
    use super::WaveFunction;

    #[test]
    fn names_are_found_in_any_case() {
        assert_eq!(
            WaveFunction::from_name("InverseSawTooth"),
            Some(WaveFunction::InverseSawtooth)
        );
        assert_eq!(WaveFunction::from_name("sine"), None);
    }
}
