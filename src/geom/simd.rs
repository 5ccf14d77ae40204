//! Picks the widest vector instructions of the machine at run time. The only `unsafe` of the crate.
//!
//! Each kernel is ONE plain function marked `#[inline(always)]`; the functions here compile it again
//! for each instruction set (`#[target_feature]` reaches only what is inlined). None of them changes
//! the order of the operations or fuses any, so every path gives the same bits. On Arm, NEON belongs to
//! the baseline and needs no choice.

/// An instruction set that the kernels are compiled for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Path {
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
    pub(crate) fn available() -> impl Iterator<Item = Self> {
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
    pub(crate) fn best() -> Self {
        Self::available().next().unwrap_or(Self::Baseline)
    }
}

/// Work that is worth compiling for each instruction set.
pub(crate) trait Kernel {
    /// What it gives.
    type Out;

    /// Does it. To be marked `#[inline(always)]`, like all that it calls.
    fn run(self) -> Self::Out;
}

/// Runs a kernel on a path.
#[allow(unsafe_code, reason = "a function compiled for more than the baseline is unsafe to call")]
#[inline]
pub(crate) fn run<K: Kernel>(path: Path, kernel: K) -> K::Out {
    match path {
        // SAFETY: `Path::available` is the only source of this path and has seen AVX-512F.
        #[cfg(target_arch = "x86_64")]
        Path::Avx512 => unsafe { run_avx512(kernel) },
        // SAFETY: `Path::available` is the only source of this path and has seen AVX2.
        #[cfg(target_arch = "x86_64")]
        Path::Avx2 => unsafe { run_avx2(kernel) },
        Path::Baseline => kernel.run(),
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f")]
fn run_avx512<K: Kernel>(kernel: K) -> K::Out {
    kernel.run()
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn run_avx2<K: Kernel>(kernel: K) -> K::Out {
    kernel.run()
}
