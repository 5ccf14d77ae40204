use super::*;
use crate::artwork::{Fonts, read_svg};
use crate::job::{Draft, Job, Library, SurfaceSpec};
use crate::outline::{Outlines, trace};

/// A bar of 60 x 12 mm and a square of 10 mm, two layers.
const ART: &str = r##"<svg xmlns="http://www.w3.org/2000/svg" width="80mm" height="30mm" viewBox="0 0 80 30">
<rect x="2" y="2" width="60" height="12" fill="#aa0000"/><rect x="66" y="10" width="10" height="10" fill="#0000aa"/></svg>"##;

fn artwork(svg: &str) -> (Job, Outlines) {
    let artwork = read_svg(svg.as_bytes(), &Fonts::none()).unwrap();
    let draft = Draft::for_artwork("a.svg", &Library::built_in());
    let job = draft.settle(&artwork.found()).unwrap();
    let placed =
        artwork.place(&job.layers, job.artwork_unit_mm, job.artwork_lower_left_mm).unwrap();
    let outlines = trace(&placed, &job.layers, &job.tolerance).unwrap();
    (job, outlines)
}

fn bar(height_mm: f64) -> Subject {
    let (job, outlines) = artwork(ART);
    let wanted = Wanted { outline: Some(1), height_mm: Some(height_mm), ..Wanted::default() };
    Subject::of(&job, &outlines, &wanted).unwrap()
}

fn by(subject: &Subject, method: &str) -> Compared {
    measure(subject, raise(subject, method, &[]).unwrap()).unwrap()
}

/// Half as wide as 6 mm, 3 mm high: the parabola's slope at the outline is 2 * 3 / 6, and its second derivative
/// -2 * 3 / 36 across, so that the plate energy of the band is the square of that.
#[test]
fn a_bar_is_the_parabola_by_the_methods_that_aim_at_it() {
    let subject = bar(3.0);
    assert_eq!(subject.parts(), 1);
    for method in ["ruled", "ratio", "profile"] {
        let got = by(&subject, method);
        let [rms, largest] = got.measures.ridge.unwrap();
        assert!(rms < 0.01 && largest < 0.03, "{method}: {got:?}", got = got.measures);
        assert!((got.measures.highest - 3.0).abs() < 0.01, "{method}");
        assert!(got.overshoot_mm < 1e-3, "{method}: {}", got.overshoot_mm);
        assert!((got.measures.slope - 1.0).abs() < 0.15, "{method}: {}", got.measures.slope);
        assert!(got.exceptions.is_empty() && got.notes.is_empty(), "{method}: {:?}", got.notes);
        assert_eq!(got.faces > 0, method == "ruled", "{method}");
    }
}

#[test]
fn the_section_across_a_bar_is_its_parabola() {
    let subject = bar(3.0);
    let got = by(&subject, "ruled");
    let (grid, column) = (subject.grid(), subject.cuts().column);
    let bounds = subject.outlines().layers[0].figures[0].regions[0].bounds();
    let middle = bounds.center().y;
    // The bar is as wide everywhere: the cut goes through its middle.
    let off = grid.node(column, 0).x - bounds.center().x;
    assert!(off.abs() < 2.0, "{off}");
    for j in 0..grid.ny {
        let off = (grid.node(column, j).y - middle) / 6.0;
        let want = if off.abs() < 1.0 { 3.0 * (1.0 - off * off) } else { 0.0 };
        // Next to the outline only part of a node's cell is covered.
        let within = if (off.abs() - 1.0).abs() < 0.05 { 0.2 } else { 0.01 };
        let z = f64::from(got.relief.at(column, j));
        assert!((z - want).abs() < within, "{off}: {z} {want}");
    }
}

/// Loop's limit is half of a vertex and a twelfth of each of its six neighbours; on an even crest two of these lie on the
/// crest and four on the outline: 1/2 + 2/12.
#[test]
fn a_surface_that_sinks_shows_it_in_its_ridge() {
    let subject = bar(3.0);
    let got = by(&subject, "loop");
    assert!((got.measures.highest - 3.0 * 2.0 / 3.0).abs() < 0.03, "{}", got.measures.highest);
    let [_, largest] = got.measures.ridge.unwrap();
    assert!(largest > 0.97, "{largest}");
    assert_eq!(got.overshoot_mm, 0.0);
}

#[test]
fn every_method_raises_and_the_crest_is_as_high_as_asked() {
    let subject = bar(2.0);
    for method in SurfaceSpec::METHODS {
        let got = by(&subject, method);
        assert!(got.measures.highest > 0.9 && got.measures.highest < 2.6, "{method}");
        assert!(got.measures.steepest >= got.measures.slope);
        assert_eq!(got.method, *method);
    }
}

#[test]
fn what_is_not_there_is_named_with_what_is() {
    let (job, outlines) = artwork(ART);
    let of = |wanted: Wanted| Subject::of(&job, &outlines, &wanted).unwrap_err().to_string();
    let lost = of(Wanted { layer: Some("leaf".into()), ..Wanted::default() });
    for layer in &job.layers {
        assert!(lost.contains("'leaf'") && lost.contains(&layer.name), "{lost}");
    }
    let lost = of(Wanted { outline: Some(3), ..Wanted::default() });
    assert!(lost.contains("outline 3") && lost.contains("from 1 to 2"), "{lost}");
    let fine = of(Wanted { pitch_mm: Some(0.001), ..Wanted::default() });
    let least: f64 =
        fine.split("--pitch ").nth(1).unwrap().split(' ').next().unwrap().parse().unwrap();
    let wanted = Wanted { pitch_mm: Some(least), ..Wanted::default() };
    assert!(Subject::of(&job, &outlines, &wanted).is_ok(), "{fine}");
    let subject = bar(1.0);
    let lost = raise(&subject, "wax", &[]).unwrap_err().to_string();
    assert!(lost.contains("'wax'") && lost.contains("ruled"), "{lost}");
}

#[test]
fn one_layer_of_several_is_chosen_by_name() {
    let (job, outlines) = artwork(ART);
    let name = job.layers[1].name.clone();
    let wanted = Wanted { layer: Some(name), ..Wanted::default() };
    let subject = Subject::of(&job, &outlines, &wanted).unwrap();
    assert!((subject.size() - DVec2::splat(10.0)).abs().max_element() < 1e-6);
    assert_eq!(subject.job().layers.len(), 1);
    assert_eq!(subject.job().layers[0].height_mm, job.layers[1].height_mm);
}
