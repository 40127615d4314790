//! OpenEXR files: linear radiance in 32-bit float, with sample counts and variance so that partial results can be joined.

use super::{OutputError, atomic};
use crate::render::film::Film;
use exr::prelude::{
    AnyChannel, AnyChannels, Encoding, FlatImage, FlatSamples, Image, Layer, LayerAttributes, ReadChannels, ReadLayers,
    SmallVec, Text, WritableImage,
};
use std::io::Cursor;
use std::path::Path;

/// A named plane of values, row by row from the top.
pub type Plane = (String, Vec<f32>);

fn split<const N: usize>(names: [&str; N], pixels: &[[f32; N]]) -> Vec<Plane> {
    (0..N)
        .map(|c| (names[c].to_owned(), pixels.iter().map(|p| p[c]).collect()))
        .collect()
}

/// Three planes R, G, B.
pub fn rgb(pixels: &[[f32; 3]]) -> Vec<Plane> {
    split(["R", "G", "B"], pixels)
}

/// Three planes X, Y, Z.
pub fn xyz(pixels: &[[f32; 3]]) -> Vec<Plane> {
    split(["X", "Y", "Z"], pixels)
}

/// Two planes X, Y.
pub fn xy(pixels: &[[f32; 2]]) -> Vec<Plane> {
    split(["X", "Y"], pixels)
}

/// Writes planes of equal size, with text attributes.
///
/// # Errors
/// [`OutputError`] naming the file.
pub fn write(
    path: &Path,
    width: u32,
    height: u32,
    planes: Vec<Plane>,
    attributes: &[(&str, String)],
) -> Result<(), OutputError> {
    let failed = |reason: String| OutputError::Encode {
        path: path.to_owned(),
        reason,
    };
    let channels: SmallVec<[AnyChannel<FlatSamples>; 4]> = planes
        .into_iter()
        .map(|(name, values)| AnyChannel::new(Text::from(name.as_str()), FlatSamples::F32(values)))
        .collect();
    let mut layer_attributes = LayerAttributes::default();
    for (name, value) in attributes {
        if let Some(text) = Text::new_or_none(value) {
            layer_attributes
                .other
                .insert(Text::from(*name), exr::meta::attribute::AttributeValue::Text(text));
        }
    }
    let layer = Layer::new(
        (width as usize, height as usize),
        layer_attributes,
        Encoding::FAST_LOSSLESS,
        AnyChannels::sort(channels),
    );
    let mut bytes = Cursor::new(Vec::new());
    Image::from_layer(layer)
        .write()
        .to_buffered(&mut bytes)
        .map_err(|e| failed(e.to_string()))?;
    atomic::write(path, &bytes.into_inner())
}

/// Reads the planes of the first layer. Half-float and integer channels are converted.
///
/// # Errors
/// [`OutputError::Read`].
pub fn read(path: &Path) -> Result<(u32, u32, Vec<Plane>), OutputError> {
    let failed = |reason: String| OutputError::Read {
        path: path.to_owned(),
        reason,
    };
    let bytes = std::fs::read(path).map_err(|e| failed(e.to_string()))?;
    // A damaged file can make the decoder panic rather than fail; the user still gets one sentence.
    let image: FlatImage = std::panic::catch_unwind(|| {
        exr::prelude::read()
            .no_deep_data()
            .largest_resolution_level()
            .all_channels()
            .all_layers()
            .all_attributes()
            .non_parallel()
            .from_buffered(Cursor::new(bytes))
    })
    .map_err(|_| failed("the file is damaged".to_owned()))?
    .map_err(|e| failed(e.to_string()))?;
    let layer = image
        .layer_data
        .into_iter()
        .next()
        .ok_or_else(|| failed("it has no image".to_owned()))?;
    let (width, height) = (layer.size.width() as u32, layer.size.height() as u32);
    let planes = layer
        .channel_data
        .list
        .into_iter()
        .map(|channel| {
            let values = channel.sample_data.values_as_f32().collect();
            (channel.name.to_string(), values)
        })
        .collect();
    Ok((width, height, planes))
}

/// Writes a film: R, G, B, samples, variance and the shares by source.
///
/// # Errors
/// [`OutputError`] naming the file.
pub fn write_film(path: &Path, film: &Film, attributes: &[(&str, String)]) -> Result<(), OutputError> {
    let mut planes = rgb(&film.mean);
    planes.push(("samples".to_owned(), film.samples.clone()));
    planes.push(("variance".to_owned(), film.variance.clone()));
    planes.extend(split(["direct.R", "direct.G", "direct.B"], &film.direct));
    planes.extend(split(["emission.R", "emission.G", "emission.B"], &film.emission));
    write(path, film.width, film.height, planes, attributes)
}

/// Pixels of the planes R, G, B; of the only plane for all three where there is one.
///
/// # Errors
/// [`OutputError::Read`] where they are missing.
pub fn pixels(path: &Path, planes: &[Plane]) -> Result<Vec<[f32; 3]>, OutputError> {
    let find = |names: [&str; 2]| planes.iter().find(|(n, _)| names.contains(&n.as_str())).map(|(_, v)| v);
    let (r, g, b) = match (find(["R", "X"]), find(["G", "Y"]), find(["B", "Z"]), planes) {
        (Some(r), Some(g), Some(b), _) => (r, g, b),
        (_, _, _, [(_, only)]) => (only, only, only),
        _ => {
            return Err(OutputError::Read {
                path: path.to_owned(),
                reason: "it has no R, G, B channels".to_owned(),
            });
        }
    };
    Ok((0..r.len()).map(|i| [r[i], g[i], b[i]]).collect())
}

/// Reads a film that [`write_film`] wrote; a plain RGB file counts as one sample a pixel.
///
/// # Errors
/// [`OutputError::Read`].
pub fn read_film(path: &Path) -> Result<Film, OutputError> {
    let (width, height, planes) = read(path)?;
    let mut film = Film::new(width, height);
    film.mean = pixels(path, &planes)?;
    let plane = |name: &str| planes.iter().find(|(n, _)| n == name).map(|(_, v)| v.clone());
    film.samples = plane("samples").unwrap_or_else(|| vec![1.0; film.mean.len()]);
    film.variance = plane("variance").unwrap_or_else(|| vec![0.0; film.mean.len()]);
    let layer = |layer: &str| -> Vec<[f32; 3]> {
        let c = ["R", "G", "B"].map(|c| plane(&format!("{layer}.{c}")).unwrap_or_else(|| vec![0.0; film.mean.len()]));
        (0..film.mean.len()).map(|i| [c[0][i], c[1][i], c[2][i]]).collect()
    };
    film.direct = layer("direct");
    film.emission = layer("emission");
    Ok(film)
}
