//! What an image should be: pixels, and how uncertain they are.

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
    /// What tables call it.
    pub(super) name: String,
    /// Columns and rows; None where every size will do.
    size: Option<(usize, usize)>,
    /// Pixels row by row; one for all if every size will do.
    pixels: Vec<[f64; 3]>,
    /// The variance of each; None if nobody knows.
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
    /// A layer of an image, or the beauty.
    pub(super) fn of(path: &Path, layer: Option<&str>) -> Result<(Self, ImageEstimate), StudyError> {
        let name = path.display().to_string();
        let side = ImageEstimate::of_image(&name, &layered(exr::read(path)?, layer, &name)?)?;
        Ok((Self { width: side.width, height: side.height, pixels: side.pixels.clone() }, side))
    }
}

/// The image with a layer in place of its beauty, whose variances it does not share.
fn layered(mut image: Image, layer: Option<&str>, name: &str) -> Result<Image, StudyError> {
    let Some(layer) = layer.filter(|layer| !layer.is_empty()) else { return Ok(image) };
    let channels: Option<Vec<_>> = ["R", "G", "B"]
        .into_iter()
        .map(|channel| Some((channel.to_owned(), image.channel(&format!("{layer}.{channel}"))?.to_vec())))
        .collect();
    let lacks = || exr::FileError { file: name.to_owned(), what: format!("has no layer \"{layer}\" of colours") };
    image.channels = channels.ok_or_else(lacks)?;
    Ok(image)
}

impl GroundTruth {
    /// The reference of a scene; None if it is still to be rendered.
    pub(super) fn load(study: &Study, plan: &Plan, index: usize) -> Result<Option<Self>, StudyError> {
        let scene = &study.spec.scenes.as_ref()[index];
        let layer = scene.reference_layer.as_ref().or(scene.layer.as_ref()).map(String::as_str);
        match scene.reference.as_ref() {
            ReferenceSpec::Value(value) => Ok(Some(Self {
                name: "closed spec".into(),
                size: None,
                pixels: vec![*value],
                noise: Some(vec![[0.0; 3]]),
            })),
            ReferenceSpec::Image(file) => {
                let (picture, side) = Picture::of(&study.path(file), layer)?;
                Ok(Some(Self::of_side(picture, side)))
            }
            ReferenceSpec::Folder(folder) => Self::of_folder(study, scene, folder, layer).map(Some),
            ReferenceSpec::Render(_) => Self::of_runs(plan, index, layer),
        }
    }

    fn of_side(picture: Picture, side: ImageEstimate) -> Self {
        let noise = match side.uncertainty {
            Uncertainty::Pixels(variances) => Some(variances),
            _ => None,
        };
        Self { name: side.name, size: Some((picture.width, picture.height)), pixels: picture.pixels, noise }
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

    /// The mean of runs; its noise is known from their scatter, or from the variances of the image if it is one.
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
        let Some((first, side)) = runs.next() else { return Ok(None) };
        let mut ground_truth = Self { name: cell.id.clone(), ..Self::of_side(first, side) };
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

    /// The reference in the size of a picture, with the pixels that count in its mask.
    ///
    /// # Errors
    /// If it has another size, or the mask leaves no pixel.
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
        let error_decomposition = |values: &[[f64; 3]]| match self.size {
            Some(_) => values.to_vec(),
            None => vec![values[0]; picture.pixels.len()],
        };
        let pixels = error_decomposition(&self.pixels);
        let mask =
            scene.mask.as_ref().map(|spec| (mask::mark(spec.as_ref(), picture.width, &pixels), spec.span().start));
        if let Some((marks, at)) = &mask
            && !marks.contains(&true)
        {
            return Err(study.fault(*at, "the mask leaves no pixel of the image"));
        }
        Ok(Target {
            name: self.name.clone(),
            noise: self.noise.as_deref().map(error_decomposition),
            mask: mask.map(|(marks, _)| marks),
            pixels,
        })
    }
}

/// A reference of the size of the images that are held to it.
#[derive(Debug)]
pub(super) struct Target {
    pub(super) name: String,
    pub(super) pixels: Vec<[f64; 3]>,
    pub(super) noise: Option<Vec<[f64; 3]>>,
    pub(super) mask: Option<Vec<bool>>,
}
