//! A tree over the lights of a scene, by which a receiver finds those that matter to it (Moreau, Pharr and Clarberg 2019,
//! "Dynamic Many-Light Sampling for Real-Time Ray Tracing"; Conty Estevez and Kulla 2018, "Importance Sampling of Many
//! Lights with Adaptive Tree Splitting").
//!
//! The lights are brought into the tree's order, so that a node is a range of lights. A receiver's row of lights, which is
//! a list of ranges too, then tells the weight that a node has *in that row*: one tree serves every PVS cluster.

use super::light_power::strength;
use super::records::{LIGHT_DOME, LIGHT_SPHERE, LIGHT_SUN, LIGHT_TRIANGLE, LIGHT_TWO_SIDED, Light, LightNode};
use crate::assets::bsp::Bounds;
use glam::{Affine3A, BVec3, Vec3};
use std::f32::consts::{FRAC_PI_2, PI};

/// The tree, and the order of lights that it wants.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LightTree {
    /// Depth first, the root first; empty where there is no light at a finite place.
    pub nodes: Vec<LightNode>,
    /// Lights at finite places. They come first; suns follow.
    pub finite: u32,
}

/// Half angle of a cone whose normals count as one, radians.
const ONE_WAY: f32 = 1e-4;
/// What lies between two poses of a sweep is this share of its bounds outside at most, and faces so many radians elsewhere.
const SWEEP_SLACK: f32 = 0.01;
const SWEEP_TURN: f32 = 0.1;
/// Bins per axis for the choice of a split.
const BINS: usize = 16;

/// Directions in which lights emit: a cone of normals, each with a half space of emission.
#[derive(Clone, Copy, Debug)]
struct Cone {
    axis: Vec3,
    /// Half angle, radians; π for all directions.
    angle: f32,
}

impl Cone {
    const EMPTY: Self = Self {
        axis: Vec3::ZERO,
        angle: -1.0,
    };

    /// The smallest cone around both.
    fn union(self, other: Self) -> Self {
        let (a, b) = if self.angle >= other.angle {
            (self, other)
        } else {
            (other, self)
        };
        if b.angle < 0.0 {
            return a;
        }
        // An arc cosine would lose small angles.
        let between = a.axis.cross(b.axis).length().atan2(a.axis.dot(b.axis));
        if (between + b.angle).min(PI) <= a.angle {
            return a;
        }
        let angle = (a.angle + between + b.angle) * 0.5;
        let across = b.axis - a.axis * a.axis.dot(b.axis);
        let whole = Self {
            axis: a.axis,
            angle: PI,
        };
        let Some(across) = across.try_normalize().filter(|_| angle < PI) else {
            return whole;
        };
        let turn = angle - a.angle;
        Self {
            axis: (a.axis * turn.cos() + across * turn.sin()).normalize(),
            angle,
        }
    }

    /// Measure of the directions that get light, up to a constant (Conty Estevez and Kulla 2018, eq. 1).
    fn measure(self) -> f32 {
        let o = self.angle.max(0.0);
        let w = (o + FRAC_PI_2).min(PI);
        let (sin, cos) = o.sin_cos();
        2.0 * PI * (1.0 - cos) + FRAC_PI_2 * (2.0 * w * sin - (o - 2.0 * w).cos() - 2.0 * o * sin + cos)
    }
}

/// What the building looks at of a light.
#[derive(Clone, Copy)]
struct Item {
    index: u32,
    /// Corners of a triangle, else three times the middle.
    corners: [Vec3; 3],
    bounds: Bounds,
    cone: Cone,
    strength: f32,
    moves: bool,
}

impl Item {
    /// Least product of an axis with a point of the light, wherever it goes.
    fn lowest(&self, axis: Vec3) -> f32 {
        if self.moves {
            let b = self.bounds;
            return axis.dot(Vec3::select(axis.cmpgt(Vec3::ZERO), b.min, b.max));
        }
        self.corners
            .into_iter()
            .map(|p| axis.dot(p))
            .fold(f32::INFINITY, f32::min)
    }
}

/// Sums over a set of items.
#[derive(Clone, Copy)]
struct Group {
    bounds: Bounds,
    cone: Cone,
    strength: f32,
    count: u32,
}

impl Group {
    const EMPTY: Self = Self {
        bounds: Bounds::EMPTY,
        cone: Cone::EMPTY,
        strength: 0.0,
        count: 0,
    };

    fn with(self, item: &Item) -> Self {
        self.union(Self {
            bounds: item.bounds,
            cone: item.cone,
            strength: item.strength,
            count: 1,
        })
    }

    fn union(self, other: Self) -> Self {
        Self {
            bounds: self.bounds.union(other.bounds),
            cone: self.cone.union(other.cone),
            strength: self.strength + other.strength,
            count: self.count + other.count,
        }
    }

    /// Cost of a node: strength × surface of the bounds × measure of directions (the surface area orientation
    /// heuristic).
    fn cost(&self) -> f32 {
        if self.count == 0 {
            return 0.0;
        }
        let s = self.bounds.max - self.bounds.min;
        // A unit of thickness keeps coplanar lights from costing nothing.
        let s = s + Vec3::ONE;
        // Strengths may be 0; their number then decides.
        let strength = self.strength.max(f32::MIN_POSITIVE);
        strength * (s.x * s.y + s.y * s.z + s.z * s.x) * self.cone.measure()
    }
}

/// `sweep`: poses of a light that moves, relative to its record.
fn item(index: u32, light: &Light, sweep: Option<&[Affine3A]>) -> Item {
    let p0 = Vec3::from(light.p0);
    let (e1, e2) = (Vec3::from(light.p1), Vec3::from(light.p2));
    let mut bounds = Bounds::EMPTY;
    let corners = if light.kind == LIGHT_SPHERE {
        [p0; 3]
    } else {
        [p0, p0 + e1, p0 + e2]
    };
    let mut cone = Cone {
        axis: Vec3::Z,
        angle: PI,
    };
    if light.kind == LIGHT_SPHERE {
        bounds = Bounds {
            min: p0 - light.size,
            max: p0 + light.size,
        };
    } else {
        corners.into_iter().for_each(|p| bounds.include(p));
        let both = light.kind == LIGHT_DOME || light.flags & LIGHT_TWO_SIDED != 0;
        if let Some(axis) = e1.cross(e2).try_normalize().filter(|_| !both) {
            cone = Cone { axis, angle: 0.0 };
        }
    }
    if let Some(poses) = sweep {
        let (rest, facing) = (bounds, cone);
        (bounds, cone) = (Bounds::EMPTY, Cone::EMPTY);
        for pose in poses {
            for corner in 0..8u32 {
                let upper = BVec3::new(corner & 1 != 0, corner & 2 != 0, corner & 4 != 0);
                bounds.include(pose.transform_point3(Vec3::select(upper, rest.max, rest.min)));
            }
            cone = cone.union(Cone {
                axis: pose.transform_vector3(facing.axis).normalize_or(facing.axis),
                angle: facing.angle,
            });
        }
        bounds = bounds.grown((bounds.max - bounds.min).max_element() * SWEEP_SLACK);
        // Ways to face between two poses.
        if cone.angle > ONE_WAY {
            cone.angle = (cone.angle + SWEEP_TURN).min(PI);
        }
    }
    Item {
        index,
        corners,
        bounds,
        cone,
        strength: strength(light),
        moves: sweep.is_some(),
    }
}

impl LightTree {
    /// Builds the tree; the second value is the order: at place i, the number that the light had before. `sweeps`: of each
    /// light, its poses if it moves.
    pub fn build(lights: &[Light], sweeps: &[Option<&[Affine3A]>]) -> (Self, Vec<u32>) {
        let finite = |l: &&Light| matches!(l.kind, LIGHT_TRIANGLE | LIGHT_SPHERE | LIGHT_DOME);
        let mut items: Vec<Item> = (0u32..)
            .zip(lights)
            .filter(|(_, l)| finite(l))
            .map(|(i, l)| item(i, l, sweeps[i as usize]))
            .collect();
        let mut nodes = Vec::with_capacity((2 * items.len()).saturating_sub(1));
        if !items.is_empty() {
            split(&mut items, 0, &mut nodes);
        }
        let mut order: Vec<u32> = items.iter().map(|i| i.index).collect();
        debug_assert!(lights.iter().all(|l| finite(&l) || l.kind == LIGHT_SUN));
        order.extend((0u32..).zip(lights).filter(|(_, l)| !finite(l)).map(|(i, _)| i));
        let tree = Self {
            nodes,
            finite: items.len() as u32,
        };
        (tree, order)
    }
}

/// Builds the node over `items`, whose first will be light number `first`, and all below it.
fn split(items: &mut [Item], first: u32, nodes: &mut Vec<LightNode>) {
    let group = items.iter().fold(Group::EMPTY, |g, i| g.with(i));
    let here = nodes.len();
    let centre = group.bounds.centre();
    let half = group.bounds.max - centre;
    // A little more than the bounds, so that rounding leaves nothing outside.
    let slack = 1e-3 + (centre.abs().max_element() + half.max_element()) * 2e-6;
    let axis = group.cone.axis;
    let front = if group.cone.angle <= ONE_WAY {
        // Normals that differ a little tilt the emitters' planes a little.
        let lowest = items.iter().map(|i| i.lowest(axis)).fold(f32::INFINITY, f32::min);
        lowest - slack - 2.0 * half.length() * ONE_WAY
    } else {
        f32::MIN
    };
    nodes.push(LightNode {
        centre: centre.into(),
        half_size: (half + slack).into(),
        front,
        axis: axis.into(),
        // Likewise.
        cos_cone: if group.cone.angle >= PI {
            -1.0
        } else {
            (group.cone.angle.cos() - 2e-6).max(-1.0)
        },
        first,
        count: items.len() as u32,
        right: 0,
    });
    if items.len() == 1 {
        return;
    }
    let middle = partition(items, &group);
    let (left, right) = items.split_at_mut(middle);
    split(left, first, nodes);
    nodes[here].right = nodes.len() as u32;
    split(right, first + middle as u32, nodes);
}

/// Parts items in two non-empty halves by the cheapest of the binned splits; returns the size of the first.
fn partition(items: &mut [Item], group: &Group) -> usize {
    let mut centres = Bounds::EMPTY;
    items.iter().for_each(|i| centres.include(i.bounds.centre()));
    let extent = centres.max - centres.min;
    let bin_of = |item: &Item, axis: usize| {
        let at = (item.bounds.centre()[axis] - centres.min[axis]) / extent[axis];
        ((at * BINS as f32) as usize).min(BINS - 1)
    };
    let mut best = (f32::INFINITY, 0, 0);
    for axis in 0..3 {
        if extent[axis].is_nan() || extent[axis] <= 0.0 {
            continue;
        }
        let mut bins = [Group::EMPTY; BINS];
        for item in items.iter() {
            let bin = &mut bins[bin_of(item, axis)];
            *bin = bin.with(item);
        }
        let mut above = [Group::EMPTY; BINS];
        let mut sum = Group::EMPTY;
        for i in (1..BINS).rev() {
            sum = sum.union(bins[i]);
            above[i] = sum;
        }
        let mut below = Group::EMPTY;
        // Long sides are cut first: a thin split leaves both halves as far across as the whole.
        let shape = (group.bounds.max - group.bounds.min).max_element() / extent[axis];
        for i in 1..BINS {
            below = below.union(bins[i - 1]);
            if below.count > 0 && above[i].count > 0 {
                let cost = (below.cost() + above[i].cost()) * shape;
                if cost < best.0 {
                    best = (cost, axis, i);
                }
            }
        }
    }
    let (cost, axis, bin) = best;
    if cost == f32::INFINITY {
        // All in one place: any half is as good.
        return items.len() / 2;
    }
    let mut from = 0;
    for i in 0..items.len() {
        if bin_of(&items[i], axis) < bin {
            items.swap(from, i);
            from += 1;
        }
    }
    // The order within the halves must not depend on how they were swapped.
    items[..from].sort_unstable_by_key(|i| i.index);
    items[from..].sort_unstable_by_key(|i| i.index);
    from
}

#[cfg(test)]
mod tests {
    use super::*;
    use bytemuck::Zeroable;

    fn triangles(n: u32) -> Vec<Light> {
        let random = |i: u32, d: u32| crate::scene::sampling::unit(crate::scene::sampling::key(1, i, d));
        (0..n)
            .map(|i| {
                let v = |d: u32, size: f32| std::array::from_fn(|k| (random(i, d + k as u32) - 0.5) * size);
                Light {
                    kind: match i {
                        _ if i % 9 == 4 => LIGHT_SPHERE,
                        _ if i % 50 == 7 => LIGHT_SUN,
                        _ => LIGHT_TRIANGLE,
                    },
                    flags: u32::from(i % 5 == 0) * LIGHT_TWO_SIDED,
                    p0: v(0, 4000.0),
                    p1: v(3, 60.0),
                    p2: v(6, 60.0),
                    size: 4.0,
                    radiance: [random(i, 9); 3],
                    ..Light::zeroed()
                }
            })
            .collect()
    }

    #[test]
    fn nodes_bound_their_lights() {
        let lights = triangles(500);
        let (tree, order) = LightTree::build(&lights, &[None; 500]);
        let mut sorted = order.clone();
        sorted.sort_unstable();
        assert!(sorted.iter().copied().eq(0..500));
        let suns = lights.iter().filter(|l| l.kind == LIGHT_SUN).count();
        assert!(suns > 0);
        assert_eq!(tree.finite as usize, 500 - suns);
        assert_eq!(tree.nodes.len(), 2 * tree.finite as usize - 1);
        for (at, node) in tree.nodes.iter().enumerate() {
            for i in node.first..node.first + node.count {
                let light = &lights[order[i as usize] as usize];
                let item = item(0, light, None);
                let corners = [item.bounds.min, item.bounds.max];
                for c in corners {
                    let off = (c - Vec3::from(node.centre)).abs();
                    assert!(off.cmple(Vec3::from(node.half_size)).all());
                }
                if node.front > f32::MIN {
                    assert!(
                        (item.corners.iter()).all(|c| Vec3::from(node.axis).dot(*c) > node.front),
                        "an emitter behind the node's front"
                    );
                }
                if node.cos_cone > -1.0 {
                    assert_eq!(item.cone.angle, 0.0);
                    assert!(item.cone.axis.dot(Vec3::from(node.axis)) >= node.cos_cone);
                }
            }
            if node.right == 0 {
                assert_eq!(node.count, 1);
            } else {
                let (left, right) = (&tree.nodes[at + 1], &tree.nodes[node.right as usize]);
                assert_eq!(left.first, node.first);
                assert_eq!(right.first, left.first + left.count);
                assert_eq!(left.count + right.count, node.count);
            }
        }
    }

    #[test]
    fn lights_in_one_place_and_none_at_all() {
        let one = triangles(1)[0];
        let (tree, order) = LightTree::build(&[one; 33], &[None; 33]);
        assert_eq!((tree.nodes.len(), order.len()), (65, 33));
        assert_eq!(LightTree::build(&[], &[]), (LightTree::default(), Vec::new()));
    }
}
