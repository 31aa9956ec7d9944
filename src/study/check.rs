//! Reads the file of a study and validates what serde cannot check.

use std::{collections::BTreeSet, fs, path::Path};

use glob::Pattern;
use toml::Spanned;

use super::{
    Study, StudyError,
    spec::{ComparisonSpec, FitSpec, MaskSpec, MethodSpec, Quantity, ReferenceSpec, RendererName, SceneSpec, fault},
};
use crate::film::exr::FileError;

/// The minimum number of runs of a cell for an estimate of its scatter.
const MIN_SEEDS: u32 = 3;
/// The maximum number of seeds of a cell: they have ten bits.
const MAX_SEEDS: u32 = 1024;

impl Study {
    /// Reads the file of a study.
    ///
    /// # Errors
    /// If the file cannot be read, or a value in it is invalid.
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
    spec.comparisons.iter().try_for_each(|comparison| check_comparison(study, comparison))
}

fn not_empty<T>(study: &Study, list: &Spanned<Vec<T>>, what: &str) -> Result<(), StudyError> {
    if list.as_ref().is_empty() {
        Err(study.fault(list.span().start, format!("needs at least one {what}")))
    } else {
        Ok(())
    }
}

fn unique(study: &Study, names: impl Iterator<Item = (String, usize)>, what: &str) -> Result<(), StudyError> {
    let mut ids = BTreeSet::new();
    for (name, at) in names {
        let id = super::plan::identifier(&name);
        if id == super::plan::REFERENCE {
            return Err(study
                .fault(at, "\"reference\" is the reserved name of runs that render a reference; choose another name"));
        }
        if id.is_empty() {
            return Err(study.fault(at, format!("the {what} has a name without letters or digits")));
        }
        if !ids.insert(id) {
            return Err(
                study.fault(at, format!("another {what} is called \"{name}\" too; give each {what} a different name"))
            );
        }
    }
    Ok(())
}

fn check_scene(study: &Study, scene: &SceneSpec) -> Result<(), StudyError> {
    let file = study.path(scene.file.as_ref());
    if !file.is_file() {
        let what = format!("there is no scene {}; paths are relative to the study's folder", file.display());
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
            Err(study.fault(at, "the value of the reference is not finite; write three finite numbers"))
        }
        ReferenceSpec::Render(render) if render.spp == 0 || render.seeds == 0 => {
            Err(study.fault(at, "the reference has no samples; write spp and seeds of 1 or more"))
        }
        _ => scene.mask.as_ref().map_or(Ok(()), |mask| check_mask(study, mask)),
    }
}

fn check_mask(study: &Study, mask: &Spanned<MaskSpec>) -> Result<(), StudyError> {
    let MaskSpec { x, y, above, below } = mask.as_ref();
    let empty = [x, y].into_iter().flatten().any(|[from, to]| from >= to);
    let infinite = [above, below].into_iter().flatten().any(|limit| !limit.is_finite());
    if empty || infinite || (x.is_none() && y.is_none() && above.is_none() && below.is_none()) {
        let what = "the mask is empty or not finite; write x = [first, last + 1], y = [first, last + 1], above = or below = a luminance";
        return Err(study.fault(mask.span().start, what));
    }
    Ok(())
}

fn check_method(study: &Study, method: &MethodSpec) -> Result<(), StudyError> {
    glob(study, &method.scenes)?;
    let here = method.name.span().start;
    if method.renderer == RendererName::Mitsuba && method.integrator.is_none() {
        return Err(
            study.fault(here, "a method of Mitsuba needs an integrator; write, for example, integrator = \"path\"")
        );
    }
    if let Some(spp) = &method.spp
        && *spp.as_ref() == 0
    {
        return Err(study.fault(spp.span().start, "spp is 0; write 1 or more"));
    }
    match &method.vary {
        None if method.spp.is_none() => {
            return Err(study.fault(here, "the number of samples is missing; write vary or spp"));
        }
        Some(vary) => {
            let (at, values) = (vary.values.span().start, vary.values.as_ref());
            let counts = super::plan::is_samples(vary.name.as_ref());
            let sound =
                |x: &f64| *x > 0.0 && x.is_finite() && (!counts || (x.fract() == 0.0 && *x <= f64::from(u32::MAX)));
            if values.is_empty() || !values.iter().all(sound) {
                let what = if counts { "whole numbers from 1" } else { "finite numbers above 0" };
                return Err(study.fault(at, format!("the values of vary must be {what}")));
            }
            if values.windows(2).any(|pair| pair[0] >= pair[1]) {
                return Err(study.fault(at, "the values of vary must be in rising order"));
            }
            if counts && method.spp.is_some() {
                return Err(study.fault(here, "spp is both varied and fixed; leave spp out"));
            }
            if !counts && method.spp.is_none() {
                return Err(study.fault(here, "spp is not varied; write spp, the number of samples per pixel"));
            }
            if method.params.contains_key(vary.name.as_ref()) {
                return Err(study
                    .fault(here, format!("{} is both varied and fixed; leave it out of params", vary.name.as_ref())));
            }
        }
        None => (),
    }
    for (name, scale) in &method.scale {
        let s = scale.as_ref();
        if !(s.at > 0.0 && s.at.is_finite() && s.value > 0.0 && s.value.is_finite() && s.power.is_finite()) {
            let what = format!(
                "the scale of {name} needs finite numbers, with at and value above 0; only power may be negative"
            );
            return Err(study.fault(scale.span().start, what));
        }
        if method.params.contains_key(name) {
            return Err(
                study.fault(scale.span().start, format!("{name} is both scaled and fixed; leave it out of params"))
            );
        }
    }
    Ok(())
}

fn check_fit(study: &Study, fit: &Spanned<FitSpec>) -> Result<(), StudyError> {
    let (at, fit) = (fit.span().start, fit.as_ref());
    check_pattern(study, &fit.methods, study.spec.methods.as_ref().iter().map(|m| m.name.as_ref().clone()), "method")?;
    check_pattern(study, &fit.scenes, study.spec.scenes.as_ref().iter().map(SceneSpec::name), "scene")?;
    let predictions = [fit.slope.is_some(), fit.slope_within.is_some(), fit.finite_n.is_some(), fit.zero];
    if predictions.into_iter().filter(|given| *given).count() > 1 {
        return Err(
            study.fault(at, "a fit has at most one prediction; write one of slope, slope_within, finite_n and zero")
        );
    }
    if fit.y == Quantity::Bias && !fit.zero && fit.finite_n.is_none() {
        return Err(study.fault(at, "bias may be negative and has no logarithm; fit bias_rms, or write zero = true"));
    }
    if fit.zero && !matches!(fit.y, Quantity::Bias | Quantity::BiasSquared) {
        return Err(study.fault(at, "zero = true applies to bias and bias_squared only"));
    }
    let numbers = [fit.slope, fit.half_width].into_iter().flatten();
    let numbers =
        numbers.chain(fit.slope_within.into_iter().chain(fit.range).flatten()).chain(fit.amplitudes.iter().copied());
    if numbers.into_iter().any(|x| !x.is_finite()) {
        return Err(study.fault(at, "a prediction is not finite; write a finite number"));
    }
    if fit.slope_within.into_iter().chain(fit.range).any(|[low, high]| low >= high) {
        return Err(study.fault(at, "the first value of a range must be less than the second"));
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

fn check_comparison(study: &Study, comparison: &Spanned<ComparisonSpec>) -> Result<(), StudyError> {
    let (at, comparison) = (comparison.span().start, comparison.as_ref());
    check_pattern(study, &comparison.scenes, study.spec.scenes.as_ref().iter().map(SceneSpec::name), "scene")?;
    for name in comparison.methods.as_ref().iter().chain(&comparison.expected_lower) {
        if !study.spec.methods.as_ref().iter().any(|method| method.name.as_ref() == name) {
            return Err(study.fault(at, format!("no method is called \"{name}\"")));
        }
    }
    if let Some(lower) = &comparison.expected_lower
        && !comparison.methods.as_ref().contains(lower)
    {
        return Err(study.fault(at, format!("lower = \"{lower}\" is not one of the two methods")));
    }
    if comparison.y == Quantity::Bias {
        return Err(study.fault(at, "bias may be negative and has no logarithm; compare bias_rms"));
    }
    if comparison.at.is_some_and(|x| !(x > 0.0 && x.is_finite())) {
        return Err(study.fault(at, "at must be a finite number above 0"));
    }
    Ok(())
}

fn glob(study: &Study, pattern: &Spanned<String>) -> Result<Pattern, StudyError> {
    let fault =
        |error| study.fault(pattern.span().start, format!("\"{}\" is not a pattern: {error}", pattern.as_ref()));
    Pattern::new(pattern.as_ref()).map_err(fault)
}

/// Checks that a pattern matches at least one name. Otherwise a misspelt name would disable its fit silently.
fn check_pattern(
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

    /// A valid study of a scene that exists.
    fn study() -> String {
        let scene = concat!(env!("CARGO_MANIFEST_DIR"), "/assets/scenes/diffuse-room.xml");
        format!(
            "title = \"t\"\nabout = \"a\"\nseeds = 8\n[[scene]]\nfile = \"{scene}\"\nreference = {{value = [1, 1, 1]}}\n\
             [[method]]\nname = \"path\"\nvary = {{name = \"spp\", values = [1, 4, 16]}}\n\
             [[fit]]\ny = \"rmse\"\nslope = -0.5\n"
        )
    }

    fn error(text: String) -> String {
        let found = Study::parse(Path::new("s.toml"), text).expect_err("the study is invalid").to_string();
        assert!(!found.contains('\n'), "{found}");
        found
    }

    #[test]
    fn valid_studies_are_read() {
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
    fn invalid_studies_are_rejected_with_line_and_column() {
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
            ("[1, 4, 16]", "[1, 4, inf]", "s.toml:9:32: the values of vary must be whole numbers from 1"),
            ("[1, 4, 16]", "[1, 16, 4]", "the values of vary must be in rising order"),
            ("[1, 4, 16]", "[]", "the values of vary must be"),
            ("\"spp\"", "\"lookup_size\"", "spp is not varied; write spp"),
            ("slope = -0.5", "slope = nan", "not finite"),
            ("slope = -0.5", "slope = -0.5\nzero = true", "at most one prediction"),
            ("slope = -0.5", "methods = \"pth\"", "no method matches \"pth\"; there are: path"),
            ("slope = -0.5", "methods = \"[\"", "is not a pattern"),
            ("slope = -0.5", "finite_n = [{progressive_bias = {alpha = 1.5}}]", "alpha is 1.5"),
            ("slope = -0.5", "finite_n = []", "one curve or two"),
            ("y = \"rmse\"", "y = \"error\"", "unknown variant `error`"),
            ("y = \"rmse\"", "y = \"bias\"", "bias may be negative"),
            ("name = \"path\"", "name = \"!\"", "a name without letters"),
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
