//! Areas, laws and notes of traced artwork.

mod laws;
mod random;
mod smooth;

use std::f64::consts::PI;

use super::*;
use crate::artwork::{FillRule, Fonts, Part, Placed, Shape, read_svg};
use crate::geom::{Tolerance, distance_to_segment};
use crate::job::{Combine, LayerSpec, Profile, Rgb, Selector, SurfaceSpec};

fn layer(select: Selector) -> LayerSpec {
    LayerSpec {
        name: select.to_string(),
        select,
        surface: SurfaceSpec::Profile { profile: Profile::Parabola, radius_mm: None },
        base_mm: 0.0,
        height_mm: 1.0,
        offset_mm: 0.0,
        combine: Combine::Max,
        blend_mm: 0.0,
        feather_mm: 0.0,
        draft_rad: 0.0,
        slope_cap: f64::INFINITY,
        union: false,
        smooth: None,
        visible: false,
        edits: None,
    }
}

/// Places a drawing of 100 x 100 units, one unit a millimetre, at its own coordinates (y up).
fn placed(body: &str, layers: &[LayerSpec]) -> Placed {
    let text = format!(
        "<svg xmlns='http://www.w3.org/2000/svg' width='100' height='100'>\n{body}\n</svg>"
    );
    let art = read_svg(text.as_bytes(), &Fonts::none()).unwrap();
    art.place(layers, 1.0, art.bounds().min).unwrap()
}

fn traced(body: &str, layers: &[LayerSpec]) -> Outlines {
    let outlines = trace(&placed(body, layers), layers, &Tolerance::default()).unwrap();
    for region in outlines.layers.iter().flat_map(|l| &l.figures).flat_map(|f| &f.regions) {
        assert_eq!(region.check(), Ok(()));
    }
    outlines
}

/// The figures of a drawing whose only layer takes everything, and the notes.
fn all(body: &str) -> (Vec<Figure>, Vec<String>) {
    let mut outlines = traced(body, &[layer(Selector::All)]);
    (outlines.layers.remove(0).figures, outlines.notes)
}

fn area(figures: &[Figure]) -> f64 {
    figures.iter().flat_map(|f| &f.regions).map(Region::area).sum()
}

fn counts(figures: &[Figure]) -> Vec<(usize, usize)> {
    let holes = |f: &Figure| f.regions.iter().map(|r| r.holes.len()).sum();
    figures.iter().map(|f| (f.regions.len(), holes(f))).collect()
}

#[test]
fn a_circle_is_flattened_to_within_the_chord_tolerance() {
    for r in [0.5, 5.0, 45.0] {
        let body = format!("<circle cx='50' cy='50' r='{r}'/>");
        let (figures, notes) = all(&body);
        let ring = &figures[0].regions[0].outer;
        // `usvg` draws a circle as four cubics, good to 3e-4 of the radius; the rest is the chords'. Flattening
        // spends a tenth of its tolerance on quadratics in between, so vertices may be off by that.
        let slack = 3e-4 * r + 1e-4;
        let center = DVec2::splat(50.0);
        for (i, a) in ring.iter().enumerate() {
            let b = ring[(i + 1) % ring.len()];
            let gap = r - distance_to_segment(center, *a, b);
            assert!(gap.abs() <= 0.02 + slack, "r {r}: {gap}");
            assert!(
                (a.distance(center) - r).abs() <= slack + 0.002,
                "r {r}: {}",
                a.distance(center) - r
            );
        }
        let missing = PI * r * r - area(&figures);
        assert!(missing.abs() <= 2.0 * PI * r * (0.02 + slack), "r {r}: {missing}");
        // A regular polygon with a tenth of the chord tolerance has pi / sqrt(2 * 0.002 / r) sides.
        let needed = PI / (0.004 / r).sqrt();
        assert!(
            (ring.len() as f64) < 1.2 * needed + 16.0,
            "{} vertices, {needed:.0} needed",
            ring.len()
        );
        assert_eq!(notes, Vec::<String>::new());
    }
}

#[test]
fn strokes_have_the_area_of_width_times_length() {
    let close = |body: &str, expected: f64, slack: f64| {
        let (figures, notes) = all(body);
        let got = area(&figures);
        assert!((got - expected).abs() < slack, "{body}: {got} for {expected}");
        assert_eq!(notes, Vec::<String>::new(), "{body}");
    };
    let line =
        |more: &str| format!("<path d='M20 30L60 60' stroke='#000' stroke-width='4' {more}/>");
    close(&line(""), 50.0 * 4.0, 1e-3);
    close(&line("stroke-linecap='square'"), 54.0 * 4.0, 1e-3);
    close(&line("stroke-linecap='round'"), 200.0 + PI * 4.0, 0.2);
    // A frame: 24 x 24 less 16 x 16; with round joins the corners lose 4 r^2 - pi r^2, r = 2.
    let frame = |more: &str| {
        format!(
            "<rect x='20' y='20' width='20' height='20' fill='none' stroke='#000' stroke-width='4' {more}/>"
        )
    };
    close(&frame(""), 576.0 - 256.0, 1e-3);
    close(&frame("stroke-linejoin='round'"), 320.0 - 16.0 + 4.0 * PI, 0.2);
    // A bevel cuts each corner's square of side 2 in half.
    close(&frame("stroke-linejoin='bevel'"), 320.0 - 8.0, 1e-3);
    close(
        "<circle cx='50' cy='50' r='20' fill='none' stroke='#000' stroke-width='2'/>",
        PI * (441.0 - 361.0),
        3.0,
    );
}

#[test]
fn stars_are_filled_by_their_own_rule() {
    let r = 40.0;
    let tip = |k: u32| {
        let a = f64::from(k) * 0.8 * PI;
        format!("{},{} ", 50.0 - r * libm::sin(a), 50.0 - r * libm::cos(a))
    };
    let points: String = (0..5).map(tip).collect();
    let deg = |d: f64| libm::sin(d.to_radians());
    let inner = r * deg(18.0) / deg(54.0);
    let star = 5.0 * r * inner * deg(36.0);
    let pentagon = 2.5 * inner * inner * deg(72.0);

    let (figures, notes) = all(&format!("<polygon id='s' points='{points}'/>"));
    assert!((area(&figures) - star).abs() < 1e-3);
    assert_eq!(counts(&figures), [(1, 0)]);
    assert_eq!(
        notes,
        ["layer 'all': 1 shape crosses itself and was resolved by its own fill rule: \
          polygon 's' (line 2) 5 times -> 1 region (non-zero)"]
    );

    let (figures, notes) = all(&format!("<polygon id='s' fill-rule='evenodd' points='{points}'/>"));
    assert!((area(&figures) - (star - pentagon)).abs() < 0.02, "the points are parted by a hair");
    assert_eq!(counts(&figures), [(5, 0)], "five points that touch are five regions");
    assert!(notes[0].contains("5 times -> 5 regions (even-odd)"), "{notes:?}");
    assert!(notes[1].contains("1 shape touches itself"), "{notes:?}");
    assert!(notes[1].contains("at 5 places"), "{notes:?}");
}

#[test]
fn rings_nest_and_islands_are_regions_of_their_own() {
    let square = |at: f64, side: f64| format!("M{at} {at}h{side}v{side}h-{side}z");
    let d =
        [square(10.0, 80.0), square(20.0, 60.0), square(30.0, 40.0), square(40.0, 20.0)].concat();
    let (figures, notes) = all(&format!("<path fill-rule='evenodd' d='{d}'/>"));
    assert_eq!(counts(&figures), [(2, 2)]);
    let mut areas: Vec<f64> = figures[0].regions.iter().map(|r| r.area().round()).collect();
    areas.sort_by(f64::total_cmp);
    assert_eq!(areas, [1200.0, 2800.0]);
    assert_eq!(notes, Vec::<String>::new());
    // The non-zero rule fills them all: they run the same way round.
    let (figures, _) = all(&format!("<path d='{d}'/>"));
    assert_eq!(counts(&figures), [(1, 0)]);
    assert!((area(&figures) - 6400.0).abs() < 1e-3);
}

#[test]
fn squares_that_touch_at_a_corner_become_two_regions_a_hair_apart() {
    let (figures, notes) = all("<path d='M10 10h20v20h-20zM30 30h20v20h-20z'/>");
    assert_eq!(counts(&figures), [(2, 0)]);
    let corners: Vec<DVec2> = figures[0]
        .regions
        .iter()
        .map(|r| {
            *r.outer
                .iter()
                .min_by(|a, b| {
                    (a.distance(DVec2::new(30.0, 70.0)))
                        .total_cmp(&b.distance(DVec2::new(30.0, 70.0)))
                })
                .unwrap()
        })
        .collect();
    assert!(
        (corners[0].distance(corners[1]) - 2e-4).abs() < 1e-6,
        "each copy moves 1e-4 into its own square"
    );
    assert_eq!(
        notes,
        [
            "layer 'all': 1 shape touches itself and was parted there by 0.0001 mm: path (line 2) at 1 place"
        ]
    );
}

#[test]
fn a_hole_that_touches_the_outline_opens_to_it() {
    // A square with a diamond whose left tip lies on the left side.
    let (figures, _) =
        all("<path fill-rule='evenodd' d='M10 10h60v60h-60zM10 40L40 20L60 40L40 60z'/>");
    assert_eq!(counts(&figures), [(1, 0)]);
    assert!((area(&figures) - (3600.0 - 1000.0)).abs() < 0.02, "{}", area(&figures));
    // With two holes that touch each other the wall between them opens.
    let (figures, _) = all(
        "<path fill-rule='evenodd' d='M10 10h80v80h-80zM20 50l15-15l15 15l-15 15zM50 50l15-15l15 15l-15 15z'/>",
    );
    assert_eq!(counts(&figures), [(1, 1)]);
    assert!((area(&figures) - (6400.0 - 900.0)).abs() < 0.02);
}

#[test]
fn each_path_is_a_figure_and_union_melts_them() {
    let body = "<rect x='10' y='10' width='40' height='40' fill='#f00'/><rect x='30' y='30' width='40' height='40' fill='#f00'/>";
    let (figures, notes) = all(body);
    assert_eq!(counts(&figures), [(1, 0), (1, 0)]);
    assert_eq!(figures[0].source, "rect (line 2)");
    assert!((area(&figures) - 3200.0).abs() < 1e-3);
    assert_eq!(notes, Vec::<String>::new());
    let union = LayerSpec { union: true, ..layer(Selector::All) };
    let melted = traced(body, &[union]);
    assert_eq!(counts(&melted.layers[0].figures), [(1, 0)]);
    assert!((area(&melted.layers[0].figures) - 2800.0).abs() < 1e-3);
    assert_eq!(melted.layers[0].figures[0].source, "the 2 paths of the layer together");
}

#[test]
fn visible_keeps_what_paint_order_leaves() {
    let body = "<rect id='low' x='10' y='10' width='40' height='40' fill='#f00'/>\
                <rect id='under' x='36' y='36' width='8' height='8' fill='#0f0'/>\
                <rect id='high' x='30' y='30' width='40' height='40' fill='#00f' stroke='#000' stroke-width='2'/>";
    let visible = |c: Rgb| LayerSpec { visible: true, ..layer(Selector::Fill(c)) };
    let red = traced(body, &[visible(Rgb(255, 0, 0))]);
    // The blue square with its stroke begins at 29; `under` is below it.
    assert!((area(&red.layers[0].figures) - (1600.0 - 21.0 * 21.0)).abs() < 1e-3);
    let blue = traced(body, &[visible(Rgb(0, 0, 255))]);
    assert!(
        (area(&blue.layers[0].figures) - 38.0 * 38.0).abs() < 1e-3,
        "its own stroke lies over it"
    );
    let layers = [visible(Rgb(0, 255, 0))];
    let e = trace(&placed(body, &layers), &layers, &Tolerance::default()).unwrap_err();
    let words = e.to_string();
    assert!(words.contains("layer 'fill:#00ff00': nothing is left"), "{words}");
    assert!(words.contains("rect 'under' (line 2)") && words.contains("painted over"), "{words}");
}

#[test]
fn what_is_too_small_is_named_and_left_out() {
    let (figures, notes) = all("<rect width='50' height='50'/>\
         <rect id='dust' x='60' width='0.01' height='0.01'/>\
         <path id='crumbs' d='M60 10h9v9h-9z M80 10h0.01v0.01h-0.01z'/>");
    assert_eq!(counts(&figures), [(1, 0), (1, 0)]);
    assert_eq!(
        notes,
        [
            "layer 'all': 1 shape lost parts or holes too small to carve (below 0.02 mm square): \
             path 'crumbs' (line 2) 1 sliver",
            "layer 'all': 1 shape is too small to carve (below 0.02 mm square) and was left out: \
             rect 'dust' (line 2)",
        ]
    );
    let layers = [layer(Selector::Id("dust".into()))];
    let body = "<rect width='50' height='50'/><rect id='dust' x='60' width='0.01' height='0.01'/>";
    let e = trace(&placed(body, &layers), &layers, &Tolerance::default()).unwrap_err();
    assert!(
        matches!(&e, OutlineError::EmptyLayer { why, .. } if why.contains("rect 'dust'")),
        "{e}"
    );
}

#[test]
fn doubled_lines_and_spikes_vanish() {
    // A square with a hair sticking out and back, and a notch that is walked twice.
    let (figures, _) = all("<path d='M10 10H50V50H90H50V90H10V60H30H10z'/>");
    assert_eq!(counts(&figures), [(1, 0)]);
    assert!((area(&figures) - 3200.0).abs() < 1e-3);
    assert!(figures[0].regions[0].outer.iter().all(|p| p.x < 50.001));
}

#[test]
fn notes_stay_few_however_many_paths_there_are() {
    let bow = |i: u32| format!("<path d='M{i} 0L{0} 10L{0} 0L{i} 10z'/>", i + 1);
    let body = (0..60).map(bow).collect::<Vec<_>>().concat();
    let (_, notes) = all(&body);
    assert_eq!(notes.len(), 2, "{notes:?}");
    assert!(notes[0].starts_with("layer 'all': 60 shapes cross themselves"), "{notes:?}");
    assert!(notes[0].ends_with("and 57 more"), "{notes:?}");
}

fn shape_of(curve: kurbo::BezPath) -> Placed {
    let shape = Shape {
        curve,
        course: None,
        rule: FillRule::EvenOdd,
        part: Part::Fill,
        color: Rgb(0, 0, 0),
        source: "path 'x' (line 1)".into(),
        ids: vec![],
        labels: vec![],
        layers: vec![],
    };
    let bounds = Bounds::new(DVec2::ZERO, DVec2::splat(100.0));
    Placed { shapes: vec![shape], layers: vec![vec![0]], bounds, notes: vec![] }
}

#[test]
fn hostile_curves_are_refused_with_their_name() {
    let layers = [layer(Selector::All)];
    let run = |placed: &Placed, chord_mm: f64| {
        trace(placed, &layers, &Tolerance { chord_mm, ..Tolerance::default() })
    };
    let polygon = |points: &[(f64, f64)]| {
        let mut path = kurbo::BezPath::new();
        path.move_to(points[0]);
        points[1..].iter().for_each(|p| path.line_to(*p));
        path.close_path();
        shape_of(path)
    };
    let square = polygon(&[(0.0, 0.0), (9.0, 0.0), (9.0, 9.0)]);
    for chord_mm in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(matches!(run(&square, chord_mm), Err(OutlineError::Chord { .. })), "{chord_mm}");
    }
    for bad in [f64::NAN, f64::INFINITY] {
        let e = run(&polygon(&[(0.0, 0.0), (bad, 0.0), (9.0, 9.0)]), 0.02).unwrap_err();
        assert_eq!(e, OutlineError::NotFinite { shape: "path 'x' (line 1)".into() });
    }
    // 1501 diagonals of a circle: more than 500,000 crossings.
    let n = 1501_u32;
    let chords: Vec<(f64, f64)> = (0..n)
        .map(|i| {
            let a = f64::from(i) * f64::from(n / 2) / f64::from(n) * std::f64::consts::TAU;
            (50.0 + 50.0 * libm::cos(a), 50.0 + 50.0 * libm::sin(a))
        })
        .collect();
    assert!(matches!(run(&polygon(&chords), 0.02), Err(OutlineError::Scribble { .. })));
    let mut round = kurbo::BezPath::new();
    round.move_to((0.0, 0.0));
    round.curve_to((100.0, 0.0), (100.0, 100.0), (0.0, 100.0));
    assert!(matches!(run(&shape_of(round), 1e-12), Err(OutlineError::TooFine { .. })));
}

/// Path of a sample's artwork.
fn sample(path: &str) -> Vec<u8> {
    std::fs::read(format!("{}/samples/{path}", env!("CARGO_MANIFEST_DIR"))).unwrap()
}

fn at_140_mm(bytes: &[u8], edit: impl Fn(&mut LayerSpec)) -> (Placed, Vec<LayerSpec>) {
    let art = read_svg(bytes, &Fonts::none()).unwrap();
    let mut layers: Vec<LayerSpec> =
        art.layers_found().into_iter().map(|f| layer(f.select)).collect();
    layers.iter_mut().for_each(edit);
    let unit_mm = 140.0 / art.bounds().size().max_element();
    let placed = art.place(&layers, unit_mm, DVec2::ZERO).unwrap();
    (placed, layers)
}

#[test]
fn real_artwork_keeps_every_law_in_every_mode() {
    for file in
        ["lotus/lotus.svg", "celtic-square/celtic-square.svg", "cloud/cloud.svg", "tiger/tiger.svg"]
    {
        let bytes = sample(file);
        for (visible, union) in [(false, false), (true, false), (false, true), (true, true)] {
            let (placed, layers) = at_140_mm(&bytes, |l| (l.visible, l.union) = (visible, union));
            let outlines = trace(&placed, &layers, &Tolerance::default()).unwrap();
            for figure in outlines.layers.iter().flat_map(|l| &l.figures) {
                assert!(!figure.regions.is_empty());
                for region in &figure.regions {
                    assert_eq!(region.check(), Ok(()), "{file} {}", figure.source);
                }
            }
            assert!(outlines.notes.len() <= 4 * layers.len(), "{:#?}", outlines.notes);
        }
    }
}

#[test]
fn petals_of_one_colour_stay_separate_bodies() {
    let (placed, layers) = at_140_mm(&sample("lotus/lotus.svg"), |_| {});
    let outlines = trace(&placed, &layers, &Tolerance::default()).unwrap();
    let figures: Vec<usize> = outlines.layers.iter().map(|l| l.figures.len()).collect();
    assert_eq!(figures, [1, 1, 4, 4, 1]);
}

#[test]
fn the_celtic_square_has_its_holes() {
    let (placed, layers) =
        at_140_mm(&sample("celtic-square/celtic-square.svg"), |l| l.union = true);
    let outlines = trace(&placed, &layers, &Tolerance::default()).unwrap();
    let holes: usize = outlines.layers[0].figures[0].regions.iter().map(|r| r.holes.len()).sum();
    assert!(holes > 20, "{holes}");
}

#[test]
fn the_number_of_threads_changes_nothing() {
    let (placed, layers) = at_140_mm(&sample("tiger/tiger.svg"), |l| l.visible = true);
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let outlines = pool.install(|| trace(&placed, &layers, &Tolerance::default())).unwrap();
        format!("{outlines:?}")
    };
    assert!(with(1) == with(3));
}
