//! Edits against the laws of the specification: targets are met, places are found, what cannot be done is told.

use super::*;
use crate::job::{Combine, CrestSpec, Selector, SurfaceSpec, Written};
use crate::outline::Figure;
use crate::surface::Edit;
use proptest::prelude::*;

/// Quadrilaterals over (0, 0) .. (n, n), flat but for `height`.
fn grid(n: u32, height: impl Fn(f64, f64) -> f64) -> PolyMesh {
    let count = n + 1;
    let at = |k: u32| {
        let (x, y) = (f64::from(k % count), f64::from(k / count));
        DVec3::new(x, y, height(x, y))
    };
    let mut mesh = PolyMesh::with_vertices((0..count * count).map(at).collect());
    for k in (0..n * count).filter(|k| k % count < n) {
        mesh.add_face(&[k, k + 1, k + count + 1, k + count]);
    }
    mesh
}

/// A pentagon, a triangle and quadrilaterals round a vertex of valence 5: nothing regular about it.
fn irregular() -> PolyMesh {
    let ring = |count: u32, radius: f64, turn: f64| {
        (0..count).map(move |k| {
            let angle = (f64::from(k) + turn) / f64::from(count) * std::f64::consts::TAU;
            DVec3::new(radius * libm::cos(angle), radius * libm::sin(angle), 1.0 / radius)
        })
    };
    let mut points = vec![DVec3::Z];
    points.extend(ring(10, 2.0, 0.0));
    points.extend(ring(10, 4.0, 0.0));
    let mut mesh = PolyMesh::with_vertices(points);
    for k in 0..5 {
        mesh.add_face(&[0, 1 + 2 * k, 2 + 2 * k, 1 + (2 * k + 2) % 10]);
    }
    for k in 0..8 {
        mesh.add_face(&[1 + k, 11 + k, 12 + k, 2 + k]);
    }
    mesh.add_face(&[9, 19, 20, 11, 1]);
    mesh.add_face(&[9, 1, 10]);
    mesh
}

fn refined(control: &PolyMesh, levels: u32) -> PolyMesh {
    SpacedMesh::new(control.clone()).refined(levels).unwrap().settled().unwrap()
}

fn edit_at(at: EditPlace, target: EditTarget, normal: Option<DVec3>) -> EditSpec {
    EditSpec { at, target, normal, written: Written("job.toml:9:1".into()) }
}

fn up(x: f64, y: f64, height: f64) -> EditSpec {
    edit_at(EditPlace::Plan(DVec2::new(x, y)), EditTarget::Height(height), None)
}

fn spec(list: Vec<EditSpec>) -> EditsSpec {
    let method = EditMethod::Energy { penalty: None };
    EditsSpec { list, method, rings: Some(4), in_space: false, outline_moves: false }
}

/// The remarks without those that only say where an edit lies.
fn news(mut remarks: Vec<Remark>) -> Vec<Remark> {
    remarks.retain(|remark| !matches!(remark, Remark::EditPlaced { .. }));
    remarks
}

/// The mesh drawn to the edits, and the remarks.
fn drawn(
    control: &PolyMesh,
    levels: u32,
    spec: &EditsSpec,
) -> Result<(PolyMesh, Vec<Remark>), EditFault> {
    let mut fine = if levels > 0 { refined(control, levels) } else { control.clone() };
    let all: Vec<usize> = (0..spec.list.len()).collect();
    let mut remarks = Vec::new();
    draw_to(spec, &all, &Refined { control, levels, halved: 0 }, &mut fine, &mut remarks)?;
    Ok((fine, news(remarks)))
}

/// The highest place of a refined mesh over a point: its height and normal.
fn over(control: &PolyMesh, levels: u32, fine: &PolyMesh, at: DVec2) -> (f64, DVec3) {
    let surface = LimitSurface::of(control, |_, _| false).unwrap();
    let place = Grown::new(control, fine, levels, &surface, 0).over_plan(at).unwrap();
    (place.at(fine).z, place.normal(fine))
}

#[test]
fn heights_and_normals_are_met_by_every_method_and_the_rest_of_the_outline_stays() {
    let control = grid(8, |x, y| 1.0 - 0.02 * ((x - 4.0).powi(2) + (y - 4.0).powi(2)));
    let place = EditPlace::Plan(DVec2::new(3.3, 4.6));
    let normal = DVec3::new(0.3, -0.2, 1.0);
    let list = vec![edit_at(place, EditTarget::Height(2.5), Some(normal)), up(5.7, 2.2, 0.4)];
    for method in [EditMethod::LeastChange, EditMethod::Energy { penalty: None }] {
        for (rings, in_space) in [(Some(2), false), (None, false), (Some(3), true)] {
            let spec = EditsSpec { method, rings, in_space, ..spec(list.clone()) };
            let (fine, remarks) = drawn(&control, 4, &spec).unwrap();
            assert!(remarks.is_empty(), "{remarks:?}");
            let (height, got) = over(&control, 4, &fine, DVec2::new(3.3, 4.6));
            // Triangles of an edited quadrilateral may be cut the other way: off by its bend.
            assert!((height - 2.5).abs() < 1e-3, "{method:?} {rings:?} {in_space}: {height}");
            assert!(got.angle_between(normal) < 0.02, "{method:?}: {got}");
            let (height, _) = over(&control, 4, &fine, DVec2::new(5.7, 2.2));
            assert!((height - 0.4).abs() < 1e-3, "{height}");
            let before = refined(&control, 4);
            let on_rim = |p: &DVec3| [p.x, p.y].iter().any(|v| *v == 0.0 || *v == 8.0);
            for (a, b) in before.vertices.iter().zip(&fine.vertices) {
                assert!(!on_rim(a) || a.distance(*b) < 1e-12, "{a} {b}");
                assert!(in_space || a.truncate() == b.truncate());
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    /// On uneven sheets, whatever is asked for far enough apart is met at every place, and the outline stays. A triangle
    /// may be cut the other way after its edit: off by what its quadrilateral twists.
    #[test]
    fn what_is_asked_for_apart_is_met_on_any_sheet(
        shape in prop::collection::vec((-0.3..0.3, -0.3..0.3, -1.0..1.0), 100),
        asked in prop::collection::vec((-0.8..0.8, -0.8..0.8, -1.5..1.5, prop::option::of((-0.4..0.4, -0.4..0.4))), 1..5),
        least_change in any::<bool>(),
        everywhere in any::<bool>(),
    ) {
        let mut control = grid(9, |_, _| 0.0);
        for (at, (x, y, z)) in control.vertices.iter_mut().zip(shape) {
            let inner = at.x > 0.0 && at.x < 9.0 && at.y > 0.0 && at.y < 9.0;
            *at += if inner { DVec3::new(x, y, z) } else { DVec3::Z * z };
        }
        let middles = [(2.5, 2.5), (6.5, 2.5), (2.5, 6.5), (6.5, 6.5)];
        let list = asked.into_iter().zip(middles).map(|((x, y, height, slope), middle)| {
            let at = EditPlace::Plan(DVec2::new(middle.0 + x, middle.1 + y));
            let normal = slope.map(|(x, y): (f64, f64)| DVec3::new(x, y, 1.0));
            edit_at(at, EditTarget::Height(height), normal)
        });
        let method = if least_change { EditMethod::LeastChange } else { EditMethod::Energy { penalty: None } };
        let spec = EditsSpec { method, rings: (!everywhere).then_some(2), ..spec(list.collect()) };
        let (fine, remarks) = drawn(&control, 4, &spec).unwrap();
        prop_assert!(remarks.is_empty(), "{remarks:?}");
        let twists = fine.faces().map(|face| {
            let [a, b, c, d] = [0, 1, 2, 3].map(|k| fine.vertices[face[k] as usize].z);
            0.5 * (a - b + c - d).abs()
        });
        let twist = twists.fold(0.0, f64::max);
        for edit in &spec.list {
            let (EditPlace::Plan(at), EditTarget::Height(height)) = (edit.at, &edit.target) else { unreachable!() };
            let (got, _) = over(&control, 4, &fine, at);
            prop_assert!((got - height).abs() < twist + 1e-7, "{at}: {got} {height}, {twist}");
        }
        let before = refined(&control, 4);
        for (a, b) in before.vertices.iter().zip(&fine.vertices) {
            prop_assert!(a.truncate() == b.truncate());
            let on_rim = [a.x, a.y].iter().any(|v| *v <= 1e-9 || *v >= 9.0 - 1e-9);
            prop_assert!(!on_rim || a.distance(*b) < 1e-12);
        }
    }
}

/// A strip of faces from rim to rim has no vertex that could move before it is refined.
#[test]
fn meshes_without_inner_vertices_are_edited_on_a_finer_one() {
    let points = [[0.0, 0.0], [4.0, 0.0], [8.0, 0.0], [8.0, 4.0], [4.0, 4.0], [0.0, 4.0]];
    let mut control = PolyMesh::with_vertices(points.map(|[x, y]| DVec3::new(x, y, 0.0)).to_vec());
    control.add_face(&[0, 1, 4, 5]);
    control.add_face(&[1, 2, 3, 4]);
    let normal = DVec3::new(0.1, -0.2, 1.0);
    let place = EditPlace::Plan(DVec2::new(3.1, 2.3));
    let by_plan = spec(vec![edit_at(place, EditTarget::Height(0.7), Some(normal))]);
    let place = EditPlace::Mesh { face: 2, corner: None, u: 0.4, v: 0.6 };
    let by_face = spec(vec![edit_at(place, EditTarget::Height(0.7), None)]);
    for (halved, missed) in [(0, true), (1, true), (2, false), (3, false)] {
        for spec in [&by_plan, &by_face] {
            let mut fine = refined(&control, 5);
            let mut remarks = Vec::new();
            let from = Refined { control: &control, levels: 5, halved };
            draw_to(spec, &[0], &from, &mut fine, &mut remarks).unwrap();
            let remarks = news(remarks);
            let misses = missed && (halved == 0 || spec == &by_plan);
            assert_eq!(remarks.is_empty(), !misses, "{halved}: {remarks:?}");
            if spec == &by_plan && !missed {
                let (height, got) = over(&control, 5, &fine, DVec2::new(3.1, 2.3));
                assert!((height - 0.7).abs() < 1e-3 && got.angle_between(normal) < 0.02);
            }
        }
    }
}

#[test]
fn a_mesh_that_is_inside_out_takes_normals_too() {
    let mut control = PolyMesh::with_vertices(grid(6, |_, _| 0.5).vertices);
    for face in grid(6, |_, _| 0.0).faces() {
        control.add_face(&[face[0], face[3], face[2], face[1]]);
    }
    let normal = DVec3::new(0.2, 0.1, 1.0);
    let place = EditPlace::Plan(DVec2::new(2.7, 3.2));
    let one = edit_at(place, EditTarget::Height(1.0), Some(normal));
    let (fine, remarks) = drawn(&control, 4, &spec(vec![one])).unwrap();
    assert!(remarks.is_empty(), "{remarks:?}");
    let (height, got) = over(&control, 4, &fine, DVec2::new(2.7, 3.2));
    assert!((height - 1.0).abs() < 1e-3 && got.angle_between(normal) < 0.02, "{height} {got}");
}

#[test]
fn a_place_moves_to_a_point_in_space() {
    let control = grid(8, |_, _| 0.0);
    let to = DVec3::new(4.4, 3.9, 1.5);
    let one = edit_at(EditPlace::Plan(DVec2::new(4.0, 4.0)), EditTarget::Point(to), None);
    let spec = EditsSpec { in_space: true, ..spec(vec![one]) };
    let (fine, remarks) = drawn(&control, 3, &spec).unwrap();
    assert!(remarks.is_empty(), "{remarks:?}");
    // The middle vertex was there, and vertices keep their numbers.
    assert!(fine.vertices[40].distance(to) < 1e-9, "{}", fine.vertices[40]);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn places_by_their_face_lie_where_the_limit_surface_has_them(
        face in 0_usize..15, corner in 0_usize..4, u in 0.0_f64..=1.0, v in 0.0_f64..=1.0,
    ) {
        let (control, levels) = (irregular(), 5);
        let surface = LimitSurface::of(&control, |_, _| false).unwrap();
        let fine = refined(&control, levels);
        let grown = Grown::new(&control, &fine, levels, &surface, 0);
        let part = (grown.sides(face) != 4 || corner > 0).then_some(corner.min(grown.sides(face) - 1));
        let found = grown.on_mesh(face, part, u, v).at(&fine);
        let want = surface.at_part(face, part, u, v).unwrap().place(&control.vertices);
        // A facet is a sixteenth of a side long: off by its bend.
        prop_assert!(found.distance(want) < 0.01, "{found} {want}");
        // Rows are those of the place: applied to the control mesh they give it again.
        let place = grown.on_mesh(face, part, u, v);
        let Edit::Over { row, .. } = grown.over(&place, None, None) else { unreachable!() };
        let sum: f64 = row.iter().map(|r| r.1).sum();
        let again: DVec3 = row.iter().map(|&(v, part)| control.vertices[v as usize] * part).sum();
        prop_assert!((sum - 1.0).abs() < 1e-12);
        prop_assert!(again.distance(found) < 2e-3, "{again} {found}");
    }
}

#[test]
fn an_iso_line_passes_through_its_heights_from_face_to_face() {
    let control = grid(8, |_, _| 0.0);
    let heights = vec![0.5, 1.0, 1.25, 0.75];
    for along_v in [false, true] {
        // The middle of the face from (2, 3) to (3, 4), counted from 1.
        let at = EditPlace::Mesh { face: 3 * 8 + 2 + 1, corner: None, u: 0.5, v: 0.5 };
        let target = EditTarget::Line { along_v, heights: heights.clone() };
        let spec = spec(vec![edit_at(at, target, None)]);
        let (fine, remarks) = drawn(&control, 3, &spec).unwrap();
        assert!(remarks.is_empty(), "{remarks:?}");
        for (k, wanted) in heights.iter().enumerate() {
            let k = k as f64;
            let at = if along_v { DVec2::new(2.5, 3.0 + k) } else { DVec2::new(2.0 + k, 3.5) };
            let (height, _) = over(&control, 3, &fine, at + DVec2::splat(1e-9));
            assert!((height - wanted).abs() < 1e-6, "{at}: {height}");
        }
    }
}

#[test]
fn edits_that_contradict_each_other_are_met_in_the_mean_and_told() {
    let control = grid(8, |_, _| 0.0);
    let (fine, remarks) =
        drawn(&control, 3, &spec(vec![up(4.2, 4.1, 1.0), up(4.2, 4.1, 2.0)])).unwrap();
    let (height, _) = over(&control, 3, &fine, DVec2::new(4.2, 4.1));
    assert!((height - 1.5).abs() < 1e-6, "{height}");
    let [
        Remark::EditMissed { edit: 0, by_mm: a, .. },
        Remark::EditMissed { edit: 1, by_mm: b, .. },
    ] = remarks[..]
    else {
        panic!("{remarks:?}");
    };
    assert!((a - 0.5).abs() < 1e-6 && (b - 0.5).abs() < 1e-6, "{a} {b}");
    // On the outline nothing moves.
    let (_, remarks) = drawn(&control, 3, &spec(vec![up(4.0, 0.0, 1.0)])).unwrap();
    assert!(
        matches!(remarks[..], [Remark::EditMissed { edit: 0, by_mm, .. }] if (by_mm - 1.0).abs() < 1e-9)
    );
    // The same twice is no contradiction.
    let (_, remarks) =
        drawn(&control, 3, &spec(vec![up(4.2, 4.1, 1.0), up(4.2, 4.1, 1.0)])).unwrap();
    assert!(remarks.is_empty(), "{remarks:?}");
}

#[test]
fn a_penalty_lets_an_edit_be_missed_as_tabled() {
    // Section 4.4 of the specification: the 7 x 7 grid, its boundary held, reaches .976467497 of 1 at 100.
    let control = grid(6, |_, _| 0.0);
    let method = EditMethod::Energy { penalty: Some(100.0) };
    let spec = EditsSpec { method, rings: None, ..spec(vec![up(3.0, 3.0, 1.0)]) };
    let (fine, remarks) = drawn(&control, 2, &spec).unwrap();
    let (height, _) = over(&control, 2, &fine, DVec2::new(3.0, 3.0));
    assert!((height - 0.976_467_497).abs() < 1e-8, "{height}");
    assert!(matches!(remarks[..], [Remark::EditMissed { edit: 0, .. }]), "{remarks:?}");
}

#[test]
fn moves_past_the_neighbours_are_told_as_folds() {
    let control = grid(8, |_, _| 0.0);
    let to = DVec3::new(6.5, 4.0, 0.5);
    let one = edit_at(EditPlace::Plan(DVec2::new(4.0, 4.0)), EditTarget::Point(to), None);
    let spec = EditsSpec { in_space: true, rings: Some(1), ..spec(vec![up(1.5, 1.5, 0.2), one]) };
    let (_, remarks) = drawn(&control, 3, &spec).unwrap();
    let [Remark::EditFolded { edit: 1, at }] = remarks[..] else { panic!("{remarks:?}") };
    assert!(at.distance(to.truncate()) < 3.0, "{at}");
}

#[test]
fn what_cannot_be_edited_is_refused_with_its_place_in_the_job() {
    let control = grid(8, |_, _| 0.0);
    let refused = |levels: u32, one: EditSpec| {
        let fault = drawn(&control, levels, &spec(vec![one])).unwrap_err();
        assert!(fault.to_string().starts_with("job.toml:9:1: "), "{fault}");
        fault
    };
    let mesh = |face, corner| EditPlace::Mesh { face, corner, u: 0.5, v: 0.5 };
    let height = || EditTarget::Height(1.0);
    let line = |count: usize| EditTarget::Line { along_v: false, heights: vec![0.0; count] };
    assert!(matches!(refused(2, up(9.0, 4.0, 1.0)), EditFault::Outside { .. }));
    assert!(matches!(refused(0, up(4.0, 4.0, 1.0)), EditFault::NoLevels { .. }));
    let fault = refused(2, edit_at(mesh(65, None), height(), None));
    assert!(matches!(fault, EditFault::NoFace { face: 65, count: 64, .. }));
    let fault = refused(2, edit_at(mesh(1, Some(5)), height(), None));
    assert!(matches!(fault, EditFault::Corner { face: 1, sides: 4, .. }));
    let fault = refused(2, edit_at(mesh(6, None), line(5), None));
    assert!(matches!(fault, EditFault::Line { faces: 3, what: "the outline", .. }), "{fault}");
    let level = edit_at(mesh(28, None), EditTarget::Normal, Some(DVec3::X));
    assert!(matches!(refused(2, level), EditFault::Steep { .. }));
    let down = edit_at(mesh(28, None), EditTarget::Normal, Some(-DVec3::Z));
    assert!(matches!(refused(2, down), EditFault::Flipped { .. }));
    let odd = drawn(&irregular(), 2, &spec(vec![edit_at(mesh(15, None), height(), None)]));
    assert!(matches!(odd, Err(EditFault::Corner { face: 15, sides: 3, .. })));
    let odd = drawn(&irregular(), 2, &spec(vec![edit_at(mesh(6, None), line(4), None)]));
    assert!(matches!(odd, Err(EditFault::Line { .. })), "{odd:?}");
}

#[test]
fn every_edit_lies_in_a_figure_of_its_layer() {
    let on = |at: EditPlace| LayerSpec {
        name: "leaf".into(),
        select: Selector::All,
        surface: SurfaceSpec::Ruled(CrestSpec::default()),
        base_mm: 0.0,
        height_mm: 3.0,
        offset_mm: 0.0,
        combine: Combine::Max,
        blend_mm: 0.0,
        feather_mm: 0.0,
        draft_rad: 0.0,
        slope_cap: 4.0,
        smooth: None,
        union: false,
        visible: false,
        edits: Some(spec(vec![edit_at(at, EditTarget::Height(2.0), None)])),
    };
    let square = |at: f64| vec![DVec2::splat(at), DVec2::new(at + 9.0, at), DVec2::splat(at + 9.0)];
    let region = |at: f64| Region { outer: square(at), holes: vec![] };
    let outline = |places: &[f64]| OutlineLayer {
        name: "leaf".into(),
        figures: places
            .iter()
            .map(|at| Figure { source: "path".into(), regions: vec![region(*at)] })
            .collect(),
        ridges: vec![],
    };
    let plan = on(EditPlace::Plan(DVec2::new(8.0, 4.0)));
    let fault = check_used(&outline(&[20.0, 40.0]), &plan).unwrap_err();
    assert!(matches!(fault, EditFault::Outside { .. }), "{fault}");
    assert!(fault.to_string().contains("job.toml:9:1"), "{fault}");
    assert_eq!(check_used(&outline(&[20.0, 2.0]), &plan), Ok(()));
    assert_eq!((within(&plan, &region(2.0)), within(&plan, &region(20.0))), (vec![0], vec![]));
    let by_face = on(EditPlace::Mesh { face: 1, corner: None, u: 0.5, v: 0.5 });
    assert_eq!(check_used(&outline(&[20.0]), &by_face), Ok(()));
    let fault = check_used(&outline(&[20.0, 2.0]), &by_face).unwrap_err();
    assert!(matches!(fault, EditFault::ManyMeshes { count: 2, .. }), "{fault}");
}
