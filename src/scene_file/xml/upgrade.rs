//! Files older than version 2.0.0 wrote properties in camelCase. As in Mitsuba 3, their properties are renamed; their
//! tags and plugins are not (`<lookAt>` is an unknown element).

use std::borrow::Cow;

use glam::{DAffine3, DVec3};

use crate::scene_file::{SourceLocation, Value, transform::regular};

use super::refs::{Draft, DraftValue};
use crate::scene_file::fault::ParseFault;

/// The current name of a property of an old file, in a plugin.
pub(super) fn rename<'a>(plugin: &str, name: &'a str) -> Cow<'a, str> {
    let name = underscores(name);
    if plugin == "diffuse" && name == "diffuse_reflectance" { Cow::Borrowed("reflectance") } else { name }
}

/// `toWorld` becomes `to_world` and `intIOR` becomes `int_ior`. A name without a lower-case letter before a capital is
/// not changed.
fn underscores(name: &str) -> Cow<'_, str> {
    let mut result = String::with_capacity(name.len() + 4);
    let (mut before, mut in_word) = (' ', false);
    for c in name.chars() {
        let starts = before.is_ascii_lowercase() && c.is_ascii_uppercase();
        in_word = starts || (in_word && c.is_ascii_uppercase());
        if starts {
            result.push('_');
        }
        result.push(if in_word { c.to_ascii_lowercase() } else { c });
        before = c;
    }
    if result == name { Cow::Borrowed(name) } else { Cow::Owned(result) }
}

/// The four properties that placed an old texture.
const UV: [&str; 4] = ["uoffset", "voffset", "uscale", "vscale"];

/// Replaces the four properties by `to_uv`, which translates first and then scales, as Mitsuba 3 does. Mitsuba 0.6
/// scaled first.
pub(super) fn textures(properties: &mut Vec<Draft>) -> Result<(), (SourceLocation, ParseFault)> {
    let mut numbers = [0.0, 0.0, 1.0, 1.0];
    let mut place = None;
    for (name, number) in UV.iter().zip(&mut numbers) {
        let Some(found) = properties.iter().position(|property| property.name == *name) else { continue };
        let property = properties.remove(found);
        *number = match property.value {
            DraftValue::Ready(Value::Float(value)) => value,
            DraftValue::Ready(Value::Integer(value)) => value as f64,
            _ => {
                let fault = ParseFault::new(format!("\"{name}\" is not a number")).hint("write it as <float>");
                return Err((property.place, fault));
            }
        };
        place = place.or(Some(property.place));
    }
    let Some(place) = place else { return Ok(()) };
    if let Some(property) = properties.iter().find(|property| property.name == "to_uv") {
        let what = "\"to_uv\" beside \"uoffset\", \"voffset\", \"uscale\" or \"vscale\"";
        return Err((property.place.clone(), ParseFault::new(what).hint("keep one of them")));
    }
    let [u, v, us, vs] = numbers;
    let to_uv = DAffine3::from_scale(DVec3::new(us, vs, 1.0)) * DAffine3::from_translation(DVec3::new(u, v, 0.0));
    let to_uv = regular(to_uv).map_err(|fault| (place.clone(), fault))?;
    properties.push(Draft { name: "to_uv".into(), value: DraftValue::Ready(Value::Transform(to_uv)), place });
    Ok(())
}
