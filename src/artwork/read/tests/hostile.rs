//! Input that nobody meant to carve: one clear error each, never a panic.

use proptest::prelude::*;

use super::*;

fn refuse_text(text: &str) -> ArtworkError {
    read_svg(text.as_bytes(), &Fonts::none()).unwrap_err()
}

fn gzip(text: &[u8]) -> Vec<u8> {
    use std::io::Write;
    let mut packer = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::best());
    packer.write_all(text).unwrap();
    packer.finish().unwrap()
}

#[test]
fn compressed_svg_is_read_and_broken_compression_is_refused() {
    let packed = gzip(svg("<rect width='5' height='5'/>").as_bytes());
    assert_eq!(read_svg(&packed, &Fonts::none()).unwrap().shapes.len(), 1);
    let e = read_svg(&packed[..packed.len() - 12], &Fonts::none()).unwrap_err();
    assert!(matches!(e, ArtworkError::Compressed { .. }), "{e}");
}

#[test]
fn a_compression_bomb_stops_at_the_limit() {
    let packed = gzip(&vec![b' '; 300 << 20]);
    assert!(packed.len() < 1 << 20);
    let e = read_svg(&packed, &Fonts::none()).unwrap_err();
    assert!(matches!(e, ArtworkError::TooBig { .. }), "{e}");
}

#[test]
fn truncated_xml_is_located() {
    let whole = svg("<g>\n<rect width='5' height='5'/>\n</g>");
    let e = refuse_text(&whole[..whole.len() - 12]);
    assert!(matches!(e, ArtworkError::Xml { .. }), "{e}");
    let e = refuse_text(&svg("<rect width='5'\n height='5'>"));
    assert!(matches!(e, ArtworkError::Xml { line: 4, .. }), "{e}");
    for text in ["", "   ", "not xml", "<svg", "<?xml version='1.0'?>"] {
        assert!(matches!(refuse_text(text), ArtworkError::Xml { .. }), "{text}");
    }
}

#[test]
fn every_prefix_of_real_artwork_is_refused_or_read() {
    let path = format!("{}/samples/lotus/lotus.svg", env!("CARGO_MANIFEST_DIR"));
    let bytes = std::fs::read(path).unwrap();
    for end in (0..bytes.len() - 6).step_by(13) {
        assert!(read_svg(&bytes[..end], &Fonts::none()).is_err(), "{end}");
    }
}

#[test]
fn other_encodings_and_other_files_are_told_apart() {
    let e = read_svg(b"<svg>\n\xff\xfe</svg>", &Fonts::none()).unwrap_err();
    assert_eq!(e, ArtworkError::NotText { line: 2 });
    let e = refuse_text("<html><body/></html>");
    assert!(matches!(&e, ArtworkError::NotSvg { root, .. } if root == "html"), "{e}");
    let e = refuse_text("<svg width='5' height='5'/>");
    assert!(e.to_string().contains("without the namespace of SVG"), "{e}");
    let with_mark = format!("\u{feff}{}", svg("<rect width='5' height='5'/>"));
    assert!(read_svg(with_mark.as_bytes(), &Fonts::none()).is_ok());
}

#[test]
fn numbers_that_are_none_are_named_with_their_element() {
    for (body, attribute) in [
        ("<path id='p' d='M NaN 0 L 5 5'/>", "d"),
        ("<path id='p' d='M0 0L1e400 1'/>", "d"),
        ("<path id='p' d='M0 0L1e30 1V4z'/>", "d"),
        ("<path id='p' d='M0 0 inf 5z'/>", "d"),
        ("<polygon id='p' points='0,0 5'/>", "points"),
        ("<rect id='p' width='NaN' height='5'/>", "width"),
        ("<circle id='p' cx='1e99' r='5'/>", "cx"),
        ("<g id='p' transform='scale(nan)'><rect width='5' height='5'/></g>", "transform"),
        ("<rect id='p' width='5' height='5' stroke-width='1e30' stroke='#000'/>", "stroke-width"),
    ] {
        match refuse(body) {
            ArtworkError::Value { element, attribute: a, .. } => {
                assert!(element.contains("'p' (line 2)"), "{element}");
                assert_eq!(a, attribute, "{body}");
            }
            other => panic!("{body}: {other}"),
        }
    }
}

#[test]
fn products_of_large_transforms_are_caught() {
    let e = refuse(
        "<g transform='scale(1e8)'><g transform='scale(1e8)'><rect id='p' width='5' height='5'/></g></g>",
    );
    assert!(matches!(&e, ArtworkError::Value { element, .. } if element.contains("'p'")), "{e}");
}

#[test]
fn drawings_without_a_size_are_refused_at_their_line() {
    for (attributes, attribute) in [
        ("viewBox='0 0 0 10'", "viewBox"),
        ("viewBox='0 0 10'", "viewBox"),
        ("viewBox='0 0 10 NaN'", "viewBox"),
        ("width='0' height='5'", "width"),
        ("width='5' height='-5'", "height"),
        ("width='wide' height='5'", "width"),
    ] {
        let text = format!(
            "<?xml version='1.0'?>\n<svg xmlns='http://www.w3.org/2000/svg' {attributes}><rect width='1' height='1'/></svg>"
        );
        match refuse_text(&text) {
            ArtworkError::Size { line: 2, attribute: a, .. } => assert_eq!(a, attribute),
            other => panic!("{attributes}: {other}"),
        }
    }
}

#[test]
fn artwork_without_anything_to_carve_says_what_it_found() {
    let e = refuse("<g display='none' id='off'><rect width='5' height='5'/></g>");
    assert!(matches!(e, ArtworkError::Empty { .. }));
    assert!(e.to_string().contains("g 'off' (line 2): not carved, switched off"), "{e}");
    assert!(matches!(refuse(""), ArtworkError::Empty { .. }));
    assert!(matches!(refuse("<path d=''/>"), ArtworkError::Empty { .. }));
    assert!(matches!(refuse("<path d='M5 5'/>"), ArtworkError::Empty { .. }));
}

#[test]
fn nothing_outside_the_file_is_opened() {
    for body in [
        "<image id='i' href='photo.png' width='5' height='5'/>",
        "<image id='i' xlink:href='http://example.org/photo.png' width='5' height='5'/>",
        "<image id='i' xlink:href='file:///etc/passwd' width='5' height='5'/>",
        "<use id='i' href='other.svg#petal'/>",
        "<rect id='i' width='5' height='5' fill='url(paint.svg#a)'/>",
        "<rect id='i' width='5' height='5' style='clip-path: url(\"c.svg#a\")'/>",
        "<style id='i'>@import url(theme.css);</style>",
        "<style id='i'>.a { fill: url(http://example.org/p.svg#a) }</style>",
    ] {
        let e = refuse(&format!("<rect width='5' height='5'/>{body}"));
        assert!(
            matches!(&e, ArtworkError::External { element, .. } if element.contains("'i'")),
            "{body}: {e}"
        );
    }
    let sheet =
        format!("<?xml-stylesheet href='theme.css'?>{}", svg("<rect width='5' height='5'/>"));
    assert!(matches!(refuse_text(&sheet), ArtworkError::External { .. }));
    let entity = format!(
        "<!DOCTYPE svg [<!ENTITY x SYSTEM 'file:///etc/passwd'>]>{}",
        svg("<text>&x;</text><rect width='5' height='5'/>")
    );
    assert!(matches!(refuse_text(&entity), ArtworkError::Xml { .. }));
    // Harmless: links for readers, fonts that are not read.
    let ok = "<a xlink:href='http://example.org'><rect width='5' height='5'/></a>\
              <style>/* @import 'x' */ @font-face { font-family: F; src: url(f.woff) }</style>";
    assert_eq!(read(ok).shapes.len(), 1);
}

#[test]
fn deep_nesting_is_refused_at_its_line_and_what_is_allowed_fits_the_stack() {
    for depth in [300, 3000, 100_000] {
        let body = format!(
            "{}<rect width='5' height='5'/>{}",
            "<g>\n".repeat(depth),
            "</g>".repeat(depth)
        );
        match refuse(&body) {
            ArtworkError::TooDeep { line, limit } => {
                assert!((line as usize) > limit && (line as usize) < limit + 5, "{line}");
            }
            other => panic!("{depth}: {other}"),
        }
    }
    let body = |depth: usize| {
        let open = "<g transform='translate(0.001)' opacity='0.999'>".repeat(depth);
        format!("{open}<rect width='5' height='5'/>{}", "</g>".repeat(depth))
    };
    assert_eq!(read(&body(250)).shapes.len(), 1);
}

#[test]
fn entities_that_unfold_without_end_are_refused() {
    let mut dtd = String::from("<!DOCTYPE svg [<!ENTITY a0 \"<rect width='5' height='5'/>\">");
    for i in 1..20 {
        let inner = format!("&a{};", i - 1).repeat(10);
        dtd.extend(["<!ENTITY a", &i.to_string(), " \"", &inner, "\">"]);
    }
    dtd += "]>";
    let e = refuse_text(&(dtd + &svg("&a19;")));
    assert!(matches!(e, ArtworkError::Xml { .. } | ArtworkError::TooBig { .. }), "{e}");
    let circle = "<!DOCTYPE svg [<!ENTITY a '&b;'><!ENTITY b '&a;'>]>";
    assert!(matches!(refuse_text(&format!("{circle}{}", svg("&a;"))), ArtworkError::Xml { .. }));
}

#[test]
fn elements_from_entities_are_carved() {
    let dtd =
        "<!DOCTYPE svg [<!ENTITY r \"<rect width='5' height='5'/>\"><!ENTITY blue '#0000ff'>]>";
    let text = format!(
        "{dtd}{}",
        svg("&r;<g transform='translate(9)'>&r;</g><path fill='&blue;' d='M0 0h1v1z'/>")
    );
    let art = read_svg(text.as_bytes(), &Fonts::none()).unwrap();
    assert_eq!(art.shapes.len(), 3);
    assert_eq!(art.shapes[2].color, Rgb(0, 0, 255));
}

#[test]
fn uses_in_circles_are_refused() {
    for body in [
        "<g id='a'><use id='u' href='#a'/></g>",
        "<use id='u' href='#u'/>",
        "<g id='a'><use href='#b'/></g><g id='b'><use href='#c'/></g><g id='c'><use href='#a'/></g>",
        "<clipPath id='a' clip-path='url(#b)'><path d='M0 0h9v9z'/></clipPath>\
         <clipPath id='b' clip-path='url(#c)'><path d='M0 0h9v9z'/></clipPath>\
         <clipPath id='c' clip-path='url(#a)'><path d='M0 0h9v9z'/></clipPath><rect clip-path='url(#a)' width='5' height='5'/>",
        "<mask id='a'><rect mask='url(#b)' width='5' height='5'/></mask><mask id='b'><rect style='mask:url(#a)' width='5' height='5'/></mask>",
        "<style>.m { mask: url(#a) }</style><mask id='a'><rect class='m' width='5' height='5'/></mask>",
        "<pattern id='a' width='1' height='1'><rect fill='url(#b)' width='5' height='5'/></pattern>\
         <pattern id='b' width='1' height='1'><rect fill='url(#a)' width='5' height='5'/></pattern>",
        "<linearGradient id='a' href='#b'/><linearGradient id='b' href='#a'/>",
    ] {
        let e = refuse(&format!("<rect width='5' height='5'/>{body}"));
        assert!(matches!(e, ArtworkError::Circle { .. }), "{body}: {e}");
    }
    let e = refuse("<use id='u' href='#missing'/>");
    assert!(matches!(e, ArtworkError::Dangling { .. }), "{e}");
}

#[test]
fn uses_that_unfold_without_end_are_refused() {
    let mut body = String::from("<g id='g0'><rect width='5' height='5'/></g>");
    for i in 1..12 {
        let inner = format!("<use href='#g{}'/>", i - 1).repeat(10);
        body.extend(["<g id='g", &i.to_string(), "'>", &inner, "</g>"]);
    }
    let e = refuse(&body);
    assert!(matches!(e, ArtworkError::TooBig { .. }), "{e}");
    let mut chain = String::from("<g id='g0'><rect width='5' height='5'/></g>");
    for i in 1..2000 {
        chain.extend([
            "<g id='g",
            &i.to_string(),
            "'><use href='#g",
            &(i - 1).to_string(),
            "'/></g>",
        ]);
    }
    let e = refuse(&chain);
    assert!(matches!(e, ArtworkError::TooDeep { .. }), "{e}");
}

#[test]
fn dashes_without_end_are_refused() {
    let e = refuse("<path id='p' d='M0 0H100' stroke='#000' stroke-dasharray='1e-7'/>");
    assert!(matches!(&e, ArtworkError::Dashes { element, .. } if element.contains("'p'")), "{e}");
}

#[test]
fn errors_say_where_and_what_to_do() {
    let e = refuse("<path id='petal' d='M0 0L5 x'/>").to_string();
    assert_eq!(
        e,
        "path 'petal' (line 2): d is broken at \"x\": a number is missing; repair or remove the element"
    );
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]
    /// Whatever is done to the bytes, reading ends in artwork or an error.
    #[test]
    fn mangled_bytes_never_panic(edits in prop::collection::vec((0_usize..900, any::<u8>()), 1..8)) {
        let mut bytes = svg(
            "<style>.a{fill:#f00}</style><defs><clipPath id='c'><circle r='30'/></clipPath></defs>\
             <g id='g' transform='translate(3 4) rotate(5)' inkscape:label='x'><path class='a' d='M0 0C1 2 30 4 5 60Q7 8 9 9A5 5 0 0 1 50 50z' \
             stroke='#000' stroke-width='2' stroke-dasharray='3 4' stroke-linejoin='round'/></g>\
             <use href='#g' x='9' clip-path='url(#c)'/><ellipse cx='5' cy='5' rx='3' ry='40%'/>",
        ).into_bytes();
        for (at, byte) in edits {
            let at = at % bytes.len();
            bytes[at] = byte;
        }
        let _ = read_svg(&bytes, &Fonts::none());
    }

    /// Digits are where the danger is: any of them may become any other sign of a number.
    #[test]
    fn mangled_numbers_never_panic(edits in prop::collection::vec((0_usize..400, 0_usize..8), 1..6)) {
        let mut bytes = svg(
            "<g transform='matrix(1 0.5 0.25 2 3 4)'><path d='M10 20C11 22 33 44 55 66A15 25 10 0 1 50 50L1.5 20' \
             stroke='#000' stroke-width='12.5' stroke-dasharray='30 45'/><rect x='10' width='20' height='30' rx='4'/></g>",
        ).into_bytes();
        for (at, sign) in edits {
            let digits: Vec<usize> = (200..bytes.len()).filter(|i| bytes[*i].is_ascii_digit()).collect();
            let at = digits[at % digits.len()];
            bytes[at] = b"0915.-e "[sign];
        }
        let _ = read_svg(&bytes, &Fonts::none());
    }
}
