use std::{
    collections::HashMap,
    path::{Path, PathBuf},
    sync::Arc,
};

use roxmltree::Node;

use crate::scene_file::{Category, Document, ObjectId, SceneError, SourceLocation, Value, closest};

use super::{
    element::Element,
    guard::{self, Limits},
    limit,
    params::Parameters,
    refs::{self, Draft, DraftObject, DraftValue, Ids},
    source::{self, SourceText},
    transform::OPERATIONS,
    upgrade,
};
use crate::scene_file::fault::{Faults, ParseFault};

/// The elements that hold a value.
const PROPERTIES: [&str; 9] =
    ["float", "integer", "boolean", "string", "rgb", "spectrum", "point", "vector", "transform"];

/// The elements that are neither objects nor values.
const OTHERS: [&str; 5] = ["ref", "default", "include", "alias", "path"];

/// Reads the scene's text and all files that it includes.
pub(super) fn document(
    text: &str,
    name: &str,
    folder: &Path,
    canonical: Option<PathBuf>,
    definitions: &[(String, String)],
) -> Result<Document, SceneError> {
    let fatal = |fault| SceneError(vec![fault]);
    if text.len() > limit::BYTES {
        return Err(fatal(source::too_large(name)));
    }
    let mut reader = Reader {
        parameters: Parameters::new(definitions).map_err(|fault| fatal(fault.at(None)))?,
        faults: Faults::default(),
        complete: true,
        bytes: text.len(),
        elements: 0,
        includes: 0,
        drafts: Vec::new(),
        ids: Ids::default(),
        folder: Arc::new(folder.to_owned()),
        paths: Vec::new(),
        open: vec![OpenFile { canonical, folder: folder.to_owned() }],
        files: vec![name.into()],
    };
    reader.file(&SourceText::new(name, text), Outer { parent: None, name: None, nesting: 0 });
    reader.finish(definitions)
}

/// The state of the reading.
pub(super) struct Reader {
    pub(super) parameters: Parameters,
    pub(super) faults: Faults,
    /// False once a part was skipped, which may contain what seems to be missing.
    pub(super) complete: bool,
    pub(super) bytes: usize,
    elements: usize,
    pub(super) includes: usize,
    pub(super) drafts: Vec<DraftObject>,
    ids: Ids,
    /// The scene's folder, which the file names of plugins are relative to.
    pub(super) folder: Arc<PathBuf>,
    /// The `<path>`s, relative to that folder.
    pub(super) paths: Vec<PathBuf>,
    /// The files that are being read, outermost first.
    pub(super) open: Vec<OpenFile>,
    pub(super) files: Vec<PathBuf>,
}

pub(super) struct OpenFile {
    pub(super) canonical: Option<PathBuf>,
    pub(super) folder: PathBuf,
}

/// The surroundings of a file.
pub(super) struct Outer<'p> {
    /// The object around its `<include>`; None for the scene file.
    pub(super) parent: Option<&'p mut Parent>,
    /// The `name` of the `<include>`.
    pub(super) name: Option<&'p str>,
    /// The number of elements around it.
    pub(super) nesting: usize,
}

/// The properties of a file that its elements need.
pub(super) struct File<'t> {
    pub(super) source: &'t SourceText<'t>,
    /// Whether the file is older than version 2.0.0.
    old: bool,
    pub(super) included: bool,
    pub(super) nesting: usize,
}

/// An object whose children are being read.
pub(super) struct Parent {
    object: ObjectId,
    plugin: String,
    /// Whether its file is older than version 2.0.0.
    old: bool,
    /// The number of its children without a name.
    unnamed: usize,
    names: HashMap<String, SourceLocation>,
}

/// The position of an element in its file.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Spot {
    /// In the outermost object of its file.
    Outermost,
    /// In an included `<scene>`, of which only the objects are kept.
    Spliced,
    /// Anywhere else.
    Inner,
}

impl Reader {
    fn finish(mut self, definitions: &[(String, String)]) -> Result<Document, SceneError> {
        self.apply_paths();
        let mut objects = Vec::new();
        // A parameter may be used in a part that was skipped, so it is reported as unused only after a complete
        // reading.
        if self.complete && !self.faults.stopped() {
            objects = refs::resolve(std::mem::take(&mut self.drafts), &self.ids, &self.folder, &mut self.faults);
        }
        if self.faults.is_empty() {
            for (name, value) in self.parameters.unused(definitions) {
                let hint = match self.parameters.near(name) {
                    Some(near) => format!("did you mean ${near}?"),
                    None => format!("the scene mentions ${name} nowhere"),
                };
                self.faults.report(ParseFault::new(format!("unused parameter: ${name}={value}")).hint(hint).at(None));
            }
        }
        let files = self.files.clone();
        let document = self.faults.or(Document { objects, root: ObjectId(0), files: self.files });
        document.map_err(|error| error.in_order(&files))
    }

    /// Reads a file. Its root becomes an object; an included scene adds its objects to the surrounding object.
    pub(super) fn file(&mut self, source: &SourceText<'_>, outer: Outer<'_>) {
        let room = Limits { elements: limit::ELEMENTS - self.elements, nesting: limit::NESTING - outer.nesting };
        match guard::check(source.text, room) {
            Ok(elements) => self.elements += elements,
            Err((offset, fault)) => return self.give_up(&source.place(offset), fault),
        }
        match source.tree() {
            Ok(tree) => self.root(tree.root_element(), source, outer),
            Err((place, fault)) => self.give_up(&place, fault),
        }
    }

    fn give_up(&mut self, place: &SourceLocation, fault: ParseFault) {
        self.faults.push(place, fault);
        self.complete = false;
    }

    fn root(&mut self, node: Node<'_, '_>, source: &SourceText<'_>, outer: Outer<'_>) {
        let included = outer.parent.is_some();
        let mut element = Element::new(node, source, &mut self.parameters, &mut self.faults);
        let Some(category) = category(&element) else {
            let fault = ParseFault::new(format!("<{}> cannot be the outermost element", element.tag));
            return self.give_up(&element.place, fault.hint("put it into a <scene version=\"3.0.0\">"));
        };
        let (required, optional): (&[_], &[_]) = match category {
            Category::Scene => (&["version"], &["type", "id", "name"]),
            _ => (&["version", "type"], &["id", "name"]),
        };
        element.check(source, required, optional, &mut self.faults);
        let old = self.version(&element, source);
        let file = File { source, old, included, nesting: outer.nesting };
        if included && element.has("name") {
            let fault = ParseFault::new("the name of an included object has no effect").on("name");
            self.fault(&file, &element, fault.hint("give the name to the <include>"));
        }
        match outer.parent {
            Some(parent) if category == Category::Scene => {
                if outer.name.is_some() {
                    let what = "an included <scene> cannot have a name";
                    self.faults.push(&element.place, ParseFault::new(what).hint("remove the name of its <include>"));
                }
                self.children(&file, node, parent, Spot::Spliced);
            }
            Some(parent) => self.object(&file, node, &element, category, Some((parent, outer.name))),
            None => self.object(&file, node, &element, category, None),
        }
    }

    /// Whether the file is older than version 2.0.0.
    fn version(&mut self, element: &Element<'_>, source: &SourceText<'_>) -> bool {
        let Some(text) = element.get("version") else { return false };
        let parts: Option<Vec<u32>> = text.split('.').map(|part| part.parse().ok()).collect();
        match parts.as_deref() {
            Some([major, _, _]) => *major < 2,
            _ => {
                let fault = ParseFault::new(format!("invalid version number \"{text}\"")).on("version");
                let place = element.place_of(&fault, source);
                self.faults.push(&place, fault.hint("write three numbers like 3.0.0"));
                false
            }
        }
    }

    /// Reads an object with its content, and adds it to the surrounding object under a name.
    fn object(
        &mut self,
        file: &File<'_>,
        node: Node<'_, '_>,
        element: &Element<'_>,
        category: Category,
        around: Option<(&mut Parent, Option<&str>)>,
    ) {
        let plugin = element.get("type").unwrap_or_default();
        if category == Category::Scene && !matches!(plugin, "" | "scene") {
            let fault = ParseFault::new(format!("no scene is called \"{plugin}\"")).on("type");
            self.fault(file, element, fault.hint("a <scene> needs no type"));
        }
        let object = ObjectId(self.drafts.len());
        let id = element.get("id").filter(|id| !id.is_empty());
        if let Some(id) = id
            && let Err(fault) = self.ids.add(id, object, &element.place)
        {
            self.fault(file, element, fault.on("id"));
        }
        if let Some((parent, name)) = around {
            self.add(parent, name, &element.place, DraftValue::Ready(Value::Object(object)));
        }
        let plugin = if category == Category::Scene { "" } else { plugin };
        self.drafts.push(DraftObject {
            category,
            plugin: plugin.into(),
            id: id.map(str::to_owned),
            place: element.place.clone(),
            properties: Vec::new(),
        });
        let mut parent = Parent { object, plugin: plugin.into(), old: file.old, unnamed: 0, names: HashMap::new() };
        let outermost = node.parent().is_some_and(|outer| outer.is_root());
        self.children(file, node, &mut parent, if outermost { Spot::Outermost } else { Spot::Inner });
        if file.old
            && let Err((place, fault)) = upgrade::textures(&mut self.drafts[object.0].properties)
        {
            self.faults.push(&place, fault);
        }
    }

    fn children(&mut self, file: &File<'_>, node: Node<'_, '_>, parent: &mut Parent, spot: Spot) {
        for child in node.children().filter(Node::is_element) {
            if self.faults.stopped() {
                return;
            }
            self.child(file, child, parent, spot);
        }
    }

    /// Reads a child element of an object.
    fn child(&mut self, file: &File<'_>, node: Node<'_, '_>, parent: &mut Parent, spot: Spot) {
        let mut element = Element::new(node, file.source, &mut self.parameters, &mut self.faults);
        let tag = element.tag;
        if let Some(category) = category(&element) {
            if category == Category::Scene {
                let fault =
                    ParseFault::new("a <scene> inside another object").hint("<include> it from a file of its own");
                return self.give_up(&element.place, fault);
            }
            element.check(file.source, &["type"], &["id", "name"], &mut self.faults);
            let name = element.get("name");
            return self.object(file, node, &element, category, Some((parent, name)));
        }
        if spot == Spot::Spliced && (tag == "ref" || PROPERTIES.contains(&tag)) {
            let fault = ParseFault::new(format!("a <{tag}> directly in an included <scene> would be lost"));
            return self.faults.push(&element.place, fault.hint("write it in the including file"));
        }
        match tag {
            "transform" => return self.transform(file, node, element, parent),
            "ref" => self.reference(file, &mut element, parent),
            "default" => self.default(file, &mut element),
            "alias" => self.alias(file, &mut element),
            "path" => self.path(file, &mut element, spot),
            "include" => self.include(file, node, &mut element, parent),
            _ if PROPERTIES.contains(&tag) => self.property(file, &mut element, parent),
            _ => return self.unknown(&element),
        }
        self.childless(file, node);
    }

    /// Reports child elements of an element that cannot have any.
    pub(super) fn childless(&mut self, file: &File<'_>, node: Node<'_, '_>) {
        for child in node.children().filter(Node::is_element) {
            let what = format!("<{}> cannot stand inside <{}>", child.tag_name().name(), node.tag_name().name());
            let place = file.source.place(child.range().start);
            self.give_up(&place, ParseFault::new(what).hint(format!("<{}> holds no elements", node.tag_name().name())));
        }
    }

    fn unknown(&mut self, element: &Element<'_>) {
        let tag = element.tag;
        let fault = if OPERATIONS.contains(&tag) {
            ParseFault::new(format!("<{tag}> can only stand inside a <transform>"))
                .hint(format!("write <transform name=\"to_world\"><{tag} .../></transform>"))
        } else {
            let known = Category::ALL.iter().map(|(_, tag)| *tag).chain(PROPERTIES).chain(OTHERS);
            let fault = ParseFault::new(format!("unknown element <{tag}>"));
            match tag {
                "color" | "srgb" => fault.hint("write <rgb>, whose values are linear"),
                _ => match closest(tag, known.clone().chain(OPERATIONS)) {
                    Some(near) => fault.hint(format!("did you mean <{near}>?")),
                    None => fault.hint(format!("known are {}", known.collect::<Vec<_>>().join(", "))),
                },
            }
        };
        self.give_up(&element.place, fault);
    }

    fn reference(&mut self, file: &File<'_>, element: &mut Element<'_>, parent: &mut Parent) {
        element.check(file.source, &["id"], &["name"], &mut self.faults);
        if element.sound {
            let id = element.required("id").to_owned();
            self.add(parent, element.get("name"), &element.place, DraftValue::Ref(id));
        }
    }

    /// Defines a parameter for the rest of the scene, unless it is already defined.
    fn default(&mut self, file: &File<'_>, element: &mut Element<'_>) {
        element.check(file.source, &["name", "value"], &[], &mut self.faults);
        if !element.sound {
            return;
        }
        if let Err(fault) = self.parameters.define(element.required("name"), element.required("value")) {
            self.fault(file, element, fault);
        }
    }

    /// Adds a second id to an object that was defined before.
    fn alias(&mut self, file: &File<'_>, element: &mut Element<'_>) {
        element.check(file.source, &["id", "as"], &[], &mut self.faults);
        if !element.sound {
            return;
        }
        let id = element.required("id");
        let result = match self.ids.find(id) {
            Some(object) => self.ids.add(element.required("as"), object, &element.place).map_err(|f| f.on("as")),
            None => Err(ParseFault::new(format!("alias source ID \"{id}\" not found"))
                .hint(format!("an alias stands after its object; {}", self.ids.hint(id)))
                .on("id")),
        };
        if let Err(fault) = result {
            self.fault(file, element, fault);
        }
    }

    /// Adds a property that must have a name.
    pub(super) fn named(&mut self, file: &File<'_>, element: &Element<'_>, parent: &mut Parent, value: DraftValue) {
        match element.required("name") {
            "" => self.fault(file, element, ParseFault::new("the name is empty").hint("name the property").on("name")),
            name => self.add(parent, Some(name), &element.place, value),
        }
    }

    /// Adds a property, or a child object, which may do without a name.
    fn add(&mut self, parent: &mut Parent, name: Option<&str>, place: &SourceLocation, value: DraftValue) {
        let name = match name.filter(|name| !name.is_empty()) {
            Some(name) if parent.old => upgrade::rename(&parent.plugin, name).into_owned(),
            Some(name) => name.to_owned(),
            None => {
                parent.unnamed += 1;
                format!("_arg_{}", parent.unnamed - 1)
            }
        };
        if let Some(previous) = parent.names.insert(name.clone(), place.clone()) {
            let fault = ParseFault::new(format!("\"{name}\" is given twice"));
            return self.faults.push(place, fault.hint(format!("previous was at {previous}")));
        }
        self.drafts[parent.object.0].properties.push(Draft { name, value, place: place.clone() });
    }

    pub(super) fn fault(&mut self, file: &File<'_>, element: &Element<'_>, fault: ParseFault) {
        let place = element.place_of(&fault, file.source);
        self.faults.push(&place, fault);
    }
}

/// The category of an object; a `<spectrum>` with a type is a texture.
fn category(element: &Element<'_>) -> Option<Category> {
    match element.tag {
        "spectrum" if element.has("type") => Some(Category::Texture),
        tag => Category::from_tag(tag),
    }
}
