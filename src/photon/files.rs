//! Exports photons as PLY and NumPy files.

use super::{EmittedPhotons, Photon, PhotonMapKind};
use crate::film::picture::{automatic_exposure, srgb_byte};

/// The position of a photon, the photon, and the index of its map.
type FileRecord<'h> = (&'h [f32; 3], &'h Photon, u8);

fn all<'h>(maps: &[(PhotonMapKind, &'h EmittedPhotons)]) -> impl Iterator<Item = FileRecord<'h>> {
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
fn push_vectors(bytes: &mut Vec<u8>, (position, photon, _): FileRecord<'_>) {
    push_floats(bytes, *position);
    push_floats(bytes, photon.power().as_vec3().to_array());
    push_floats(bytes, photon.direction().as_vec3().to_array());
}

/// Writes the class, the number of bounces and the map.
fn push_numbers(bytes: &mut Vec<u8>, (_, photon, map): FileRecord<'_>) {
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

/// The fields of the structured array.
const NPY_FIELDS: &str = "[('position', '<f4', (3,)), ('power', '<f4', (3,)), ('direction', '<f4', (3,)), \
                          ('class', '|u1'), ('bounces', '<u2'), ('map', '|u1')]";

/// A `NumPy` file, version 1.0 of numpy.lib.format, with a structured array of all photons.
#[must_use]
pub fn npy(maps: &[(PhotonMapKind, &EmittedPhotons)]) -> Vec<u8> {
    const PREFIX: &[u8] = b"\x93NUMPY\x01\x00";
    let header = format!("{{'descr': {NPY_FIELDS}, 'fortran_order': False, 'shape': ({},), }}", count(maps));
    // Blanks and a line's end fill the header, so that the data begins at a multiple of 64 bytes.
    let before = PREFIX.len() + size_of::<u16>();
    let length = (before + header.len() + 1).next_multiple_of(64) - before;
    let mut bytes = PREFIX.to_vec();
    bytes.extend((length as u16).to_le_bytes());
    bytes.extend(format!("{header:<width$}\n", width = length - 1).into_bytes());
    for kept in all(maps) {
        push_vectors(&mut bytes, kept);
        push_numbers(&mut bytes, kept);
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
        let (header, data) = bytes.split_at(256);
        // As numpy.lib.format of numpy 2.4 writes it.
        let expected = "{'descr': [('position', '<f4', (3,)), ('power', '<f4', (3,)), ('direction', '<f4', (3,)), \
                        ('class', '|u1'), ('bounces', '<u2'), ('map', '|u1')], 'fortran_order': False, 'shape': (2,), }";
        assert_eq!(header[..10], *b"\x93NUMPY\x01\x00\xf6\x00");
        assert_eq!(str::from_utf8(&header[10..]), Ok(format!("{expected:<245}\n").as_str()));
        assert_eq!(data.len(), 2 * 40);
        assert_eq!(bytes[bytes.len() - 4..], [PathClass::Caustic as u8, 1, 0, 0]);
    }

    #[test]
    fn a_file_without_photons_has_only_a_header() {
        assert!(ply(&[]).ends_with(b"end_header\n"));
        assert_eq!(npy(&[]).len(), 256);
    }
}
