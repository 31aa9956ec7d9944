use std::path::{Path, PathBuf};

use roxmltree::Node;

use crate::scene_file::{Spectrum, Value};

use super::{
    element::Element,
    limit,
    reader::{File, OpenFile, Outer, Parent, Reader, Spot},
    refs::DraftValue,
    source::{self, SourceText},
};
use crate::scene_file::fault::ParseFault;

impl Reader {
    /// Adds a search folder for files.
    pub(super) fn path(&mut self, file: &File<'_>, element: &mut Element<'_>, spot: Spot) {
        element.check(file.source, &["value"], &[], &mut self.faults);
        if !element.sound {
            return;
        }
        let folder = PathBuf::from(element.required("value"));
        let fault = if file.included {
            ParseFault::new("a <path> in an included file does not reach the plugins")
                .hint("write it in the scene file")
        } else if spot != Spot::Outermost {
            ParseFault::new("a <path> can only stand directly in the outermost element").hint("move it there")
        } else if !self.folder.join(&folder).is_dir() {
            ParseFault::new(format!("folder \"{}\" not found", folder.display()))
                .hint("it is relative to the scene file")
                .on("value")
        } else {
            return self.paths.push(folder);
        };
        self.fault(file, element, fault);
    }

    /// Resolves the file names of plugins against the `<path>`s, the last of which is searched first.
    pub(super) fn apply_paths(&mut self) {
        if self.paths.is_empty() {
            return;
        }
        for property in self.drafts.iter_mut().flat_map(|draft| &mut draft.properties) {
            let name = match &mut property.value {
                DraftValue::Ready(Value::String(name)) if property.name == "filename" => name,
                DraftValue::Ready(Value::Spectrum(Spectrum::File(name))) => name,
                _ => continue,
            };
            let found = self.paths.iter().rev().map(|path| path.join(&*name));
            if let Some(found) = found.into_iter().find(|found| self.folder.join(found).exists()) {
                *name = found.display().to_string();
            }
        }
    }

    /// Reads another file as if its content were written here.
    pub(super) fn include(
        &mut self,
        file: &File<'_>,
        node: Node<'_, '_>,
        element: &mut Element<'_>,
        parent: &mut Parent,
    ) {
        element.check(file.source, &["filename"], &["name"], &mut self.faults);
        if !element.sound {
            self.complete = false;
            return;
        }
        let opened = self.open_include(element.required("filename"));
        let (path, canonical) = match opened {
            Ok(opened) => opened,
            Err(fault) => {
                self.complete = false;
                self.fault(file, element, fault.on("filename"));
                if self.includes > limit::INCLUDES {
                    self.faults.stop();
                }
                return;
            }
        };
        let name = path.display().to_string();
        let text = match source::load(&path, &name, limit::BYTES - self.bytes) {
            Ok(text) => text,
            Err(fault) => {
                self.complete = false;
                return self.faults.report(fault);
            }
        };
        self.bytes += text.len();
        let folder = path.parent().unwrap_or_else(|| Path::new("")).to_owned();
        self.open.push(OpenFile { canonical: Some(canonical), folder });
        if !self.files.contains(&path) {
            self.files.push(path);
        }
        let nesting = file.nesting + node.ancestors().filter(Node::is_element).count();
        let name_here = element.get("name").filter(|name| !name.is_empty());
        self.file(&SourceText::new(&name, &text), Outer { parent: Some(parent), name: name_here, nesting });
        self.open.pop();
    }

    /// Finds an included file; rejects cycles and too many includes.
    fn open_include(&mut self, filename: &str) -> Result<(PathBuf, PathBuf), ParseFault> {
        self.includes += 1;
        if self.includes > limit::INCLUDES {
            return Err(ParseFault::new(format!("more than {} includes", limit::INCLUDES)));
        }
        if self.open.len() >= limit::INCLUDE_DEPTH {
            return Err(ParseFault::new(format!("files include one another more than {} deep", limit::INCLUDE_DEPTH)));
        }
        let around = self.open.iter().rev().map(|file| file.folder.clone());
        let paths = self.paths.iter().rev().map(|path| self.folder.join(path));
        let found = around.chain(paths).map(|folder| folder.join(filename)).find(|path| path.exists());
        let Some((path, canonical)) = found.and_then(|path| path.canonicalize().ok().map(|c| (path, c))) else {
            return Err(ParseFault::new(format!("included file \"{filename}\" not found"))
                .hint("its name is relative to the including file"));
        };
        if self.open.iter().any(|file| file.canonical.as_ref() == Some(&canonical)) {
            return Err(ParseFault::new(format!("\"{filename}\" includes itself")).hint("remove one of the includes"));
        }
        Ok((path, canonical))
    }
}
