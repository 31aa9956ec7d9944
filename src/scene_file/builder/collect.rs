use std::{
    collections::{HashMap, hash_map},
    path::PathBuf,
    sync::Arc,
};

use super::{
    Entry, ObjectBuilder,
    argument::{Content, checked},
};
use crate::scene_file::{
    Category, Document, ObjectId, SceneError, SourceLocation, Value,
    fault::{Faults, ParseFault},
    xml::refs::{self, Draft, DraftObject, DraftValue, Ids},
};

/// Lays out nested objects one after the other, each before those in it, as the reader of scene files does.
#[derive(Default)]
pub(super) struct Collector {
    drafts: Vec<DraftObject>,
    ids: Ids,
    faults: Faults,
}

impl Collector {
    pub(super) fn document(mut self, root: ObjectBuilder, folder: PathBuf) -> Result<Document, SceneError> {
        let label = label(&root, None);
        self.object(root, &label);
        let objects = refs::resolve(self.drafts, &self.ids, &Arc::new(folder), &mut self.faults);
        self.faults.or(Document { objects, root: ObjectId(0), files: Vec::new() })
    }

    /// Adds an object with its parameters and children. Messages call it by the label.
    fn object(&mut self, object: ObjectBuilder, label: &Arc<str>) -> ObjectId {
        let number = ObjectId(self.drafts.len());
        let place = object.place.for_object(label);
        if let Some(id) = &object.id
            && let Err(fault) = self.ids.add(id, number, &place)
        {
            self.faults.push(&place, fault);
        }
        let (category, plugin, id) = (object.category, object.plugin, object.id);
        self.drafts.push(DraftObject { category, plugin, id, place, properties: Vec::new() });
        let outer = if category == Category::Scene { None } else { Some(label) };
        let labels = labels(&object.entries, outer);
        let mut names = Names::default();
        for (entry, child) in object.entries.into_iter().zip(labels) {
            let place = entry.place.clone().for_object(label);
            match self.property(entry, child, &mut names, &place) {
                Ok(property) => self.drafts[number.0].properties.push(property),
                Err(fault) => self.faults.push(&place, fault),
            }
        }
        number
    }

    /// Adds a property. If it is an object, messages call it `child`.
    fn property(
        &mut self,
        entry: Entry,
        child: Option<Arc<str>>,
        names: &mut Names,
        place: &SourceLocation,
    ) -> Result<Draft, ParseFault> {
        let is_named = entry.name.is_some();
        let name = names.name(entry.name, place)?;
        match self.value(entry.argument.0, child) {
            Ok((value, own_place)) => Ok(Draft { name, value, place: own_place.unwrap_or(place.clone()) }),
            Err(fault) if is_named => Err(ParseFault { what: format!("\"{name}\": {}", fault.what), ..fault }),
            Err(fault) => Err(fault),
        }
    }

    /// The value of a property, and the place of the child object if it is one.
    fn value(
        &mut self,
        content: Content,
        label: Option<Arc<str>>,
    ) -> Result<(DraftValue, Option<SourceLocation>), ParseFault> {
        match content {
            Content::Value(value) => Ok((DraftValue::Ready(checked(value)?), None)),
            Content::Reference(id) => Ok((DraftValue::Ref(id), None)),
            Content::Invalid(fault) => Err(fault),
            Content::Object(object) if object.category == Category::Scene => {
                Err(ParseFault::new("a scene inside another object").hint("add its objects one by one"))
            }
            Content::Object(object) => {
                let id = self.object(*object, &label.expect("every object has a label"));
                let place = self.drafts[id.0].place.clone();
                Ok((DraftValue::Ready(Value::Object(id)), Some(place)))
            }
        }
    }
}

/// The names of an object's properties, and where they were given.
#[derive(Default)]
struct Names {
    given: HashMap<String, SourceLocation>,
    unnamed: usize,
}

impl Names {
    /// The name of the next property.
    fn name(&mut self, name: Option<String>, place: &SourceLocation) -> Result<String, ParseFault> {
        let name = name.unwrap_or_else(|| {
            self.unnamed += 1;
            format!("_arg_{}", self.unnamed - 1)
        });
        if name.is_empty() {
            return Err(ParseFault::new("the name is empty").hint("name the parameter"));
        }
        match self.given.entry(name) {
            hash_map::Entry::Occupied(entry) => {
                let fault = ParseFault::new(format!("\"{}\" is given twice", entry.key()));
                Err(fault.hint(format!("previous was at {}", entry.get())))
            }
            hash_map::Entry::Vacant(entry) => {
                let name = entry.key().clone();
                entry.insert(place.clone());
                Ok(name)
            }
        }
    }
}

/// The labels of the objects among some entries, for messages. Objects without an id are counted from 1 among the
/// objects of their category if there are several.
fn labels(entries: &[Entry], outer: Option<&Arc<str>>) -> Vec<Option<Arc<str>>> {
    let object = |entry: &Entry| match &entry.argument.0 {
        Content::Object(object) => Some(object.category),
        _ => None,
    };
    let mut counts: HashMap<Category, usize> = HashMap::new();
    let mut result = Vec::with_capacity(entries.len());
    for entry in entries {
        let Content::Object(child) = &entry.argument.0 else {
            result.push(None);
            continue;
        };
        let count = counts.entry(child.category).or_default();
        *count += 1;
        let is_one_of_several = entries.iter().filter(|other| object(other) == Some(child.category)).nth(1).is_some();
        let own = label(child, is_one_of_several.then_some(*count));
        result.push(Some(outer.map_or(own.clone(), |outer| format!("{outer} > {own}").into())));
    }
    result
}

fn label(object: &ObjectBuilder, number: Option<usize>) -> Arc<str> {
    let kind = match object.category {
        Category::Scene => "the scene".to_owned(),
        category => format!("{category} \"{}\"", object.plugin),
    };
    match (&object.id, number) {
        (Some(id), _) => format!("{kind} with the id \"{id}\"").into(),
        (None, Some(number)) => format!("{kind} #{number}").into(),
        (None, None) => kind.into(),
    }
}
