//! Every method over random figures, as a job names it.

use super::figures_tests::{Noise, blob, raise_region};
use super::*;
use crate::geom::DVec2;
use crate::job::{Control, CrestSpec, Join, Profile, Scheme, SkeletonSpec, SubdivisionSpec};
use crate::outline::Region;

fn subdivision(scheme: Scheme, control: Control) -> SurfaceSpec {
    let crest = CrestSpec::default();
    SurfaceSpec::Subdivision(SubdivisionSpec {
        scheme,
        levels: None,
        adaptive_mm: None,
        draft_rad: None,
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
        // Kobbelt's scheme folds in plan where lobes are narrow (4 of 40 do), Coons patches where narrow sectors round a
        // pole lie beside wide ones (2 of 40).
        let most = if scheme == Scheme::Kobbelt { 5 } else { 2 };
        raised_with_fallbacks(&subdivision(scheme, scheme.usual_control()), most);
    }
}

/// With a draft, Coons surfaces stand on as many of the figures.
#[test]
fn coons_surfaces_with_a_draft_are_raised() {
    let SurfaceSpec::Subdivision(mut spec) = subdivision(Scheme::Coons, Control::Quads) else {
        panic!("it subdivides")
    };
    spec.draft_rad = Some(30_f64.to_radians());
    raised_with_fallbacks(&SurfaceSpec::Subdivision(spec), 2);
}

/// The steepest and the gentlest of the triangles along the outline, degrees.
fn slopes_at_rim(mesh: &Mesh) -> [f64; 2] {
    let rim: std::collections::HashSet<[u32; 2]> = mesh.rim().into_iter().collect();
    let mut slopes = [f64::INFINITY, f64::NEG_INFINITY];
    for f in &mesh.faces {
        if (0..3).any(|k| rim.contains(&[f[k], f[(k + 1) % 3]])) {
            let [a, b, c] = f.map(|v| mesh.vertices[v as usize]);
            let normal = (b - a).cross(c - a);
            let slope = libm::atan2(normal.truncate().length(), normal.z).to_degrees();
            slopes = [slopes[0].min(slope), slopes[1].max(slope)];
        }
    }
    slopes
}

/// Coons surfaces leave the whole outline at their draft: what the facets beside it lack is halved from level to level, and
/// less than 0.6 degrees are left in the limit. The crest keeps its height.
#[test]
fn coons_surfaces_leave_the_outline_at_their_draft() {
    let ellipse = |a: f64, b: f64| -> Vec<DVec2> {
        let step = std::f64::consts::TAU / 720.0;
        (0..720).map(|k| DVec2::from_angle(step * f64::from(k)) * DVec2::new(a, b)).collect()
    };
    let mut hole = ellipse(3.0, 3.0);
    hole.reverse();
    for (outer, holes) in [(ellipse(8.0, 4.5), vec![]), (ellipse(9.0, 9.0), vec![hole])] {
        for draft_deg in [20.0_f64, 30.0, 50.0] {
            let slopes = [5, 6, 7].map(|levels| {
                let control = Control::Quads;
                let SurfaceSpec::Subdivision(mut spec) = subdivision(Scheme::Coons, control) else {
                    panic!("it subdivides")
                };
                (spec.draft_rad, spec.levels) = (Some(draft_deg.to_radians()), Some(levels));
                let at = |ring: &Vec<DVec2>| ring.iter().map(|p| *p + DVec2::splat(12.0)).collect();
                let region = Region { outer: at(&outer), holes: holes.iter().map(at).collect() };
                let (surfaces, notes) = raise_region(region, SurfaceSpec::Subdivision(spec));
                let Surface::Mesh(mesh) = &surfaces[0][0] else { panic!("{notes:?}") };
                let top = mesh.vertices.iter().map(|v| v.z).fold(0.0, f64::max);
                // The default slope cap lets a ring 6 mm wide rise to 4.775.
                assert!((4.77..5.4).contains(&top), "{top}");
                slopes_at_rim(mesh)
            });
            for k in 0..2 {
                let limit = 2.0 * slopes[2][k] - slopes[1][k];
                assert!((limit - draft_deg).abs() < 0.6, "{draft_deg}: {slopes:?}");
                assert!(
                    (slopes[2][k] - draft_deg).abs()
                        < 0.6 * (slopes[1][k] - draft_deg).abs() + 0.05,
                    "{draft_deg}: {slopes:?}"
                );
            }
        }
    }
}

#[test]
fn other_control_meshes_are_raised() {
    for control in [Control::Split, Control::Quad4, Control::Quad6] {
        raised_with_fallbacks(&subdivision(Scheme::Butterfly, control), 2);
    }
    raised_with_fallbacks(&subdivision(Scheme::CatmullClark, Control::Quads), 2);
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
