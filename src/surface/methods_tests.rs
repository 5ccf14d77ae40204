//! Every method over random figures, as a job names it.

use super::figures_tests::{Noise, blob, raise_region};
use super::*;
use crate::geom::DVec2;
use crate::job::{Control, CrestSpec, Join, Profile, Scheme, SkeletonSpec, SubdivisionSpec};

fn subdivision(scheme: Scheme, control: Control) -> SurfaceSpec {
    let crest = CrestSpec::default();
    SurfaceSpec::Subdivision(SubdivisionSpec {
        scheme,
        levels: None,
        adaptive_mm: None,
        control,
        crest,
    })
}

fn patches_of(ridge_true: bool) -> SurfaceSpec {
    let skeleton = SkeletonSpec { join: Join::Pairs, ..SkeletonSpec::default() };
    SurfaceSpec::Patches { ridge_true, crest: CrestSpec { skeleton, ..CrestSpec::default() } }
}

/// Of 40 random figures, every third with a hole, so many at most fall back on the ratio field.
fn raised_with_fallbacks(surface: &SurfaceSpec, most: usize) {
    let mut noise = Noise(4711);
    let mut fell_back = Vec::new();
    for k in 0..40 {
        let mut region = blob(k, &mut noise);
        for p in region.outer.iter_mut().chain(region.holes.iter_mut().flatten()) {
            *p = *p * 0.8 + DVec2::splat(6.0);
        }
        let (surfaces, notes) = raise_region(region, surface.clone());
        match &surfaces[0][0] {
            Surface::Mesh(mesh) => {
                assert_eq!(mesh.check(), Ok(()));
                assert!(mesh.vertices.iter().all(|v| v.z >= -1e-9));
            }
            Surface::Field(patch) => {
                let mesh =
                    matches!(surface, SurfaceSpec::Patches { .. } | SurfaceSpec::Subdivision(_));
                if mesh {
                    fell_back.push(k);
                    assert!(notes.iter().any(|n| n.contains(surface.method())), "{notes:?}");
                }
                assert!(patch.z.iter().any(|z| *z > 0.5));
                assert!(patch.z.iter().all(|z| !z.is_infinite()));
            }
            other => panic!("{other:?}"),
        }
    }
    println!("{}: {} fell back", surface.method(), fell_back.len());
    assert!(fell_back.len() <= most, "{}: {fell_back:?}", surface.method());
}

#[test]
fn patches_are_raised() {
    raised_with_fallbacks(&patches_of(false), 2);
    // Where the ridge is on the spine, rows may cross on the inside of bends.
    raised_with_fallbacks(&patches_of(true), 8);
}

#[test]
fn subdivision_surfaces_are_raised() {
    for scheme in Scheme::ALL {
        raised_with_fallbacks(&subdivision(scheme, Control::Even), 2);
    }
}

#[test]
fn other_control_meshes_are_raised() {
    for control in [Control::Split, Control::Quad4, Control::Quad6] {
        raised_with_fallbacks(&subdivision(Scheme::Butterfly, control), 2);
    }
}

#[test]
fn fields_are_raised() {
    raised_with_fallbacks(&SurfaceSpec::Harmonic(CrestSpec::default()), 0);
    raised_with_fallbacks(&SurfaceSpec::RFunction { profile: Profile::Parabola, order: 2 }, 0);
    for directions in [1, 8] {
        let profile = Profile::Bell;
        raised_with_fallbacks(&SurfaceSpec::ScanLines { directions, profile }, 0);
    }
    let crest = CrestSpec { profile: Profile::Round, width_power: 1.0, ..CrestSpec::default() };
    raised_with_fallbacks(&SurfaceSpec::Teddy(crest), 0);
}

/// The adaptive surface is the uniform one within its tolerance.
#[test]
fn an_adaptive_surface_is_the_uniform_one_with_fewer_triangles() {
    let mut noise = Noise(7);
    let mut region = blob(1, &mut noise);
    region.outer.iter_mut().for_each(|p| *p = *p * 0.8 + DVec2::splat(6.0));
    let mesh = |adaptive_mm: Option<f64>| {
        let SurfaceSpec::Subdivision(mut spec) = subdivision(Scheme::Butterfly, Control::Even)
        else {
            panic!("it subdivides")
        };
        (spec.levels, spec.adaptive_mm) = (Some(4), adaptive_mm);
        let (mut surfaces, notes) = raise_region(region.clone(), SurfaceSpec::Subdivision(spec));
        match surfaces.remove(0).remove(0) {
            Surface::Mesh(mesh) => mesh,
            _ => panic!("{notes:?}"),
        }
    };
    let (uniform, adaptive) = (mesh(None), mesh(Some(0.1)));
    assert!(adaptive.faces.len() * 2 < uniform.faces.len());
    let volume = |mesh: &Mesh| -> f64 {
        let of = |f: &[u32; 3]| {
            let [a, b, c] = f.map(|v| mesh.vertices[v as usize]);
            crate::geom::orient(a.truncate(), b.truncate(), c.truncate()) * (a.z + b.z + c.z) / 6.0
        };
        mesh.faces.iter().map(of).sum()
    };
    let (whole, part) = (volume(&uniform), volume(&adaptive));
    assert!((whole - part).abs() < 0.02 * whole, "{whole} {part}");
}
