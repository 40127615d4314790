//! The map builder: tree, visible set, winding, leaf lists and round trip, on fixtures and random layouts.

use glam::Vec3;
use q3rays::assets::bsp::build::fixtures::{self, Doorways, Fixture, LitBox};
use q3rays::assets::bsp::build::{
    Bounds, BuildError, CellId, Entity, Face, MapBuilder, Mesh, MeshVertex, Paints, Patch, column, stress,
};
use q3rays::assets::bsp::file::Bsp;
use q3rays::assets::bsp::lumps::{SURFACE_PATCH, SURFACE_PLANAR, SURFACE_TRIANGLES, Surface, Vertex};

const BARE: Paints = [None; 6];

/// xorshift: tests need repeatable, not good, numbers.
struct Random(u64);

impl Random {
    fn unit(&mut self) -> f32 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 40) as f32 / (1_u64 << 24) as f32
    }

    fn below(&mut self, n: usize) -> usize {
        ((self.unit() * n as f32) as usize).min(n - 1)
    }

    fn inside(&mut self, b: &Bounds) -> Vec3 {
        let t = Vec3::new(self.unit(), self.unit(), self.unit());
        b.mins.as_vec3() + (b.maxs - b.mins).as_vec3() * t
    }
}

fn leaf_at(bsp: &Bsp, point: Vec3) -> usize {
    let mut child = 0;
    while child >= 0 {
        let node = &bsp.nodes[child as usize];
        let plane = &bsp.planes[node.plane as usize];
        let height = Vec3::from(plane.normal).dot(point) - plane.dist;
        child = node.children[usize::from(height < 0.0)];
    }
    (-1 - child) as usize
}

fn cluster_at(bsp: &Bsp, point: Vec3) -> Option<u32> {
    u32::try_from(bsp.leafs[leaf_at(bsp, point)].cluster).ok()
}

fn map() -> MapBuilder {
    MapBuilder::new(Entity::new("worldspawn"))
}

fn triangles<'a>(bsp: &'a Bsp, surface: &Surface) -> impl Iterator<Item = [&'a Vertex; 3]> {
    let first = surface.first_vertex;
    let indices = &bsp.indices[surface.first_index as usize..][..surface.index_count as usize];
    indices
        .chunks_exact(3)
        .map(move |t| [0, 1, 2].map(|i| &bsp.vertices[(first + t[i]) as usize]))
}

fn fixtures() -> Vec<Fixture> {
    let lit = LitBox {
        size: 256,
        albedo: 128,
        light: [[100, 90], [140, 170]],
        surfacelight: 1000,
    };
    let made = [
        fixtures::closed_box(256, 100),
        fixtures::furnace(128, 128, 500),
        fixtures::lit_box(&lit),
        fixtures::free_emitter(64.0, 1000, false),
        fixtures::free_emitter(64.0, 1000, true),
        fixtures::doorway_light(1000),
        fixtures::chain(5, Doorways::InLine, 1000),
        fixtures::chain(5, Doorways::Staggered, 1000),
        fixtures::unvised(3, 1000),
        fixtures::surface_in_solid(1000),
        stress(12),
        stress(9_000),
    ];
    made.into_iter().map(|f| f.unwrap()).collect()
}

#[test]
fn files_survive_a_round_trip() {
    for fixture in fixtures() {
        assert_eq!(
            Bsp::read(&fixture.bsp.write()).unwrap(),
            fixture.bsp,
            "{}",
            fixture.name
        );
    }
}

#[test]
fn planes_come_in_pairs_and_brush_sides_in_axial_order() {
    for fixture in fixtures() {
        let bsp = &fixture.bsp;
        for pair in bsp.planes.chunks_exact(2) {
            assert_eq!(Vec3::from(pair[0].normal), -Vec3::from(pair[1].normal));
            assert_eq!(pair[0].dist, -pair[1].dist);
        }
        for brush in &bsp.brushes {
            let sides = &bsp.brush_sides[brush.first_side as usize..][..brush.side_count as usize];
            for (face, side) in Face::ALL.iter().zip(sides) {
                assert_eq!(Vec3::from(bsp.planes[side.plane as usize].normal), face.normal());
            }
        }
    }
}

#[test]
fn triangles_run_clockwise_seen_from_their_front() {
    for fixture in fixtures() {
        let bsp = &fixture.bsp;
        for surface in &bsp.surfaces {
            assert!([SURFACE_PLANAR, SURFACE_PATCH, SURFACE_TRIANGLES].contains(&surface.kind));
            for [a, b, c] in triangles(bsp, surface) {
                let [pa, pb, pc] = [a, b, c].map(|v| Vec3::from(v.position));
                let turn = (pb - pa).cross(pc - pa);
                assert!(
                    [a, b, c].iter().all(|v| turn.dot(Vec3::from(v.normal)) < 0.0),
                    "{}",
                    fixture.name
                );
            }
        }
    }
}

#[test]
fn walls_look_into_open_space() {
    for fixture in fixtures() {
        let bsp = &fixture.bsp;
        for surface in bsp.surfaces.iter().filter(|s| s.kind == SURFACE_PLANAR) {
            for [a, b, c] in triangles(bsp, surface) {
                let middle = [a, b, c].iter().map(|v| Vec3::from(v.position)).sum::<Vec3>() / 3.0;
                if middle.z >= 0.0 {
                    assert!(
                        cluster_at(bsp, middle + Vec3::from(a.normal) * 0.25).is_some(),
                        "{}",
                        fixture.name
                    );
                }
            }
        }
    }
}

#[test]
fn leaves_list_every_surface_that_touches_them() {
    let mut random = Random(7);
    for fixture in fixtures() {
        let bsp = &fixture.bsp;
        for (number, surface) in bsp.surfaces.iter().enumerate() {
            for corners in triangles(bsp, surface).take(40) {
                let [a, b, c] = corners.map(|v| Vec3::from(v.position));
                for _ in 0..20 {
                    let (mut u, mut v) = (random.unit(), random.unit());
                    if u + v > 1.0 {
                        (u, v) = (1.0 - u, 1.0 - v);
                    }
                    let point = a + (b - a) * u + (c - a) * v;
                    let leaf = &bsp.leafs[leaf_at(bsp, point + Vec3::from(corners[0].normal) * 0.01)];
                    if leaf.cluster < 0 {
                        continue;
                    }
                    let list =
                        &bsp.leaf_surfaces[leaf.first_leaf_surface as usize..][..leaf.leaf_surface_count as usize];
                    let inside = (0..3).all(|i| leaf.mins[i] as f32 <= point[i] && point[i] <= leaf.maxs[i] as f32);
                    assert!(
                        !inside || list.contains(&(number as i32)),
                        "{}: surface {number}",
                        fixture.name
                    );
                }
            }
        }
    }
}

#[test]
fn the_straddling_light_is_in_three_clusters_and_the_buried_one_in_none() {
    let clusters_of_last = |bsp: &Bsp| {
        let last = bsp.surfaces.len() as i32 - 1;
        let lists = |leaf: &&q3rays::assets::bsp::lumps::Leaf| {
            bsp.leaf_surfaces[leaf.first_leaf_surface as usize..][..leaf.leaf_surface_count as usize].contains(&last)
        };
        let mut clusters: Vec<i32> = bsp.leafs.iter().filter(lists).map(|l| l.cluster).collect();
        clusters.sort_unstable();
        clusters.dedup();
        clusters
    };
    assert_eq!(clusters_of_last(&fixtures::doorway_light(10).unwrap().bsp), [0, 1, 2]);
    assert_eq!(
        clusters_of_last(&fixtures::surface_in_solid(10).unwrap().bsp),
        [0_i32; 0]
    );
}

#[test]
fn points_land_in_their_room_or_in_solid() {
    let mut random = Random(11);
    for seed in 1..6 {
        let (map, cells, _) = random_layout(seed, 60);
        let mut map = map;
        let pillars: Vec<Bounds> = (0..20).map(|i| shrunk(&cells[i * cells.len() / 20], 3)).collect();
        pillars.iter().for_each(|p| map.solid(*p, BARE));
        let bsp = map.build().unwrap();
        for _ in 0..20_000 {
            let p = random.inside(&Bounds::new([-64; 3], [1600, 1600, 700]));
            let near_face = |b: &Bounds| !b.contains(p) && grown(b).contains(p);
            if cells.iter().chain(&pillars).any(near_face) {
                continue;
            }
            let cell = cells
                .iter()
                .position(|c| c.contains(p))
                .filter(|_| !pillars.iter().any(|b| b.contains(p)));
            assert_eq!(cluster_at(&bsp, p), cell.map(|c| c as u32), "{p}");
            let leaf = &bsp.leafs[leaf_at(&bsp, p)];
            let brushes = &bsp.leaf_brushes[leaf.first_leaf_brush as usize..][..leaf.leaf_brush_count as usize];
            let in_brush = |&b: &i32| {
                let brush = &bsp.brushes[b as usize];
                bsp.brush_sides[brush.first_side as usize..][..brush.side_count as usize]
                    .iter()
                    .all(|side| {
                        let plane = &bsp.planes[side.plane as usize];
                        Vec3::from(plane.normal).dot(p) <= plane.dist
                    })
            };
            let any_brush = (0..bsp.brushes.len() as i32).any(|b| in_brush(&b));
            assert_eq!(
                brushes.iter().any(in_brush),
                any_brush,
                "the leaf lists the brush at {p}"
            );
            assert!(!any_brush || cell.is_none(), "brushes stay out of open space at {p}");
        }
    }
}

fn shrunk(b: &Bounds, by: i32) -> Bounds {
    let third = (b.maxs - b.mins) / by;
    Bounds {
        mins: b.mins + third,
        maxs: b.maxs - third,
    }
}

fn grown(b: &Bounds) -> Bounds {
    Bounds {
        mins: b.mins - 1,
        maxs: b.maxs + 1,
    }
}

/// Rooms on a 3D grid with random sizes, joined by random doorways. Returns the cells and the joined pairs.
fn random_layout(seed: u64, rooms: usize) -> (MapBuilder, Vec<Bounds>, Vec<(usize, usize)>) {
    let mut random = Random(seed * 7919);
    let mut map = map();
    let (mut cells, mut ids, mut joined) = (Vec::new(), Vec::<CellId>::new(), Vec::new());
    let grid = [5, 5, 3];
    let pitch = 256;
    let slots: Vec<[i32; 3]> = (0..rooms.min(75))
        .map(|i| [i % 5, i / 5 % 5, i / 25].map(|v| v as i32))
        .collect();
    for slot in &slots {
        let mins = slot.map(|s| s * pitch);
        let bounds = Bounds::new(mins, mins.map(|m| m + pitch - 32));
        ids.push(map.cell("room", bounds, BARE));
        cells.push(bounds);
    }
    for (a, slot) in slots.iter().enumerate() {
        for axis in 0..3 {
            let mut next = *slot;
            next[axis] += 1;
            let Some(b) = slots.iter().position(|s| *s == next) else {
                continue;
            };
            if next[axis] >= grid[axis] || random.unit() < 0.25 {
                continue;
            }
            let mut door = cells[a];
            door.mins[axis] = cells[a].maxs[axis];
            door.maxs[axis] = cells[b].mins[axis];
            for other in (0..3).filter(|&o| o != axis) {
                let size = 24 + random.below(100) as i32;
                door.mins[other] += random.below(96) as i32;
                door.maxs[other] = door.mins[other] + size;
            }
            let passage = map.passage("door", ids[a], ids[b], door, BARE);
            let number = cells.len();
            assert_eq!(passage.cluster() as usize, number);
            cells.push(door);
            joined.push((a, number));
            joined.push((number, b));
        }
    }
    (map, cells, joined)
}

/// Cells that a straight segment passes, or `None` where it leaves open space.
fn cells_along(cells: &[Bounds], joined: &[(usize, usize)], from: usize, start: Vec3, end: Vec3) -> Option<Vec<usize>> {
    let direction = end - start;
    let mut path = vec![from];
    loop {
        let here = *path.last()?;
        let bounds = &cells[here];
        if bounds.contains(end) {
            return Some(path);
        }
        let (mut exit, mut axis) = (f32::INFINITY, 0);
        for a in 0..3 {
            let wall = if direction[a] > 0.0 {
                bounds.maxs[a]
            } else {
                bounds.mins[a]
            };
            let t = if direction[a] == 0.0 {
                f32::INFINITY
            } else {
                (wall as f32 - start[a]) / direction[a]
            };
            if t < exit {
                (exit, axis) = (t, a);
            }
        }
        let point = start + direction * exit;
        let neighbours = joined
            .iter()
            .filter_map(|&(a, b)| (a == here).then_some(b).or((b == here).then_some(a)));
        let next = neighbours.into_iter().find(|&n| {
            let other = &cells[n];
            let meets = if direction[axis] > 0.0 {
                other.mins[axis] == bounds.maxs[axis]
            } else {
                other.maxs[axis] == bounds.mins[axis]
            };
            let within = |a: usize| other.mins[a] as f32 <= point[a] && point[a] <= other.maxs[a] as f32;
            meets && (0..3).all(|a| a == axis || within(a))
        })?;
        if path.contains(&next) {
            return None;
        }
        path.push(next);
    }
}

/// A segment that starts just inside cell `a` by one of its portals and ends just inside `b` by one of that cell's.
fn through_portals(
    random: &mut Random,
    cells: &[Bounds],
    joined: &[(usize, usize)],
    a: usize,
    b: usize,
) -> Option<(Vec3, Vec3)> {
    let mut point = |cell: usize| {
        let pairs: Vec<_> = joined.iter().filter(|(p, q)| *p == cell || *q == cell).collect();
        let (p, q) = pairs[random.below(pairs.len())];
        random.inside(&cells[*p].intersection(&cells[*q]))
    };
    let (p, q) = (point(a), point(b));
    let step = (q - p).try_normalize()? * 0.01;
    let (start, end) = (p - step, q + step);
    (cells[a].contains(start) && cells[b].contains(end)).then_some((start, end))
}

#[test]
fn the_visible_set_is_conservative_and_tight() {
    let mut random = Random(3);
    let (mut marked, mut confirmed) = (0, 0);
    for seed in 1..4 {
        let (map, cells, joined) = random_layout(seed, 50);
        let visibility = map.build().unwrap().visibility.unwrap();
        for _ in 0..60_000 {
            let from = random.below(cells.len());
            let start = random.inside(&cells[from]);
            let towards = random.below(cells.len());
            let end = random.inside(&cells[towards]);
            if let Some(path) = cells_along(&cells, &joined, from, start, end) {
                for &a in &path {
                    for &b in &path {
                        assert!(visibility.sees(a as u32, b as u32), "seed {seed}: {a} sees {b}");
                    }
                }
            }
        }
        for a in 0..cells.len() {
            for b in 0..a {
                assert_eq!(visibility.sees(a as u32, b as u32), visibility.sees(b as u32, a as u32));
                if visibility.sees(a as u32, b as u32) {
                    marked += 1;
                    let lit = |ends: (Vec3, Vec3)| cells_along(&cells, &joined, a, ends.0, ends.1).is_some();
                    confirmed += usize::from(
                        (0..4000).any(|_| lit((random.inside(&cells[a]), random.inside(&cells[b]))))
                            || (0..8000).any(|_| through_portals(&mut random, &cells, &joined, a, b).is_some_and(lit)),
                    );
                }
            }
        }
    }
    eprintln!("{confirmed} of {marked} visible pairs confirmed by rays");
    assert!(confirmed as f64 > 0.95 * marked as f64, "{confirmed} of {marked}");
}

#[test]
fn nothing_is_seen_around_two_bends() {
    let mut map = map();
    // A U: two arms along y, joined at their far ends by a bar along x. No line from one arm's upper half to the other.
    let left = map.cell("left", Bounds::new([0, 0, 0], [64, 512, 128]), BARE);
    let right = map.cell("right", Bounds::new([448, 0, 0], [512, 512, 128]), BARE);
    let corner_left = map.cell("corner left", Bounds::new([0, 512, 0], [64, 576, 128]), BARE);
    let corner_right = map.cell("corner right", Bounds::new([448, 512, 0], [512, 576, 128]), BARE);
    let bar = map.cell("bar", Bounds::new([64, 512, 0], [448, 576, 128]), BARE);
    for (a, b) in [
        (left, corner_left),
        (corner_left, bar),
        (bar, corner_right),
        (corner_right, right),
    ] {
        map.connect(a, b);
    }
    let visibility = map.build().unwrap().visibility.unwrap();
    let sees = |a: CellId, b: CellId| visibility.sees(a.cluster(), b.cluster());
    assert!(!sees(left, right));
    assert!(sees(left, bar) && sees(right, bar) && sees(corner_left, corner_right));
    // A flat line from an arm reaches the far corner, but would have to turn back to enter the other arm.
    assert!(sees(left, corner_right) && sees(corner_left, right));
}

#[test]
fn doorways_in_line_are_seen_through_and_staggered_ones_are_not() {
    let line = fixtures::chain(6, Doorways::InLine, 100)
        .unwrap()
        .bsp
        .visibility
        .unwrap();
    assert!((0..11).all(|a| (0..11).all(|b| line.sees(a, b))));
    let staggered = fixtures::chain(6, Doorways::Staggered, 100)
        .unwrap()
        .bsp
        .visibility
        .unwrap();
    assert!(staggered.sees(0, 4), "the second doorway is seen through the first");
    assert!(!staggered.sees(0, 6) && !staggered.sees(0, 10));
    assert!(fixtures::unvised(3, 100).unwrap().bsp.visibility.is_none());
}

#[test]
fn solids_are_drawn_only_where_they_border_on_open_space() {
    let mut map = map();
    let paint = map.paint("textures/test", 64.0);
    map.cell("room", Bounds::new([0; 3], [256; 3]), [Some(paint); 6]);
    map.pillar(Bounds::new([96, 96, 0], [160, 160, 128]), paint);
    map.pillar(Bounds::new([-8, 10, 10], [8, 40, 40]), paint);
    let bsp = map.build().unwrap();
    let area: f32 = bsp
        .surfaces
        .iter()
        .flat_map(|s| triangles(&bsp, s))
        .map(|t| {
            let [a, b, c] = t.map(|v| Vec3::from(v.position));
            (b - a).cross(c - a).length() / 2.0
        })
        .sum();
    let standing = 4.0 * 64.0 * 128.0 + 64.0 * 64.0 - 64.0 * 64.0;
    let in_wall = 4.0 * 30.0 * 8.0;
    assert_eq!(area, 6.0 * 256.0 * 256.0 + standing + in_wall);
    assert_eq!(cluster_at(&bsp, Vec3::new(128.0, 128.0, 64.0)), None);
}

#[test]
fn patches_are_listed_where_their_curve_is() {
    let mut map = map();
    let paint = map.paint("textures/test", 64.0);
    map.cell("room", Bounds::new([0; 3], [256; 3]), [Some(paint); 6]);
    map.patch(column(Vec3::new(128.0, 128.0, 0.0), 24.0, 256.0, 64.0), paint.shader);
    let bsp = map.build().unwrap();
    let leaf = &bsp.leafs[leaf_at(&bsp, Vec3::new(151.0, 128.0, 40.0))];
    let list = &bsp.leaf_surfaces[leaf.first_leaf_surface as usize..][..leaf.leaf_surface_count as usize];
    assert!(list.contains(&(bsp.surfaces.len() as i32 - 1)));
}

#[test]
fn mistakes_are_named() {
    let room = Bounds::new([0; 3], [64; 3]);
    let error = |describe: &dyn Fn(&mut MapBuilder)| {
        let mut map = map();
        describe(&mut map);
        map.build().unwrap_err()
    };
    let beside = |m: &mut MapBuilder, x: i32| {
        let a = m.cell("a", room, BARE);
        let b = m.cell("b", Bounds::new([x, 0, 0], [x + 64, 64, 64]), BARE);
        (a, b)
    };
    let (a, b) = ("a".to_owned(), "b".to_owned());
    let pair = || (a.clone(), b.clone());
    assert_eq!(error(&|_| ()), BuildError::NoCells);
    let ((a1, b1), (a2, b2), (a3, b3)) = (pair(), pair(), pair());
    assert_eq!(
        error(&|m| _ = beside(m, 32)),
        BuildError::OverlappingCells { a: a1, b: b1 }
    );
    assert_eq!(
        error(&|m| _ = beside(m, 64)),
        BuildError::TouchingCells { a: a2, b: b2 }
    );
    let apart = |m: &mut MapBuilder| {
        let (a, b) = beside(m, 80);
        m.connect(a, b);
    };
    assert_eq!(error(&apart), BuildError::PortalNotShared { a: a3, b: b3 });
    let flat = |m: &mut MapBuilder| _ = m.cell("flat", Bounds::new([0; 3], [64, 64, 0]), BARE);
    assert!(matches!(error(&flat), BuildError::Empty { .. }));
    let far = |m: &mut MapBuilder| _ = m.cell("far", Bounds::new([0; 3], [70_000, 64, 64]), BARE);
    assert!(matches!(error(&far), BuildError::TooFar { .. }));
    let panel = |m: &mut MapBuilder| {
        let paint = m.paint("p", 1.0);
        let cell = m.cell("room", room, BARE);
        m.panel(cell, Face::MaxZ, Bounds::new([0, 0, 60], [8, 8, 60]), paint);
    };
    assert!(matches!(error(&panel), BuildError::PanelNotOnFace { .. }));
    let patch = |m: &mut MapBuilder| {
        m.cell("room", room, BARE);
        let bad = Patch {
            width: 2,
            height: 3,
            points: Vec::new(),
        };
        m.patch(bad, MapBuilder::CAULK);
    };
    assert!(matches!(error(&patch), BuildError::PatchGrid { .. }));
    let mesh = |m: &mut MapBuilder| {
        m.cell("room", room, BARE);
        let bad = Mesh {
            vertices: Vec::<MeshVertex>::new(),
            triangles: vec![[0, 1, 2]],
        };
        m.mesh(bad, MapBuilder::CAULK);
    };
    assert!(matches!(error(&mesh), BuildError::MeshIndex { .. }));
}

#[test]
fn stress_maps_have_the_triangles_asked_for() {
    for asked in [12, 1_000, 25_000] {
        let bsp = stress(asked).unwrap().bsp;
        assert_eq!(bsp.indices.len() / 3, asked);
    }
}

/// The largest stress map, timed: `cargo test --release -- --ignored million`.
#[test]
#[ignore = "a second or so in release builds, long in debug ones"]
fn a_million_triangles_build_in_seconds() {
    let start = std::time::Instant::now();
    let bsp = stress(1_000_000).unwrap().bsp;
    eprintln!(
        "{} triangles, {} clusters: {:?}",
        bsp.indices.len() / 3,
        bsp.leafs.len(),
        start.elapsed()
    );
    assert_eq!(bsp.indices.len(), 3_000_000);
    assert!(start.elapsed().as_secs() < 20);
}
