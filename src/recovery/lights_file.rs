//! Lights files: what was recovered for a map, as text that people can edit.
//!
//! ```text
//! # From a hash that begins a word on, a line is a comment.
//! map oa_dm1
//! encoding gamma 1 compensate 1
//! ambient 0.01 0.01 0.012
//! sky 0 0 0
//! indirect 0.8
//! scale textures/base_light/light1_5000 0.93
//! light 128 64 320 photons 300 color 1 0.9 0.7
//! light 0 0 64 photons 200 color 1 1 1 radius 8 target 0 0 0 cone 64
//! ```
//!
//! Order does not matter, except that the last of several `scale` lines for one name counts. `ambient` and `sky` are E/π in
//! luxel units (a byte of 255 is 1), `photons` is what a light entity's key `light` says, `color` has 1 as its largest
//! component, `radius` is the lamp's in units, `target` and `cone` make a spot as a light entity's target and `radius` do.

use super::encoding::{Encoding, Evidence};
use crate::assets::vfs::{FileSource, VfsError};
use glam::Vec3;
use std::fmt::{self, Display, Write};
use thiserror::Error;

/// Why a text is no lights file.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[error("lights file, line {line}: {problem}")]
pub struct LightsFileError {
    /// From 1.
    pub line: usize,
    pub problem: Problem,
}

/// What is wrong with a line.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum Problem {
    #[error("unknown word \"{0}\"")]
    Unknown(String),
    #[error("{what} needs {wanted} finite number(s)")]
    Numbers { what: &'static str, wanted: usize },
    #[error("{0} must be positive")]
    NotPositive(&'static str),
    #[error("{0} must not be negative")]
    Negative(&'static str),
    #[error("{0} needs a name")]
    Name(&'static str),
    #[error("\"cone\" without \"target\"")]
    ConeWithoutTarget,
}

/// Why an override could not be used.
#[derive(Debug, Error)]
pub enum OverrideError {
    #[error("{path}: {source}")]
    Text { path: String, source: LightsFileError },
    #[error(transparent)]
    Files(#[from] VfsError),
}

/// A spot's direction and width.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spot {
    /// Point on the axis, world units.
    pub target: Vec3,
    /// Radius of the cone at the target, units.
    pub cone: f32,
}

/// A point light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FileLight {
    /// World units.
    pub origin: Vec3,
    /// As the entity key `light`: E/π at distance d is 7500·photons/(255·d²).
    pub photons: f32,
    /// Linear, largest component 1.
    pub color: Vec3,
    /// Radius of the lamp, units; `None`: as light entities have.
    pub radius: Option<f32>,
    pub spot: Option<Spot>,
    /// Share of the map's evidence that it explains, where that is known.
    pub share: Option<f32>,
}

/// What the lights of a known term are multiplied by.
#[derive(Clone, Debug, PartialEq)]
pub struct Scale {
    /// The shader, or `sun:1` and the like.
    pub name: String,
    pub scale: f32,
    /// Share of the stored light that they give, where that is known.
    pub share: Option<f32>,
}

/// Everything a lights file says.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LightsFile {
    pub map: String,
    pub encoding: Option<Encoding>,
    /// E/π everywhere, luxel units.
    pub ambient: Vec3,
    /// Radiance of sky that no script explains, luxel units.
    pub sky: Vec3,
    /// Part of the gathered indirect light that the bake had, 0..=1.
    pub indirect: f32,
    /// Scales of known terms by name; 1 where none is given.
    pub scales: Vec<Scale>,
    pub lights: Vec<FileLight>,
}

/// Path of a map's lights file in the paks.
pub fn path(map: &str) -> String {
    let bsp = crate::assets::vfs::search_path::map_path(map);
    format!("{}.lights", bsp.strip_suffix(".bsp").unwrap_or(&bsp))
}

/// The lights file that overrides everything for a map, if there is one.
///
/// # Errors
/// [`OverrideError`] where it cannot be read or understood.
pub fn find_override(files: &dyn FileSource, map: &str) -> Result<Option<LightsFile>, OverrideError> {
    let path = path(map);
    let Some(bytes) = files.read(&path)? else {
        return Ok(None);
    };
    let text = String::from_utf8_lossy(&bytes);
    LightsFile::parse(&text)
        .map(Some)
        .map_err(|source| OverrideError::Text { path, source })
}

struct Words<'a>(std::iter::Peekable<std::str::SplitWhitespace<'a>>);

impl Words<'_> {
    fn numbers<const N: usize>(&mut self, what: &'static str) -> Result<[f32; N], Problem> {
        let mut out = [0.0; N];
        for o in &mut out {
            *o = self
                .0
                .next()
                .and_then(|w| w.parse().ok())
                .filter(|x: &f32| x.is_finite())
                .ok_or(Problem::Numbers { what, wanted: N })?;
        }
        Ok(out)
    }

    fn number(&mut self, what: &'static str) -> Result<f32, Problem> {
        self.numbers::<1>(what).map(|[x]| x)
    }

    fn positive(&mut self, what: &'static str) -> Result<f32, Problem> {
        self.number(what).and_then(|x| {
            if x > 0.0 {
                Ok(x)
            } else {
                Err(Problem::NotPositive(what))
            }
        })
    }

    fn colour(&mut self, what: &'static str) -> Result<Vec3, Problem> {
        let c = Vec3::from(self.numbers::<3>(what)?);
        if c.min_element() < 0.0 {
            return Err(Problem::Negative(what));
        }
        Ok(c)
    }
}

impl LightsFile {
    /// Reads a text.
    ///
    /// # Errors
    /// [`LightsFileError`] with the line at fault.
    pub fn parse(text: &str) -> Result<Self, LightsFileError> {
        let mut out = Self::default();
        for (i, line) in text.lines().enumerate() {
            let (line, comment) = split_comment(line);
            let mut words = Words(line.split_whitespace().peekable());
            out.line(&mut words, comment)
                .map_err(|problem| LightsFileError { line: i + 1, problem })?;
        }
        Ok(out)
    }

    fn line(&mut self, words: &mut Words, comment: &str) -> Result<(), Problem> {
        let Some(first) = words.0.next() else {
            return Ok(());
        };
        match first {
            "map" => words.0.next().ok_or(Problem::Name("map"))?.clone_into(&mut self.map),
            "encoding" => self.encoding = Some(encoding(words)?),
            "ambient" => self.ambient = words.colour("ambient")?,
            "sky" => self.sky = words.colour("sky")?,
            "indirect" => self.indirect = words.number("indirect")?.clamp(0.0, 1.0),
            "scale" => {
                let name = words.0.next().ok_or(Problem::Name("scale"))?.to_owned();
                let scale = words.number("scale")?;
                if scale < 0.0 {
                    return Err(Problem::Negative("scale"));
                }
                self.scales.retain(|s| s.name != name);
                self.scales.push(Scale {
                    name,
                    scale,
                    share: explained(comment),
                });
            }
            "light" => {
                let mut light = light(words)?;
                light.share = explained(comment);
                self.lights.push(light);
            }
            other => return Err(Problem::Unknown(other.to_owned())),
        }
        match words.0.next() {
            Some(more) => Err(Problem::Unknown(more.to_owned())),
            None => Ok(()),
        }
    }
}

/// The share that a comment says is explained.
fn explained(comment: &str) -> Option<f32> {
    comment
        .split_once("explains")
        .and_then(|(_, rest)| rest.trim().trim_end_matches('%').parse::<f32>().ok())
        .filter(|s| s.is_finite())
        .map(|percent| percent / 100.0)
}

/// A line and its comment. Shader names may hold hashes, though not begin with one.
fn split_comment(line: &str) -> (&str, &str) {
    let begins_word = |i: &usize| line[..*i].chars().next_back().is_none_or(char::is_whitespace);
    match line.match_indices('#').map(|(i, _)| i).find(begins_word) {
        Some(i) => (&line[..i], &line[i + 1..]),
        None => (line, ""),
    }
}

fn encoding(words: &mut Words) -> Result<Encoding, Problem> {
    let mut out = Encoding {
        evidence: Evidence::Stated,
        ..Encoding::LINEAR
    };
    while let Some(word) = words.0.next() {
        match word {
            "gamma" => out.gamma = words.positive("gamma")?,
            "compensate" => out.compensate = words.positive("compensate")?,
            other => return Err(Problem::Unknown(other.to_owned())),
        }
    }
    Ok(out)
}

fn light(words: &mut Words) -> Result<FileLight, Problem> {
    let mut out = FileLight {
        origin: Vec3::from(words.numbers::<3>("light")?),
        photons: 300.0,
        color: Vec3::ONE,
        radius: None,
        spot: None,
        share: None,
    };
    let mut cone = None;
    while let Some(word) = words.0.next() {
        match word {
            "photons" => out.photons = words.number("photons")?,
            "color" => out.color = words.colour("color")?,
            "radius" => out.radius = Some(words.positive("radius")?),
            "target" => {
                out.spot = Some(Spot {
                    target: Vec3::from(words.numbers::<3>("target")?),
                    cone: 64.0,
                });
            }
            "cone" => cone = Some(words.positive("cone")?),
            other => return Err(Problem::Unknown(other.to_owned())),
        }
    }
    match (cone, &mut out.spot) {
        (Some(cone), Some(spot)) => spot.cone = cone,
        (Some(_), None) => return Err(Problem::ConeWithoutTarget),
        (None, _) => {}
    }
    Ok(out)
}

fn triple(v: Vec3) -> String {
    format!("{} {} {}", v.x, v.y, v.z)
}

impl Display for LightsFile {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        writeln!(
            f,
            "# Lights that were found in the lightmaps. Values as in light entities; see the manual."
        )?;
        if !self.map.is_empty() {
            writeln!(f, "map {}", self.map)?;
        }
        if let Some(e) = &self.encoding {
            writeln!(f, "encoding gamma {} compensate {}", e.gamma, e.compensate)?;
        }
        writeln!(f, "ambient {}", triple(self.ambient))?;
        writeln!(f, "sky {}", triple(self.sky))?;
        writeln!(f, "indirect {}", self.indirect)?;
        for s in &self.scales {
            write!(f, "scale {} {}", s.name, s.scale)?;
            if let Some(share) = s.share {
                write!(f, " # explains {}%", share * 100.0)?;
            }
            writeln!(f)?;
        }
        for l in &self.lights {
            let mut line = format!(
                "light {} photons {} color {}",
                triple(l.origin),
                l.photons,
                triple(l.color)
            );
            if let Some(radius) = l.radius {
                write!(line, " radius {radius}")?;
            }
            if let Some(spot) = &l.spot {
                write!(line, " target {} cone {}", triple(spot.target), spot.cone)?;
            }
            if let Some(share) = l.share {
                write!(line, " # explains {}%", share * 100.0)?;
            }
            writeln!(f, "{line}")?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scale(name: &str, scale: f32) -> Scale {
        Scale {
            name: name.to_owned(),
            scale,
            share: None,
        }
    }

    fn full() -> LightsFile {
        LightsFile {
            map: "a_map".to_owned(),
            encoding: Some(Encoding {
                gamma: 1.3,
                compensate: 2.0,
                evidence: Evidence::Stated,
            }),
            ambient: Vec3::new(0.01, 0.02, 1.0 / 3.0),
            sky: Vec3::new(0.0, 0.25, 1e-7),
            indirect: 0.75,
            scales: vec![
                scale("textures/a/b", 0.93),
                scale("textures/a/#hash", 0.5),
                scale("sun:4", 0.0),
            ],
            lights: vec![
                FileLight {
                    origin: Vec3::new(-1.5, 1e5, 0.1),
                    photons: 312.7,
                    color: Vec3::new(1.0, 0.9, 1.0 / 3.0),
                    radius: None,
                    spot: None,
                    share: None,
                },
                FileLight {
                    origin: Vec3::ZERO,
                    photons: -20.0,
                    color: Vec3::ONE,
                    radius: Some(8.0),
                    spot: Some(Spot {
                        target: Vec3::new(1.0, 2.0, 3.0),
                        cone: 32.0,
                    }),
                    share: None,
                },
            ],
        }
    }

    #[test]
    fn what_is_written_is_read_back() {
        let file = full();
        assert_eq!(LightsFile::parse(&file.to_string()), Ok(file));
    }

    #[test]
    fn shares_survive_as_comments() {
        let mut file = full();
        file.lights[0].share = Some(0.125);
        let read = LightsFile::parse(&file.to_string()).map(|f| f.lights[0].share);
        assert_eq!(read, Ok(Some(0.125)));
    }

    #[test]
    fn people_may_leave_things_out() {
        let text = "\n  # only a light\nlight 1 2 3 # here\nlight 4 5 6 target 0 0 0\n";
        let Ok(file) = LightsFile::parse(text) else {
            panic!("not read");
        };
        assert_eq!(file.lights.len(), 2);
        assert_eq!((file.lights[0].photons, file.lights[0].color), (300.0, Vec3::ONE));
        assert_eq!(file.lights[1].spot.map(|s| s.cone), Some(64.0));
    }

    #[test]
    fn errors_name_line_and_fault() {
        let fault = |text: &str| LightsFile::parse(text).map_err(|e| (e.line, e.problem));
        let numbers = |what, wanted| Problem::Numbers { what, wanted };
        for (text, line, problem) in [
            ("map a\nlamp 1 2 3", 2, Problem::Unknown("lamp".to_owned())),
            ("light 1 2", 1, numbers("light", 3)),
            ("light 1 2 nan", 1, numbers("light", 3)),
            ("light 1 2 3 color 1 -1 0", 1, Problem::Negative("color")),
            ("light 1 2 3 radius 0", 1, Problem::NotPositive("radius")),
            ("light 1 2 3 cone 64", 1, Problem::ConeWithoutTarget),
            ("light 1 2 3 colour 1 1 1", 1, Problem::Unknown("colour".to_owned())),
            ("\n\nscale", 3, Problem::Name("scale")),
            ("scale x -1", 1, Problem::Negative("scale")),
            ("indirect much", 1, numbers("indirect", 1)),
            ("ambient 1 2 3 4", 1, Problem::Unknown("4".to_owned())),
            ("encoding gamma 0", 1, Problem::NotPositive("gamma")),
        ] {
            assert_eq!(fault(text), Err((line, problem)), "{text:?}");
        }
    }

    #[test]
    fn the_path_is_beside_the_map() {
        assert_eq!(path("Oa_Dm1"), "maps/oa_dm1.lights");
        assert_eq!(path("maps/x.bsp"), "maps/x.lights");
    }
}
