//! Images of one solid built from different shapes.

use crate::{
    comparison::{ImageEstimate, with_image_configured},
    law::{Check, Effort, Finding, Law},
    render::{Renderer, Replicate},
    stats::Outcome,
    validation::setup::{self, GLASS, path},
};

/// The laws of CSG images.
pub const LAWS: &[Law] = &[Law {
    name: "csg/render-equivalence",
    claim: "A glass sphere built as a quadric, or as the union of two hemispheres with a common face, gives an image that agrees with that \
            of the sphere shape. A value of 0 means agreement.",
    source: "the solids are the same set of points; the verdict must have the power to detect a bias of half a percent (2 % at quick effort)",
    check: Check::Analytic(same_image),
}];

const SPHERE: &str = r#"<shape type="sphere"><float name="radius" value="0.8"/>GLASS</shape>"#;
const QUADRIC: &str = r#"<shape type="quadric"><string name="coefficients" value="1 1 1 0 0 0 0 0 0 -0.64"/>
    <point name="bbox_min" value="-1"/><point name="bbox_max" value="1"/>GLASS</shape>"#;
/// Two hemispheres, cut by an oblique plane and by the same plane reversed.
const HALVES: &str = r#"<shape type="csg"><string name="operation" value="union"/>
    <shape type="csg"><string name="operation" value="intersection"/>
        <shape type="sphere"><float name="radius" value="0.8"/></shape>
        <shape type="plane"><transform name="to_world"><rotate x="0.6" z="0.8" angle="50"/></transform></shape></shape>
    <shape type="csg"><string name="operation" value="intersection"/>
        <shape type="sphere"><float name="radius" value="0.8"/></shape>
        <shape type="plane"><transform name="to_world"><rotate x="1" angle="180"/><rotate x="0.6" z="0.8" angle="50"/></transform></shape>
    </shape>GLASS</shape>"#;

/// A renderer of the solid over a checkered plane in a constant environment.
fn renderer(solid: &str) -> Renderer {
    const SENSOR: &str = r#"<sensor type="perspective"><float name="fov" value="40"/>
        <transform name="to_world"><lookat origin="0.4, 0.6, 3.2" target="0, 0, 0" up="0, 1, 0"/></transform>
        <film type="hdrfilm"><integer name="width" value="48"/><integer name="height" value="32"/><rfilter type="box"/></film></sensor>"#;
    const ROOM: &str = r#"<shape type="plane"><transform name="to_world"><rotate x="1" angle="-90"/><translate y="-0.9"/></transform>
        <bsdf type="diffuse"><texture type="checkerboard" name="reflectance"><rgb name="color0" value="0.8, 0.7, 0.3"/>
        <rgb name="color1" value="0.1, 0.3, 0.5"/></texture></bsdf></shape>
        <emitter type="constant"><rgb name="radiance" value="0.6, 0.8, 1.1"/></emitter>"#;
    setup::renderer(&path(8, 5), SENSOR, &(ROOM.to_owned() + &solid.replace("GLASS", GLASS)))
}

fn same_image(effort: Effort) -> Vec<Finding> {
    const REPLICATES: u64 = 32;
    let (samples, config, scale) = (effort.samples(32), effort.verdict(), effort.falsification());
    let side = |ball: &str, number: u64| {
        ImageEstimate::of_replicates(&renderer(ball), Replicate { seed: 70, number, samples }, REPLICATES)
    };
    let reference = side(SPHERE, 0);
    let compare = |(name, solid, first): (&str, &str, u64)| {
        let ours = side(solid, first);
        let outcome = |ours: &ImageEstimate| {
            let found = with_image_configured(ours, &reference, &config).expect("the images have equal sizes");
            found.verdict.expect("replicates have variance").outcome
        };
        let brighter = outcome(&ours.scaled(scale));
        [
            Finding::error(name, f64::from(outcome(&ours) != Outcome::Agrees), 0.0),
            Finding::error(format!("{name}, times {scale} differs"), f64::from(brighter != Outcome::Differs), 0.0),
        ]
    };
    [("quadric", QUADRIC, REPLICATES), ("two halves", HALVES, 2 * REPLICATES)].into_iter().flat_map(compare).collect()
}
