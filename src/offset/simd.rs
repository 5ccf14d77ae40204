//! Picks the widest vector instructions of the machine at run time. The only `unsafe` of the crate.
//!
//! Each kernel is ONE plain function marked `#[inline(always)]`; the functions here compile it again
//! for each instruction set (`#[target_feature]` reaches only what is inlined). None of them changes
//! the order of the operations or fuses any, so every path gives the same bits. On Arm, NEON belongs to
//! the baseline and needs no choice.

use super::exact::{self, FacetRow};
use super::fold::{self, Band, Way};
use super::scatter::{self, Ball};

/// An instruction set that the kernels are compiled for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Path {
    /// Sixteen `f32` at a time.
    #[cfg(target_arch = "x86_64")]
    Avx512,
    /// Eight `f32` at a time.
    #[cfg(target_arch = "x86_64")]
    Avx2,
    /// What every machine of this architecture has: SSE2 or NEON.
    Baseline,
}

impl Path {
    /// Every path that this machine can take, the widest first.
    pub(super) fn available() -> impl Iterator<Item = Self> {
        [
            #[cfg(target_arch = "x86_64")]
            std::arch::is_x86_feature_detected!("avx512f").then_some(Self::Avx512),
            #[cfg(target_arch = "x86_64")]
            std::arch::is_x86_feature_detected!("avx2").then_some(Self::Avx2),
            Some(Self::Baseline),
        ]
        .into_iter()
        .flatten()
    }

    /// The widest path that this machine can take.
    pub(super) fn best() -> Self {
        Self::available().next().unwrap_or(Self::Baseline)
    }
}

/// [`fold::fold_band`] on a path.
#[allow(unsafe_code, reason = "a function compiled for more than the baseline is unsafe to call")]
pub(super) fn fold_band(path: Path, band: &mut Band) {
    match path {
        // SAFETY: `Path::available` is the only source of this path and has seen AVX-512F.
        #[cfg(target_arch = "x86_64")]
        Path::Avx512 => unsafe { fold_band_avx512(band) },
        // SAFETY: `Path::available` is the only source of this path and has seen AVX2.
        #[cfg(target_arch = "x86_64")]
        Path::Avx2 => unsafe { fold_band_avx2(band) },
        Path::Baseline => fold::fold_band::<1>(band),
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f")]
fn fold_band_avx512(band: &mut Band) {
    fold::fold_band::<2>(band);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn fold_band_avx2(band: &mut Band) {
    fold::fold_band::<2>(band);
}

/// [`scatter::scatter_band`] on a path.
#[allow(unsafe_code, reason = "a function compiled for more than the baseline is unsafe to call")]
pub(super) fn scatter_band(path: Path, band: &mut Band, ball: &Ball, way: Way) -> bool {
    match path {
        // SAFETY: `Path::available` is the only source of this path and has seen AVX-512F.
        #[cfg(target_arch = "x86_64")]
        Path::Avx512 => unsafe { scatter_band_avx512(band, ball, way) },
        // SAFETY: `Path::available` is the only source of this path and has seen AVX2.
        #[cfg(target_arch = "x86_64")]
        Path::Avx2 => unsafe { scatter_band_avx2(band, ball, way) },
        Path::Baseline => scatter::scatter_band(band, ball, way),
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f")]
fn scatter_band_avx512(band: &mut Band, ball: &Ball, way: Way) -> bool {
    scatter::scatter_band(band, ball, way)
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn scatter_band_avx2(band: &mut Band, ball: &Ball, way: Way) -> bool {
    scatter::scatter_band(band, ball, way)
}

/// [`exact::tilt_row`] on a path.
#[allow(unsafe_code, reason = "a function compiled for more than the baseline is unsafe to call")]
pub(super) fn tilt_row(path: Path, row: &mut FacetRow) {
    match path {
        // SAFETY: `Path::available` is the only source of this path and has seen AVX-512F.
        #[cfg(target_arch = "x86_64")]
        Path::Avx512 => unsafe { tilt_row_avx512(row) },
        // SAFETY: `Path::available` is the only source of this path and has seen AVX2.
        #[cfg(target_arch = "x86_64")]
        Path::Avx2 => unsafe { tilt_row_avx2(row) },
        Path::Baseline => exact::tilt_row(row),
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f")]
fn tilt_row_avx512(row: &mut FacetRow) {
    exact::tilt_row(row);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn tilt_row_avx2(row: &mut FacetRow) {
    exact::tilt_row(row);
}
