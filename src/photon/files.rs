//! Exports photons as PLY and NumPy files.

use npyz::{DType, Field, WriteOptions, WriterBuilder as _};

use super::{EmittedPhotons, Photon, PhotonMapKind};
use crate::film::picture::{automatic_exposure, srgb_byte};

/// The position of a photon, the photon, and the index of its map.
type Record<'h> = (&'h [f32; 3], &'h Photon, u8);

fn all<'h>(maps: &[(PhotonMapKind, &'h EmittedPhotons)]) -> impl Iterator<Item = Record<'h>> {
    maps.iter().flat_map(|&(kind, emitted)| {
        emitted.positions.iter().zip(&emitted.photons).map(move |(position, photon)| (position, photon, kind as u8))
    })
}

fn count(maps: &[(PhotonMapKind, &EmittedPhotons)]) -> usize {
    maps.iter().map(|(_, emitted)| emitted.photons.len()).sum()
}

fn push_floats(bytes: &mut Vec<u8>, values: [f32; 3]) {
    bytes.extend(values.into_iter().flat_map(f32::to_le_bytes));
}

/// Writes the position, power and direction.
fn push_vectors(bytes: &mut Vec<u8>, (position, photon, _): Record<'_>) {
    push_floats(bytes, *position);
    push_floats(bytes, photon.power().as_vec3().to_array());
    push_floats(bytes, photon.direction().as_vec3().to_array());
}

/// Writes the class, the number of bounces and the map.
fn push_numbers(bytes: &mut Vec<u8>, (_, photon, map): Record<'_>) {
    bytes.push(photon.class() as u8);
    bytes.extend((photon.bounces() as u16).to_le_bytes());
    bytes.push(map);
}

const PLY_PROPERTIES: &str = "\
property float x
property float y
property float z
property float power_r
property float power_g
property float power_b
property float dx
property float dy
property float dz
property uchar red
property uchar green
property uchar blue
property uchar class
property ushort bounces
property uchar map
";

/// The bytes of a binary PLY file with a vertex for each photon, whose colour is its tone-mapped power.
#[must_use]
pub fn ply(maps: &[(PhotonMapKind, &EmittedPhotons)]) -> Vec<u8> {
    let powers: Vec<[f32; 3]> = all(maps).map(|(_, photon, _)| photon.power().as_vec3().to_array()).collect();
    let scale = automatic_exposure(&powers).exp2();
    let count = count(maps);
    let mut bytes = format!(
        "ply\nformat binary_little_endian 1.0\ncomment photons: power in W, (dx, dy, dz) towards where they came from\n\
         comment class: 0 direct, 2 caustic, 3 indirect; map: 0 global, 1 caustic\n\
         element vertex {count}\n{PLY_PROPERTIES}end_header\n"
    )
    .into_bytes();
    for record in all(maps) {
        push_vectors(&mut bytes, record);
        bytes.extend(record.1.power().to_array().map(|power| srgb_byte(scale * power)));
        push_numbers(&mut bytes, record);
    }
    bytes
}

/// The bytes of a NumPy file with a structured array of all photons.
#[must_use]
pub fn npy(maps: &[(PhotonMapKind, &EmittedPhotons)]) -> Vec<u8> {
    let plain = |code: &str| DType::Plain(code.parse().expect("a valid type code"));
    let vector = || DType::Array(3, Box::new(plain("<f4")));
    let fields = [
        ("position", vector()),
        ("power", vector()),
        ("direction", vector()),
        ("class", plain("|u1")),
        ("bounces", plain("<u2")),
        ("map", plain("|u1")),
    ];
    let fields = fields.into_iter().map(|(name, dtype)| Field { name: name.into(), dtype }).collect();
    let header = WriteOptions::new_header_only()
        .shape(&[count(maps) as u64])
        .dtype(DType::Record(fields))
        .writer(std::io::Cursor::new(Vec::new()))
        .write_header_only();
    let mut bytes = header.expect("a header can be written to memory").into_inner();
    for record in all(maps) {
        push_vectors(&mut bytes, record);
        push_numbers(&mut bytes, record);
    }
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{math::Rgb, photon::SurfaceSide, transport::PathClass};
    use glam::DVec3;

    fn trace_photons(powers: &[f64]) -> EmittedPhotons {
        let photon = |&w: &f64| {
            Photon::new(Rgb::new(w, 2.0 * w, 0.0), DVec3::X, SurfaceSide::new(DVec3::Z, 3), 2, PathClass::Caustic)
        };
        let photons: Vec<_> = powers.iter().map(photon).collect();
        EmittedPhotons { positions: vec![[1.0, 2.0, 3.0]; powers.len()], photons, ..EmittedPhotons::default() }
    }

    #[test]
    fn the_size_of_a_point_cloud_matches_its_header() {
        let (global, caustic) = (trace_photons(&[1.0, 0.5]), trace_photons(&[2.0]));
        let bytes = ply(&[(PhotonMapKind::Global, &global), (PhotonMapKind::Caustic, &caustic)]);
        let text = String::from_utf8_lossy(&bytes);
        let end = text.find("end_header\n").expect("the header ends") + "end_header\n".len();
        assert!(text[..end].contains("element vertex 3\n"));
        assert_eq!(bytes.len() - end, 3 * 43);
        assert_eq!(bytes[end..end + 4], 1.0_f32.to_le_bytes());
        assert_eq!(bytes[bytes.len() - 4..], [PathClass::Caustic as u8, 1, 0, 1]);
    }

    #[test]
    fn an_array_has_named_fields() {
        let global = trace_photons(&[1.0, 0.5]);
        let bytes = npy(&[(PhotonMapKind::Global, &global)]);
        let file = npyz::NpyFile::new(&bytes[..]).expect("an array");
        assert_eq!(file.shape(), &[2]);
        assert_eq!(file.dtype().num_bytes(), Some(40));
        let names = "position power direction class bounces map".split(' ');
        let DType::Record(fields) = file.dtype() else { panic!("the array has no fields") };
        assert!(fields.iter().map(|field| field.name.as_str()).eq(names));
        assert_eq!(bytes.len() % 8, 0);
        assert_eq!(bytes[bytes.len() - 4..], [PathClass::Caustic as u8, 1, 0, 0]);
    }

    #[test]
    fn a_file_without_photons_has_only_a_header() {
        assert!(ply(&[]).ends_with(b"end_header\n"));
        assert_eq!(npyz::NpyFile::new(&npy(&[])[..]).expect("an array").shape(), &[0]);
    }
}
