//! `deformVertexes`: changes of the geometry itself.

use super::wave::Wave;
use glam::Vec3;

/// One deformation; a shader has up to three, applied in order.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Deform {
    /// Along the normal by a wave whose phase grows by (x + y + z) · `spread`; `spread` is 1 / `div` of the script.
    Wave { spread: f32, wave: Wave },
    /// Wobbling normals.
    Normal { amplitude: f32, frequency: f32 },
    /// Along the normal by the texture coordinate s.
    Bulge { width: f32, height: f32, speed: f32 },
    /// The whole surface, by `direction` (units) times a wave.
    Move { direction: Vec3, wave: Wave },
    /// Quads turn to face the viewer.
    Autosprite,
    /// Quads turn around their long axis to face the viewer.
    Autosprite2,
    /// Flattened on the ground as a shadow.
    ProjectionShadow,
    /// Text of slot 0..=7.
    Text(u8),
}
