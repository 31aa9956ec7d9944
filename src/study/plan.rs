//! Cells and runs: the images that a study needs, their seeds, and the commands that render them.

use std::{
    collections::{BTreeMap, BTreeSet},
    path::{Path, PathBuf},
};

use glob::Pattern;
use sha2::{Digest as _, Sha256};

use super::{
    Study, StudyError,
    run::{OtherRenderer, Run},
    spec::{MethodSpec, ReferenceSpec, RendererName, Scalar, SceneSpec},
};
use crate::{film::exr, provenance, scene_file::xml};

/// All cells of a study, in the order of its file.
#[derive(Debug)]
pub struct Plan {
    /// The folder of all results.
    pub folder: PathBuf,
    /// For each scene, the cell of its rendered reference, if any, then the cells of all methods.
    pub cells: Vec<Cell>,
}

/// A scene, a method and one value of the varied parameter; or the reference of a scene.
#[derive(Clone, Debug)]
pub struct Cell {
    /// The name: letters, digits, dots and hyphens.
    pub id: String,
    /// The index of the scene in the study.
    pub(super) scene: usize,
    /// The index of the method in the study; None for a reference.
    pub(super) method: Option<usize>,
    /// The name of the varied parameter.
    pub(super) x_name: String,
    /// The value of the varied parameter.
    pub(super) x: f64,
    pub(super) spp: u32,
    pub(super) parameters: String,
    /// The runs, with independent seeds.
    pub runs: Vec<Run>,
}

/// The method name of runs that render a reference.
pub const REFERENCE: &str = "reference";

/// Whether the varied parameter is the number of samples per pixel. A progressive integrator takes one sample per pass.
pub(super) fn is_samples(name: &str) -> bool {
    matches!(name, "spp" | "passes")
}

/// A name in the form used in names of cells.
pub(super) fn identifier(name: &str) -> String {
    let plain = |c: char| if c.is_ascii_alphanumeric() || c == '.' { c.to_ascii_lowercase() } else { '-' };
    name.chars().map(plain).collect::<String>().trim_matches('-').to_owned()
}

impl Plan {
    /// The plan of a study whose results go into a folder.
    ///
    /// # Errors
    /// If a scene cannot be read, or two cells would share seeds.
    pub fn new(study: &Study, folder: &Path) -> Result<Self, StudyError> {
        let mut cells = Vec::new();
        for (index, scene) in study.spec.scenes.as_ref().iter().enumerate() {
            let builder = Builder { study, folder, index, scene };
            cells.extend(builder.reference()?);
            for (number, method) in study.spec.methods.as_ref().iter().enumerate() {
                let pattern = Pattern::new(method.scenes.as_ref()).expect("patterns were checked");
                if pattern.matches(&scene.name()) {
                    cells.extend(builder.cells(number, method)?);
                }
            }
        }
        let plan = Self { folder: folder.to_owned(), cells };
        plan.check_seeds(study)?;
        Ok(plan)
    }

    /// All runs.
    pub fn runs(&self) -> impl Iterator<Item = &Run> {
        self.cells.iter().flat_map(|cell| &cell.runs)
    }

    /// Checks that no two cells of a scene share seeds: the points of a fit must be independent.
    fn check_seeds(&self, study: &Study) -> Result<(), StudyError> {
        let mut seeds = BTreeSet::new();
        for cell in &self.cells {
            if !cell.runs.iter().all(|run| seeds.insert((cell.scene, run.seed))) {
                let at = study.spec.methods.span().start;
                return Err(study.fault(at, format!("{} shares seeds with another cell; rename its method", cell.id)));
            }
        }
        Ok(())
    }
}

/// Builds the cells of a scene.
struct Builder<'s> {
    study: &'s Study,
    folder: &'s Path,
    index: usize,
    scene: &'s SceneSpec,
}

/// The settings of a run.
struct RunSpec<'m> {
    method: &'m str,
    renderer: RendererName,
    variant: Option<String>,
    integrator: Option<&'m String>,
    sampler: Option<&'m String>,
    params: BTreeMap<String, String>,
    defines: BTreeMap<String, String>,
    spp: u32,
}

impl Builder<'_> {
    /// The cell of the runs that render the reference; None if the reference is not rendered.
    fn reference(&self) -> Result<Option<Cell>, StudyError> {
        let ReferenceSpec::Render(spec) = self.scene.reference.as_ref() else { return Ok(None) };
        let run = RunSpec {
            method: REFERENCE,
            renderer: RendererName::Etendue,
            variant: None,
            integrator: spec.integrator.as_ref(),
            sampler: spec.sampler.as_ref(),
            params: texts(&spec.params),
            defines: self.defines(&spec.defines),
            spp: spec.spp,
        };
        let id = format!("{}.{REFERENCE}", identifier(&self.scene.name()));
        let first = spec.seed.unwrap_or_else(|| first_seed(&id));
        let seeds: Vec<u64> = (first..first.saturating_add(spec.seeds.into())).collect();
        self.cell(id, None, ("spp".into(), f64::from(spec.spp)), &run, &seeds).map(Some)
    }

    fn cells(&self, number: usize, method: &MethodSpec) -> Result<Vec<Cell>, StudyError> {
        let fixed = method.spp.as_ref().map_or(1, |spp| *spp.as_ref());
        let (name, values) = match &method.vary {
            Some(vary) => (vary.name.as_ref().as_str(), vary.values.as_ref().clone()),
            None => ("spp", vec![f64::from(fixed)]),
        };
        values.into_iter().map(|x| self.cell_at(number, method, name, x, fixed)).collect()
    }

    fn cell_at(&self, number: usize, method: &MethodSpec, name: &str, x: f64, fixed: u32) -> Result<Cell, StudyError> {
        let mut params = texts(&method.params);
        let mut defines = self.defines(&method.defines);
        let mut spp = fixed;
        match name.strip_prefix('$') {
            Some(define) => drop(defines.insert(define.to_owned(), x.to_string())),
            None if is_samples(name) => spp = x as u32,
            None => drop(params.insert(name.to_owned(), x.to_string())),
        }
        for (name, scale) in &method.scale {
            params.insert(name.clone(), scale.as_ref().value(x).to_string());
        }
        let spec = RunSpec {
            method: method.name.as_ref(),
            renderer: method.renderer,
            variant: method.variant.clone(),
            integrator: method.integrator.as_ref(),
            sampler: method.sampler.as_ref(),
            params,
            defines,
            spp,
        };
        let id = format!("{}.{}.{x}", identifier(&self.scene.name()), identifier(spec.method));
        let first = first_seed(&id) + self.study.spec.first_seed.as_ref().map_or(0, |first| *first.as_ref());
        let seeds: Vec<u64> = (first..first + u64::from(*self.study.spec.seeds.as_ref())).collect();
        self.cell(id, Some(number), (name.to_owned(), x), &spec, &seeds)
    }

    fn cell(
        &self,
        id: String,
        method: Option<usize>,
        (x_name, x): (String, f64),
        spec: &RunSpec<'_>,
        seeds: &[u64],
    ) -> Result<Cell, StudyError> {
        let file = self.study.path(self.scene.file.as_ref());
        let defines: Vec<(String, String)> = spec.defines.clone().into_iter().collect();
        let document = xml::read(&file, &defines)?;
        let hash = provenance::scene_hash(&document).map_err(|error| exr::FileError::new(&file, error))?;
        let parameters = spec.parameters();
        let header = |seed: u64| {
            let texts = [
                ("etendue.scene_sha256", Some(hash.clone())),
                ("etendue.integrator", spec.integrator.cloned()),
                ("etendue.sampler", spec.sampler.cloned()),
                ("etendue.parameters", Some(parameters.clone())),
                ("etendue.spp", Some(spec.spp.to_string())),
                ("etendue.seed", Some(seed.to_string())),
            ];
            texts.into_iter().filter_map(|(name, text)| Some((name, text?))).collect()
        };
        let ours = spec.renderer == RendererName::Etendue;
        let run = |&seed: &u64| Run {
            cell: id.clone(),
            scene: file.display().to_string(),
            method: spec.method.to_owned(),
            renderer: spec.renderer,
            x,
            seed,
            output: self.folder.join("runs").join(&id).join(format!("seed-{seed}.exr")),
            arguments: ours.then(|| spec.arguments(&file, seed)),
            other: (!ours).then(|| spec.other()),
            header: header(seed),
        };
        let runs = seeds.iter().map(run).collect();
        Ok(Cell { scene: self.index, method, x_name, x, spp: spec.spp, parameters, runs, id })
    }

    /// The scene's parameters. The method's parameters override the scene's.
    fn defines(&self, own: &BTreeMap<String, Scalar>) -> BTreeMap<String, String> {
        let mut all = texts(&self.scene.defines);
        all.extend(texts(own));
        all
    }
}

impl RunSpec<'_> {
    /// The parameters as the header of the image states them.
    fn parameters(&self) -> String {
        let pairs: Vec<_> = self.params.iter().chain(&self.defines).map(|(n, v)| format!("{n}={v}")).collect();
        pairs.join(" ")
    }

    fn arguments(&self, scene: &Path, seed: u64) -> Vec<String> {
        let mut all = vec!["render".to_owned(), scene.display().to_string()];
        let mut add = |flag: &str, value: String| all.extend([flag.to_owned(), value]);
        if let Some(integrator) = self.integrator {
            add("--integrator", integrator.clone());
        }
        if let Some(sampler) = self.sampler {
            add("--sampler", sampler.clone());
        }
        self.params.iter().for_each(|(name, value)| add("--param", format!("{name}={value}")));
        self.defines.iter().for_each(|(name, value)| add("-D", format!("{name}={value}")));
        add("--spp", self.spp.to_string());
        add("--seed", seed.to_string());
        all
    }

    fn other(&self) -> OtherRenderer {
        OtherRenderer {
            integrator: self.integrator.cloned().unwrap_or_default(),
            sampler: self.sampler.cloned(),
            params: self.params.clone(),
            defines: self.defines.clone(),
            variant: self.variant.clone(),
            spp: self.spp,
        }
    }
}

fn texts(values: &BTreeMap<String, Scalar>) -> BTreeMap<String, String> {
    values.iter().map(|(name, value)| (name.clone(), value.to_string())).collect()
}

/// The first of the 1024 seeds of a cell. The upper 22 of 32 bits are a hash of the cell's name. So a cell keeps its
/// seeds when other cells change, and the seeds fit Mitsuba's 32 bits. Cells must not share seeds: the first 16 samples
/// of a pixel are the same at 16 and at 64 samples, so such cells would not be independent.
fn first_seed(cell: &str) -> u64 {
    let hash = Sha256::digest(cell.as_bytes());
    let bits = u32::from_be_bytes([hash[0], hash[1], hash[2], hash[3]]);
    u64::from(bits >> 10) << 10
}

#[cfg(test)]
mod tests {
    use super::*;

    const STUDY: &str = r#"
title = "t"
about = "a"
seeds = 3
first_seed = 5
[[scene]]
name = "Room_1"
file = "assets/scenes/diffuse-room.xml"
reference = {render = {integrator = "path", spp = 64, seeds = 2}}
[[method]]
name = "photons"
integrator = "photonmapper"
spp = 4
params = {lookup_size = 0, kernel = "cone"}
vary = {name = "global_photons", values = [1e3, 8e3]}
scale = {global_lookup_radius = {at = 1e3, value = 0.5, power = -0.3333333333333333}}
[[method]]
name = "mi"
renderer = "mitsuba"
integrator = "path"
vary = {name = "spp", values = [1]}
"#;

    fn plan(text: &str) -> Plan {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("study.toml");
        let study = Study::parse(&file, text.to_owned()).unwrap();
        Plan::new(&study, Path::new("out")).unwrap()
    }

    #[test]
    fn cells_have_commands_and_seeds() {
        let plan = plan(STUDY);
        let ids: Vec<_> = plan.cells.iter().map(|cell| cell.id.as_str()).collect();
        assert_eq!(ids, ["room-1.reference", "room-1.photons.1000", "room-1.photons.8000", "room-1.mi.1"]);
        assert_eq!(plan.runs().count(), 2 + 3 + 3 + 3);
        let run = &plan.cells[2].runs[0];
        let arguments = run.arguments.as_ref().unwrap();
        let tail = "--integrator photonmapper --param global_lookup_radius=0.25 --param global_photons=8000 \
                    --param kernel=cone --param lookup_size=0 --spp 4 --seed";
        assert!(arguments.join(" ").contains(tail), "{arguments:?}");
        assert!(run.output.starts_with("out/runs/room-1.photons.8000"));
        assert_eq!(run.seed % 1024, 5);
        let mitsuba = serde_json::to_value(&plan.cells[3].runs[0]).unwrap();
        assert_eq!((mitsuba["renderer"].as_str(), mitsuba["spp"].as_u64()), (Some("mitsuba"), Some(1)));
        assert!(mitsuba.get("arguments").is_none() && mitsuba["seed"].as_u64() < Some(1 << 32));
    }

    #[test]
    fn a_cell_keeps_its_seeds_when_others_change() {
        let (before, after) = (plan(STUDY), plan(&STUDY.replace("[1e3, 8e3]", "[1e3, 2e3, 8e3]")));
        let seeds = |plan: &Plan, id: &str| {
            plan.cells.iter().find(|cell| cell.id == id).unwrap().runs.iter().map(|r| r.seed).collect::<Vec<_>>()
        };
        for id in ["room-1.reference", "room-1.photons.1000", "room-1.photons.8000"] {
            assert_eq!(seeds(&before, id), seeds(&after, id));
        }
        let mut all: Vec<u64> = after.runs().map(|run| run.seed).collect();
        all.sort_unstable();
        all.dedup();
        assert_eq!(all.len(), after.runs().count());
    }
}
