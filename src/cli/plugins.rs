use std::process::ExitCode;

use clap::Args;
use etendue::{
    catalogue,
    scene_file::{Category, DefaultValue, Param, Plugin, closest, mitsuba},
};

use super::say;

/// Lists the plugins of scene files, or prints the manual page of one.
///
/// A manual page has the plugin's formula and source, its parameters with types, ranges and defaults, an example, and
/// the names of the checks that cover it, for etendue verify --only.
#[derive(Debug, Args)]
pub(crate) struct Plugins {
    /// A plugin, such as sppm, for its manual page; or a category, such as bsdf, or a part of a name, for a smaller
    /// table
    name: Option<String>,
    /// Print a Markdown table of the plugins of Mitsuba 3.9: read here, or not
    #[arg(long, conflicts_with = "name")]
    mitsuba: bool,
}

impl Plugins {
    pub(crate) fn run(self) -> anyhow::Result<ExitCode> {
        if self.mitsuba {
            say(catalogue::mitsuba_table().trim_end())?;
            return Ok(ExitCode::SUCCESS);
        }
        let name = self.name.unwrap_or_default();
        let mut pages = catalogue::plugins().filter(|plugin| plugin.name == name).peekable();
        if pages.peek().is_some() {
            pages.try_for_each(|plugin| say(plugin.page()))?;
            return Ok(ExitCode::SUCCESS);
        }
        let is_shown = |plugin: &&Plugin| plugin.name.contains(&name) || plugin.category.tag() == name;
        let mut rows = catalogue::plugins().filter(is_shown).peekable();
        if rows.peek().is_none() {
            anyhow::bail!(unknown(&name));
        }
        rows.try_for_each(|plugin| say(entry(plugin)))?;
        Ok(ExitCode::SUCCESS)
    }
}

/// The error for an unknown plugin, with the name that was probably meant.
fn unknown(name: &str) -> String {
    if let Some(theirs) = mitsuba::PLUGINS.iter().find(|plugin| plugin.name == name) {
        return format!("no {} is called \"{name}\" here; {}", theirs.category, theirs.missing());
    }
    let known = catalogue::plugins().map(|plugin| plugin.name).chain(Category::ALL.map(|(_, tag)| tag));
    match closest(name, known) {
        Some(near) => format!("no plugin is called \"{name}\"; did you mean \"{near}\"?"),
        None => format!("no plugin is called \"{name}\"; etendue plugins lists all"),
    }
}

/// The plugin's part of the table.
fn entry(plugin: &Plugin) -> String {
    let row = |p: &Param| format!("    {:<24} {:<10} {:<22} {}\n", p.name, p.kind.name(), default(p), p.meaning());
    let rows: String = plugin.params.iter().map(row).collect();
    format!("{} {}\n    {}\n{rows}", plugin.category, plugin.name, plugin.summary)
}

fn default(param: &Param) -> String {
    match param.default {
        DefaultValue::Required => "required".into(),
        DefaultValue::Absent(without) => format!("[{without}]"),
        DefaultValue::Value(value) => value.into(),
    }
}
