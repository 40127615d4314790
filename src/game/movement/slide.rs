//! Sliding along what is met, and stepping over what is low.

use super::{Body, GRAVITY, STEP, STEP_HEIGHT, WALKABLE, World, extent};
use glam::Vec3;

/// Speeds into a plane are turned back by a little more than they are, so that rounding leaves none.
const OVERCLIP: f32 = 1.001;
const MOST_BUMPS: usize = 4;
const MOST_PLANES: usize = 5;
/// Speed into a plane that counts as such.
const INTO: f32 = 0.1;
/// Planes whose normals are this near are one.
const SAME_PLANE: f32 = 0.99;

/// A velocity without what goes into a plane.
pub fn clip(velocity: Vec3, normal: Vec3) -> Vec3 {
    let into = velocity.dot(normal);
    velocity - normal * if into < 0.0 { into * OVERCLIP } else { into / OVERCLIP }
}

/// A velocity that goes into none of some planes; zero where three of them meet.
fn along(velocity: Vec3, planes: &[Vec3]) -> Vec3 {
    for (i, first) in planes.iter().enumerate() {
        if velocity.dot(*first) >= INTO {
            continue;
        }
        let mut turned = clip(velocity, *first);
        for (j, second) in planes.iter().enumerate() {
            if j == i || turned.dot(*second) >= INTO {
                continue;
            }
            turned = clip(turned, *second);
            if turned.dot(*first) >= 0.0 {
                continue;
            }
            // Along the crease between both.
            let crease = first.cross(*second).normalize_or_zero();
            turned = crease * crease.dot(velocity);
            let stuck = |(k, third): (usize, &Vec3)| k != i && k != j && turned.dot(*third) < INTO;
            if planes.iter().enumerate().any(stuck) {
                return Vec3::ZERO;
            }
        }
        return turned;
    }
    velocity
}

impl Body {
    /// Moves for one step, along whatever is in the way. True where something was.
    pub(super) fn slide(&mut self, world: &World<'_>, falls: bool) -> bool {
        // What the velocity is after the step; the mean of before and after moves the body.
        let mut later = self.velocity;
        if falls {
            later.z -= GRAVITY * STEP;
            self.velocity.z = (self.velocity.z + later.z) * 0.5;
            if let Some(ground) = self.ground {
                self.velocity = clip(self.velocity, ground.normal);
            }
        }
        let mut planes = Vec::with_capacity(MOST_PLANES);
        planes.extend(self.ground.map(|g| g.normal));
        // Never back against where it went.
        planes.extend(self.velocity.try_normalize());
        let mut left = STEP;
        let mut bumped = false;
        for _ in 0..MOST_BUMPS {
            let trace = world.sweep(extent(self.crouched), self.origin, self.origin + self.velocity * left);
            if trace.all_solid {
                self.velocity.z = 0.0;
                return true;
            }
            if trace.fraction > 0.0 {
                self.origin = trace.end;
            }
            if trace.fraction >= 1.0 {
                break;
            }
            bumped = true;
            left *= 1.0 - trace.fraction;
            if planes.len() >= MOST_PLANES {
                self.velocity = Vec3::ZERO;
                return true;
            }
            if planes.iter().any(|p| p.dot(trace.normal) > SAME_PLANE) {
                // The same plane again: off it by a hair.
                self.velocity += trace.normal;
                continue;
            }
            planes.push(trace.normal);
            self.velocity = along(self.velocity, &planes);
            later = along(later, &planes);
            if self.velocity == Vec3::ZERO {
                break;
            }
        }
        if falls {
            self.velocity = later;
        }
        bumped
    }

    /// The same, over steps.
    pub(super) fn step_slide(&mut self, world: &World<'_>, falls: bool) {
        let before = *self;
        if !self.slide(world, falls) {
            return;
        }
        let size = extent(self.crouched);
        let down = world.sweep(size, before.origin, before.origin - Vec3::Z * STEP_HEIGHT);
        // Who flies up does not step, unless just over ground.
        if before.velocity.z > 0.0 && (down.fraction >= 1.0 || down.normal.z < WALKABLE) {
            return;
        }
        let up = world.sweep(size, before.origin, before.origin + Vec3::Z * STEP_HEIGHT);
        if up.all_solid {
            return;
        }
        let height = up.end.z - before.origin.z;
        let low = *self;
        self.origin = up.end;
        self.velocity = before.velocity;
        self.slide(world, falls);
        let down = world.sweep(size, self.origin, self.origin - Vec3::Z * height);
        if !down.all_solid {
            self.origin = down.end;
        }
        if down.fraction < 1.0 {
            self.velocity = clip(self.velocity, down.normal);
        }
        let risen = self.origin.z - low.origin.z;
        if risen > 2.0 {
            self.view_lag = (self.view_lag + risen).min(STEP_HEIGHT);
        }
    }
}
