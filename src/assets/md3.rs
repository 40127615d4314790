//! MD3 models: vertex-animated triangle meshes with tags.

use glam::{Affine3A, Mat3A, Vec2, Vec3, Vec3A};
use thiserror::Error;

/// Most frames, tags a frame, surfaces, and vertices and triangles a surface that are read: the format's own limits.
const MOST_FRAMES: u32 = 1024;
const MOST_TAGS: u32 = 16;
const MOST_SURFACES: u32 = 32;
const MOST_VERTICES: u32 = 4096;
const MOST_TRIANGLES: u32 = 8192;
/// Bytes of a name.
const NAME: usize = 64;
/// Coordinates are stored in 64ths of a unit.
const SCALE: f32 = 1.0 / 64.0;

/// What is wrong with a model file.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum Md3Error {
    #[error("it is not an MD3 model")]
    NotMd3,
    #[error("it is of version {0}; only version 15 is known")]
    Version(u32),
    #[error("it has {count} {what}; the format allows {most}")]
    Count { what: &'static str, count: u32, most: u32 },
    #[error("its {0} lie outside the file")]
    Truncated(&'static str),
    #[error("a triangle names vertex {vertex} of {count}")]
    Vertex { vertex: u32, count: u32 },
}

/// A vertex in one frame, model space, units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Md3Vertex {
    pub position: Vec3,
    /// Unit normal.
    pub normal: Vec3,
}

/// A part of a model with its own material.
#[derive(Clone, Debug, PartialEq)]
pub struct Md3Surface {
    pub name: String,
    /// Material where no skin says otherwise; empty for none.
    pub shader: String,
    pub triangles: Vec<[u32; 3]>,
    pub uvs: Vec<Vec2>,
    /// By frame.
    pub frames: Vec<Vec<Md3Vertex>>,
}

/// A place on a model where others are attached.
#[derive(Clone, Debug, PartialEq)]
pub struct Md3Tag {
    pub name: String,
    /// Tag to model space.
    pub place: Affine3A,
}

/// A model.
#[derive(Clone, Debug, PartialEq)]
pub struct Md3 {
    pub surfaces: Vec<Md3Surface>,
    /// By frame.
    pub tags: Vec<Vec<Md3Tag>>,
    pub frame_count: u32,
}

struct Bytes<'a>(&'a [u8]);

impl<'a> Bytes<'a> {
    fn slice(&self, at: usize, length: usize, what: &'static str) -> Result<&'a [u8], Md3Error> {
        let end = at.checked_add(length).ok_or(Md3Error::Truncated(what))?;
        self.0.get(at..end).ok_or(Md3Error::Truncated(what))
    }

    fn word(&self, at: usize, what: &'static str) -> Result<u32, Md3Error> {
        let b = self.slice(at, 4, what)?;
        Ok(u32::from_le_bytes([b[0], b[1], b[2], b[3]]))
    }

    fn float(&self, at: usize, what: &'static str) -> Result<f32, Md3Error> {
        let x = f32::from_bits(self.word(at, what)?);
        Ok(if x.is_finite() { x } else { 0.0 })
    }

    fn vector(&self, at: usize, what: &'static str) -> Result<Vec3, Md3Error> {
        Ok(Vec3::new(
            self.float(at, what)?,
            self.float(at + 4, what)?,
            self.float(at + 8, what)?,
        ))
    }

    fn name(&self, at: usize, what: &'static str) -> Result<String, Md3Error> {
        let bytes = self.slice(at, NAME, what)?;
        let end = bytes.iter().position(|b| *b == 0).unwrap_or(NAME);
        Ok(String::from_utf8_lossy(&bytes[..end])
            .replace('\\', "/")
            .to_ascii_lowercase())
    }

    fn count(&self, at: usize, what: &'static str, most: u32) -> Result<u32, Md3Error> {
        let count = self.word(at, what)?;
        if count > most {
            return Err(Md3Error::Count { what, count, most });
        }
        Ok(count)
    }
}

/// Normals are stored as two angles of 255 steps a turn: zenith in the low byte, azimuth in the high one.
fn normal(code: u16) -> Vec3 {
    let angle = |b: u16| f32::from(b) * (std::f32::consts::TAU / 255.0);
    let (zenith, azimuth) = (angle(code & 0xff), angle(code >> 8));
    Vec3::new(azimuth.cos() * zenith.sin(), azimuth.sin() * zenith.sin(), zenith.cos())
}

fn surface(bytes: &Bytes<'_>, frame_count: u32) -> Result<(Md3Surface, usize), Md3Error> {
    const WHAT: &str = "surfaces";
    let vertices = bytes.count(80, "vertices in a surface", MOST_VERTICES)?;
    let triangles = bytes.count(84, "triangles in a surface", MOST_TRIANGLES)?;
    let at = |field: usize| bytes.word(field, WHAT).map(|x| x as usize);
    let (triangles_at, shaders_at, uvs_at, vertices_at, end) = (at(88)?, at(92)?, at(96)?, at(100)?, at(104)?);
    let shader = if bytes.word(76, WHAT)? > 0 {
        bytes.name(shaders_at, "materials")?
    } else {
        String::new()
    };
    let mut indices = Vec::with_capacity(triangles as usize);
    for t in 0..triangles as usize {
        let mut corners = [0; 3];
        for (c, corner) in corners.iter_mut().enumerate() {
            *corner = bytes.word(triangles_at.saturating_add(t * 12 + c * 4), "triangles")?;
            if *corner >= vertices {
                return Err(Md3Error::Vertex {
                    vertex: *corner,
                    count: vertices,
                });
            }
        }
        indices.push(corners);
    }
    let uvs = (0..vertices as usize)
        .map(|v| {
            let at = uvs_at.saturating_add(v * 8);
            Ok(Vec2::new(
                bytes.float(at, "texture coordinates")?,
                bytes.float(at + 4, "texture coordinates")?,
            ))
        })
        .collect::<Result<Vec<_>, _>>()?;
    let stored = bytes.slice(vertices_at, (frame_count * vertices) as usize * 8, "vertices")?;
    let number = |v: &[u8], i: usize| i16::from_le_bytes([v[2 * i], v[2 * i + 1]]);
    let frames = stored
        .chunks_exact((vertices as usize * 8).max(1))
        .map(|frame| {
            let vertex = |v: &[u8]| Md3Vertex {
                position: Vec3::from([0, 1, 2].map(|i| f32::from(number(v, i)) * SCALE)),
                normal: normal(number(v, 3) as u16),
            };
            frame.chunks_exact(8).map(vertex).collect()
        })
        .collect();
    let surface = Md3Surface {
        name: bytes.name(4, WHAT)?,
        shader,
        triangles: indices,
        uvs,
        frames,
    };
    Ok((surface, end))
}

impl Md3 {
    /// Reads a model.
    ///
    /// # Errors
    /// [`Md3Error`] says what is wrong with it.
    pub fn read(data: &[u8]) -> Result<Self, Md3Error> {
        let bytes = Bytes(data);
        if bytes.slice(0, 4, "header").map_err(|_| Md3Error::NotMd3)? != b"IDP3" {
            return Err(Md3Error::NotMd3);
        }
        match bytes.word(4, "header")? {
            15 => {}
            other => return Err(Md3Error::Version(other)),
        }
        let frame_count = bytes.count(76, "frames", MOST_FRAMES)?;
        let tag_count = bytes.count(80, "tags", MOST_TAGS)?;
        let surface_count = bytes.count(84, "surfaces", MOST_SURFACES)?;
        let (tags_at, surfaces_at) = (bytes.word(96, "header")? as usize, bytes.word(100, "header")? as usize);
        let tag = |i: usize| {
            let at = tags_at.saturating_add(i * 112);
            let axis = |n: usize| bytes.vector(at + NAME + 12 + n * 12, "tags").map(Vec3A::from);
            Ok(Md3Tag {
                name: bytes.name(at, "tags")?,
                place: Affine3A {
                    translation: bytes.vector(at + NAME, "tags")?.into(),
                    matrix3: Mat3A::from_cols(axis(0)?, axis(1)?, axis(2)?),
                },
            })
        };
        let tags = (0..frame_count as usize)
            .map(|f| {
                (0..tag_count as usize)
                    .map(|t| tag(f * tag_count as usize + t))
                    .collect()
            })
            .collect::<Result<Vec<Vec<_>>, _>>()?;
        let mut surfaces = Vec::new();
        let mut at = surfaces_at;
        for _ in 0..surface_count {
            let rest = data.get(at..).ok_or(Md3Error::Truncated("surfaces"))?;
            let (surface, length) = surface(&Bytes(rest), frame_count)?;
            surfaces.push(surface);
            at = at.saturating_add(length);
        }
        Ok(Self {
            surfaces,
            tags,
            frame_count,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A triangle in two frames, with a tag.
    fn model() -> Vec<u8> {
        let name = |text: &str| {
            let mut bytes = text.as_bytes().to_vec();
            bytes.resize(NAME, 0);
            bytes
        };
        let words = |w: &[u32]| w.iter().flat_map(|x| x.to_le_bytes()).collect::<Vec<u8>>();
        let mut tags = Vec::new();
        for x in [1.0f32, 2.0] {
            tags.extend(name("tag_weapon"));
            let f = [x, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];
            tags.extend(f.iter().flat_map(|x| x.to_le_bytes()));
        }
        let mut surface = b"IDP3".to_vec();
        surface.extend(name("body"));
        // Flags, frames, shaders, vertices, triangles, offsets.
        let (triangles, shaders) = (108, 108 + 12);
        let uvs = shaders + 68;
        let vertices = uvs + 24;
        let end = vertices + 48;
        surface.extend(words(&[0, 2, 1, 3, 1, triangles, shaders, uvs, vertices, end]));
        surface.extend(words(&[0, 1, 2]));
        surface.extend(name("Models\\A"));
        surface.extend(words(&[0]));
        surface.extend([0f32, 0.0, 1.0, 0.0, 0.0, 1.0].iter().flat_map(|x| x.to_le_bytes()));
        for frame in 0..2i16 {
            for (x, y) in [(0i16, 0i16), (64, 0), (0, 64)] {
                surface.extend([x, y, frame * 64, 0].iter().flat_map(|x| x.to_le_bytes()));
            }
        }
        let header = 108;
        let mut out = b"IDP3".to_vec();
        out.extend(words(&[15]));
        out.extend(name("model"));
        let (tags_at, surfaces_at) = (header, header + tags.len() as u32);
        let total = surfaces_at + surface.len() as u32;
        out.extend(words(&[0, 2, 1, 1, 0, header, tags_at, surfaces_at, total]));
        out.extend(tags);
        out.extend(surface);
        out
    }

    #[test]
    fn a_model_is_read_whole() {
        let m = Md3::read(&model()).unwrap();
        assert_eq!((m.frame_count, m.surfaces.len(), m.tags.len()), (2, 1, 2));
        let s = &m.surfaces[0];
        assert_eq!((s.shader.as_str(), s.triangles[0]), ("models/a", [0, 1, 2]));
        assert_eq!(s.frames[1][1].position, Vec3::new(1.0, 0.0, 1.0));
        assert_eq!(s.frames[0][0].normal, Vec3::Z);
        assert_eq!(m.tags[1][0].place.translation, Vec3A::new(2.0, 0.0, 0.0));
    }

    #[test]
    fn no_cut_or_flipped_byte_brings_it_down() {
        let good = model();
        for n in 0..good.len() {
            assert!(Md3::read(&good[..n]).is_err(), "{n} bytes are taken for a model");
            for bit in [0, 3, 7] {
                let mut bad = good.clone();
                bad[n] ^= 1 << bit;
                let _ = Md3::read(&bad);
            }
        }
    }
}
