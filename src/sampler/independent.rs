use super::{Address, Common, PathSampler, SAMPLE_COUNT, SEED, SamplerModel};
use crate::{
    math::rng::Stream,
    scene_file::{Category, Described, Params, Plugin, SceneError, manual},
};

/// Independent uniform random numbers from PCG.
#[derive(Clone, Debug)]
pub struct Independent {
    pub(super) common: Common,
}

impl Default for Independent {
    fn default() -> Self {
        Self { common: Common { sample_count: 4, seed: 0 } }
    }
}

impl Described for Independent {
    const PLUGIN: Plugin = Plugin {
        category: Category::Sampler,
        manual: manual!("independent.rs": "Independent"),
        name: "independent",
        summary: "Independent uniform random numbers; the only sampler for which per-pixel variances are exact.",
        params: &[SAMPLE_COUNT, SEED],
        examples: &[r#"<sampler type="independent"><integer name="sample_count" value="16"/></sampler>"#],
        evidence: &["sampler/variance", "sampler/dimensions", "reference/diffuse-room"],
    };

    fn read(params: &Params<'_>) -> Result<Self, SceneError> {
        Ok(Self { common: Common::read(params)? })
    }
}

impl SamplerModel for Independent {
    fn sample_count(&self) -> u32 {
        self.common.sample_count
    }

    fn seed(&self) -> u64 {
        self.common.seed
    }

    #[inline]
    fn path_sampler(&self, address: &Address) -> PathSampler {
        PathSampler::Independent(Stream::at(&address.of_sample()))
    }

    fn is_open_ended(&self) -> bool {
        true
    }
}
