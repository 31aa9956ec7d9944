use glam::DVec2;

use super::{Address, Common, PathSampler, SAMPLE_COUNT, SEED, SampleStream, SamplerModel};
use crate::{
    math::rng::{hash, permute},
    scene_file::{Category, Described, Params, Plugin, SceneError, manual},
};

/// Sobol points with Owen scrambling: pairs of dimensions are (0, 2)-nets in base 2. They are padded: each pair of
/// dimensions, pixel and replicate has its own scrambling and order. Mitsuba's `ldsampler` also uses scrambled (0,
/// 2)-sequences.
///
/// Burley 2020, "Practical Hash-based Owen Scrambling", JCGT 9(4). The points have 24 bits.
#[derive(Clone, Debug)]
pub struct LowDiscrepancy {
    pub(super) common: Common,
}

impl Described for LowDiscrepancy {
    const PLUGIN: Plugin = Plugin {
        category: Category::Sampler,
        manual: manual!("low_discrepancy.rs": "LowDiscrepancy"),
        name: "ldsampler",
        summary: "Owen-scrambled Sobol points, padded by pairs of dimensions.",
        params: &[SAMPLE_COUNT, SEED],
        examples: &[r#"<sampler type="ldsampler"><integer name="sample_count" value="16"/></sampler>"#],
        evidence: &["sampler/variance", "sampler/dimensions", "reference/moment-still-life"],
    };

    fn read(params: &Params<'_>) -> Result<Self, SceneError> {
        Ok(Self { common: Common::read(params)? })
    }
}

/// The number of distinct Sobol points of the library.
const SEQUENCE: u32 = 1 << 16;

impl SamplerModel for LowDiscrepancy {
    fn sample_count(&self) -> u32 {
        self.common.sample_count
    }

    fn seed(&self) -> u64 {
        self.common.seed
    }

    fn path_sampler(&self, address: &Address) -> PathSampler {
        // Each block of 65,536 samples has its own net.
        let block = u64::from(address.sample / SEQUENCE);
        let length = address.samples.min(SEQUENCE);
        PathSampler::LowDiscrepancy(Sobol {
            pixel: hash(&[hash(&address.of_pixel()), block]),
            sample: address.sample % SEQUENCE,
            length,
            dimension: 0,
        })
    }
}

/// The random numbers of one path.
#[derive(Clone, Debug)]
pub struct Sobol {
    pixel: u64,
    sample: u32,
    length: u32,
    dimension: u64,
}

impl Sobol {
    /// The index of this sample in the permuted order of the next pair of dimensions, and the scrambling of that pair.
    fn next(&mut self) -> (u32, u64) {
        self.dimension += 1;
        let scramble = hash(&[self.pixel, self.dimension]);
        (permute(self.sample, self.length, scramble as u32), scramble)
    }
}

impl SampleStream for Sobol {
    fn next_1d(&mut self) -> f64 {
        let (index, scramble) = self.next();
        f64::from(sobol_burley::sample(index, 0, (scramble >> 32) as u32))
    }

    fn next_2d(&mut self) -> DVec2 {
        let (index, scramble) = self.next();
        let seed = (scramble >> 32) as u32;
        // With one seed, the library scrambles every dimension differently.
        let [x, y] = [0, 1].map(|dimension| f64::from(sobol_burley::sample(index, dimension, seed)));
        DVec2::new(x, y)
    }
}
