//! stub
use super::*;
use crate::outline::Region;
use crate::skeleton::*;
pub fn field(
    _r: &Region,
    _s: &Spine,
    _h: &Heights,
    _ri: &Ridge,
    _g: &Grid,
    window: &Window,
) -> Patch {
    Patch::empty(*window)
}
