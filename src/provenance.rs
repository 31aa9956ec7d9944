//! The provenance of an image, for its header.

use std::{fs, io, path::PathBuf};

use sha2::{Digest as _, Sha256};

use crate::scene_file::{Document, Property, Spectrum, Value};

/// The version of this program, with the commit that it was built from, if known.
#[must_use]
pub fn version() -> String {
    match option_env!("ETENDUE_COMMIT") {
        Some(commit) => format!("{} ({commit})", env!("CARGO_PKG_VERSION")),
        None => env!("CARGO_PKG_VERSION").to_owned(),
    }
}

/// The files of a scene: its XML files, the scene file first, then the meshes and textures that it uses, by name.
#[must_use]
pub fn files(document: &Document) -> Vec<PathBuf> {
    let mut others: Vec<PathBuf> = Vec::new();
    for (object, _) in document.objects.iter().zip(document.used()).filter(|(_, is_used)| *is_used) {
        others.extend(object.properties.iter().filter_map(file_name).map(|name| object.folder.join(name)));
    }
    others.sort();
    others.dedup();
    document.files.iter().cloned().chain(others).collect()
}

/// The file that a property names.
fn file_name(property: &Property) -> Option<&str> {
    match &property.value {
        Value::String(file) if property.name == "filename" => Some(file),
        Value::Spectrum(Spectrum::File(file)) => Some(file),
        _ => None,
    }
}

/// The SHA-256 of a file's bytes, in hexadecimal.
///
/// # Errors
/// If it cannot be read.
pub fn hash_of_file(path: &std::path::Path) -> io::Result<String> {
    Ok(hexadecimal(&Sha256::digest(fs::read(path)?)))
}

/// The SHA-256 of the content of a scene, in hexadecimal: of the hashes of all its files, in order. For a scene built
/// in code, all objects and parameters come first.
///
/// # Errors
/// If a file cannot be read.
pub fn scene_hash(document: &Document) -> io::Result<String> {
    let mut all = Sha256::new();
    if document.files.is_empty() {
        for object in &document.objects {
            all.update(format!("{:?} {:?}\n", object.category, object.plugin));
            for property in &object.properties {
                all.update(format!("{:?} {:?}\n", property.name, property.value));
            }
        }
    }
    for file in files(document) {
        all.update(hash_of_file(&file)?);
    }
    Ok(hexadecimal(&all.finalize()))
}

fn hexadecimal(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}
