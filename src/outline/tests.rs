//! Areas, laws and notes of traced artwork.

use super::*;
use crate::artwork::{Fonts, read_svg};
use crate::geom::Tolerance;
use crate::job::{Combine, LayerSpec, Profile, Selector, SurfaceSpec};

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
        visible: false,
    }
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
        let a =
            read_svg(&std::fs::read(format!("/work/shared/art/{name}")).unwrap(), &Fonts::none())
                .unwrap();
        let t1 = t.elapsed();
        let size = a.bounds().size();
        let mm = 140.0 / size.max_element();
        for (what, visible, union) in [
            ("plain", false, false),
            ("visible", true, false),
            ("union", false, true),
            ("both", true, true),
        ] {
            let layers: Vec<LayerSpec> = a
                .layers_found()
                .into_iter()
                .map(|f| LayerSpec { visible, union, ..layer(f.select) })
                .collect();
            let t = std::time::Instant::now();
            let p = a.place(&layers, mm, DVec2::new(10.0, 10.0)).unwrap();
            let t2 = t.elapsed();
            let t = std::time::Instant::now();
            let o = trace(&p, &layers, &Tolerance::default()).unwrap();
            println!("{name} {what}: read {t1:?} place {t2:?} trace {:?}", t.elapsed());
            let mut vertices = 0;
            for l in &o.layers {
                let mut area = 0.0;
                let mut regions = 0;
                for f in &l.figures {
                    for r in &f.regions {
                        r.check().unwrap();
                        area += r.area();
                        regions += 1;
                        vertices += r.rings().map(<[DVec2]>::len).sum::<usize>();
                    }
                }
                println!("   {} figures {} regions {regions} area {area}", l.name, l.figures.len());
            }
            println!("   vertices {vertices}");
            for n in &o.notes {
                println!("     {n}");
            }
        }
    }
}
