//! The BSP tree: axial splits until every leaf is one open cell's, or solid.

use super::error::BuildError;
use super::map::Cell;
use super::shape::Bounds;
use glam::Vec3;

/// What lies wholly within this distance of a splitting plane counts as in it, units.
const ON_PLANE: f32 = 0.01;

/// Inner node: child 0 lies above `level` along `axis`. Children as in the file: node, or −1−leaf.
pub struct TreeNode {
    pub axis: usize,
    pub level: i32,
    pub children: [i32; 2],
    pub bounds: Bounds,
}

/// Box-shaped leaf; `cell` is `None` in solid.
pub struct TreeLeaf {
    pub bounds: Bounds,
    pub cell: Option<usize>,
}

/// Tree over cells and carving solids. Node 0 is the root.
pub struct Tree {
    pub nodes: Vec<TreeNode>,
    pub leafs: Vec<TreeLeaf>,
}

struct Builder<'a> {
    cells: &'a [Cell],
    solids: &'a [Bounds],
    tree: Tree,
}

impl Tree {
    /// Splits `world`, which must enclose all cells with room to spare. `solids` are taken away from the cells.
    pub fn build(world: Bounds, cells: &[Cell], solids: &[Bounds]) -> Result<Self, BuildError> {
        let mut builder = Builder {
            cells,
            solids,
            tree: Self {
                nodes: Vec::new(),
                leafs: Vec::new(),
            },
        };
        builder.split(world, (0..cells.len()).collect(), (0..solids.len()).collect())?;
        Ok(builder.tree)
    }

    /// Calls `visit` with every leaf whose interior the box meets. Along an axis without extent, touching counts.
    pub fn leafs_in_box(&self, mins: Vec3, maxs: Vec3, visit: &mut impl FnMut(usize)) {
        self.walk_box(0, mins, maxs, visit);
    }

    fn walk_box(&self, child: i32, mins: Vec3, maxs: Vec3, visit: &mut impl FnMut(usize)) {
        if child < 0 {
            return visit((-1 - child) as usize);
        }
        let node = &self.nodes[child as usize];
        let [above, below] = node.sides(mins[node.axis], maxs[node.axis]);
        if above {
            self.walk_box(node.children[0], mins, maxs, visit);
        }
        if below {
            self.walk_box(node.children[1], mins, maxs, visit);
        }
    }

    /// Calls `visit` with every leaf that the convex polygon enters. One that lies in a splitting plane goes to both sides.
    pub fn leafs_of_polygon(&self, polygon: &[Vec3], visit: &mut impl FnMut(usize)) {
        self.walk_polygon(0, polygon, visit);
    }

    fn walk_polygon(&self, child: i32, polygon: &[Vec3], visit: &mut impl FnMut(usize)) {
        if child < 0 {
            return visit((-1 - child) as usize);
        }
        let node = &self.nodes[child as usize];
        let coordinates = || polygon.iter().map(|p| p[node.axis]);
        let least = coordinates().fold(f32::INFINITY, f32::min);
        let most = coordinates().fold(f32::NEG_INFINITY, f32::max);
        let level = node.level as f32;
        let [above, below] = node.sides(least, most);
        let cut = above && below && !node.holds(least, most);
        for (child, enters, upper) in [(node.children[0], above, true), (node.children[1], below, false)] {
            if cut {
                self.walk_polygon(child, &clip(polygon, node.axis, level, upper), visit);
            } else if enters {
                self.walk_polygon(child, polygon, visit);
            }
        }
    }
}

impl TreeNode {
    /// Which children (above, below) an interval along the node's axis enters: both, where it lies in the plane.
    fn sides(&self, least: f32, most: f32) -> [bool; 2] {
        let level = self.level as f32;
        if self.holds(least, most) {
            [true, true]
        } else {
            [most > level, least < level]
        }
    }

    /// Whether an interval along the node's axis lies in its plane.
    fn holds(&self, least: f32, most: f32) -> bool {
        let level = self.level as f32;
        level - least <= ON_PLANE && most - level <= ON_PLANE
    }
}

/// The part of a convex polygon on one side of an axial plane.
fn clip(polygon: &[Vec3], axis: usize, level: f32, above: bool) -> Vec<Vec3> {
    let height = |p: Vec3| if above { p[axis] - level } else { level - p[axis] };
    let mut out = Vec::with_capacity(polygon.len() + 1);
    for (i, &p) in polygon.iter().enumerate() {
        let q = polygon[(i + 1) % polygon.len()];
        let (hp, hq) = (height(p), height(q));
        if hp >= 0.0 {
            out.push(p);
        }
        if (hp > 0.0 && hq < 0.0) || (hp < 0.0 && hq > 0.0) {
            // Not `lerp`: equal coordinates must stay equal to the bit, or a polygon in a plane leaves it.
            let mut cut = p + (q - p) * (hp / (hp - hq));
            cut[axis] = level;
            out.push(cut);
        }
    }
    out
}

impl Builder<'_> {
    /// Builds the subtree of a region from the cells and solids that meet its interior; returns it as a child number.
    fn split(&mut self, region: Bounds, cells: Vec<usize>, solids: Vec<usize>) -> Result<i32, BuildError> {
        let solid = cells.is_empty() || solids.iter().any(|&s| self.solids[s].encloses(&region));
        let around = cells.iter().copied().find(|&c| self.cells[c].bounds.encloses(&region));
        if let Some(a) = around
            && let Some(&b) = cells.iter().find(|&&b| b != a)
        {
            return Err(BuildError::OverlappingCells {
                a: self.cells[a.min(b)].name.clone(),
                b: self.cells[a.max(b)].name.clone(),
            });
        }
        if solid || (around.is_some() && solids.is_empty()) {
            self.tree.leafs.push(TreeLeaf {
                bounds: region,
                cell: if solid { None } else { around },
            });
            return Ok(-(self.tree.leafs.len() as i32));
        }
        let cell_boxes = cells.iter().map(|&c| &self.cells[c].bounds);
        let boxes: Vec<&Bounds> = cell_boxes.chain(solids.iter().map(|&s| &self.solids[s])).collect();
        let (axis, level) = best_plane(&region, &boxes);
        let number = self.tree.nodes.len();
        self.tree.nodes.push(TreeNode {
            axis,
            level,
            children: [0; 2],
            bounds: region,
        });
        let (mut above, mut below) = (region, region);
        above.mins[axis] = level;
        below.maxs[axis] = level;
        for (side, part) in [above, below].into_iter().enumerate() {
            let cells = cells
                .iter()
                .copied()
                .filter(|&c| self.cells[c].bounds.overlaps(&part))
                .collect();
            let solids = solids
                .iter()
                .copied()
                .filter(|&s| self.solids[s].overlaps(&part))
                .collect();
            let child = self.split(part, cells, solids)?;
            self.tree.nodes[number].children[side] = child;
        }
        Ok(number as i32)
    }
}

/// The face plane inside the region that cuts the fewest boxes and best halves the rest. There always is one: some box
/// meets the region without enclosing it.
fn best_plane(region: &Bounds, boxes: &[&Bounds]) -> (usize, i32) {
    let mut best = (i64::MAX, 0, region.mins.x);
    for axis in 0..3 {
        let mut mins: Vec<i32> = boxes.iter().map(|b| b.mins[axis]).collect();
        let mut maxs: Vec<i32> = boxes.iter().map(|b| b.maxs[axis]).collect();
        mins.sort_unstable();
        maxs.sort_unstable();
        for &level in mins.iter().chain(&maxs) {
            if level <= region.mins[axis] || region.maxs[axis] <= level {
                continue;
            }
            let below = mins.partition_point(|&m| m < level) as i64;
            let above = (maxs.len() - maxs.partition_point(|&m| m <= level)) as i64;
            let cuts = below + above - boxes.len() as i64;
            let cost = (below - above).abs() + 3 * cuts;
            if cost < best.0 {
                best = (cost, axis, level);
            }
        }
    }
    (best.1, best.2)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cut_polygon_stays_in_its_plane_to_the_bit() {
        let corner = |x: f32, z: f32| Vec3::new(x, -772.0, z);
        let triangle = [corner(440.0, -256.0), corner(481.0, -256.0), corner(487.0, -215.0)];
        for level in 441..481 {
            for above in [true, false] {
                assert!(clip(&triangle, 0, level as f32, above).iter().all(|p| p.y == -772.0));
            }
        }
    }
}
