//! A way through a map for benchmarks: from spawn point to spawn point and back, always through open space.
//!
//! Points in the open are joined where a box of an eye's size passes from one to the other (a probabilistic road map: Kavraki and
//! others 1996); the shortest ways between spawn points along them are then rounded off, as far as there is room.

use crate::assets::bsp::{Bounds, Bsp};
use crate::game::collision::{CollisionWorld, Extent, PLAYER_SOLID};
use crate::scene::Scene;
use crate::scene::camera::{Camera, EYE_HEIGHT};
use crate::scene::sampling::{key, unit};
use crate::scene::spawns::overview;
use glam::Vec3;

/// Half the size of the box around the eye that must pass, units.
const ROOM: f32 = 12.0;
/// Points in the open beside the spawn points, and tries to find them.
const POINTS: usize = 600;
const TRIES: u32 = 20_000;
/// Heights over the ground that points may have, units.
const LOWEST: f32 = 24.0;
const HIGHEST: f32 = 128.0;
/// Nearest points that each is joined to, and how far away these may be, units.
const NEIGHBOURS: usize = 10;
const FARTHEST: f32 = 900.0;
/// Most spawn points on the way.
const MOST_STOPS: usize = 12;
/// Rounds in which corners are cut.
const ROUNDS: usize = 4;
/// How far ahead one looks, units, and the share of the way there that the look turns in a frame.
const AHEAD: f32 = 160.0;
const TURN: f32 = 0.06;
/// Units a frame: the game's walking speed at 60 frames a second.
pub const STEP: f32 = 320.0 / 60.0;
/// Degrees a frame where there is nowhere to go.
const SPIN: f32 = 1.0;

/// A closed way; empty where there is nowhere to go.
#[derive(Clone, Debug)]
pub struct Tour {
    points: Vec<Vec3>,
    /// Way to each point, and around at last.
    lengths: Vec<f32>,
    start: Camera,
}

/// Points and which are joined.
struct Roads {
    points: Vec<Vec3>,
    joined: Vec<Vec<(usize, f32)>>,
}

struct Space<'a> {
    bsp: &'a Bsp,
    collision: CollisionWorld,
}

impl Space<'_> {
    fn passes(&self, a: Vec3, b: Vec3) -> bool {
        let extent = Extent {
            mins: Vec3::splat(-ROOM),
            maxs: Vec3::splat(ROOM),
        };
        let trace = self.collision.sweep(extent, a, b, PLAYER_SOLID, &[]);
        trace.fraction >= 1.0 && !trace.start_solid
    }

    /// A random point of the map with ground below it.
    fn point(&self, bounds: Bounds, number: u32) -> Option<Vec3> {
        let u = |k: u32| unit(key(0x70_75_72, number, k));
        let p = bounds.min + (bounds.max - bounds.min) * Vec3::new(u(0), u(1), u(2));
        self.bsp.cluster_at(p)?;
        let down = self
            .collision
            .sweep(Extent::POINT, p, p - Vec3::Z * 4096.0, PLAYER_SOLID, &[]);
        if down.start_solid || down.fraction >= 1.0 {
            return None;
        }
        let at = down.end + Vec3::Z * (LOWEST + (HIGHEST - LOWEST) * u(3));
        (self.bsp.cluster_at(at).is_some() && self.passes(at, at)).then_some(at)
    }
}

impl Roads {
    fn new(space: &Space<'_>, points: Vec<Vec3>) -> Self {
        let mut joined = vec![Vec::new(); points.len()];
        for i in 0..points.len() {
            let mut near: Vec<(usize, f32)> = (0..points.len())
                .filter(|j| *j != i)
                .map(|j| (j, points[i].distance(points[j])))
                .filter(|(_, d)| *d < FARTHEST)
                .collect();
            near.sort_by(|a, b| a.1.total_cmp(&b.1));
            for (j, d) in near.into_iter().take(NEIGHBOURS) {
                if space.passes(points[i], points[j]) {
                    joined[i].push((j, d));
                    joined[j].push((i, d));
                }
            }
        }
        Self { points, joined }
    }

    /// Lengths of the shortest ways from a point, and the point before each.
    fn ways(&self, from: usize) -> (Vec<f32>, Vec<usize>) {
        let n = self.points.len();
        let (mut length, mut before, mut done) = (vec![f32::INFINITY; n], vec![usize::MAX; n], vec![false; n]);
        length[from] = 0.0;
        loop {
            let open = (0..n).filter(|i| !done[*i] && length[*i].is_finite());
            let Some(i) = open.min_by(|a, b| length[*a].total_cmp(&length[*b])) else {
                return (length, before);
            };
            done[i] = true;
            for &(j, d) in &self.joined[i] {
                if length[i] + d < length[j] {
                    (length[j], before[j]) = (length[i] + d, i);
                }
            }
        }
    }

    /// The way from the first of `stops` to the nearest other one, and so on, and back.
    fn round(&self, stops: usize) -> Vec<Vec3> {
        let reached = |from: usize| {
            let (length, _) = self.ways(from);
            (0..stops).filter(|s| length[*s].is_finite()).count()
        };
        // A spawn point may stand where nothing else is reached from.
        let first = (0..stops).max_by_key(|s| (reached(*s), stops - s)).unwrap_or(0);
        let mut left: Vec<usize> = (0..stops).filter(|s| *s != first).collect();
        let mut out = vec![self.points[first]];
        let mut at = first;
        loop {
            let (length, before) = self.ways(at);
            let next = left
                .iter()
                .copied()
                .filter(|s| length[*s].is_finite())
                .min_by(|a, b| length[*a].total_cmp(&length[*b]));
            let to = next.unwrap_or(first);
            let mut way = Vec::new();
            let mut i = to;
            while i != at && i != usize::MAX {
                way.push(self.points[i]);
                i = before[i];
            }
            out.extend(way.into_iter().rev());
            if next.is_none() {
                out.dedup();
                return out;
            }
            left.retain(|s| *s != to);
            at = to;
        }
    }
}

/// Cuts the corners of a closed way where there is room (Chaikin 1974).
fn rounded(space: &Space<'_>, points: &[Vec3]) -> Vec<Vec3> {
    let n = points.len();
    let mut out = Vec::new();
    for i in 0..n {
        let (before, at, after) = (points[(i + n - 1) % n], points[i], points[(i + 1) % n]);
        let (a, b) = (at.lerp(before, 0.25), at.lerp(after, 0.25));
        if space.passes(a, b) {
            out.extend([a, b]);
        } else {
            out.push(at);
        }
    }
    out
}

impl Tour {
    /// Finds a way through a map.
    pub fn new(scene: &Scene, fov: f32) -> Self {
        let space = Space {
            bsp: &scene.bsp,
            collision: CollisionWorld::new(&scene.bsp),
        };
        let mut points: Vec<Vec3> = scene
            .spawns
            .iter()
            .map(|s| Vec3::from(s.origin) + Vec3::Z * EYE_HEIGHT)
            .filter(|p| space.passes(*p, *p))
            .take(MOST_STOPS)
            .collect();
        let stops = points.len();
        let start = scene
            .spawns
            .first()
            .map_or_else(|| overview(&scene.bsp, fov), |s| crate::scene::spawns::view(s, fov));
        let bounds = space.collision.bounds(0);
        if let Some(bounds) = bounds {
            points.extend((0..TRIES).filter_map(|i| space.point(bounds, i)).take(POINTS));
        }
        let mut way = if stops > 1 {
            Roads::new(&space, points).round(stops)
        } else {
            Vec::new()
        };
        if way.len() < 3 {
            way.clear();
        }
        for _ in 0..ROUNDS {
            way = rounded(&space, &way);
        }
        let mut lengths = vec![0.0];
        for i in 0..way.len() {
            lengths.push(lengths[i] + way[i].distance(way[(i + 1) % way.len()]));
        }
        Self {
            points: way,
            lengths,
            start,
        }
    }

    /// Length of the way around, units.
    pub fn length(&self) -> f32 {
        self.lengths.last().copied().unwrap_or(0.0)
    }

    fn at(&self, way: f32) -> Vec3 {
        let way = way.rem_euclid(self.length());
        let n = self.points.len();
        let i = self.lengths.partition_point(|l| *l <= way).clamp(1, n) - 1;
        let span = self.lengths[i + 1] - self.lengths[i];
        let share = if span > 0.0 {
            (way - self.lengths[i]) / span
        } else {
            0.0
        };
        self.points[i].lerp(self.points[(i + 1) % n], share.min(1.0))
    }

    /// The view in each of so many frames at [`STEP`] units a frame; where there is nowhere to go one turns on the spot.
    pub fn cameras(&self, frames: usize) -> Vec<Camera> {
        if self.length() <= 0.0 {
            let turned = |i: usize| Camera {
                yaw: self.start.yaw + SPIN * i as f32,
                ..self.start
            };
            return (0..frames).map(turned).collect();
        }
        let towards = |i: usize| {
            let way = i as f32 * STEP;
            (self.at(way + AHEAD) - self.at(way)).normalize_or(Vec3::X)
        };
        let mut look = towards(0);
        (0..frames)
            .map(|i| {
                look = look.lerp(towards(i), TURN).normalize_or(look);
                Camera {
                    eye: self.at(i as f32 * STEP).into(),
                    pitch: -look.z.clamp(-1.0, 1.0).asin().to_degrees() * 0.5,
                    yaw: look.y.atan2(look.x).to_degrees(),
                    roll: 0.0,
                    fov: self.start.fov,
                }
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::assets::vfs::Vfs;
    use crate::content::embedded::EMBEDDED;

    #[test]
    fn the_way_through_the_shipped_map_is_open_and_smooth() {
        let files = Vfs::mount(&[], EMBEDDED);
        let scene = Scene::load(&files, "showcase").expect("the shipped map");
        let tour = Tour::new(&scene, 90.0);
        assert!(tour.length() > 1000.0, "{}", tour.length());
        let cameras = tour.cameras(1200);
        let space = Space {
            bsp: &scene.bsp,
            collision: CollisionWorld::new(&scene.bsp),
        };
        for pair in cameras.windows(2) {
            let [a, b] = [pair[0].eye, pair[1].eye].map(Vec3::from);
            assert!(space.passes(a, b), "{a} to {b}");
            assert!(a.distance(b) < STEP * 1.01);
            let turned = (pair[1].yaw - pair[0].yaw + 180.0).rem_euclid(360.0) - 180.0;
            assert!(turned.abs() < 12.0, "{turned}");
        }
        assert_eq!(tour.cameras(300), cameras[..300]);
    }
}
