use std::process::ExitCode;

use clap::Args;
use etendue::{
    catalogue,
    node::{Kind, Param, Plugin, Preset},
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
    let row = |p: &Param| format!("    {:<24} {:<10} {:<22} {}\n", p.name, kind(p), default(p), about(p));
    let rows: String = plugin.params.iter().map(row).collect();
    format!("{} {}\n    {}\n{rows}", plugin.category, plugin.name, plugin.summary)
}

fn kind(param: &Param) -> String {
    match param.kind {
        Kind::Float => "float".into(),
        Kind::Integer => "integer".into(),
        Kind::Boolean => "boolean".into(),
        Kind::String | Kind::File | Kind::Choice(_) => "string".into(),
        Kind::Rgb => "rgb".into(),
        Kind::Texture => "texture".into(),
        Kind::Point => "point".into(),
        Kind::Transform => "transform".into(),
        Kind::Object(category) => category.tag().into(),
    }
}

fn default(param: &Param) -> String {
    match param.preset {
        Preset::Required => "required".into(),
        Preset::Absent(without) => format!("[{without}]"),
        Preset::Value(value) => value.into(),
    }
}

fn about(param: &Param) -> String {
    match param.kind {
        Kind::Choice(words) => format!("{}: {}", param.about, words.join(", ")),
        _ => param.about.into(),
    }
}
