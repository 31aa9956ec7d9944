//! Changes to a document before plugins read it, and objects as text.

use super::{Category, Document, Object, ObjectId, Override, Plugin, Property, SourceLocation, Value};

impl Document {
    /// The first child of a category in an object.
    #[must_use]
    pub fn child(&self, parent: ObjectId, category: Category) -> Option<ObjectId> {
        self.object(parent).properties.iter().find_map(|property| match property.value {
            Value::Object(id) if self.object(id).category == category => Some(id),
            _ => None,
        })
    }

    /// Adds an object that can replace `own`: the plugin `name`, one of `plugins`. It takes over the parameters of
    /// `own` that it has too. If `own` wraps other objects of its category, it takes over their parameters as well.
    /// Messages about the new object mention `option`, the text with which the user asked for it.
    pub fn add_stand_in(
        &mut self,
        own: Option<ObjectId>,
        category: Category,
        name: &str,
        plugins: &[&Plugin],
    ) -> ObjectId {
        let known = plugins.iter().find(|plugin| plugin.name == name);
        let has = |param: &str| known.is_some_and(|plugin| plugin.all_params().any(|p| p.name == param));
        let kept = |p: &&Property| !matches!(p.value, Value::Object(_)) && has(&p.name);
        let mut properties: Vec<Property> = Vec::new();
        let mut next = own;
        while let Some(id) = next {
            properties.extend(self.object(id).properties.iter().filter(kept).cloned());
            next = self.child(id, category);
        }
        self.objects.push(Object {
            category,
            plugin: name.to_owned(),
            id: None,
            place: SourceLocation::Override(Override::Plugin { category, name: name.to_owned() }),
            folder: self.object(self.root).folder.clone(),
            properties,
        });
        ObjectId(self.objects.len() - 1)
    }

    /// An object as text that does not depend on the order of its parameters: the name of its plugin with the given
    /// parameters, sorted by name, without those in `left_out`.
    #[must_use]
    pub fn describe(&self, id: ObjectId, left_out: &[&str]) -> String {
        let object = self.object(id);
        let mut parts: Vec<_> = object.properties.iter().filter(|p| !left_out.contains(&p.name.as_str())).collect();
        parts.sort_by(|a, b| a.name.cmp(&b.name));
        let parts = parts.into_iter().map(|property| match &property.value {
            Value::Object(child) => format!(" ({})", self.describe(*child, left_out)),
            value => format!(" {}={}", property.name, text(value)),
        });
        object.plugin.clone() + &parts.collect::<String>()
    }
}

fn text(value: &Value) -> String {
    match value {
        Value::Float(x) => format!("{x:?}"),
        Value::Integer(i) => i.to_string(),
        Value::Boolean(b) => b.to_string(),
        Value::String(s) => s.clone(),
        other => format!("{other:?}"),
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::scene_file::xml;

    #[test]
    fn objects_are_described_in_one_way_only() {
        let described = |integrator: &str| {
            let text = format!(r#"<scene version="3.0.0">{integrator}</scene>"#);
            let document = xml::parse(&text, "test", Path::new(""), &[]).expect("valid XML");
            document.describe(document.child(document.root, Category::Integrator).expect("it is there"), &["seed"])
        };
        let (one, two) = (r#"<integer name="b" value="3"/>"#, r#"<float name="a" value="0.5"/>"#);
        let child = r#"<integrator type="q"><string name="s" value="x"/><integer name="seed" value="1"/></integrator>"#;
        for parts in [[one, two, child], [child, two, one]] {
            let text = format!(r#"<integrator type="p">{}</integrator>"#, parts.concat());
            let parts = described(&text);
            assert!(parts == "p (q s=x) a=0.5 b=3", "{parts}");
        }
    }
}
