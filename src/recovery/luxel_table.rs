//! Luxels as comma-separated values.

use super::recover::LuxelRow;
use glam::Vec3;
use std::fmt::Write;

/// Names of the columns.
const HEAD: &str = "x,y,z,nx,ny,nz,stored_r,stored_g,stored_b,known_r,known_g,known_b,recovered_r,recovered_g,recovered_b,\
                    indirect_r,indirect_g,indirect_b,clamped,held_out";

/// A table of luxels: position in units, unit normal, E/π in luxel units, flags as 0 or 1.
pub fn csv(rows: &[LuxelRow]) -> String {
    let mut out = String::from(HEAD);
    out.push('\n');
    for r in rows {
        let parts: [Vec3; 6] = [r.position, r.normal, r.stored, r.known, r.recovered, r.indirect];
        for v in parts {
            // Writing to a string cannot fail.
            let _ = write!(out, "{},{},{},", v.x, v.y, v.z);
        }
        let _ = writeln!(out, "{},{}", u8::from(r.clamped), u8::from(r.held_out));
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_line_has_a_value_for_every_name() {
        let row = LuxelRow {
            position: Vec3::X,
            normal: Vec3::Z,
            stored: Vec3::ONE,
            known: Vec3::ZERO,
            recovered: Vec3::ONE,
            indirect: Vec3::ZERO,
            clamped: true,
            held_out: false,
        };
        let text = csv(&[row; 2]);
        let counts: Vec<usize> = text.lines().map(|l| l.split(',').count()).collect();
        assert_eq!(counts, [20; 3]);
        assert!(text.ends_with("1,0\n"));
    }
}
