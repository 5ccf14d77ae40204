//! The kernels of the offset, each on the instruction set that is asked for.

use super::exact::{self, FacetRow};
use super::fold::{self, Band, Way};
use super::scatter::{self, Ball};
pub(super) use crate::geom::simd::Path;
use crate::geom::simd::{Kernel, run};

/// [`fold::fold_band`] with so many accumulators.
struct Fold<'a, 'b, const N: usize>(&'a mut Band<'b>);

impl<const N: usize> Kernel for Fold<'_, '_, N> {
    type Out = ();

    #[inline(always)]
    fn run(self) {
        fold::fold_band::<N>(self.0);
    }
}

/// [`fold::fold_band`] on a path.
pub(super) fn fold_band(path: Path, band: &mut Band) {
    if path == Path::Baseline { run(path, Fold::<1>(band)) } else { run(path, Fold::<2>(band)) }
}

struct Scatter<'a, 'b>(&'a mut Band<'b>, &'a Ball, Way);

impl Kernel for Scatter<'_, '_> {
    type Out = bool;

    #[inline(always)]
    fn run(self) -> bool {
        scatter::scatter_band(self.0, self.1, self.2)
    }
}

/// [`scatter::scatter_band`] on a path.
pub(super) fn scatter_band(path: Path, band: &mut Band, ball: &Ball, way: Way) -> bool {
    run(path, Scatter(band, ball, way))
}

struct Tilt<'a, 'b>(&'a mut FacetRow<'b>);

impl Kernel for Tilt<'_, '_> {
    type Out = ();

    #[inline(always)]
    fn run(self) {
        exact::tilt_row(self.0);
    }
}

/// [`exact::tilt_row`] on a path.
pub(super) fn tilt_row(path: Path, row: &mut FacetRow) {
    run(path, Tilt(row));
}
