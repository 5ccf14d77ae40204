//! Text becomes outlines, with a font that is made here: one glyph, `I`, a box of 500 x 700 units of 1000.

use super::*;

/// Appends numbers of two bytes.
fn words(values: &[i32]) -> Vec<u8> {
    values.iter().flat_map(|v| (*v as i16).to_be_bytes()).collect()
}

fn long(value: u32) -> Vec<u8> {
    value.to_be_bytes().to_vec()
}

/// A TrueType font after the tables of the OpenType specification.
fn font(family: &str) -> Vec<u8> {
    let head = [
        long(0x0001_0000),
        long(0x0001_0000),
        long(0),
        long(0x5f0f_3cf5),
        words(&[0, 1000]),
        vec![0; 16],
        words(&[0, 0, 500, 700, 0, 8, 2, 0, 0]),
    ]
    .concat();
    let hhea =
        [long(0x0001_0000), words(&[800, -200, 0, 600, 0, 0, 500, 1, 0, 0, 0, 0, 0, 0, 0, 2])]
            .concat();
    let maxp = [long(0x0001_0000), words(&[2, 4, 1, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0])].concat();
    let hmtx = words(&[600, 0, 600, 0]);
    // Character I (73) is glyph 1.
    let cmap = [
        words(&[0, 1, 3, 1]),
        long(12),
        words(&[4, 32, 0, 4, 4, 1, 0, 73, -1, 0, 73, -1, 1 - 73, 1, 0, 0]),
    ]
    .concat();
    // One contour of four points on the curve, corners of the box.
    let glyph = [
        words(&[1, 0, 0, 500, 700, 3, 0]),
        vec![1; 4],
        words(&[0, 500, 0, -500]),
        words(&[0, 0, 700, 0]),
    ]
    .concat();
    let loca = words(&[0, 0, (glyph.len() / 2) as i32]);
    let letters: Vec<u8> = family.encode_utf16().flat_map(u16::to_be_bytes).collect();
    let n = letters.len() as i32;
    let record = |id: i32| words(&[3, 1, 0x409, id, n, 0]);
    let name = [words(&[0, 3, 42]), record(1), record(4), record(6), letters].concat();
    let os2 = [words(&[4, 600, 400, 5, 0]), vec![0; 86]].concat();
    let post = [long(0x0003_0000), vec![0; 28]].concat();
    let tables: [(&[u8; 4], Vec<u8>); 10] = [
        (b"OS/2", os2),
        (b"cmap", cmap),
        (b"glyf", glyph),
        (b"head", head),
        (b"hhea", hhea),
        (b"hmtx", hmtx),
        (b"loca", loca),
        (b"maxp", maxp),
        (b"name", name),
        (b"post", post),
    ];
    let mut out = [long(0x0001_0000), words(&[10, 128, 3, 32])].concat();
    let mut at = (out.len() + 16 * tables.len()) as u32;
    let mut body = Vec::new();
    for (tag, table) in &tables {
        let length = table.len() as u32;
        out.extend([tag.to_vec(), long(0), long(at), long(length)].concat());
        body.extend_from_slice(table);
        body.resize(body.len().next_multiple_of(4), 0);
        at += length.next_multiple_of(4);
    }
    out.extend(body);
    out
}

fn set(text: &str, fonts: &Fonts) -> Result<Artwork, ArtworkError> {
    read_svg(svg(text).as_bytes(), fonts)
}

#[test]
fn text_becomes_closed_outlines_of_its_element() {
    let fonts = Fonts::from_data(vec![font("Boxes")]);
    let art = set("<text id='motto' x='10' y='50' font-family='Boxes' font-size='10' fill='#ff0000'>II</text>", &fonts)
        .unwrap();
    // Two boxes of 5 x 7 at 10 and 16 on the base line at y = 50.
    assert_box(&art, (10.0, 50.0), (21.0, 57.0));
    let found = art.layers_found();
    assert!((found[0].area - 70.0).abs() < 1e-2, "{found:?}");
    assert!(art.shapes.iter().all(|s| s.ids == ["motto"] && s.color == Rgb(255, 0, 0)));
    assert_eq!(art.notes, Vec::<String>::new());
}

#[test]
fn a_missing_font_is_an_error_that_says_how_to_give_a_folder() {
    let text =
        "<text id='motto' font-family='Garamond' y='9'>II</text><rect width='5' height='5'/>";
    for fonts in [Fonts::none(), Fonts::from_data(vec![font("Boxes"), b"no font".to_vec()])] {
        let e = set(text, &fonts).unwrap_err();
        assert!(matches!(e, ArtworkError::Font { .. }), "{e}");
        let words = e.to_string();
        for part in ["'Garamond'", "text 'motto' (line 2)", "font_dirs"] {
            assert!(words.contains(part), "{words}");
        }
    }
}

#[test]
fn a_stand_in_that_the_text_allows_is_noted() {
    let fonts = Fonts::from_data(vec![font("Boxes")]);
    for family in ["font-family='Garamond, serif'", "font-family='Garamond, Boxes'", ""] {
        let art = set(&format!("<text {family} y='9'>I</text>"), &fonts).unwrap();
        assert!(has_note(&art, &["Boxes", "another font"]), "{family}: {:?}", art.notes);
    }
}

#[test]
fn a_character_that_no_font_has_is_an_error() {
    let fonts = Fonts::from_data(vec![font("Boxes")]);
    let e = set("<text id='motto' font-family='Boxes' y='9'>I am</text>", &fonts).unwrap_err();
    assert!(
        e.to_string().starts_with("no font has the characters 'a', 'm' (text 'motto' (line 2))"),
        "{e}"
    );
}
