//! stub
use crate::job::Profile;
use crate::skeleton::Spine;
#[derive(Debug, Clone)]
pub struct Ridge {
    pub height_mm: f64,
    pub base_mm: Vec<f64>,
    pub profile: Profile,
    pub slope_cap: f64,
    pub width_power: f64,
    pub along: Vec<[f64; 2]>,
}
#[derive(Debug, Clone)]
pub struct Heights {
    pub nodes: Vec<f64>,
    pub branches: Vec<Vec<f64>>,
}
impl Ridge {
    pub fn heights(&self, _s: &Spine) -> Heights {
        Heights { nodes: vec![], branches: vec![] }
    }
}
