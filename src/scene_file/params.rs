use std::{cell::RefCell, path::PathBuf, sync::Arc};

use glam::{DAffine3, DVec3};

use super::{
    Category, DefaultValue, Document, MeshArrays, Object, ObjectId, Param, ParamKind, Plugin, Property, Range,
    SceneError, Spectrum, Value, plugin::number, spelling,
};
use crate::{
    math::Rgb,
    spectrum::{self, Quantity},
};

/// A plugin's view of its own object. It reads parameters according to the plugin's table: it checks types and ranges,
/// and fills in the defaults. At the end it reports properties that were not read.
///
/// # Errors
/// A reader fails if the parameter has another type, is out of its range, or is absent and required.
///
/// # Panics
/// A reader panics if the plugin's table lacks the parameter, which is a bug of the plugin.
pub struct Params<'d> {
    document: &'d Document,
    object: &'d Object,
    plugin: &'static Plugin,
    /// Whether each of `object.properties` was read.
    used: RefCell<Vec<bool>>,
}

impl<'d> Params<'d> {
    /// The view of an object, with the table of its plugin from the given list.
    ///
    /// # Errors
    /// If the object is of another category, or the list has no plugin with its name.
    pub fn of(
        document: &'d Document,
        id: ObjectId,
        category: Category,
        plugins: &[&'static Plugin],
    ) -> Result<Self, SceneError> {
        let object = document.object(id);
        if object.category != category {
            let what = format!(
                "{} \"{}\" is used where {} is needed",
                object.category,
                object.plugin,
                with_article(category.tag())
            );
            return Err(SceneError::at(&object.place, what));
        }
        let Some(plugin) = plugins.iter().find(|plugin| plugin.name == object.plugin) else {
            let (what, hint) = spelling::unknown_plugin(category, &object.plugin, plugins);
            return Err(SceneError::at(&object.place, what).hint(hint));
        };
        Ok(Self { document, object, plugin, used: RefCell::new(vec![false; object.properties.len()]) })
    }

    /// The manual page with the table of parameters.
    #[must_use]
    pub fn plugin(&self) -> &'static Plugin {
        self.plugin
    }

    /// The whole document, to read child objects from.
    #[must_use]
    pub fn document(&self) -> &'d Document {
        self.document
    }

    /// The object itself.
    #[must_use]
    pub fn object(&self) -> &'d Object {
        self.object
    }

    /// A number; an integer is accepted as a float.
    ///
    /// # Errors
    /// If the value is of another type, out of its range, or absent and required. All readers below fail for the same
    /// reasons.
    pub fn float(&self, name: &str) -> Result<f64, SceneError> {
        self.required(name, self.optional_float(name)?)
    }

    /// A number that may be absent.
    pub fn optional_float(&self, name: &str) -> Result<Option<f64>, SceneError> {
        let param = self.param(name);
        let number = match self.find(name) {
            None => default_text(param).map(parse_float),
            Some(Property { value: Value::Float(x), .. }) => Some(*x),
            Some(Property { value: Value::Integer(i), .. }) => Some(*i as f64),
            Some(property) => return Err(self.wrong_type(property, "float")),
        };
        number.map_or(Ok(None), |x| self.in_range(param, x).map(Some))
    }

    /// A whole number.
    pub fn integer(&self, name: &str) -> Result<i64, SceneError> {
        self.required(name, self.optional_integer(name)?)
    }

    /// A whole number that may be absent.
    pub fn optional_integer(&self, name: &str) -> Result<Option<i64>, SceneError> {
        let param = self.param(name);
        let number = match self.find(name) {
            None => default_text(param).map(|text| parse_float(text) as i64),
            Some(Property { value: Value::Integer(i), .. }) => Some(*i),
            Some(property) => return Err(self.wrong_type(property, "integer")),
        };
        if let Some(number) = number {
            self.in_range(param, number as f64)?;
        }
        Ok(number)
    }

    /// A boolean, true or false.
    pub fn boolean(&self, name: &str) -> Result<bool, SceneError> {
        self.required(name, self.optional_boolean(name)?)
    }

    /// A boolean that may be absent.
    pub fn optional_boolean(&self, name: &str) -> Result<Option<bool>, SceneError> {
        match self.find(name) {
            None => Ok(default_text(self.param(name)).map(|text| text == "true")),
            Some(Property { value: Value::Boolean(b), .. }) => Ok(Some(*b)),
            Some(property) => Err(self.wrong_type(property, "boolean")),
        }
    }

    /// A text. The text of a [`ParamKind::Choice`] is one of the choices.
    pub fn string(&self, name: &str) -> Result<&'d str, SceneError> {
        self.required(name, self.optional_string(name)?)
    }

    /// A text that may be absent.
    pub fn optional_string(&self, name: &str) -> Result<Option<&'d str>, SceneError> {
        let param = self.param(name);
        let text = match self.find(name) {
            None => return Ok(default_text(param)),
            Some(Property { value: Value::String(text), .. }) => text,
            Some(property) => return Err(self.wrong_type(property, "string")),
        };
        if let ParamKind::Choice(words) = param.kind
            && !words.contains(&text.as_str())
        {
            let error = self.error(name, format!("\"{name}\" cannot be \"{text}\""));
            return Err(error.hint(spelling::hint(text, words)));
        }
        Ok(Some(text))
    }

    /// A file name. A relative one starts from the folder of the scene file.
    pub fn file(&self, name: &str) -> Result<PathBuf, SceneError> {
        Ok(self.object.folder.join(self.string(name)?))
    }

    /// Linear RGB, each channel within the parameter's range.
    pub fn rgb(&self, name: &str) -> Result<Rgb, SceneError> {
        let colour = match self.find(name) {
            None => default_text(self.param(name)).map(parse_vector),
            Some(property) => Some(self.colour(property)?),
        };
        self.required(name, colour)
    }

    /// The colour in a property, each channel within the parameter's range. A spectrum becomes RGB as in Mitsuba.
    pub fn colour(&self, property: &Property) -> Result<Rgb, SceneError> {
        let rgb = match &property.value {
            Value::Rgb(rgb) => *rgb,
            Value::Float(x) => Rgb::splat(*x),
            Value::Integer(i) => Rgb::splat(*i as f64),
            Value::Spectrum(given) => self.spectrum(property, given)?,
            _ => return Err(self.wrong_type(property, "rgb")),
        };
        let range = self.param(&property.name).range;
        if rgb.to_array().iter().all(|&x| range.contains(x)) {
            return Ok(rgb);
        }
        let what = format!("\"{}\" is [{}]", property.name, rgb.to_array().map(number).join(", "));
        Err(SceneError::at(&property.place, what).hint(format!("each channel must be {}", range.describe())))
    }

    fn spectrum(&self, property: &Property, given: &Spectrum) -> Result<Rgb, SceneError> {
        let quantity = self.quantity(&property.name);
        Ok(match given {
            Spectrum::Uniform(x) => spectrum::uniform_to_rgb(*x, quantity),
            Spectrum::Tabulated(pairs) => spectrum::to_rgb(pairs, quantity),
            Spectrum::File(name) => {
                let pairs = spectrum::read_spd(&self.object.folder.join(name));
                spectrum::to_rgb(&pairs.map_err(|what| SceneError::at(&property.place, what))?, quantity)
            }
        })
    }

    /// What the values of a spectrum are in a parameter.
    #[must_use]
    pub fn quantity(&self, name: &str) -> Quantity {
        match (self.object.category, self.param(name).kind) {
            (Category::Emitter, _) => Quantity::Light,
            (_, ParamKind::Index) => Quantity::Index,
            _ => Quantity::Reflectance,
        }
    }

    /// Three coordinates.
    pub fn point(&self, name: &str) -> Result<DVec3, SceneError> {
        self.required(name, self.optional_point(name)?)
    }

    /// Three coordinates that may be absent, each within the parameter's range.
    pub fn optional_point(&self, name: &str) -> Result<Option<DVec3>, SceneError> {
        let param = self.param(name);
        let point = match self.find(name) {
            None => default_text(param).map(parse_vector),
            Some(Property { value: Value::Vector(v), .. }) => Some(*v),
            Some(property) => return Err(self.wrong_type(property, "point")),
        };
        for x in point.iter().flat_map(|point| point.to_array()) {
            self.in_range(param, x)?;
        }
        Ok(point)
    }

    /// Finite numbers in one text, separated by commas or blanks. There may be any number of them.
    pub fn numbers(&self, name: &str) -> Result<Vec<f64>, SceneError> {
        let parse = |item: &str| {
            let number = item.parse().ok().filter(|x: &f64| x.is_finite());
            number.ok_or_else(|| self.error(name, format!("\"{item}\" in \"{name}\" is not a finite number")))
        };
        let items = self.string(name)?.split(|c: char| c == ',' || c.is_ascii_whitespace());
        items.filter(|item| !item.is_empty()).map(parse).collect()
    }

    /// An affine map; the identity if absent.
    pub fn transform(&self, name: &str) -> Result<DAffine3, SceneError> {
        self.param(name);
        match self.find(name) {
            None => Ok(DAffine3::IDENTITY),
            Some(Property { value: Value::Transform(map), .. }) => Ok(*map),
            Some(property) => Err(self.wrong_type(property, "transform")),
        }
    }

    /// Triangles in arrays.
    pub fn mesh(&self, name: &str) -> Result<&'d Arc<MeshArrays>, SceneError> {
        let arrays = match self.find(name) {
            None => None,
            Some(Property { value: Value::Mesh(arrays), .. }) => Some(arrays),
            Some(property) => return Err(self.wrong_type(property, "mesh")),
        };
        self.required(name, arrays)
    }

    /// The property itself, for values of several types; None if it is absent.
    pub fn find(&self, name: &str) -> Option<&'d Property> {
        self.param(name);
        let index = self.object.properties.iter().position(|p| p.name == name)?;
        self.used.borrow_mut()[index] = true;
        Some(&self.object.properties[index])
    }

    /// The range of a parameter.
    #[must_use]
    pub fn range(&self, name: &str) -> Range {
        self.param(name).range
    }

    /// The child objects of one category under any name, in document order.
    #[must_use]
    pub fn children(&self, category: Category) -> Vec<ObjectId> {
        let mut used = self.used.borrow_mut();
        let mut found = Vec::new();
        for (property, used) in self.object.properties.iter().zip(used.iter_mut()) {
            if let Value::Object(id) = property.value
                && self.document.object(id).category == category
            {
                *used = true;
                found.push(id);
            }
        }
        found
    }

    /// The only child object of a category, if there is one.
    ///
    /// # Errors
    /// If there are several.
    pub fn child(&self, category: Category) -> Result<Option<ObjectId>, SceneError> {
        let children = self.children(category);
        if children.len() > 1 {
            let what = format!("{} can have only one {category}, this has {}", self.called(), children.len());
            let error = SceneError::at(&self.document.object(children[1]).place, what);
            return Err(error.hint("keep one of them"));
        }
        Ok(children.first().copied())
    }

    /// An error about a parameter, at its place, or at the place of the object if the parameter is absent.
    #[must_use]
    pub fn error(&self, name: &str, what: impl Into<String>) -> SceneError {
        let property = self.object.properties.iter().find(|p| p.name == name);
        SceneError::at(property.map_or(&self.object.place, |p| &p.place), what)
    }

    /// Checks that every property was read, and the types of those without an effect.
    ///
    /// # Errors
    /// One fault for each property that was not read, with the names of all parameters.
    pub fn finish(&self) -> Result<(), SceneError> {
        let mut error = SceneError(Vec::new());
        let ignored = self.plugin.params.iter().filter(|param| !param.has_effect);
        // Whoever reads a shared parameter does not read it through this view.
        for param in ignored.chain(self.plugin.category.shared_params()) {
            error.0.extend(self.check_type(param).err().into_iter().flat_map(|wrong| wrong.0));
        }
        for (property, used) in self.object.properties.iter().zip(self.used.borrow().iter()) {
            if !used {
                error.0.extend(self.unused(property).0);
            }
        }
        if error.0.is_empty() { Ok(()) } else { Err(error) }
    }

    /// Checks the type of a parameter that may be absent.
    fn check_type(&self, param: &Param) -> Result<(), SceneError> {
        match param.kind {
            ParamKind::Boolean => self.optional_boolean(param.name).map(drop),
            ParamKind::Integer => self.optional_integer(param.name).map(drop),
            ParamKind::Float => self.optional_float(param.name).map(drop),
            _ => self.optional_string(param.name).map(drop),
        }
    }

    fn unused(&self, property: &Property) -> SceneError {
        if let Value::Object(id) = property.value {
            let child = self.document.object(id);
            let what = format!("{} takes no {} \"{}\"", self.called(), child.category, child.plugin);
            return SceneError::at(&child.place, what);
        }
        let what = format!("{} has no parameter \"{}\"", self.called(), property.name);
        let known: Vec<_> = self.plugin.all_params().map(|p| p.name).collect();
        SceneError::at(&property.place, what).hint(spelling::hint(&property.name, &known))
    }

    /// The kind and the name of the object with an article, such as `a bsdf "mask"`.
    #[must_use]
    pub fn called(&self) -> String {
        match self.plugin.name {
            "" => with_article(self.plugin.category.tag()),
            name => format!("{} \"{name}\"", with_article(self.plugin.category.tag())),
        }
    }

    fn param(&self, name: &str) -> &'static Param {
        let found = self.plugin.all_params().find(|p| p.name == name);
        found.unwrap_or_else(|| panic!("{} reads \"{name}\", which its table lacks", self.called()))
    }

    fn required<T>(&self, name: &str, value: Option<T>) -> Result<T, SceneError> {
        let missing = || SceneError::at(&self.object.place, format!("{} needs \"{name}\"", self.called()));
        value.ok_or_else(|| missing().hint(self.param(name).description))
    }

    fn wrong_type(&self, property: &Property, expected: &str) -> SceneError {
        let what = format!("\"{}\" is {}", property.name, with_article(property.value.type_name()));
        SceneError::at(&property.place, what).hint(format!("must be {}", with_article(expected)))
    }

    fn in_range(&self, param: &Param, x: f64) -> Result<f64, SceneError> {
        if param.range.contains(x) {
            return Ok(x);
        }
        let error = self.error(param.name, format!("\"{}\" is {}", param.name, number(x)));
        Err(error.hint(format!("must be {}", param.range.describe())))
    }
}

fn with_article(word: &str) -> String {
    let article = if word.starts_with(['a', 'e', 'i', 'o', 'u']) { "an" } else { "a" };
    format!("{article} {word}")
}

fn default_text(param: &Param) -> Option<&'static str> {
    match param.default {
        DefaultValue::Value(text) => Some(text),
        DefaultValue::Required | DefaultValue::Absent(_) => None,
    }
}

/// Parses a number of a parameter table. The numbers are constants, and a test parses every one.
fn parse_float(text: &str) -> f64 {
    text.parse().expect("a default in a parameter table is a number")
}

fn parse_vector(text: &str) -> DVec3 {
    let numbers: Vec<f64> = text.split(',').map(|part| parse_float(part.trim())).collect();
    match numbers[..] {
        [x] => DVec3::splat(x),
        [x, y, z] => DVec3::new(x, y, z),
        _ => panic!("a default in a parameter table has one number or three: {text}"),
    }
}
