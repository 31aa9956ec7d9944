//! Reads and writes `OpenEXR` files.

use std::{io::Write as _, path::Path};

use exr::prelude::{
    AnyChannel, AnyChannels, AttributeValue, Encoding, FlatSamples, IntegerBounds, Layer, LayerAttributes,
    ReadChannels, ReadLayers, Text, Vec2, WritableImage,
};
use glam::DVec2;

use super::{Crop, Image};

/// An error of reading or writing a file; its message is one line that names the file.
#[derive(Debug, thiserror::Error)]
#[error("{file}: {what}")]
pub struct FileError {
    /// The file.
    pub file: String,
    /// The fault.
    pub what: String,
}

impl FileError {
    /// An error of the file at `path`.
    pub fn new(path: &Path, what: impl std::fmt::Display) -> Self {
        Self { file: path.display().to_string(), what: what.to_string() }
    }
}

/// Writes a file atomically: to a temporary file in the same folder, which is then renamed.
///
/// # Errors
/// If the path is a folder, or its folder cannot be written to.
pub fn write_whole(path: &Path, bytes: &[u8]) -> Result<(), FileError> {
    let fault = |error: &dyn std::fmt::Display| FileError::new(path, error);
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    if path.is_dir() {
        return Err(fault(&"is a folder"));
    }
    let mut file = tempfile::Builder::new().prefix(".etendue").tempfile_in(folder).map_err(|e| fault(&e))?;
    file.write_all(bytes).map_err(|e| fault(&e))?;
    set_permissions(&file).map_err(|e| fault(&e))?;
    file.persist(path).map(drop).map_err(|e| fault(&e.error))
}

/// Makes a temporary file, which only its owner can read, readable by all.
fn set_permissions(file: &tempfile::NamedTempFile) -> std::io::Result<()> {
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt as _;
        file.as_file().set_permissions(std::fs::Permissions::from_mode(0o644))?;
    }
    Ok(())
}

/// Writes an image as 32-bit floats with lossless compression, with its attributes in the header.
///
/// # Errors
/// If the file cannot be written; no partial file remains.
pub fn write(path: &Path, image: &Image) -> Result<(), FileError> {
    let channel =
        |(name, values): &(String, Vec<f32>)| AnyChannel::new(name.as_str(), FlatSamples::F32(values.clone()));
    let channels = AnyChannels::sort(image.channels.iter().map(channel).collect());
    let mut header = LayerAttributes {
        layer_position: Vec2(image.crop.x as i32, image.crop.y as i32),
        software_name: Some(Text::from("etendue")),
        ..LayerAttributes::default()
    };
    for (name, value) in &image.attributes {
        header.other.insert(utf8(name), AttributeValue::Text(utf8(value)));
    }
    let size = Vec2(image.crop.width as usize, image.crop.height as usize);
    let layer = Layer::new(size, header, Encoding::SMALL_LOSSLESS, channels);
    let mut file = exr::prelude::Image::from_layer(layer);
    let whole = Vec2(image.size.x as usize, image.size.y as usize);
    file.attributes.display_window = IntegerBounds::new((0, 0), whole);
    let mut bytes = std::io::Cursor::new(Vec::new());
    file.write().to_buffered(&mut bytes).map_err(|error| FileError::new(path, error))?;
    write_whole(path, bytes.get_ref())
}

/// Encodes header texts as UTF-8, although the crate assumes Latin-1, because file names can contain any characters.
fn utf8(text: &str) -> Text {
    Text::from_slice_unchecked(text.as_bytes())
}

/// Reads the text attributes in the header of a file, without its pixels.
///
/// # Errors
/// If the file cannot be read or is not an `OpenEXR` image.
pub fn read_attributes(path: &Path) -> Result<Vec<(String, String)>, FileError> {
    let data = exr::meta::MetaData::read_from_file(path, false).map_err(|error| FileError::new(path, error))?;
    let headers = data.headers.iter().flat_map(|header| &header.own_attributes.other);
    Ok(headers.filter_map(text).collect())
}

/// The name and value of a text attribute; None for other attributes.
fn text((name, value): (&Text, &AttributeValue)) -> Option<(String, String)> {
    match value {
        AttributeValue::Text(text) => Some((name.to_string(), String::from_utf8_lossy(text.as_slice()).into_owned())),
        _ => None,
    }
}

/// Reads all channels of the first layer of a file, as 32-bit floats.
///
/// # Errors
/// If the file cannot be read or is not an `OpenEXR` image.
pub fn read(path: &Path) -> Result<Image, FileError> {
    let bytes = std::fs::read(path).map_err(|error| FileError::new(path, error))?;
    let reader = exr::prelude::read().no_deep_data().largest_resolution_level().all_channels().first_valid_layer();
    let file = reader.all_attributes().from_buffered(std::io::Cursor::new(bytes));
    let file = file.map_err(|error| FileError::new(path, error))?;
    let layer = file.layer_data;
    let values = |samples: FlatSamples| match samples {
        FlatSamples::F32(values) => values,
        FlatSamples::F16(values) => values.into_iter().map(f32::from).collect(),
        FlatSamples::U32(values) => values.into_iter().map(|x| x as f32).collect(),
    };
    let mut channels: Vec<_> =
        layer.channel_data.list.into_iter().map(|c| (c.name.to_string(), values(c.sample_data))).collect();
    channels
        .sort_by_key(|(name, _)| (["R", "G", "B"].iter().position(|known| known == name).unwrap_or(3), name.clone()));
    let attributes = layer.attributes.other.iter().filter_map(text).collect();
    let position = layer.attributes.layer_position;
    let window = file.attributes.display_window;
    Ok(Image {
        crop: Crop {
            x: (position.0 - window.position.0).max(0) as u32,
            y: (position.1 - window.position.1).max(0) as u32,
            width: layer.size.0 as u32,
            height: layer.size.1 as u32,
        },
        size: DVec2::new(window.size.0 as f64, window.size.1 as f64),
        channels,
        attributes,
    })
}
