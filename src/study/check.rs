//! How a study's file is read, and what it says that serde cannot know to be wrong.

use std::{collections::BTreeSet, fs, path::Path};

use glob::Pattern;
use toml::Spanned;

use super::{
    Study, StudyError,
    spec::{ComparisonSpec, FitSpec, MaskSpec, MethodSpec, Quantity, ReferenceSpec, RendererName, SceneSpec, fault},
};
use crate::film::exr::FileError;

/// The fewest runs of a cell from which its scatter is known at all well.
const MIN_SEEDS: u32 = 3;
/// Seeds of a cell have ten bits.
const MAX_SEEDS: u32 = 1024;

impl Study {
    /// Reads the file of a study.
    ///
    /// # Errors
    /// If it cannot be read, or says what a study cannot mean.
    pub fn read(file: &Path) -> Result<Self, StudyError> {
        let text = fs::read_to_string(file).map_err(|error| FileError::new(file, error))?;
        Self::parse(file, text)
    }

    pub(super) fn parse(file: &Path, text: String) -> Result<Self, StudyError> {
        let name = file.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned());
        match toml::from_str(&text) {
            Ok(spec) => {
                let study = Self { file: file.to_owned(), name, text, spec };
                check(&study)?;
                Ok(study)
            }
            Err(error) => {
                let at = error.span().map_or(0, |span| span.start);
                Err(fault(file, &text, at, error.message().replace('\n', "; ")))
            }
        }
    }
}

fn check(study: &Study) -> Result<(), StudyError> {
    let spec = &study.spec;
    let seeds = *spec.seeds.as_ref();
    let at = spec.seeds.span().start;
    if seeds == 0 || seeds > MAX_SEEDS {
        return Err(study.fault(at, format!("seeds is {seeds}; write 1 to {MAX_SEEDS}")));
    }
    if seeds < MIN_SEEDS && !(spec.fits.is_empty() && spec.comparisons.is_empty()) {
        let what = format!(
            "seeds is {seeds}, but [[fit]] and [[compare]] need the scatter between runs; write {MIN_SEEDS} or more"
        );
        return Err(study.fault(at, what));
    }
    if let Some(first) = &spec.first_seed
        && u64::from(seeds) + first.as_ref() > u64::from(MAX_SEEDS)
    {
        let what =
            format!("first_seed + seeds is more than {MAX_SEEDS}; the seeds of a cell are 0 to {}", MAX_SEEDS - 1);
        return Err(study.fault(first.span().start, what));
    }
    not_empty(study, &spec.scenes, "[[scene]]")?;
    not_empty(study, &spec.methods, "[[method]]")?;
    unique(study, spec.scenes.as_ref().iter().map(|scene| (scene.name(), scene.file.span().start)), "scene")?;
    let methods = spec.methods.as_ref().iter();
    unique(study, methods.map(|method| (method.name.as_ref().clone(), method.name.span().start)), "method")?;
    spec.scenes.as_ref().iter().try_for_each(|scene| check_scene(study, scene))?;
    spec.methods.as_ref().iter().try_for_each(|method| check_method(study, method))?;
    spec.fits.iter().try_for_each(|fit| check_fit(study, fit))?;
    spec.comparisons.iter().try_for_each(|comparison| check_contest(study, comparison))
}

fn not_empty<T>(study: &Study, list: &Spanned<Vec<T>>, what: &str) -> Result<(), StudyError> {
    if list.as_ref().is_empty() {
        Err(study.fault(list.span().start, format!("needs a {what} at least")))
    } else {
        Ok(())
    }
}

fn unique(study: &Study, names: impl Iterator<Item = (String, usize)>, what: &str) -> Result<(), StudyError> {
    let mut seen = BTreeSet::new();
    for (name, at) in names {
        let id = super::plan::identifier(&name);
        if id == super::plan::REFERENCE {
            return Err(study.fault(at, "\"reference\" is the name of the runs that make one; choose another"));
        }
        if id.is_empty() {
            return Err(study.fault(at, format!("the {what} has no name of letters or digits")));
        }
        if !seen.insert(id) {
            return Err(study.fault(at, format!("another {what} is called \"{name}\" too; give them different names")));
        }
    }
    Ok(())
}

fn check_scene(study: &Study, scene: &SceneSpec) -> Result<(), StudyError> {
    let file = study.path(scene.file.as_ref());
    if !file.is_file() {
        let what = format!("there is no scene {}; paths start from the study's folder", file.display());
        return Err(study.fault(scene.file.span().start, what));
    }
    let at = scene.reference.span().start;
    match scene.reference.as_ref() {
        ReferenceSpec::Folder(folder) if !study.path(folder).is_dir() => {
            Err(study.fault(at, format!("there is no folder {}", study.path(folder).display())))
        }
        ReferenceSpec::Image(image) if !study.path(image).is_file() => {
            Err(study.fault(at, format!("there is no image {}", study.path(image).display())))
        }
        ReferenceSpec::Value(value) if !value.iter().all(|x| x.is_finite()) => {
            Err(study.fault(at, "the value of the reference is not finite; write three numbers"))
        }
        ReferenceSpec::Render(render) if render.spp == 0 || render.seeds == 0 => {
            Err(study.fault(at, "the reference takes no samples; write spp and seeds of 1 or more"))
        }
        _ => scene.mask.as_ref().map_or(Ok(()), |mask| check_mask(study, mask)),
    }
}

fn check_mask(study: &Study, mask: &Spanned<MaskSpec>) -> Result<(), StudyError> {
    let MaskSpec { x, y, above, below } = mask.as_ref();
    let empty = [x, y].into_iter().flatten().any(|[from, to]| from >= to);
    let infinite = [above, below].into_iter().flatten().any(|limit| !limit.is_finite());
    if empty || infinite || (x.is_none() && y.is_none() && above.is_none() && below.is_none()) {
        let what = "the mask is none; write x = [first, beyond last], y = [...], above = or below = a luminance";
        return Err(study.fault(mask.span().start, what));
    }
    Ok(())
}

fn check_method(study: &Study, method: &MethodSpec) -> Result<(), StudyError> {
    glob(study, &method.scenes)?;
    let here = method.name.span().start;
    if method.renderer == RendererName::Mitsuba && method.integrator.is_none() {
        return Err(study.fault(here, "a method of Mitsuba names its integrator; write integrator = \"path\""));
    }
    if let Some(spp) = &method.spp
        && *spp.as_ref() == 0
    {
        return Err(study.fault(spp.span().start, "spp is 0; write 1 or more"));
    }
    match &method.vary {
        None if method.spp.is_none() => {
            return Err(study.fault(here, "nothing says how much is rendered; write vary or spp"));
        }
        Some(vary) => {
            let (at, values) = (vary.values.span().start, vary.values.as_ref());
            let counts = super::plan::is_samples(vary.name.as_ref());
            let sound =
                |x: &f64| *x > 0.0 && x.is_finite() && (!counts || (x.fract() == 0.0 && *x <= f64::from(u32::MAX)));
            if values.is_empty() || !values.iter().all(sound) {
                let what = if counts { "whole numbers from 1" } else { "finite numbers above 0" };
                return Err(study.fault(at, format!("what is varied takes {what}")));
            }
            if values.windows(2).any(|pair| pair[0] >= pair[1]) {
                return Err(study.fault(at, "what is varied rises from value to value"));
            }
            if counts && method.spp.is_some() {
                return Err(study.fault(here, "spp is varied and fixed; leave spp out"));
            }
            if !counts && method.spp.is_none() {
                return Err(study.fault(here, "spp is not varied; write how many samples a pixel gets"));
            }
            if method.params.contains_key(vary.name.as_ref()) {
                return Err(
                    study.fault(here, format!("{} is varied and fixed; leave it out of params", vary.name.as_ref()))
                );
            }
        }
        None => (),
    }
    for (name, scale) in &method.scale {
        let s = scale.as_ref();
        if !(s.at > 0.0 && s.at.is_finite() && s.value > 0.0 && s.value.is_finite() && s.power.is_finite()) {
            let what =
                format!("{name} is scaled by numbers that are not finite and above 0; only power may be negative");
            return Err(study.fault(scale.span().start, what));
        }
        if method.params.contains_key(name) {
            return Err(study.fault(scale.span().start, format!("{name} is scaled and fixed; leave it out of params")));
        }
    }
    Ok(())
}

fn check_fit(study: &Study, fit: &Spanned<FitSpec>) -> Result<(), StudyError> {
    let (at, fit) = (fit.span().start, fit.as_ref());
    names(study, &fit.methods, study.spec.methods.as_ref().iter().map(|m| m.name.as_ref().clone()), "method")?;
    names(study, &fit.scenes, study.spec.scenes.as_ref().iter().map(SceneSpec::name), "scene")?;
    let predictions = [fit.slope.is_some(), fit.slope_within.is_some(), fit.finite_n.is_some(), fit.zero];
    if predictions.into_iter().filter(|given| *given).count() > 1 {
        return Err(study.fault(at, "a fit has one prediction: slope, slope_within, finite_n or zero"));
    }
    if fit.y == Quantity::Bias && !fit.zero && fit.finite_n.is_none() {
        return Err(study.fault(at, "bias has a sign and no logarithm; fit bias_rms, or write zero = true"));
    }
    if fit.zero && !matches!(fit.y, Quantity::Bias | Quantity::BiasSquared) {
        return Err(study.fault(at, "only bias and bias_squared can be found to be 0"));
    }
    let numbers = [fit.slope, fit.half_width].into_iter().flatten();
    let numbers =
        numbers.chain(fit.slope_within.into_iter().chain(fit.range).flatten()).chain(fit.amplitudes.iter().copied());
    if numbers.into_iter().any(|x| !x.is_finite()) {
        return Err(study.fault(at, "a prediction is not finite; write a number"));
    }
    if fit.slope_within.into_iter().chain(fit.range).any(|[low, high]| low >= high) {
        return Err(study.fault(at, "a range goes from less to more"));
    }
    let curves = fit.finite_n.as_deref().unwrap_or_default();
    if let Some(what) = curves.iter().find_map(super::theory::Curve::fault) {
        return Err(study.fault(at, what));
    }
    if fit.finite_n.is_some() && !(1..=2).contains(&curves.len()) {
        return Err(study.fault(at, "finite_n takes one curve or two"));
    }
    if fit.amplitudes.len() > curves.len() {
        return Err(study.fault(at, "there are more amplitudes than curves"));
    }
    Ok(())
}

fn check_contest(study: &Study, comparison: &Spanned<ComparisonSpec>) -> Result<(), StudyError> {
    let (at, comparison) = (comparison.span().start, comparison.as_ref());
    names(study, &comparison.scenes, study.spec.scenes.as_ref().iter().map(SceneSpec::name), "scene")?;
    for name in comparison.methods.as_ref().iter().chain(&comparison.expected_lower) {
        if !study.spec.methods.as_ref().iter().any(|method| method.name.as_ref() == name) {
            return Err(study.fault(at, format!("no method is called \"{name}\"")));
        }
    }
    if let Some(lower) = &comparison.expected_lower
        && !comparison.methods.as_ref().contains(lower)
    {
        return Err(study.fault(at, format!("lower = \"{lower}\" is none of the two methods")));
    }
    if comparison.y == Quantity::Bias {
        return Err(study.fault(at, "bias has a sign and no logarithm; compare bias_rms"));
    }
    if comparison.at.is_some_and(|x| !(x > 0.0 && x.is_finite())) {
        return Err(study.fault(at, "at is not a finite number above 0"));
    }
    Ok(())
}

fn glob(study: &Study, pattern: &Spanned<String>) -> Result<Pattern, StudyError> {
    let fault =
        |error| study.fault(pattern.span().start, format!("\"{}\" is not a pattern: {error}", pattern.as_ref()));
    Pattern::new(pattern.as_ref()).map_err(fault)
}

/// A pattern must match something: a misspelt name would silence its fit.
fn names(
    study: &Study,
    pattern: &Spanned<String>,
    mut known: impl Iterator<Item = String> + Clone,
    what: &str,
) -> Result<(), StudyError> {
    let glob = glob(study, pattern)?;
    if known.clone().any(|name| glob.matches(&name)) {
        return Ok(());
    }
    let all: Vec<_> = known.by_ref().collect();
    let text = format!("no {what} matches \"{}\"; there are: {}", pattern.as_ref(), all.join(", "));
    Err(study.fault(pattern.span().start, text))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A study that is right, over a file that exists.
    fn study() -> String {
        let scene = concat!(env!("CARGO_MANIFEST_DIR"), "/assets/scenes/diffuse-room.xml");
        format!(
            "title = \"t\"\nabout = \"a\"\nseeds = 8\n[[scene]]\nfile = \"{scene}\"\nreference = {{value = [1, 1, 1]}}\n\
             [[method]]\nname = \"path\"\nvary = {{name = \"spp\", values = [1, 4, 16]}}\n\
             [[fit]]\ny = \"rmse\"\nslope = -0.5\n"
        )
    }

    fn error(text: String) -> String {
        let found = Study::parse(Path::new("s.toml"), text).expect_err("it is wrong").to_string();
        assert!(!found.contains('\n'), "{found}");
        found
    }

    #[test]
    fn what_is_right_is_read() {
        let study = Study::parse(Path::new("a/s.toml"), study()).unwrap();
        assert_eq!((study.name.as_str(), study.title()), ("s", "t"));
    }

    #[test]
    fn the_studies_of_the_project_are_read() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/studies");
        let files = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
        let studies: Vec<_> =
            files.filter(|file| file.extension().is_some_and(|extension| extension == "toml")).collect();
        assert!(studies.len() > 5);
        for file in studies {
            Study::read(&file).unwrap();
        }
    }

    #[test]
    fn what_is_wrong_is_refused_with_its_place() {
        let cases = [
            ("seeds = 8", "seeds = 0", "s.toml:3:9: seeds is 0; write 1 to 1024"),
            ("seeds = 8", "seeds = 2", "s.toml:3:9: seeds is 2, but [[fit]]"),
            ("seeds = 8", "seeds = 8\nfirst_seed = 1020", "s.toml:4:14: first_seed + seeds"),
            ("seeds = 8", "seed = 8", "s.toml:3:1: unknown field `seed`"),
            ("value = [1", "value = [nan", "not finite"),
            ("value = [1, 1, 1]", "folder = \"nowhere\"", "there is no folder nowhere"),
            ("value = [1, 1, 1]", "image = \"none.exr\"", "there is no image none.exr"),
            (
                "value = [1, 1, 1]",
                "ground_truth = 1",
                "unknown variant `ground_truth`, expected one of `folder`, `image`",
            ),
            ("diffuse-room", "no-room", "there is no scene"),
            ("[1, 4, 16]", "[1, 4, inf]", "s.toml:9:32: what is varied takes whole numbers from 1"),
            ("[1, 4, 16]", "[1, 16, 4]", "what is varied rises"),
            ("[1, 4, 16]", "[]", "what is varied takes"),
            ("\"spp\"", "\"lookup_size\"", "spp is not varied; write how many samples"),
            ("slope = -0.5", "slope = nan", "not finite"),
            ("slope = -0.5", "slope = -0.5\nzero = true", "one prediction"),
            ("slope = -0.5", "methods = \"pth\"", "no method matches \"pth\"; there are: path"),
            ("slope = -0.5", "methods = \"[\"", "is not a pattern"),
            ("slope = -0.5", "finite_n = [{progressive_bias = {alpha = 1.5}}]", "alpha is 1.5"),
            ("slope = -0.5", "finite_n = []", "one curve or two"),
            ("y = \"rmse\"", "y = \"error\"", "unknown variant `error`"),
            ("y = \"rmse\"", "y = \"bias\"", "bias has a sign"),
            ("name = \"path\"", "name = \"!\"", "no name of letters"),
        ];
        for (right, wrong, expected) in cases {
            let text = study();
            assert!(text.contains(right), "{right}");
            let found = error(text.replacen(right, wrong, 1));
            assert!(found.contains(expected), "{wrong}: {found}");
        }
        let twice = format!("{}[[method]]\nname = \"Path\"\nspp = 1\n", study());
        assert!(error(twice).contains("s.toml:14:8: another method is called"));
        let comparison = format!("{}[[compare]]\nmethods = [\"path\", \"paths\"]\n", study());
        assert!(error(comparison).contains("no method is called \"paths\""));
    }
}
