//! `smooth_outline`: what is rounded, what stays, and that figures stay next to each other.

use std::collections::HashSet;

use super::*;
use crate::artwork::read_bitmap;
use crate::geom::DVec2;
use crate::geom::curves::{EndRule, Fit, Scheme, Spacing};
use crate::job::{
    ArtworkSpec, CourseSpec, CrestEnds, CrestSpec, DrawnCrestSpec, DrawnCurves, DrawnSpec,
    Fit as Size, Place, SmoothSpec, SurfaceSpec, TraceSpec,
};
use proptest::prelude::*;

const FOUR_POINT: Scheme = Scheme::FourPoint { tension: 0.0625, ends: EndRule::Reflect };
const INCENTER: Scheme = Scheme::Incenter { update: 0.25 };
const BSPLINE: Scheme = Scheme::CubicBspline { fit: Fit::Control };
const SCHEMES: [Scheme; 7] = [
    Scheme::Chaikin,
    BSPLINE,
    FOUR_POINT,
    Scheme::TwoNPoint { pairs: 3, ends: EndRule::Reflect },
    Scheme::TwoNPoint { pairs: 4, ends: EndRule::Lagrange },
    Scheme::NonuniformBspline { fit: Fit::Through, spacing: Spacing::Centripetal },
    INCENTER,
];

fn spec(scheme: Scheme) -> SmoothSpec {
    SmoothSpec {
        scheme,
        corner_rad: 40_f64.to_radians(),
        corners: vec![],
        weights: vec![],
        curves: DrawnCurves::Keep,
        levels: None,
    }
}

fn smoothed(spec: &SmoothSpec) -> LayerSpec {
    LayerSpec { smooth: Some(spec.clone()), ..layer(Selector::All) }
}

/// The figures of a drawing all of which is smoothed, and the notes.
fn smooth(body: &str, spec: &SmoothSpec) -> (Vec<Figure>, Vec<String>) {
    let mut outlines = traced(body, &[smoothed(spec)]);
    (outlines.layers.remove(0).figures, outlines.notes)
}

fn path(points: &[DVec2]) -> String {
    let d: Vec<String> = points.iter().map(|p| format!("{} {}", p.x, p.y)).collect();
    format!("<path d='M{}Z'/>", d.join("L"))
}

fn on_circle(count: u32, radius: f64) -> Vec<DVec2> {
    let point = |k: u32| {
        let (sin, cos) = libm::sincos(f64::from(k) / f64::from(count) * 2.0 * PI);
        DVec2::new(50.0 + radius * cos, 50.0 + radius * sin)
    };
    (0..count).map(point).collect()
}

fn vertices(figure: &Figure) -> Vec<DVec2> {
    figure.regions.iter().flat_map(Region::rings).flatten().copied().collect()
}

#[test]
fn a_twelve_gon_becomes_a_circle() {
    let drawn = on_circle(12, 30.0);
    let (figures, notes) = smooth(&path(&drawn), &spec(INCENTER));
    assert_eq!(notes, Vec::<String>::new());
    let ring = vertices(&figures[0]);
    // The wood is measured in micrometres, the artwork's numbers in f32.
    assert!(ring.iter().all(|p| (p.distance(DVec2::splat(50.0)) - 30.0).abs() < 2e-5));
    assert!((area(&figures) - PI * 900.0).abs() < 0.4, "{}", area(&figures));
    // As fine as a flattened curve: the sagitta of a chord is below chord_mm / 10.
    let longest =
        (0..ring.len()).map(|i| ring[i].distance(ring[(i + 1) % ring.len()])).fold(0.0, f64::max);
    assert!(longest * longest / (8.0 * 30.0) < 0.002 && ring.len() < 12 * 64, "{longest}");
}

#[test]
fn every_scheme_stays_near_the_drawn_polygon() {
    let drawn = on_circle(12, 30.0);
    let polygon = 0.5 * 12.0 * 900.0 * libm::sin(PI / 6.0);
    for scheme in SCHEMES {
        let (figures, _) = smooth(&path(&drawn), &spec(scheme));
        // Through the points: the circle, nearly. Inside: less than the polygon, but not by much.
        let inside = matches!(scheme, Scheme::Chaikin) || scheme == BSPLINE;
        let found = area(&figures);
        let (low, high) =
            if inside { (0.95 * polygon, polygon) } else { (polygon, 1.003 * PI * 900.0) };
        assert!(low < found && found < high, "{scheme:?}: {found}");
    }
}

#[test]
fn corners_stay_and_say_when_nothing_is_left_to_smooth() {
    let square = "<rect x='10' y='10' width='30' height='30'/>";
    let (figures, notes) = smooth(square, &spec(FOUR_POINT));
    assert!((area(&figures) - 900.0).abs() < 1e-6 && vertices(&figures[0]).len() == 4);
    assert_eq!(notes.len(), 1);
    assert!(notes[0].contains("changes nothing: 4 vertices are corners"), "{}", notes[0]);
    // By a wider angle they are none.
    let wide = SmoothSpec { corner_rad: PI, ..spec(FOUR_POINT) };
    let (figures, notes) = smooth(square, &wide);
    assert!(notes.is_empty() && area(&figures) > 1000.0);
}

#[test]
fn a_named_corner_stays_and_a_place_without_vertex_is_refused() {
    let drawn = on_circle(12, 30.0);
    // The drawing is turned upside down: its middle stays.
    let named = SmoothSpec { corners: vec![DVec2::new(80.2, 50.1)], ..spec(FOUR_POINT) };
    let (figures, notes) = smooth(&path(&drawn), &named);
    let ring = vertices(&figures[0]);
    let turn =
        |i: usize| crate::geom::curves::turn_at(&ring, crate::geom::curves::Course::Closed, i);
    let sharpest = (0..ring.len()).max_by(|a, b| turn(*a).total_cmp(&turn(*b))).unwrap();
    assert!(ring[sharpest].distance(DVec2::new(80.0, 50.0)) < 1e-4);
    assert!(notes.is_empty());
    let nowhere = SmoothSpec { corners: vec![DVec2::new(50.0, 50.0)], ..spec(FOUR_POINT) };
    let layers = [smoothed(&nowhere)];
    let refused = trace(&placed(&path(&drawn), &layers), &layers, &Tolerance::default());
    let message = refused.unwrap_err().to_string();
    assert!(message.contains("smooth_outline.corners names a vertex at [50, 50]"), "{message}");
}

#[test]
fn a_weight_pulls_the_outline_to_its_vertex() {
    let scheme = Scheme::NonuniformBspline { fit: Fit::Control, spacing: Spacing::Uniform };
    let drawn = path(&on_circle(12, 30.0));
    let reach = |weights: Vec<[f64; 3]>| {
        let (figures, _) = smooth(&drawn, &SmoothSpec { weights, ..spec(scheme) });
        vertices(&figures[0]).iter().map(|p| p.x).fold(0.0, f64::max)
    };
    let (light, even, heavy) =
        (reach(vec![[80.0, 50.0, 0.3]]), reach(vec![]), reach(vec![[80.0, 50.0, 8.0]]));
    // At an even spacing the curve passes a vertex at (1 + 4 + 1) / 6 of it and its neighbours.
    assert!((even - (50.0 + 30.0 * (4.0 + 2.0 * libm::cos(PI / 6.0)) / 6.0)).abs() < 1e-4);
    // With weight w at (1 + 4 w + 1) / (4 w + 2).
    let pulled = |w: f64| 50.0 + 30.0 * (4.0 * w + 2.0 * libm::cos(PI / 6.0)) / (4.0 * w + 2.0);
    assert!((heavy - pulled(8.0)).abs() < 1e-4 && light < even, "{light} {even} {heavy}");
}

#[test]
fn drawn_curves_stay_and_straight_runs_between_them_go_on_smoothly() {
    // A half disc of one arc on top, three straight sides below, all turning gently.
    let body = "<path d='M20 50A30 30 0 0 1 80 50L72 70L50 80L28 70Z'/>";
    let (drawn, _) = all(body);
    let gentle = SmoothSpec { corner_rad: 60_f64.to_radians(), ..spec(INCENTER) };
    let (figures, notes) = smooth(body, &gentle);
    assert!(notes.is_empty(), "{notes:?}");
    let (before, after) = (vertices(&drawn[0]), vertices(&figures[0]));
    let upper = |ring: &[DVec2]| -> HashSet<[u64; 2]> {
        ring.iter().filter(|p| p.y > 50.001).map(|p| p.to_array().map(f64::to_bits)).collect()
    };
    assert!(upper(&before).len() > 20);
    assert_eq!(upper(&before), upper(&after));
    // The straight sides bulge, and leave the arc in its direction: nowhere a turn as of a corner.
    assert!(area(&figures) > area(&drawn) + 50.0);
    let course = crate::geom::curves::Course::Closed;
    let turns = (0..after.len()).map(|i| crate::geom::curves::turn_at(&after, course, i));
    assert!(turns.fold(0.0, f64::max) < 0.1);
}

#[test]
fn curves_can_count_as_points() {
    let circle = "<circle cx='50' cy='50' r='30'/>";
    let (_, notes) = smooth(circle, &spec(INCENTER));
    assert!(notes[0].contains("drawn curves are kept"), "{notes:?}");
    let points = SmoothSpec { curves: DrawnCurves::Points, ..spec(INCENTER) };
    let (figures, notes) = smooth(circle, &points);
    assert!(notes.is_empty());
    // Bézier arcs leave the circle by 0.03 % of the radius.
    let off = |p: &DVec2| (p.distance(DVec2::splat(50.0)) - 30.0).abs();
    assert!(vertices(&figures[0]).iter().all(|p| off(p) < 0.02));
    // The corner between two curves stays one.
    let lens = "<path d='M20 50Q50 20 80 50Q50 80 20 50Z'/>";
    let (figures, _) = smooth(lens, &points);
    for x in [20.0, 80.0] {
        let end = DVec2::new(x, 50.0);
        assert!(vertices(&figures[0]).iter().any(|p| p.distance(end) < 1e-5));
    }
}

#[test]
fn loops_that_a_scheme_makes_are_resolved_and_told() {
    // A long side next to a very short one: the four-point scheme swings back over itself.
    let body = "<path d='M10 50L60 50L60.4 49.4L60.9 50L90 50L90 80L10 80Z'/>";
    let wild = SmoothSpec {
        corner_rad: PI,
        ..spec(Scheme::FourPoint { tension: 0.125, ends: EndRule::Reflect })
    };
    let (figures, notes) = smooth(body, &wild);
    assert!(!figures.is_empty());
    let told = notes.iter().find(|note| note.contains("made loops")).expect("a note on the loops");
    // Within a few millimetres of the short sides.
    let x = told.split("near ").nth(1).unwrap().split('.').next().unwrap().parse::<i32>().unwrap();
    assert!((50..70).contains(&x) && told.contains("name a corner there"), "{told}");
    assert!(
        !notes.iter().any(|note| note.contains("crosses itself and was resolved")),
        "{notes:?}"
    );
}

#[test]
fn too_many_levels_are_refused() {
    let mut drawn = String::from("<path d='M0 0");
    for k in 0..6000 {
        drawn += &format!("L{} {}", 0.01 * f64::from(k), 10.0 + f64::from(k % 2));
    }
    drawn += "L60 0Z'/>";
    let layers = [smoothed(&SmoothSpec { levels: Some(10), ..spec(BSPLINE) })];
    let refused = trace(&placed(&drawn, &layers), &layers, &Tolerance::default());
    let message = refused.unwrap_err().to_string();
    assert!(message.contains("levels = 10 of its smoothing"), "{message}");
}

/// Three figures around a point, next to each other, with bent borders.
const NEIGHBOURS: &str = "\
    <path fill='#ff0000' d='M0 0L50 0L51 12L47 25L53 38L50 50L38 52L25 47L12 53L0 50Z'/>\
    <path fill='#00ff00' d='M100 0L50 0L51 12L47 25L53 38L50 50L62 51L75 46L88 52L100 50Z'/>\
    <path fill='#0000ff' d='M0 50L12 53L25 47L38 52L50 50L62 51L75 46L88 52L100 50L100 100L0 100Z'/>";

#[test]
fn borders_that_figures_share_stay_the_same_bits() {
    for scheme in SCHEMES {
        let (figures, _) = smooth(NEIGHBOURS, &spec(scheme));
        assert_eq!(figures.len(), 3);
        let sets: Vec<HashSet<[u64; 2]>> = figures
            .iter()
            .map(|f| vertices(f).iter().map(|p| p.to_array().map(f64::to_bits)).collect())
            .collect();
        for (k, figure) in figures.iter().enumerate() {
            let inner = vertices(figure);
            let inner: Vec<&DVec2> = inner
                .iter()
                .filter(|p| p.x > 0.1 && p.x < 99.9 && p.y > 0.1 && p.y < 99.9)
                .collect();
            assert!(inner.len() > 60, "{scheme:?}: smoothed");
            for p in inner {
                let bits = p.to_array().map(f64::to_bits);
                let others = (0..3).filter(|i| *i != k && sets[*i].contains(&bits)).count();
                assert!(others > 0, "{scheme:?}: {p} of figure {k} is in no other");
            }
        }
        // The plane is covered without gap or overlap: 100 x 100 mm, corners and rim kept.
        assert!((area(&figures) - 10_000.0).abs() < 1e-6, "{scheme:?}: {}", area(&figures));
    }
}

/// A picture of 48 x 48 pixels as PNG.
fn png(color: impl Fn(i32, i32) -> [u8; 3]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, 48, 48);
    encoder.set_color(png::ColorType::Rgb);
    let mut writer = encoder.write_header().unwrap();
    let data: Vec<u8> = (0..48)
        .flat_map(|y| (0..48).flat_map(move |x| [(x, y)]))
        .flat_map(|(x, y)| color(x, y))
        .collect();
    writer.write_image_data(&data).unwrap();
    writer.finish().unwrap();
    bytes
}

#[test]
fn layers_of_a_picture_stay_next_to_each_other() {
    // A disc in two colours on a third one, on the backdrop: junctions and a closed border.
    let bytes = png(|x, y| {
        let (dx, dy) = (x - 24, y - 24);
        match dx * dx + dy * dy {
            r if r > 21 * 21 => [255, 255, 255],
            r if r > 14 * 14 => [200, 30, 30],
            _ if dx > dy / 2 => [30, 200, 30],
            _ => [30, 30, 200],
        }
    });
    let artwork = ArtworkSpec {
        file: "p.png".to_owned(),
        fit: Size::Own,
        at: Place::Center,
        font_dirs: vec![],
        dpi: None,
        trace: TraceSpec { simplify_px: 0.6, ..TraceSpec::default() },
    };
    let art = read_bitmap(&bytes, &artwork).unwrap();
    for scheme in SCHEMES {
        let layers = [Rgb(200, 30, 30), Rgb(30, 200, 30), Rgb(30, 30, 200)]
            .map(|c| LayerSpec { smooth: Some(spec(scheme)), ..layer(Selector::Fill(c)) });
        let placed = art.place(&layers, 1.0, DVec2::ZERO).unwrap();
        let outlines = trace(&placed, &layers, &Tolerance::default()).unwrap();
        let figures: Vec<&Figure> = outlines.layers.iter().flat_map(|l| &l.figures).collect();
        assert_eq!(figures.len(), 3, "{:?}", outlines.notes);
        // The ring's hole is the disc: what it loses the two halves have, to the last bit of every vertex.
        let all: HashSet<[u64; 2]> = figures[1..]
            .iter()
            .flat_map(|f| vertices(f))
            .map(|p| p.to_array().map(f64::to_bits))
            .collect();
        let hole = &figures[0].regions[0].holes[0];
        assert!(hole.len() > 40);
        assert!(hole.iter().all(|p| all.contains(&p.to_array().map(f64::to_bits))), "{scheme:?}");
    }
}

#[test]
fn what_covers_a_layer_covers_it_as_smoothed() {
    let body = format!(
        "<rect fill='#00ff00' x='10' y='10' width='80' height='80'/><g fill='#ff0000'>{}</g>",
        path(&on_circle(12, 30.0))
    );
    let below = LayerSpec { visible: true, ..layer(Selector::Fill(Rgb(0, 255, 0))) };
    let above = LayerSpec { smooth: Some(spec(INCENTER)), ..layer(Selector::Fill(Rgb(255, 0, 0))) };
    let outlines = traced(&body, &[below, above]);
    let areas: Vec<f64> = outlines.layers.iter().map(|l| area(&l.figures)).collect();
    assert!((areas[0] + areas[1] - 6400.0).abs() < 1e-5, "{areas:?}");
    assert!((areas[1] - PI * 900.0).abs() < 0.4);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    /// Any polygons, of which some coincide, cross or double back, become regions that keep their laws, or nothing.
    #[test]
    fn any_polygon_is_smoothed_or_refused(
        polygons in prop::collection::vec(prop::collection::vec((0u8..12, 0u8..12), 1..14), 1..4),
        scheme in 0..SCHEMES.len(),
        corner_deg in prop_oneof![Just(40.0_f64), Just(100.0), Just(180.0)],
        rule in prop_oneof![Just("nonzero"), Just("evenodd")],
    ) {
        let mut body = format!("<path d='M0 0L99 0L99 1L0 1Z'/><g fill-rule='{rule}'>");
        for polygon in polygons {
            let points: Vec<DVec2> = polygon
                .iter()
                .map(|&(x, y)| DVec2::new(f64::from(x) * 7.0 + 4.0, f64::from(y) * 7.0 + 8.0))
                .collect();
            body += &path(&points);
        }
        body += "</g>";
        let spec = SmoothSpec { corner_rad: corner_deg.to_radians(), ..spec(SCHEMES[scheme]) };
        // `traced` checks the laws of every region.
        let (figures, _) = smooth(&body, &spec);
        prop_assert!(figures.iter().all(|f| vertices(f).iter().all(|p| p.is_finite())));
    }
}

/// A drawing's crest, smoothed, and the notes.
fn crest_of(d: &str, smooth: SmoothSpec) -> (RidgePath, Vec<String>) {
    let course = CourseSpec::Paths {
        select: Selector::Id("c".into()),
        heights: vec![],
        smooth: Some(smooth),
    };
    let (sharp, half_width_mm, ends) = (false, None, CrestEnds::Natural);
    let crests = vec![DrawnCrestSpec { course, sharp, half_width_mm, ends }];
    let surface = SurfaceSpec::Drawn(DrawnSpec { crests, crest: CrestSpec::default() });
    let layer = LayerSpec { surface, ..layer(Selector::Id("o".into())) };
    let body = format!(
        "<rect id='o' x='1' y='1' width='98' height='98'/><path id='c' fill='none' stroke='red' d='{d}'/>"
    );
    let mut outlines = traced(&body, &[layer]);
    let [ref crest] = outlines.layers[0].ridges[..] else { panic!("one line") };
    (crest.clone(), std::mem::take(&mut outlines.notes))
}

/// The incenter scheme makes circles of uneven points on one: of an open line an arc between its own ends. Drawings come in
/// single precision.
#[test]
fn drawn_crests_are_smoothed_between_their_ends() {
    let centre = DVec2::splat(50.0);
    let on = |degrees: f64| {
        let (sin, cos) = libm::sincos(degrees.to_radians());
        centre + DVec2::new(cos, sin) * 30.0
    };
    let points = [0.0, 25.0, 40.0, 75.0, 100.0, 140.0, 160.0].map(on);
    let line: Vec<String> = points.iter().map(|p| format!("{} {}", p.x, p.y)).collect();
    let (crest, notes) = crest_of(&format!("M{}", line.join("L")), spec(INCENTER));
    assert_eq!(notes, Vec::<String>::new());
    assert!(!crest.closed && crest.points.len() > 100);
    let radius = (points[0] - centre).length();
    let middle = |p: &DVec2| DVec2::new(p.x, 100.0 - p.y);
    // Work coordinates run upwards.
    let all: Vec<DVec2> = crest.points.iter().map(middle).collect();
    assert!(all.iter().all(|p| (p.distance(centre) - radius).abs() < 1e-4));
    assert!(all[0].distance(points[0]) < 1e-5 && all[all.len() - 1].distance(points[6]) < 1e-5);
    assert!(points.iter().all(|p| all.iter().any(|q| p.distance(*q) < 1e-5)));
}

/// Corners stay and part the pieces, curves stay, two points are a line, and what changes nothing is told.
#[test]
fn corners_curves_and_short_lines_of_crests_stay() {
    let (crest, notes) = crest_of("M10 50L30 50L50 55L50 75L48 90", spec(Scheme::Chaikin));
    assert_eq!(notes, Vec::<String>::new());
    assert!(crest.points.contains(&DVec2::new(50.0, 45.0)), "the corner");
    assert!(!crest.points.contains(&DVec2::new(30.0, 50.0)), "cut");
    let (crest, notes) = crest_of("M10 50L90 50", spec(INCENTER));
    assert_eq!(crest.points.first(), Some(&DVec2::new(10.0, 50.0)));
    assert_eq!(crest.points.last(), Some(&DVec2::new(90.0, 50.0)));
    assert!(notes[0].contains("smooth of crest 1 changes nothing"), "{notes:?}");
    let (curve, notes) = crest_of("M10 50C30 20 60 20 90 50", spec(INCENTER));
    assert!(notes[0].contains("1 drawn curve is kept"), "{notes:?}");
    assert_eq!(curve.points.last(), Some(&DVec2::new(90.0, 50.0)));
    let (ring, _) =
        crest_of("M30 50L50 30L70 50L50 70Z", SmoothSpec { corner_rad: 3.2, ..spec(BSPLINE) });
    assert!(ring.closed && ring.points.len() > 20);
    assert!(!ring.points.contains(&DVec2::new(30.0, 50.0)));
}
