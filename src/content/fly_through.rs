//! A flight through the show-case map.

use crate::scene::camera::Camera;
use glam::Vec3;

/// The map that the flight belongs to.
pub const MAP: &str = "showcase";

/// A point of the flight: eye in units, pitch and yaw in degrees.
struct Station {
    eye: Vec3,
    pitch: f32,
    yaw: f32,
}

const fn station(eye: [f32; 3], pitch: f32, yaw: f32) -> Station {
    Station {
        eye: Vec3::from_array(eye),
        pitch,
        yaw,
    }
}

/// Passed at equal intervals. The last is the first spawn point's view.
const STATIONS: [Station; 5] = [
    station([-216.0, -140.0, 60.0], 2.0, 46.0),
    station([-80.0, -230.0, 80.0], 4.0, 72.0),
    station([80.0, -230.0, 90.0], 4.0, 98.0),
    station([190.0, -150.0, 70.0], 2.0, 114.0),
    station([200.0, -96.0, 51.0], 0.0, 117.0),
];

/// View at a share 0..1 of the flight: Catmull–Rom through the stations.
pub fn camera(share: f32, fov: f32) -> Camera {
    let last = STATIONS.len() - 1;
    let at = share.clamp(0.0, 1.0) * last as f32;
    let i = (at as usize).min(last - 1);
    let t = at - i as f32;
    let p = [i.saturating_sub(1), i, i + 1, (i + 2).min(last)].map(|k| &STATIONS[k]);
    let weights = [
        0.5 * (-t + 2.0 * t * t - t * t * t),
        0.5 * (2.0 - 5.0 * t * t + 3.0 * t * t * t),
        0.5 * (t + 4.0 * t * t - 3.0 * t * t * t),
        0.5 * (t * t * t - t * t),
    ];
    let blend = |f: fn(&Station) -> f32| p.iter().zip(weights).map(|(s, w)| f(s) * w).sum::<f32>();
    Camera {
        eye: [blend(|s| s.eye.x), blend(|s| s.eye.y), blend(|s| s.eye.z)],
        pitch: blend(|s| s.pitch),
        yaw: blend(|s| s.yaw),
        roll: 0.0,
        fov,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_flight_passes_its_stations() {
        for (i, s) in STATIONS.iter().enumerate() {
            let c = camera(i as f32 / (STATIONS.len() - 1) as f32, 90.0);
            assert!(Vec3::from(c.eye).distance(s.eye) < 1e-3);
            assert!((c.yaw - s.yaw).abs() < 1e-3);
        }
    }
}
