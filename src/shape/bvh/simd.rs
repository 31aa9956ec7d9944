//! The AVX2 kernel, and the selection between it and the portable kernel.
//!
//! This is the only module of the hierarchy with `unsafe` code: calls of functions compiled for AVX2, guarded by a
//! token that exists only if the processor supports AVX2, and aligned loads and stores. [`Portable`] gives the same
//! results.
#![allow(unsafe_code)]

use super::{
    Test, Tree,
    traverse::{self, Portable},
};
use crate::math::Ray;

/// [`Bvh::closest_block`] with the fastest kernel that the processor supports.
#[inline]
pub(super) fn closest(tree: &Tree, ray: &Ray, test: impl Test<u32>) -> Option<f64> {
    #[cfg(target_arch = "x86_64")]
    if let Some(kernel) = avx2::Avx2::detected() {
        return kernel.closest(tree, ray, test);
    }
    traverse::closest(Portable, tree, ray, test)
}

/// [`Bvh::any_block`] with the fastest kernel that the processor supports.
#[inline]
pub(super) fn any(tree: &Tree, ray: &Ray, test: impl Test<u32>) -> bool {
    #[cfg(target_arch = "x86_64")]
    if let Some(kernel) = avx2::Avx2::detected() {
        return kernel.any(tree, ray, test);
    }
    traverse::any(Portable, tree, ray, test)
}

#[cfg(target_arch = "x86_64")]
pub(super) mod avx2 {
    use std::arch::x86_64::*;

    use super::super::traverse::{self, Kernel, Slabs};
    use super::super::{Lanes, Node, Test, Tree, WIDTH};
    use crate::math::Ray;

    /// The kernel that tests eight boxes in one register. A value of this type exists only on processors with AVX2, and
    /// with BMI1 and POPCNT, which are older.
    #[derive(Clone, Copy)]
    pub(in super::super) struct Avx2(());

    impl Avx2 {
        /// The kernel, if this processor supports it.
        #[inline]
        pub(in super::super) fn detected() -> Option<Self> {
            (is_x86_feature_detected!("avx2") && is_x86_feature_detected!("bmi1") && is_x86_feature_detected!("popcnt"))
                .then_some(Self(()))
        }

        #[inline]
        pub(in super::super) fn closest(self, tree: &Tree, ray: &Ray, test: impl Test<u32>) -> Option<f64> {
            // SAFETY: an `Avx2` exists only if its features were detected.
            unsafe { closest(self, tree, ray, test) }
        }

        #[inline]
        pub(in super::super) fn any(self, tree: &Tree, ray: &Ray, test: impl Test<u32>) -> bool {
            // SAFETY: an `Avx2` exists only if its features were detected.
            unsafe { any(self, tree, ray, test) }
        }
    }

    impl Kernel for Avx2 {
        #[inline(always)]
        fn intersect(self, node: &Node, slabs: &Slabs, limit: f32) -> (Lanes, u32) {
            // SAFETY: an `Avx2` exists only if its features were detected.
            unsafe { intersect(node, slabs, limit) }
        }
    }

    #[target_feature(enable = "avx2,bmi1,popcnt")]
    fn closest(kernel: Avx2, tree: &Tree, ray: &Ray, test: impl Test<u32>) -> Option<f64> {
        traverse::closest(kernel, tree, ray, test)
    }

    #[target_feature(enable = "avx2,bmi1,popcnt")]
    fn any(kernel: Avx2, tree: &Tree, ray: &Ray, test: impl Test<u32>) -> bool {
        traverse::any(kernel, tree, ray, test)
    }

    #[inline]
    #[target_feature(enable = "avx2,bmi1,popcnt")]
    fn load(lanes: &Lanes) -> __m256 {
        // SAFETY: `Lanes` are eight `f32`, aligned to 32 bytes.
        unsafe { _mm256_load_ps(lanes.0.as_ptr()) }
    }

    #[inline]
    #[target_feature(enable = "avx2,bmi1,popcnt")]
    fn intersect(node: &Node, slabs: &Slabs, limit: f32) -> (Lanes, u32) {
        let mut entry = _mm256_set1_ps(slabs.start);
        let mut exit = _mm256_set1_ps(limit);
        for axis in 0..3 {
            let down = slabs.is_down[axis] as usize;
            let enters = _mm256_sub_ps(load(&node.planes[axis][down]), _mm256_set1_ps(slabs.near_origin[axis]));
            let leaves = _mm256_sub_ps(load(&node.planes[axis][1 - down]), _mm256_set1_ps(slabs.far_origin[axis]));
            // If the first operand is NaN, the result is the second one.
            entry = _mm256_max_ps(_mm256_mul_ps(enters, _mm256_set1_ps(slabs.near_inverse[axis])), entry);
            exit = _mm256_min_ps(_mm256_mul_ps(leaves, _mm256_set1_ps(slabs.far_inverse[axis])), exit);
        }
        let hit = _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LE_OQ>(entry, exit)) as u32;
        let mut lanes = Lanes([0.0; WIDTH]);
        // SAFETY: `Lanes` are eight `f32`, aligned to 32 bytes.
        unsafe { _mm256_store_ps(lanes.0.as_mut_ptr(), entry) };
        (lanes, hit & node.present)
    }
}
