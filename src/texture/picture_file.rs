//! Decodes the files of pictures: PNG, JPEG and `OpenEXR`.

use std::{
    fmt::Display,
    fs::File,
    io::{BufRead, BufReader, Seek},
    path::Path,
};

use exr::prelude::{ReadChannels as _, ReadLayers as _, Text, Vec2};
use zune_jpeg::{
    JpegDecoder,
    zune_core::{bytestream::ZCursor, colorspace::ColorSpace, options::DecoderOptions},
};

/// A decoded picture. Values of 8 and 16 bits are scaled to [0, 1]. Grey pictures have three equal channels, and alpha
/// is left out.
#[derive(Debug)]
pub(crate) struct Decoded {
    pub(crate) width: usize,
    pub(crate) height: usize,
    /// The texels, row by row.
    pub(crate) texels: Vec<[f32; 3]>,
    /// Whether the file holds linear floating-point numbers.
    pub(crate) is_linear: bool,
}

impl Decoded {
    /// The texels in linear RGB. Values of 8 and 16 bits are decoded from sRGB, unless they are raw.
    pub(crate) fn linear(self, is_raw: bool) -> Vec<[f32; 3]> {
        if is_raw || self.is_linear {
            return self.texels;
        }
        self.texels.into_iter().map(|texel| texel.map(srgb_to_linear)).collect()
    }
}

/// Decodes an sRGB value, IEC 61966-2-1.
fn srgb_to_linear(x: f32) -> f32 {
    if x <= 0.040_45 { x / 12.92 } else { ((x + 0.055) / 1.055).powf(2.4) }
}

/// The largest width and height in texels.
const MAX_SIDE: usize = 65_536;
/// The largest size of the decoded file in bytes.
const MAX_BYTES: usize = 1 << 30;

/// Reads a picture. The first bytes of the file determine its format, not its name.
pub(crate) fn read(path: &Path) -> Result<Decoded, String> {
    let fault = |what: &dyn Display| format!("{}: {what}", path.display());
    let mut reader = File::open(path).map(BufReader::new).map_err(|e| fault(&e))?;
    let start = reader.fill_buf().map_err(|e| fault(&e))?;
    let decoded = if start.starts_with(b"\x89PNG\r\n\x1a\n") {
        png(reader)
    } else if start.starts_with(b"\xff\xd8\xff") {
        jpeg(reader)
    } else if start.starts_with(b"\x76\x2f\x31\x01") {
        open_exr(reader)
    } else {
        Err("is neither a PNG nor a JPEG nor an OpenEXR picture".into())
    };
    decoded.map_err(|what| fault(&what.trim_end()))
}

fn png(reader: impl BufRead + Seek) -> Result<Decoded, String> {
    let fault = |error: png::DecodingError| error.to_string();
    let mut decoder = png::Decoder::new_with_limits(reader, png::Limits { bytes: MAX_BYTES });
    // Palettes and channels of fewer than 8 bits become channels of 8 bits.
    decoder.set_transformations(png::Transformations::EXPAND);
    let mut reader = decoder.read_info().map_err(fault)?;
    let (width, height) = (reader.info().width as usize, reader.info().height as usize);
    let size = reader.output_buffer_size().unwrap_or(usize::MAX);
    check_size(width, height, size)?;
    let mut bytes = vec![0; size];
    let info = reader.next_frame(&mut bytes).map_err(fault)?;
    let values: Vec<u16> = match info.bit_depth {
        png::BitDepth::Sixteen => bytes.as_chunks().0.iter().map(|&pair| u16::from_be_bytes(pair)).collect(),
        _ => bytes.into_iter().map(u16::from).collect(),
    };
    let max = if info.bit_depth == png::BitDepth::Sixteen { u16::MAX } else { u8::MAX.into() };
    let texel = |channels: &[u16]| match *channels {
        [r, g, b, ..] => colour([r, g, b], max),
        [value, ..] => grey(value, max),
        [] => [0.0; 3],
    };
    let texels = values.chunks_exact(info.color_type.samples()).map(texel).collect();
    Ok(Decoded { width, height, texels, is_linear: false })
}

fn jpeg(mut reader: impl BufRead) -> Result<Decoded, String> {
    let mut file = Vec::new();
    reader.read_to_end(&mut file).map_err(|error| error.to_string())?;
    let options = DecoderOptions::default().set_strict_mode(false).set_max_width(MAX_SIDE).set_max_height(MAX_SIDE);
    // The decoder turns every colour space into RGB.
    let mut decoder = JpegDecoder::new_with_options(ZCursor::new(file), options);
    decoder.decode_headers().map_err(|error| error.to_string())?;
    let (width, height) = decoder.dimensions().expect("the headers were decoded");
    check_size(width, height, 3 * width * height)?;
    let bytes = decoder.decode().map_err(|error| error.to_string())?;
    let is_grey = decoder.input_colorspace() == Some(ColorSpace::Luma);
    let texel = |rgb: &[u8; 3]| {
        let [r, g, b] = rgb.map(u16::from);
        if is_grey { grey(r, u8::MAX.into()) } else { colour([r, g, b], u8::MAX.into()) }
    };
    let texels = bytes.as_chunks().0.iter().map(texel).collect();
    Ok(Decoded { width, height, texels, is_linear: false })
}

fn colour(channels: [u16; 3], max: u16) -> [f32; 3] {
    channels.map(|value| f32::from(value) / f32::from(max))
}

/// Converts by multiplying with the reciprocal. It may differ from the quotient in the last bit, but keeps images with
/// grey textures unchanged to the last bit.
fn grey(value: u16, max: u16) -> [f32; 3] {
    [f32::from(value) * f32::from(max).recip(); 3]
}

/// Reads the first layer with R, G and B. The picture covers the display window, and is black where the file has no
/// data.
fn open_exr(reader: impl BufRead + Seek) -> Result<Decoded, String> {
    let fault = |error: exr::error::Error| error.to_string();
    let chunks = exr::block::read(reader, false).map_err(fault)?;
    let has_colours = |header: &&exr::meta::header::Header| {
        let has = |name| header.channels.find_index_of_channel(&Text::from(name)).is_some();
        !header.deep && ["R", "G", "B"].into_iter().all(has)
    };
    let header = chunks.headers().iter().find(has_colours).ok_or("has no channels R, G and B")?;
    let window = header.shared_attributes.display_window;
    let offset = header.own_attributes.layer_position - window.position;
    let Vec2(width, height) = window.size;
    check_size(width, height, size_of::<[f32; 3]>().saturating_mul(width).saturating_mul(height))?;
    let image = exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .rgb_channels(
            move |_, _| vec![[0.0; 3]; width * height],
            move |texels: &mut Vec<[f32; 3]>, at, (r, g, b)| {
                let Vec2(x, y) = at.to_i32() + offset;
                if let (Ok(x), Ok(y)) = (usize::try_from(x), usize::try_from(y))
                    && x < width
                    && y < height
                {
                    texels[y * width + x] = [r, g, b];
                }
            },
        )
        .first_valid_layer()
        .all_attributes()
        .from_chunks(chunks)
        .map_err(fault)?;
    Ok(Decoded { width, height, texels: image.layer_data.channel_data.pixels, is_linear: true })
}

fn check_size(width: usize, height: usize, bytes: usize) -> Result<(), String> {
    if width > MAX_SIDE || height > MAX_SIDE || bytes > MAX_BYTES {
        return Err(format!("{width} x {height} texels are too many; at most {MAX_SIDE} a side and 1 GiB are read"));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use std::io::Cursor;

    use exr::prelude::{Encoding, Image, IntegerBounds, Layer, LayerAttributes, SpecificChannels, WritableImage as _};
    use png::{BitDepth, ColorType};

    use super::*;

    /// The texels of a PNG file of one row that was written with these bytes.
    fn through_png(width: u32, colour: ColorType, depth: BitDepth, bytes: &[u8]) -> Vec<[f32; 3]> {
        let mut file = Vec::new();
        let mut encoder = png::Encoder::new(&mut file, width, 1);
        encoder.set_color(colour);
        encoder.set_depth(depth);
        if colour == ColorType::Indexed {
            encoder.set_palette(&[0, 51, 102, 153, 204, 255]);
        }
        encoder.write_header().and_then(|mut writer| writer.write_image_data(bytes)).expect("memory takes a picture");
        let decoded = png(Cursor::new(file)).expect("a picture");
        assert_eq!((decoded.width, decoded.height, decoded.is_linear), (width as usize, 1, false));
        decoded.texels
    }

    #[test]
    fn png_files_of_all_kinds() {
        let colours = through_png(2, ColorType::Rgb, BitDepth::Eight, &[0, 51, 102, 153, 204, 255]);
        assert_eq!(colours, [[0.0, 0.2, 0.4], [0.6, 0.8, 1.0]]);
        assert_eq!(through_png(2, ColorType::Indexed, BitDepth::One, &[0b0100_0000]), colours);
        let deep = through_png(1, ColorType::Rgba, BitDepth::Sixteen, &[0x33, 0x33, 0xff, 0xff, 0, 0, 1, 2]);
        assert_eq!(deep, [[0.2, 1.0, 0.0]]);
        let pairs = through_png(2, ColorType::GrayscaleAlpha, BitDepth::Eight, &[255, 7, 0, 255]);
        assert_eq!(pairs, [[1.0; 3], [0.0; 3]]);
        let steps = through_png(4, ColorType::Grayscale, BitDepth::Two, &[0b0001_1011]);
        for (texel, expected) in steps.into_iter().zip([0.0, 1.0 / 3.0, 2.0 / 3.0, 1.0]) {
            assert!(texel.iter().all(|x| (x - expected).abs() < 1e-6), "{texel:?}");
        }
    }

    #[test]
    fn jpeg_files_of_colour_and_grey() {
        // Pillow 13.0 wrote the files and reads these bytes from them; decoders may round differently.
        for (name, expected) in [("orange", [200.0, 100.0, 50.0]), ("grey", [100.0; 3])] {
            let file = format!("src/texture/files/{name}.jpg");
            let decoded = read(&Path::new(env!("CARGO_MANIFEST_DIR")).join(file)).expect("a picture");
            assert_eq!((decoded.width, decoded.height, decoded.texels.len()), (5, 3, 15));
            for texel in decoded.texels {
                assert!(
                    texel.iter().zip(expected).all(|(x, byte)| (255.0 * x - byte).abs() < 1.5),
                    "{name}: {texel:?}"
                );
            }
        }
    }

    #[test]
    fn exr_files_show_their_display_window() {
        // Data of 2 x 2 pixels from (-1, 0), in a window of 3 x 2 from (0, 0).
        let channels = SpecificChannels::rgb(|Vec2(x, y)| (x as f32, y as f32, 0.5_f32));
        let attributes = LayerAttributes { layer_position: Vec2(-1, 0), ..LayerAttributes::default() };
        let mut image = Image::from_layer(Layer::new((2, 2), attributes, Encoding::UNCOMPRESSED, channels));
        image.attributes.display_window = IntegerBounds::new((0, 0), (3, 2));
        let mut file = Cursor::new(Vec::new());
        image.write().to_buffered(&mut file).expect("memory takes a picture");
        let decoded = open_exr(Cursor::new(file.into_inner())).expect("a picture");
        assert_eq!((decoded.width, decoded.height, decoded.is_linear), (3, 2, true));
        let black = [0.0; 3];
        assert_eq!(decoded.texels, [[1.0, 0.0, 0.5], black, black, [1.0, 1.0, 0.5], black, black]);
    }

    #[test]
    fn both_pieces_of_the_srgb_curve_are_decoded() {
        assert!((srgb_to_linear(0.5) - 0.214_041).abs() < 1e-6);
        assert!((srgb_to_linear(0.02) - 0.02 / 12.92).abs() < 1e-9);
        assert!((srgb_to_linear(1.0) - 1.0).abs() < 1e-6);
    }

    #[test]
    fn other_files_and_too_many_texels() {
        let manifest = Path::new(env!("CARGO_MANIFEST_DIR")).join("Cargo.toml");
        let error = read(&manifest).expect_err("not a picture");
        assert!(error.ends_with("Cargo.toml: is neither a PNG nor a JPEG nor an OpenEXR picture"), "{error}");
        assert!(check_size(65_536, 5_000, 3 * 65_536 * 5_000).is_ok());
        assert!(check_size(65_537, 1, 3 * 65_537).is_err() && check_size(65_536, 65_536, 12 << 32).is_err());
    }
}
