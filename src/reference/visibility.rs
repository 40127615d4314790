//! Shadow rays.

use super::light_sample::{LightSample, Target};
use super::trace::Tracer;
use crate::scene::Scene;
use glam::Vec3;

/// Whether a light sample is seen from a point in front of a surface.
pub fn visible(scene: &Scene, tracer: &Tracer, origin: Vec3, sample: &LightSample) -> bool {
    match sample.target {
        Target::Point(point) => !tracer.occluded(scene, origin, point - origin, 1.0),
        Target::Sky(direction) => tracer.sees_sky(scene, origin, direction),
    }
}
