//! Where lights are chosen by what a receiver's surroundings get from them: cubes of space, told apart by light row and by
//! the way that the receivers in them face, each with a distribution over ranges of lights, inverted by
//! search: unlike an alias table that keeps well-spread random numbers well spread over lights.
//!
//! This is the table and how it is looked up; [`crate::reference::light_cells`] fills it.

use super::records::{CellEntry, LightCell};
use super::sampling::pcg;
use glam::Vec3;

/// Edge of a cube, units.
pub const CELL_SIZE: f32 = 128.0;
/// Cells of more entries get twice the candidates where one light of several is resampled.
pub const MANY_ENTRIES: usize = 64;
/// The place of a receiver is taken this far off its surface, units: walls stand on whole units and often on the cubes'
/// borders, where rounding would tell one side from the other.
pub const LIFT: f32 = 5.37;
/// Bits of a cube's x and y, and of its z; coordinates that differ by more share cubes.
const BITS_XY: u32 = 10;
const BITS_Z: u32 = 9;
/// Factors that keep slopes of 45 degrees, which maps are full of, off the borders between the ways to face.
const PREFER_Z: f32 = 1.07;
const PREFER_X: f32 = 1.03;

/// Number of the way a unit normal faces: twice its largest axis, and one more for the negative side.
fn facing(normal: Vec3) -> u32 {
    let a = normal.abs() * Vec3::new(PREFER_X, 1.0, PREFER_Z);
    let axis = if a.z >= a.x && a.z >= a.y {
        2
    } else if a.x >= a.y {
        0
    } else {
        1
    };
    2 * axis + u32::from(normal[axis as usize] < 0.0)
}

/// Cube and facing of a receiver, as [`LightCell::place`] has them. World units, unit geometric normal.
pub fn place(position: Vec3, normal: Vec3) -> u32 {
    let cube = ((position + normal * LIFT) / CELL_SIZE).floor().as_ivec3();
    let part = |c: i32, bits: u32| (c as u32) & ((1 << bits) - 1);
    let place = part(cube.x, BITS_XY) | part(cube.y, BITS_XY) << BITS_XY | part(cube.z, BITS_Z) << (2 * BITS_XY);
    place << 3 | facing(normal)
}

/// First slot to look at.
fn slot(row: u32, place: u32) -> u32 {
    pcg(row ^ pcg(place))
}

/// All cells of a scene; empty until they are made.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LightCells {
    /// A power of two of slots, at most half of them taken; none where there are no cells.
    pub slots: Vec<LightCell>,
    pub entries: Vec<CellEntry>,
    /// Least value of 32 random bits for which the entry of the same number is chosen; 0 for the first of a cell.
    pub bounds: Vec<u32>,
}

/// The entries of a cell and their bounds; none where there is no cell.
#[derive(Clone, Copy, Debug, Default)]
pub struct CellView<'a> {
    pub entries: &'a [CellEntry],
    pub bounds: &'a [u32],
}

/// Makes the probabilities of entries add up to 1 in steps of 2⁻³², one at least for each, and returns their bounds. At
/// most 2³¹ entries.
fn normalise(entries: &mut [CellEntry]) -> Vec<u32> {
    const WHOLE: u64 = 1 << 32;
    let total: f64 = entries.iter().map(|e| f64::from(e.probability)).sum();
    let spread = (WHOLE - entries.len() as u64) as f64;
    let mut sum = 0.0;
    let lower: Vec<u64> = (0u64..)
        .zip(entries.iter())
        .map(|(i, e)| {
            let at = i + (sum / total * spread) as u64;
            sum += f64::from(e.probability);
            at
        })
        .collect();
    for (i, e) in entries.iter_mut().enumerate() {
        let end = lower.get(i + 1).copied().unwrap_or(WHOLE);
        e.probability = ((end - lower[i]) as f64 / WHOLE as f64) as f32;
    }
    lower.into_iter().map(|l| l as u32).collect()
}

impl LightCells {
    /// From each cell's row, place and entries, whose probabilities are relative. A cell without entries is left out.
    pub fn new(cells: impl IntoIterator<Item = (u32, u32, Vec<CellEntry>)>) -> Self {
        let cells: Vec<_> = cells.into_iter().filter(|(.., e)| !e.is_empty()).collect();
        if cells.is_empty() {
            return Self::default();
        }
        let empty = LightCell {
            row: 0,
            place: 0,
            first: 0,
            count: 0,
        };
        let mut slots = vec![empty; (2 * cells.len()).next_power_of_two()];
        let mask = slots.len() as u32 - 1;
        let total = cells.iter().map(|(.., e)| e.len()).sum();
        let (mut entries, mut bounds) = (Vec::with_capacity(total), Vec::with_capacity(total));
        for (row, place, mut own) in cells {
            let mut at = slot(row, place) & mask;
            while slots[at as usize].count != 0 {
                at = (at + 1) & mask;
            }
            slots[at as usize] = LightCell {
                row,
                place,
                first: entries.len() as u32,
                count: own.len() as u32,
            };
            bounds.extend(normalise(&mut own));
            entries.extend(own);
        }
        Self { slots, entries, bounds }
    }

    /// The cell of receivers of a row at a place.
    pub fn find(&self, row: u32, place: u32) -> CellView<'_> {
        if self.slots.is_empty() {
            return CellView::default();
        }
        let mask = self.slots.len() as u32 - 1;
        let mut at = slot(row, place) & mask;
        loop {
            let cell = &self.slots[at as usize];
            if cell.count == 0 {
                return CellView::default();
            }
            if cell.row == row && cell.place == place {
                let range = cell.first as usize..(cell.first + cell.count) as usize;
                return CellView {
                    entries: &self.entries[range.clone()],
                    bounds: &self.bounds[range],
                };
            }
            at = (at + 1) & mask;
        }
    }

    /// Number of cells.
    pub fn count(&self) -> usize {
        self.slots.iter().filter(|c| c.count != 0).count()
    }

    /// Bytes of all tables.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.slots[..]) + size_of_val(&self.entries[..]) + size_of_val(&self.bounds[..])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn entry(weight: f32) -> CellEntry {
        CellEntry {
            first_light: 0,
            light_count: 1,
            probability: weight,
            weight: 1,
        }
    }

    #[test]
    fn bounds_have_the_wanted_shares() {
        let weights = [1.0, 0.001, 5.0, 2.0, 1e-20, 3.0];
        let mut entries = weights.map(entry);
        let bounds = normalise(&mut entries);
        assert_eq!(bounds[0], 0);
        let total: f32 = weights.iter().sum();
        for i in 0..6 {
            let end = bounds.get(i + 1).map_or(1 << 32, |b| u64::from(*b));
            let share = (end - u64::from(bounds[i])) as f64 / 4_294_967_296.0;
            assert!(share > 0.0 && (share - f64::from(weights[i] / total)).abs() < 1e-7);
            assert_eq!(entries[i].probability, share as f32);
        }
    }

    #[test]
    fn cells_are_found_again() {
        let cells: Vec<_> = (0..1000u32)
            .map(|i| {
                (
                    i % 7,
                    place(Vec3::splat(i as f32 * 200.0), Vec3::Z),
                    vec![entry(1.0); 1 + i as usize % 3],
                )
            })
            .collect();
        let table = LightCells::new(cells.clone());
        for (row, place, entries) in cells {
            assert_eq!(table.find(row, place).entries.len(), entries.len());
            assert!(table.find(row + 100, place).entries.is_empty());
        }
        assert_eq!(table.count(), 1000);
        assert!(LightCells::default().find(0, 0).entries.is_empty());
    }

    #[test]
    fn walls_on_borders_and_slopes_have_one_place() {
        let a = place(Vec3::new(256.0001, 10.0, 20.0), Vec3::X);
        assert_eq!(a, place(Vec3::new(255.9999, 10.0, 20.0), Vec3::X));
        assert_ne!(a, place(Vec3::new(256.0, 10.0, 20.0), -Vec3::X));
        let slope = Vec3::new(0.707, 0.0, 0.7072);
        assert_eq!(facing(slope), facing(Vec3::new(0.7072, 0.0, 0.707)));
    }
}
