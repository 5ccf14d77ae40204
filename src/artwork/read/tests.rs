//! What comes out of documents: real artwork, the rules of SVG, hostile input.

use super::*;

fn art(name: &str) -> Vec<u8> {
    std::fs::read(format!("/work/shared/art/{name}")).unwrap()
}

#[test]
fn peek() {
    for name in [
        "01_lotus_5colours.svg",
        "02_celtic_square.svg",
        "03_tiger_5layers.svg",
        "05_xiangyun_cloud.svg",
        "11_triskell_simple.svg",
    ] {
        let t = std::time::Instant::now();
        let a = read_svg(&art(name), &Fonts::none()).unwrap();
        println!(
            "{name} {} shapes {:?} {:?} {:?}",
            a.shapes.len(),
            a.bounds(),
            a.unit_mm,
            t.elapsed()
        );
        for n in &a.notes {
            println!("  {n}");
        }
        let t = std::time::Instant::now();
        for l in a.layers_found() {
            println!("  {} {} {}", l.select, l.name, l.area);
        }
        println!("{:?}", t.elapsed());
        println!("{:?} {:?} {:?}", a.shapes[0].source, a.shapes[0].ids, a.shapes[0].labels);
    }
}
