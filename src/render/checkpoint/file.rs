//! The file format of checkpoints: a first line with format and length, a line of JSON, the sums, and a SHA-256 of all
//! preceding bytes.

use std::{
    fs::File,
    io::{self, BufRead as _, BufReader, BufWriter, Read, Seek as _, Write},
    path::Path,
};

use serde::{Deserialize, Serialize};
use sha2::{Digest as _, Sha256};

use super::{Checkpoint, RenderRecord, draft::Draft};
use crate::{
    film::{Film, exr::FileError},
    integrator::IntegratorState,
    photon::radius::PixelRadius,
    render::drive::count,
};

/// The first bytes of every checkpoint. The number of the format and the length of the whole file in 20 digits follow.
const MAGIC: &str = "etendue checkpoint ";
const FORMAT: &str = "1";
/// The length of the first line in bytes.
const FIRST: u64 = MAGIC.len() as u64 + 30;
const HASH: u64 = 32;
/// The number of bytes of a [`PixelRadius`].
const RADIUS: u64 = 3 * 8;

fn first_line(bytes: u64) -> String {
    format!("{MAGIC}{FORMAT}, {bytes:020} bytes\n")
}

/// The line of JSON.
#[derive(Serialize, Deserialize)]
struct Header {
    record: RenderRecord,
    /// The number of pixels that have their own radius.
    pixel_radii: u64,
    has_splats: bool,
}

impl Header {
    /// The number of bytes of sums and radii that follow this header; None if it overflows.
    fn bytes(&self) -> Option<u64> {
        self.pixel_radii.checked_mul(RADIUS)?.checked_add(self.record.identity.frame.bytes(self.has_splats)?)
    }
}

impl RenderRecord {
    /// Writes the checkpoint with its sums. The file is replaced as a whole or not at all.
    ///
    /// # Errors
    /// If the file cannot be written. An existing file is then unchanged.
    pub fn write(&self, path: &Path, film: &Film, state: &IntegratorState) -> Result<(), FileError> {
        let fault = |error: io::Error| FileError::new(path, error);
        if path.is_dir() {
            return Err(FileError::new(path, "is a folder"));
        }
        let header =
            Header { record: self.clone(), pixel_radii: radii(state).len() as u64, has_splats: film.has_splats() };
        let draft = Draft::new(path).map_err(fault)?;
        match write(draft.file(), &header, film, state) {
            Ok(()) => draft.finish().map_err(fault),
            Err(error) => {
                draft.discard();
                Err(fault(error))
            }
        }
    }
}

fn write(file: &File, header: &Header, film: &Film, state: &IntegratorState) -> io::Result<()> {
    let json = serde_json::to_string(header)? + "\n";
    let sums = header.bytes().ok_or(io::ErrorKind::FileTooLarge)?;
    let mut writer = Hashing { inner: BufWriter::new(file), hash: Sha256::new() };
    writer.write_all(first_line(FIRST + json.len() as u64 + sums + HASH).as_bytes())?;
    writer.write_all(json.as_bytes())?;
    for PixelRadius { squared, photons, squared_distances } in radii(state) {
        [squared, photons, squared_distances].into_iter().try_for_each(|x| writer.write_all(&x.to_le_bytes()))?;
    }
    film.write_sums(&mut writer)?;
    let hash = writer.hash.finalize();
    writer.inner.write_all(&hash)?;
    writer.inner.flush()
}

/// The radii of the pixels in a state.
fn radii(state: &IntegratorState) -> &[PixelRadius] {
    match state {
        IntegratorState::Empty => &[],
        IntegratorState::PixelRadii(radii) => radii,
    }
}

fn read_state(reader: &mut impl Read, pixel_radii: u64) -> io::Result<IntegratorState> {
    if pixel_radii == 0 {
        return Ok(IntegratorState::Empty);
    }
    let mut number = || {
        let mut bytes = [0; 8];
        reader.read_exact(&mut bytes).map(|()| f64::from_le_bytes(bytes))
    };
    let mut radius = || Ok(PixelRadius { squared: number()?, photons: number()?, squared_distances: number()? });
    let radii: io::Result<Vec<_>> = (0..pixel_radii).map(|_| radius()).collect();
    Ok(IntegratorState::PixelRadii(radii?.into()))
}

/// A writer that hashes all bytes that it passes on.
struct Hashing<W> {
    inner: W,
    hash: Sha256,
}

impl<W: Write> Write for Hashing<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let written = self.inner.write(bytes)?;
        self.hash.update(&bytes[..written]);
        Ok(written)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.inner.flush()
    }
}

impl Checkpoint {
    /// Reads a checkpoint. Its length and its hash are checked before its content is used.
    ///
    /// # Errors
    /// If the file cannot be read, or is not a complete checkpoint.
    pub fn read(path: &Path) -> Result<Self, FileError> {
        let fault = |what: &dyn std::fmt::Display| FileError::new(path, what);
        let file = File::open(path).map_err(|error| fault(&error))?;
        let there = file.metadata().map_err(|error| fault(&error))?;
        if !there.is_file() {
            return Err(fault(&if there.is_dir() { "is a folder" } else { "is not a file" }));
        }
        check_length(&file, there.len()).map_err(|what| fault(&what))?;
        check_hash(&file, there.len()).map_err(|what| fault(&what))?;
        read(&file, there.len()).map_err(|what| fault(&what))
    }

    /// Whether a file begins as checkpoints do. The rest may be damaged.
    #[must_use]
    pub fn is_at(path: &Path) -> bool {
        let mut start = Vec::new();
        let read = File::open(path).and_then(|file| file.take(MAGIC.len() as u64).read_to_end(&mut start));
        read.is_ok() && start == MAGIC.as_bytes()
    }
}

/// Checks that a file is a checkpoint of this format and has the length that its first line states.
fn check_length(file: &File, length: u64) -> Result<(), String> {
    let mut start = Vec::new();
    file.take(FIRST).read_to_end(&mut start).map_err(|error| error.to_string())?;
    if start.is_empty() {
        return Err("is empty".into());
    }
    let known = MAGIC.len().min(start.len());
    if start[..known] != MAGIC.as_bytes()[..known] {
        return Err("is not a checkpoint of etendue".into());
    }
    let text = String::from_utf8_lossy(&start[known..]);
    let format = text.split(',').next().unwrap_or_default();
    if text.contains(',') && format != FORMAT {
        return Err(format!("is a checkpoint of format {format}; this program reads format {FORMAT}"));
    }
    if length < FIRST {
        return Err(format!("ends after {length} bytes, in its first line"));
    }
    let said = text.split([',', ' ']).find_map(|word| word.parse().ok().filter(|_| word.len() == 20));
    match said {
        Some(said) if first_line(said).as_bytes() != start => Err("is damaged in its first line".into()),
        None => Err("is damaged in its first line".into()),
        Some(said) if length < said => Err(format!("ends after {length} of {said} bytes")),
        Some(said) if length > said => Err(format!("continues after its {said} bytes, up to {length}")),
        Some(_) => Ok(()),
    }
}

fn check_hash(mut file: &File, length: u64) -> Result<(), String> {
    file.rewind().map_err(|error| error.to_string())?;
    let body = length.saturating_sub(HASH);
    let mut writer = Hashing { inner: io::sink(), hash: Sha256::new() };
    let mut reader = BufReader::with_capacity(1 << 20, file);
    io::copy(&mut reader.by_ref().take(body), &mut writer).map_err(|error| error.to_string())?;
    let mut said = Vec::new();
    reader.read_to_end(&mut said).map_err(|error| error.to_string())?;
    if writer.hash.finalize().as_slice() == said { Ok(()) } else { Err("is damaged: its SHA-256 is not right".into()) }
}

/// Reads a file whose hash is right. Another program may still have made it.
fn read(mut file: &File, length: u64) -> Result<Checkpoint, String> {
    let fault = |error: io::Error| error.to_string();
    file.seek(io::SeekFrom::Start(FIRST)).map_err(fault)?;
    let mut reader = BufReader::with_capacity(1 << 20, file.take(length - FIRST - HASH.min(length - FIRST)));
    let mut json = Vec::new();
    reader.read_until(b'\n', &mut json).map_err(fault)?;
    let header: Header = serde_json::from_slice(&json).map_err(|error| format!("its header is wrong: {error}"))?;
    let expected = header.bytes().and_then(|sums| sums.checked_add(FIRST + HASH + json.len() as u64));
    // Memory is allocated only now, and no more than the file has bytes.
    let frame = &header.record.identity.frame;
    if expected != Some(length) || !frame.is_possible() {
        return Err("its header is wrong: it does not match the length of the file".into());
    }
    let mut film = frame.film().map_err(|error| error.to_string())?;
    let state = read_state(&mut reader, header.pixel_radii).map_err(fault)?;
    film.read_sums(&mut reader, header.has_splats).map_err(fault)?;
    if !film.has_samples(count(&header.record.taken)) {
        return Err("its header is wrong: its sums are of another number of samples".into());
    }
    Ok(Checkpoint { record: header.record, film, state })
}
