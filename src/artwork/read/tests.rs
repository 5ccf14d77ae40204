//! What comes out of documents: real artwork and the rules of SVG. Hostile input has a file of its own.

mod hostile;
mod text;

use super::*;
use crate::geom::DVec2;
use crate::job::Selector;

/// A document of 100 x 100 units.
fn svg(body: &str) -> String {
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" xmlns:xlink=\"http://www.w3.org/1999/xlink\" \
         xmlns:inkscape=\"http://www.inkscape.org/namespaces/inkscape\" width=\"100\" height=\"100\">\n{body}\n</svg>"
    )
}

fn read(body: &str) -> Artwork {
    read_svg(svg(body).as_bytes(), &Fonts::none()).unwrap()
}

fn refuse(body: &str) -> ArtworkError {
    read_svg(svg(body).as_bytes(), &Fonts::none()).unwrap_err()
}

fn sample(path: &str) -> Artwork {
    let path = format!("{}/samples/{path}", env!("CARGO_MANIFEST_DIR"));
    read_svg(&std::fs::read(path).unwrap(), &Fonts::none()).unwrap()
}

/// Asserts the corners of the box round the carvable shapes.
fn assert_box(art: &Artwork, min: (f64, f64), max: (f64, f64)) {
    let b = art.bounds();
    let off =
        (b.min - DVec2::new(min.0, min.1)).abs().max((b.max - DVec2::new(max.0, max.1)).abs());
    assert!(off.max_element() < 1e-4, "{b:?}");
}

fn has_note(art: &Artwork, words: &[&str]) -> bool {
    art.notes.iter().any(|n| words.iter().all(|w| n.contains(w)))
}

#[test]
fn the_lotus_is_eleven_paths_in_five_colours() {
    let art = sample("lotus/lotus.svg");
    assert_eq!((art.shapes.len(), art.unit_mm), (11, None));
    let found = art.layers_found();
    let colors: Vec<String> = found.iter().map(|f| f.select.to_string()).collect();
    assert_eq!(
        colors,
        ["fill:#008463", "fill:#f70a8d", "fill:#ff6dc6", "fill:#f837a2", "fill:#f9c23c"]
    );
    let names: Vec<&str> = found.iter().map(|f| f.name.as_str()).collect();
    assert_eq!(names, ["green", "magenta", "pink", "magenta-2", "yellow"]);
    // The yellow centre is a disc of radius 3.49.
    let disc = std::f64::consts::PI * 3.49 * 3.49;
    assert!((found[4].area - disc).abs() < 0.02, "{}", found[4].area);
}

#[test]
fn the_tiger_has_five_labelled_layers_and_the_size_that_it_says() {
    let art = sample("tiger/tiger.svg");
    assert_eq!(art.unit_mm, Some(25.4 / 96.0), "2000pt are a physical size");
    let mut layers: Vec<&str> =
        art.shapes.iter().flat_map(|s| &s.layers).map(String::as_str).collect();
    layers.dedup();
    assert_eq!(
        layers,
        ["Background", "pink and green", "white layer", "whiskerz", "black drawing"]
    );
    for shape in &art.shapes {
        assert!(shape.ids[0].starts_with("path"), "{:?}", shape.ids);
    }
    let strokes = art.shapes.iter().filter(|s| s.part == Part::Stroke).count();
    assert!(strokes > 0);
}

#[test]
fn y_points_up_and_units_are_css_pixels() {
    let art = read("<rect x='10' y='20' width='30' height='5'/>");
    assert_box(&art, (10.0, 75.0), (40.0, 80.0));
    let shape = &art.shapes[0];
    assert_eq!(
        (shape.part, shape.color, shape.rule),
        (Part::Fill, Rgb(0, 0, 0), FillRule::NonZero)
    );
    assert_eq!(shape.source, "rect (line 2)");
}

#[test]
fn physical_units_give_millimetres() {
    for (width, mm) in
        [("50mm", 50.0), ("5cm", 50.0), ("2in", 50.8), ("144pt", 50.8), ("12pc", 50.8)]
    {
        let text = format!(
            "<svg xmlns='http://www.w3.org/2000/svg' width='{width}' height='{width}' viewBox='0 0 10 10'>\
             <rect width='10' height='10'/></svg>"
        );
        let art = read_svg(text.as_bytes(), &Fonts::none()).unwrap();
        let side = art.bounds().size().x * art.unit_mm.unwrap();
        assert!((side - mm).abs() < 1e-4, "{width}: {side}");
    }
    for width in ["50", "50px", "100%"] {
        let text = format!(
            "<svg xmlns='http://www.w3.org/2000/svg' width='{width}' viewBox='0 0 10 10'>\
             <rect width='10' height='10'/></svg>"
        );
        assert_eq!(read_svg(text.as_bytes(), &Fonts::none()).unwrap().unit_mm, None, "{width}");
    }
}

#[test]
fn a_view_box_moves_and_scales() {
    let text = "<svg xmlns='http://www.w3.org/2000/svg' width='100' height='100' viewBox='-10 -10 20 20'>\
                <rect x='-10' y='-10' width='4' height='2'/></svg>";
    let art = read_svg(text.as_bytes(), &Fonts::none()).unwrap();
    assert_box(&art, (0.0, 90.0), (20.0, 100.0));
}

#[test]
fn transforms_and_uses_apply_from_the_inside_out() {
    let art = read(
        "<defs><rect id='r' width='10' height='4' inkscape:label='brick'/></defs>\
         <g transform='translate(20 0)'><use id='u' xlink:href='#r' transform='scale(2)' x='5'/></g>",
    );
    // x: 20 + 2 * (5..15), y: 100 - 2 * (0..4)
    assert_box(&art, (30.0, 92.0), (50.0, 100.0));
    let shape = &art.shapes[0];
    assert_eq!(shape.ids, ["r", "u"], "what a use draws answers to both names");
    assert_eq!(shape.labels, ["brick"]);
    assert!(shape.is_selected_by(&Selector::Id("r".into())));
}

#[test]
fn labels_and_layers_come_from_the_groups_around() {
    let art = read(
        "<g inkscape:groupmode='layer' inkscape:label='Leaves' id='l'>\
         <g inkscape:label='left'><path d='M0 0h5v5z' inkscape:label='tip'/></g></g>\
         <path id='x' d='M0 0h5v5z'/>",
    );
    assert_eq!(art.shapes[0].labels, ["tip", "left", "Leaves"]);
    assert_eq!(art.shapes[0].layers, ["Leaves"]);
    assert_eq!(art.shapes[0].source, "path 'tip' (line 2)");
    assert!(art.shapes[0].is_selected_by(&Selector::Layer("Leaves".into())));
    assert!(!art.shapes[0].is_selected_by(&Selector::Layer("left".into())), "a group, no layer");
    assert!(art.shapes[1].labels.is_empty());
}

#[test]
fn elements_that_share_an_id_stay_apart() {
    let art = read(
        "<path id='a' inkscape:label='one' d='M0 0h5v5z'/><path id='a' inkscape:label='two' d='M9 9h5v5z'/>",
    );
    assert_eq!(art.shapes[0].labels, ["one"]);
    assert_eq!(art.shapes[1].labels, ["two"]);
    assert_eq!(art.shapes[1].ids, ["a"]);
}

#[test]
fn prefixed_elements_and_style_sheets_are_read() {
    let text = "<s:svg xmlns:s='http://www.w3.org/2000/svg' width='100' height='100'>\n\
                <s:style>.a { fill: #102030; fill-rule: evenodd }</s:style>\n<s:rect class='a' width='5' height='5'/></s:svg>";
    let art = read_svg(text.as_bytes(), &Fonts::none()).unwrap();
    assert_eq!(art.shapes[0].color, Rgb(0x10, 0x20, 0x30));
    assert_eq!(art.shapes[0].rule, FillRule::EvenOdd);
    assert_eq!(art.shapes[0].source, "rect (line 3)");
}

#[test]
fn fill_and_stroke_of_one_element_are_two_shapes_in_paint_order() {
    let art = read(
        "<rect x='10' y='10' width='10' height='10' fill='#ff0000' stroke='#ff0000' stroke-width='2'/>",
    );
    let parts: Vec<Part> = art.shapes.iter().map(|s| s.part).collect();
    assert_eq!(parts, [Part::Fill, Part::Stroke]);
    assert_box(&art, (9.0, 79.0), (21.0, 91.0));
    let found = art.layers_found();
    assert_eq!(found[0].name, "red");
    assert_eq!(found[1].name, "red-stroke");
    // The stroke is the frame 12 x 12 less 8 x 8.
    assert!(
        (found[0].area - 100.0).abs() < 1e-3 && (found[1].area - 80.0).abs() < 1e-3,
        "{found:?}"
    );
    let turned = read("<rect width='9' height='9' stroke='#ff0000' paint-order='stroke'/>");
    assert_eq!(turned.shapes[0].part, Part::Stroke);
}

#[test]
fn a_stroke_is_transformed_after_it_is_drawn() {
    // A horizontal line, stroke width 2, in a group that stretches y tenfold.
    let art =
        read("<g transform='scale(1 10)'><path d='M10 5H20' stroke='#000' stroke-width='2'/></g>");
    assert_box(&art, (10.0, 40.0), (20.0, 60.0));
    assert_eq!(art.shapes.len(), 1, "the fill of a bare line has no area");
}

#[test]
fn caps_are_as_fine_as_the_artwork_however_small_its_units() {
    let text = "<svg xmlns='http://www.w3.org/2000/svg' width='100' height='100' viewBox='0 0 0.1 0.1'>\
                <path d='M0.02 0.05H0.08' stroke='#000' stroke-width='0.02' stroke-linecap='round'/></svg>";
    let art = read_svg(text.as_bytes(), &Fonts::none()).unwrap();
    // In page units: a bar 60 x 20 and a disc of radius 10.
    let true_area = 60.0 * 20.0 + std::f64::consts::PI * 100.0;
    let area = art.layers_found()[0].area;
    // The estimate of the area is good to a chord of 1e-4 of the artwork along the caps: 0.3.
    assert!((area - true_area).abs() < 0.4, "{area} for {true_area}");
}

#[test]
fn dashes_are_cut() {
    let art = read("<path d='M0 50H100' stroke='#000' stroke-width='2' stroke-dasharray='10 15'/>");
    let area = art.layers_found()[0].area;
    assert!((area - 4.0 * 10.0 * 2.0).abs() < 1e-3, "{area}");
}

#[test]
fn a_gradient_becomes_the_mean_of_its_stops() {
    let art = read(
        "<linearGradient id='g'><stop stop-color='#000000'/><stop offset='1' stop-color='#ff8040'/></linearGradient>\
         <rect width='5' height='5' fill='url(#g)'/>",
    );
    assert_eq!(art.shapes[0].color, Rgb(128, 64, 32));
}

#[test]
fn clip_paths_cut_shapes() {
    let body = |clip: &str| {
        format!(
            "<clipPath id='c' {clip}><circle cx='50' cy='50' r='20'/></clipPath>\
             <g clip-path='url(#c)'><rect width='50' height='100'/></g>"
        )
    };
    let art = read(&body(""));
    assert_box(&art, (30.0, 30.0), (50.0, 70.0));
    let half_disc = std::f64::consts::PI * 200.0;
    assert!((art.layers_found()[0].area - half_disc).abs() < 0.5, "{:?}", art.layers_found());
    let moved = read(&body("transform='translate(-20 0)'"));
    assert_box(&moved, (10.0, 30.0), (50.0, 70.0));
}

#[test]
fn clip_paths_of_clip_paths_count_too() {
    let art = read(
        "<clipPath id='left'><rect width='50' height='100'/></clipPath>\
         <clipPath id='c' clip-path='url(#left)'><rect x='40' y='40' width='20' height='20'/></clipPath>\
         <clipPath id='d'><rect x='30' y='30' width='40' height='40' clip-path='url(#left)'/></clipPath>\
         <rect width='100' height='100' fill='#ff0000' clip-path='url(#c)'/>\
         <rect width='100' height='100' fill='#00ff00' clip-path='url(#d)'/>",
    );
    let areas: Vec<f64> = art.layers_found().iter().map(|f| f.area.round()).collect();
    assert_eq!(areas, [200.0, 800.0]);
}

#[test]
fn a_symbol_that_fits_its_window_keeps_its_curves() {
    let art = read(
        "<symbol id='s' viewBox='0 0 10 10'><circle cx='5' cy='5' r='4'/></symbol>\
         <use xlink:href='#s' width='50' height='50'/>",
    );
    assert_box(&art, (5.0, 55.0), (45.0, 95.0));
    assert!(
        art.shapes[0]
            .curve
            .elements()
            .iter()
            .any(|el| matches!(el, PathEl::CurveTo(..) | PathEl::QuadTo(..)))
    );
}

#[test]
fn open_paths_without_paint_are_kept_and_named() {
    let art = read(
        "<rect width='5' height='5'/><path id='cut' d='M0 0H50V20' fill='none' transform='translate(10 0)'/>\
         <path id='thin' d='M0 0L9 9' stroke='#000' stroke-width='0'/>",
    );
    let open: Vec<&Shape> = art.shapes.iter().filter(|s| s.part == Part::Open).collect();
    assert_eq!(open.len(), 2);
    assert_eq!(open[0].bounds().min, DVec2::new(10.0, 80.0));
    assert!(
        has_note(&art, &["path 'cut' (line 2)", "path 'thin'", "open path"]),
        "{:?}",
        art.notes
    );
    assert_box(&art, (0.0, 95.0), (5.0, 100.0));
    assert!(!open[0].is_selected_by(&Selector::All));
}

#[test]
fn what_is_not_carved_is_named() {
    let art = read(
        "<rect width='50' height='50'/>\n\
         <g id='off' display='none'><path d='M0 0h9v9z'/><path d='M0 0h9v9z'/></g>\n\
         <path id='styled' style='fill:red;display:none' d='M0 0h9v9z'/>\n\
         <path id='hidden' visibility='hidden' d='M0 0h9v9z'/>\n\
         <path id='clear' fill-opacity='0' d='M0 0h9v9z'/>\n\
         <g id='ghost' opacity='0'><path id='in-ghost' d='M0 0h9v9z'/></g>\n\
         <rect id='flat' width='0' height='9'/>\n\
         <rect id='frame' width='9' height='9' fill='none'/>\n\
         <clipPath id='c'><rect x='90' width='1' height='1'/></clipPath><rect id='gone' clip-path='url(#c)' width='9' height='9'/>\n\
         <rect id='far' x='200' width='9' height='9'/>\n\
         <rect id='glass' fill-opacity='0.5' width='9' height='9'/>\n\
         <image id='photo' href='data:image/png;base64,AAAA' width='9' height='9'/>\n\
         <foreignObject id='html' width='9' height='9'/>\n\
         <mask id='m'><rect width='5' height='5' fill='#fff'/></mask><rect id='masked' mask='url(#m)' width='9' height='9'/>\n\
         <filter id='f'><feGaussianBlur stdDeviation='2'/></filter><g id='blurred' filter='url(#f)'><rect width='9' height='9'/></g>\n\
         <pattern id='p' width='4' height='4' patternUnits='userSpaceOnUse'><rect width='2' height='2' fill='#123456'/></pattern>\
         <rect id='tiles' width='9' height='9' fill='url(#p)'/>\n\
         <rect id='css' class='off' width='9' height='9'/><style>.off { display: none }</style>",
    );
    for words in [
        ["g 'off' (line 3)", "display: none"],
        ["path 'styled'", "display: none"],
        ["path 'hidden'", "hidden"],
        ["path 'clear'", "fully transparent"],
        ["path 'in-ghost'", "fully transparent"],
        ["rect 'flat'", "paints nothing"],
        ["rect 'frame'", "neither filled nor stroked"],
        ["rect 'gone'", "inside its clip path"],
        ["rect 'far'", "outside the page"],
        ["rect 'glass'", "see-through"],
        ["image 'photo'", "bitmap"],
        ["foreignObject 'html'", "text box"],
        ["g 'blurred'", "filter"],
        ["rect 'tiles'", "pattern"],
        ["rect 'css'", "paints nothing"],
    ] {
        assert!(has_note(&art, &words), "{words:?} in {:#?}", art.notes);
    }
    assert!(has_note(&art, &["masks are not applied"]));
    let tiles = art.shapes.iter().find(|s| s.ids.iter().any(|id| id == "tiles")).unwrap();
    assert_eq!(tiles.color, Rgb(0x12, 0x34, 0x56));
    assert!(art.notes.len() < 20);
}

#[test]
fn nothing_is_said_about_artwork_without_oddities() {
    assert_eq!(read("<rect width='5' height='5'/>").notes, Vec::<String>::new());
}

mod placing {
    use super::*;
    use crate::job::{Combine, LayerSpec, Profile, SurfaceSpec};

    fn layer(select: Selector) -> LayerSpec {
        LayerSpec {
            name: "petals".into(),
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

    const BODY: &str = "<g id='flower' inkscape:label='Flower'><rect id='a' x='10' y='70' width='20' height='10' fill='#ff6dc6'/>\
        <rect id='b' x='20' y='60' width='20' height='10' fill='#008463' stroke='#000' stroke-width='0.5'/></g>";

    #[test]
    fn the_lower_left_corner_of_the_box_comes_to_its_place() {
        let art = read(
            "<rect x='10' y='70' width='20' height='10'/><rect x='20' y='60' width='20' height='10'/>",
        );
        let placed = art.place(&[layer(Selector::All)], 2.0, DVec2::new(5.0, 7.0)).unwrap();
        assert_eq!(placed.layers, [[0, 1]]);
        assert!((placed.bounds.min - DVec2::new(5.0, 7.0)).length() < 1e-9);
        assert!(
            (placed.bounds.max - DVec2::new(65.0, 47.0)).length() < 1e-9,
            "{:?}",
            placed.bounds
        );
        let second = placed.shapes[1].bounds();
        assert!((second.min - DVec2::new(25.0, 27.0)).length() < 1e-9, "{second:?}");
    }

    #[test]
    fn selectors_take_their_shapes() {
        let art = read(BODY);
        let take =
            |s: Selector| art.place(&[layer(s)], 1.0, DVec2::ZERO).unwrap().layers[0].clone();
        assert_eq!(take(Selector::All), [0, 1, 2]);
        assert_eq!(take(Selector::Fill(Rgb(0xff, 0x6d, 0xc6))), [0]);
        assert_eq!(take(Selector::Stroke(Rgb(0, 0, 0))), [2]);
        assert_eq!(take(Selector::Id("b".into())), [1, 2]);
        assert_eq!(take(Selector::Id("flower".into())), [0, 1, 2]);
        assert_eq!(take(Selector::Label("Flower".into())), [0, 1, 2]);
    }

    #[test]
    fn a_selector_without_shapes_is_told_what_there_is_nearest_first() {
        let art = read(BODY);
        let wrong = |s: Selector| art.place(&[layer(s)], 1.0, DVec2::ZERO).unwrap_err().to_string();
        let text = wrong(Selector::Fill(Rgb(0xff, 0x6c, 0xc7)));
        assert!(
            text.starts_with("layer 'petals': select = \"fill:#ff6cc7\" matches nothing"),
            "{text}"
        );
        assert!(text.contains("there is \"fill:#ff6dc6\", "), "{text}");
        assert!(wrong(Selector::Label("flowers".into())).contains("there is \"label:Flower\""));
        assert!(wrong(Selector::Layer("Flower".into())).contains("there is \"label:Flower\""));
    }

    #[test]
    fn a_layer_of_open_paths_is_explained() {
        let art = read("<rect width='5' height='5'/><path id='o' d='M0 0L9 9' fill='none'/>");
        let text = art
            .place(&[layer(Selector::Id("o".into()))], 1.0, DVec2::ZERO)
            .unwrap_err()
            .to_string();
        assert!(text.contains("open paths that paint nothing"), "{text}");
    }

    #[test]
    fn shapes_of_no_layer_are_counted() {
        let art = read(BODY);
        let select = Selector::Fill(Rgb(0xff, 0x6d, 0xc6));
        let placed = art.place(&[layer(select)], 1.0, DVec2::ZERO).unwrap();
        assert_eq!(
            placed.notes,
            [
                "2 shapes belong to no layer and will not be carved: 1 with fill:#008463, 1 with stroke:#000000"
            ]
        );
    }

    #[test]
    fn sizes_that_no_wood_has_are_refused() {
        let art = read(BODY);
        for unit_mm in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e9, 1e-9] {
            let e = art.place(&[layer(Selector::All)], unit_mm, DVec2::ZERO).unwrap_err();
            assert!(matches!(e, ArtworkError::Scale { .. }), "{e}");
        }
        assert!(art.place(&[layer(Selector::All)], 1.0, DVec2::NAN).is_err());
    }
}
