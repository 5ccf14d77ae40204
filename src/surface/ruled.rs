//! stub
use super::*;
use crate::geom::DVec2;
use crate::skeleton::*;
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum RuledFault {
    #[error("x {at}")]
    Rungs { at: DVec2 },
}
pub struct Density {
    pub spacing_mm: f64,
    pub max_facet_mm: f64,
}
pub fn mesh(
    _s: &Sampled,
    _c: &Cells,
    _r: &[Rungs],
    _sp: &Spine,
    _h: &Heights,
    _ri: &Ridge,
    _d: &Density,
) -> Mesh {
    Mesh::default()
}
pub fn check(_m: &Mesh, _s: &Sampled, _r: &Ridge) -> Result<(), RuledFault> {
    Ok(())
}
