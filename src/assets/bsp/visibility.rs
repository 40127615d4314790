//! The visibility lump: one bit row per PVS cluster.

use super::file::BspError;

/// Potentially visible set: bit `to` of row `from` says that cluster `from` may see cluster `to`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Visibility {
    pub cluster_count: u32,
    pub row_bytes: u32,
    /// Everything after the two counts, as stored; at least `cluster_count * row_bytes` bytes.
    pub rows: Vec<u8>,
}

impl Visibility {
    /// Reads the lump; an empty one means that the map was never vised.
    ///
    /// # Errors
    /// [`BspError::Visibility`] where the rows do not fit.
    pub fn read(bytes: &[u8]) -> Result<Option<Self>, BspError> {
        if bytes.is_empty() {
            return Ok(None);
        }
        let bad = |clusters, row_bytes| BspError::Visibility {
            clusters,
            row_bytes,
            bytes: bytes.len(),
        };
        if bytes.len() < 8 {
            return Err(bad(0, 0));
        }
        let int = |at: usize| bytemuck::pod_read_unaligned::<i32>(&bytes[at..at + 4]);
        let (clusters, row_bytes) = (int(0), int(4));
        let rows = &bytes[8..];
        let fits = clusters >= 0
            && row_bytes >= 0
            && i64::from(clusters) * i64::from(row_bytes) <= rows.len() as i64
            && i64::from(row_bytes) * 8 >= i64::from(clusters);
        if !fits {
            return Err(bad(clusters, row_bytes));
        }
        Ok(Some(Self {
            cluster_count: clusters as u32,
            row_bytes: row_bytes as u32,
            rows: rows.to_vec(),
        }))
    }

    /// The lump's bytes.
    pub fn bytes(&self) -> Vec<u8> {
        let mut out = Vec::with_capacity(8 + self.rows.len());
        out.extend_from_slice(&self.cluster_count.to_le_bytes());
        out.extend_from_slice(&self.row_bytes.to_le_bytes());
        out.extend_from_slice(&self.rows);
        out
    }

    /// Whether cluster `from` may see cluster `to`. Clusters beyond the rows see nothing.
    pub fn sees(&self, from: u32, to: u32) -> bool {
        if from >= self.cluster_count || to >= self.cluster_count {
            return false;
        }
        let at = from as usize * self.row_bytes as usize + to as usize / 8;
        self.rows[at] >> (to % 8) & 1 == 1
    }
}
