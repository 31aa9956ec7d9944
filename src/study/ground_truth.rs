//! References: pixels and their uncertainty.

use std::path::Path;

use super::{
    Plan, Study, StudyError, mask,
    spec::{ReferenceSpec, SceneSpec},
};
use crate::{
    comparison::{ComparisonError, ImageEstimate, Reference, Uncertainty},
    film::{Image, exr},
};

/// The reference of a scene.
#[derive(Debug)]
pub(super) struct GroundTruth {
    /// Its name in tables.
    pub(super) name: String,
    /// Columns and rows; None for a constant, which fits any size.
    size: Option<(usize, usize)>,
    /// Pixels row by row; a single pixel for a constant.
    pixels: Vec<[f64; 3]>,
    /// The variance of each pixel; None if unknown.
    pub(super) noise: Option<Vec<[f64; 3]>>,
}

/// Linear pixels, row by row.
#[derive(Clone, Debug)]
pub(super) struct Picture {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) pixels: Vec<[f64; 3]>,
}

impl Picture {
    /// Reads a layer of an image, or the beauty (RGB) if `layer` is None or empty.
    pub(super) fn of(path: &Path, layer: Option<&str>) -> Result<(Self, ImageEstimate), StudyError> {
        let name = path.display().to_string();
        let estimate = ImageEstimate::of_image(&name, &layered(exr::read(path)?, layer, &name)?)?;
        Ok((Self { width: estimate.width, height: estimate.height, pixels: estimate.pixels.clone() }, estimate))
    }
}

/// The image with a layer in place of its beauty. The variances of the beauty are dropped, because they do not apply to
/// the layer.
fn layered(mut image: Image, layer: Option<&str>, name: &str) -> Result<Image, StudyError> {
    let Some(layer) = layer.filter(|layer| !layer.is_empty()) else { return Ok(image) };
    let channels: Option<Vec<_>> = ["R", "G", "B"]
        .into_iter()
        .map(|channel| Some((channel.to_owned(), image.channel(&format!("{layer}.{channel}"))?.to_vec())))
        .collect();
    let lacks = || exr::FileError { file: name.to_owned(), what: format!("has no colour layer \"{layer}\"") };
    image.channels = channels.ok_or_else(lacks)?;
    Ok(image)
}

impl GroundTruth {
    /// Loads the reference of a scene; None if it is not yet rendered.
    pub(super) fn load(study: &Study, plan: &Plan, index: usize) -> Result<Option<Self>, StudyError> {
        let scene = &study.spec.scenes.as_ref()[index];
        let layer = scene.reference_layer.as_ref().or(scene.layer.as_ref()).map(String::as_str);
        match scene.reference.as_ref() {
            ReferenceSpec::Value(value) => Ok(Some(Self {
                name: "closed form".into(),
                size: None,
                pixels: vec![*value],
                noise: Some(vec![[0.0; 3]]),
            })),
            ReferenceSpec::Image(file) => {
                let (picture, estimate) = Picture::of(&study.path(file), layer)?;
                Ok(Some(Self::from_estimate(picture, estimate)))
            }
            ReferenceSpec::Folder(folder) => Self::of_folder(study, scene, folder, layer).map(Some),
            ReferenceSpec::Render(_) => Self::of_runs(plan, index, layer),
        }
    }

    fn from_estimate(picture: Picture, estimate: ImageEstimate) -> Self {
        let noise = match estimate.uncertainty {
            Uncertainty::Pixels(variances) => Some(variances),
            _ => None,
        };
        Self { name: estimate.name, size: Some((picture.width, picture.height)), pixels: picture.pixels, noise }
    }

    fn of_folder(study: &Study, scene: &SceneSpec, folder: &Path, layer: Option<&str>) -> Result<Self, StudyError> {
        let path = study.path(folder);
        let reference = Reference::load(&path)?;
        reference.check_fresh(&path, &study.path(scene.file.as_ref()))?;
        if layer.is_some_and(|layer| !layer.is_empty()) {
            let what =
                "a reference folder has no layers; write reference_layer = \"\" for its beauty, or another reference";
            return Err(study.fault(scene.reference.span().start, what));
        }
        Ok(Self {
            name: path.display().to_string(),
            size: Some((reference.width, reference.height)),
            noise: Some(reference.std_errors.iter().map(|se| se.map(|x| x * x)).collect()),
            pixels: reference.pixels,
        })
    }

    /// The mean of runs. Its noise is the scatter between the runs, or the variances of the image if there is only one
    /// run.
    fn of_runs(plan: &Plan, index: usize, layer: Option<&str>) -> Result<Option<Self>, StudyError> {
        let Some(cell) = plan.cells.iter().find(|cell| cell.scene == index && cell.method.is_none()) else {
            return Ok(None);
        };
        if !cell.runs.iter().all(super::Run::is_made) {
            return Ok(None);
        }
        let runs = cell.runs.iter().map(|run| Picture::of(&run.output, layer)).collect::<Result<Vec<_>, _>>()?;
        let count = runs.len() as f64;
        let mut runs = runs.into_iter();
        let Some((first, estimate)) = runs.next() else { return Ok(None) };
        let mut ground_truth = Self { name: cell.id.clone(), ..Self::from_estimate(first, estimate) };
        let others: Vec<_> = runs.map(|(picture, _)| picture.pixels).collect();
        if others.is_empty() {
            return Ok(Some(ground_truth));
        }
        let first = std::mem::take(&mut ground_truth.pixels);
        let value = |p: usize, c: usize| std::iter::once(&first).chain(&others).map(move |image| image[p][c]);
        let mean = |p, c| value(p, c).sum::<f64>() / count;
        ground_truth.pixels = (0..first.len()).map(|p| [0, 1, 2].map(|c| mean(p, c))).collect();
        let variance = |p, c| {
            let mean = mean(p, c);
            value(p, c).map(|x| (x - mean).powi(2)).sum::<f64>() / (count - 1.0) / count
        };
        ground_truth.noise = Some((0..first.len()).map(|p| [0, 1, 2].map(|c| variance(p, c))).collect());
        Ok(Some(ground_truth))
    }

    /// The reference in the size of a picture, with the mask of the scene.
    ///
    /// # Errors
    /// If the sizes differ, or the mask is empty.
    pub(super) fn fitted(
        &self,
        study: &Study,
        scene: &SceneSpec,
        picture: &Picture,
        name: &str,
    ) -> Result<Target, StudyError> {
        let found = (picture.width, picture.height);
        let expected = self.size.unwrap_or(found);
        if found != expected {
            return Err(ComparisonError::Size { name: name.to_owned(), found, expected }.into());
        }
        let expanded = |values: &[[f64; 3]]| match self.size {
            Some(_) => values.to_vec(),
            None => vec![values[0]; picture.pixels.len()],
        };
        let pixels = expanded(&self.pixels);
        let mask =
            scene.mask.as_ref().map(|spec| (mask::mark(spec.as_ref(), picture.width, &pixels), spec.span().start));
        if let Some((marks, at)) = &mask
            && !marks.contains(&true)
        {
            return Err(study.fault(*at, "the mask contains no pixel of the image"));
        }
        Ok(Target {
            name: self.name.clone(),
            noise: self.noise.as_deref().map(expanded),
            mask: mask.map(|(marks, _)| marks),
            pixels,
        })
    }
}

/// A reference in the size of the images that are compared with it.
#[derive(Debug)]
pub(super) struct Target {
    pub(super) name: String,
    pub(super) pixels: Vec<[f64; 3]>,
    pub(super) noise: Option<Vec<[f64; 3]>>,
    pub(super) mask: Option<Vec<bool>>,
}
