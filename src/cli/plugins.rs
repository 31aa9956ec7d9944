use std::process::ExitCode;

use clap::Args;
use etendue::{
    catalogue,
    scene_file::{DefaultValue, Param, ParamKind, Plugin},
};

use super::say;

/// Lists what is read from scene files: every plugin with its parameters.
#[derive(Debug, Args)]
pub(crate) struct Plugins {
    /// Only plugins whose category or name contains this.
    filter: Option<String>,
}

impl Plugins {
    pub(crate) fn run(self) -> anyhow::Result<ExitCode> {
        let filter = self.filter.unwrap_or_default();
        let mut found = 0;
        for plugin in catalogue::plugins() {
            if plugin.name.contains(&filter) || plugin.category.tag().contains(&filter) {
                say(page(plugin))?;
                found += 1;
            }
        }
        anyhow::ensure!(found > 0, "no plugin's name or category contains \"{filter}\"");
        Ok(ExitCode::SUCCESS)
    }
}

fn page(plugin: &Plugin) -> String {
    let row = |p: &Param| format!("    {:<24} {:<10} {:<22} {}\n", p.name, kind(p), default(p), description(p));
    let rows: String = plugin.params.iter().map(row).collect();
    format!("{} {}\n    {}\n{rows}", plugin.category, plugin.name, plugin.summary)
}

fn kind(param: &Param) -> String {
    match param.kind {
        ParamKind::Float => "float".into(),
        ParamKind::Integer => "integer".into(),
        ParamKind::Boolean => "boolean".into(),
        ParamKind::String | ParamKind::File | ParamKind::Choice(_) => "string".into(),
        ParamKind::Rgb => "rgb".into(),
        ParamKind::Texture => "texture".into(),
        ParamKind::Point => "point".into(),
        ParamKind::Transform => "transform".into(),
        ParamKind::Mesh => "mesh".into(),
        ParamKind::Object(category) => category.tag().into(),
    }
}

fn default(param: &Param) -> String {
    match param.default {
        DefaultValue::Required => "required".into(),
        DefaultValue::Absent(without) => format!("[{without}]"),
        DefaultValue::Value(value) => value.into(),
    }
}

fn description(param: &Param) -> String {
    match param.kind {
        ParamKind::Choice(words) => format!("{}: {}", param.description, words.join(", ")),
        _ => param.description.into(),
    }
}
