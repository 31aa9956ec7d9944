use std::{collections::HashMap, path::PathBuf, sync::Arc};

use crate::scene_file::{Category, Object, ObjectId, Property, SourceLocation, Value, closest};

use super::limit;
use crate::scene_file::fault::{Faults, ParseFault};

/// An object whose references are not yet resolved.
pub(in crate::scene_file) struct DraftObject {
    pub(in crate::scene_file) category: Category,
    pub(in crate::scene_file) plugin: String,
    pub(in crate::scene_file) id: Option<String>,
    pub(in crate::scene_file) place: SourceLocation,
    pub(in crate::scene_file) properties: Vec<Draft>,
}

/// A property whose reference, if it is one, is not yet resolved.
pub(in crate::scene_file) struct Draft {
    pub(in crate::scene_file) name: String,
    pub(in crate::scene_file) value: DraftValue,
    pub(in crate::scene_file) place: SourceLocation,
}

pub(in crate::scene_file) enum DraftValue {
    Ready(Value),
    Ref(String),
}

/// The ids with their objects and the places where they were given.
#[derive(Default)]
pub(in crate::scene_file) struct Ids(HashMap<String, (ObjectId, SourceLocation)>);

impl Ids {
    /// Gives an id to an object, unless another object has it.
    pub(in crate::scene_file) fn add(
        &mut self,
        id: &str,
        object: ObjectId,
        place: &SourceLocation,
    ) -> Result<(), ParseFault> {
        if let Some((_, previous)) = self.0.get(id) {
            return Err(ParseFault::new(format!("duplicate ID: \"{id}\"")).hint(format!("previous was at {previous}")));
        }
        self.0.insert(id.into(), (object, place.clone()));
        Ok(())
    }

    pub(in crate::scene_file) fn find(&self, id: &str) -> Option<ObjectId> {
        self.0.get(id).map(|(object, _)| *object)
    }

    /// The hint after an unknown id.
    pub(in crate::scene_file) fn hint(&self, id: &str) -> String {
        match closest(id, self.0.keys().map(String::as_str)) {
            Some(near) => format!("did you mean \"{near}\"?"),
            None => format!("no object has id=\"{id}\""),
        }
    }
}

/// Resolves the references, and rejects cycles.
pub(in crate::scene_file) fn resolve(
    drafts: Vec<DraftObject>,
    ids: &Ids,
    folder: &Arc<PathBuf>,
    faults: &mut Faults,
) -> Vec<Object> {
    let mut objects = Vec::with_capacity(drafts.len());
    let mut resolved = true;
    for draft in drafts {
        let mut properties = Vec::with_capacity(draft.properties.len());
        for Draft { name, value, place } in draft.properties {
            let value = match value {
                DraftValue::Ready(value) => value,
                DraftValue::Ref(id) => match ids.find(&id) {
                    Some(object) => Value::Object(object),
                    None => {
                        let fault = ParseFault::new(format!("unresolved reference to \"{id}\"")).hint(ids.hint(&id));
                        faults.push(&place, fault);
                        resolved = false;
                        continue;
                    }
                },
            };
            properties.push(Property { name, value, place });
        }
        let DraftObject { category, plugin, id, place, .. } = draft;
        objects.push(Object { category, plugin, id, place, folder: folder.clone(), properties });
    }
    if resolved {
        check_cycles(&objects, faults);
    }
    objects
}

/// The state of an object in the search for cycles.
#[derive(Clone, Copy, PartialEq)]
enum Mark {
    New,
    /// The object is on the current path of the search.
    Open,
    /// The object is not part of a cycle, and contains this number of levels of objects.
    Done(usize),
}

/// Walks from every object to the objects that it refers to. It uses an explicit stack, because hostile chains of
/// references are as long as the file.
fn check_cycles(objects: &[Object], faults: &mut Faults) {
    let mut marks = vec![Mark::New; objects.len()];
    for start in 0..objects.len() {
        if marks[start] != Mark::New {
            continue;
        }
        // Each entry: an object, its next property, and the levels found below it so far.
        let mut path = vec![(start, 0, 0)];
        marks[start] = Mark::Open;
        while let Some((object, next, levels)) = path.last_mut() {
            let Some(property) = objects[*object].properties.get(*next) else {
                let (object, levels) = (*object, *levels + 1);
                marks[object] = Mark::Done(levels);
                path.pop();
                if let Some((_, _, above)) = path.last_mut() {
                    *above = levels.max(*above);
                }
                if levels > limit::LEVELS {
                    let what = format!("objects are nested through references more than {} levels deep", limit::LEVELS);
                    faults.push(&objects[object].place, ParseFault::new(what).hint("use fewer levels"));
                    return;
                }
                continue;
            };
            *next += 1;
            let Value::Object(ObjectId(child)) = property.value else { continue };
            match marks[child] {
                Mark::New => {
                    marks[child] = Mark::Open;
                    path.push((child, 0, 0));
                }
                Mark::Open => faults.push(&property.place, cycle(objects, &path, child)),
                Mark::Done(below) => *levels = below.max(*levels),
            }
        }
    }
}

fn cycle(objects: &[Object], path: &[(usize, usize, usize)], child: usize) -> ParseFault {
    let name = |i: usize| match &objects[i].id {
        Some(id) => id.clone(),
        None => format!("<{}>", objects[i].category),
    };
    let around = path.iter().map(|(object, ..)| *object).skip_while(|object| *object != child).take(12);
    let names: Vec<_> = around.chain([child]).map(name).collect();
    ParseFault::new(format!("circular reference: {}", names.join(" -> "))).hint("an object cannot contain itself")
}
