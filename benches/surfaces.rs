//! How true and how smooth the crest surfaces are, beside the figures that the method is known to reach:
//! `cargo bench --bench surfaces`. Each cell reads "measured / tabled".

#![allow(clippy::print_stdout, reason = "the table is what this command is for")]

#[path = "../tests/shapes/mod.rs"]
mod shapes;

use relievo::compare::tables::{CREASES, FINE, Method, Outline, Raised, crease, shapes, summary};
use relievo::geom::DVec3;
use relievo::job::Scheme;
use relievo::surface::{
    CoonsRules, Edit, EditRules, LimitSurface, PolyMesh, Spot, coons, edit, subdivide,
};
use shapes::Ladder;
use std::time::Instant;

fn main() {
    println!("| shape | vertices | T | S | J |");
    println!("|---|---|---|---|---|");
    for shape in shapes(1) {
        let counts = Raised::new(&shape, Outline::Own, f64::INFINITY, 0.05).counts();
        print!("| {} |", shape.name);
        for (got, tabled) in counts.iter().zip(shape.counts) {
            if shape.is_tabled() {
                print!(" {got} / {tabled} |");
            } else {
                print!(" {got} / - |");
            }
        }
        println!();
    }
    let all = shapes(FINE);
    println!(
        "\n| outline | method | ring rms | ring max | S rms | plus rms | ridge | zmax | slope | plate | jump | faces | s |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|---|---|---|");
    for (outline, name) in [(Outline::Own, "own"), (Outline::FourPoint, "four-point")] {
        for method in Method::ALL {
            let start = Instant::now();
            let got = summary(&all, outline, method);
            let seconds = start.elapsed().as_secs_f64();
            print!("| {name} | {} |", method.name());
            for (got, tabled) in got.figures.iter().zip(method.tabled()) {
                match tabled {
                    Some(tabled) => print!(" {got:.4} / {tabled} |"),
                    None => print!(" {got:.4} / - |"),
                }
            }
            println!(" {}k | {seconds:.2} |", got.faces / all.len() / 1000);
        }
    }
    println!("\n| shape | rungs 0.1 apart | least step | largest step | imbalance rms |");
    println!("|---|---|---|---|---|");
    for shape in &all {
        let Ladder { count, steps: [least, most], imbalance } = Ladder::of(shape);
        println!("| {} | {count} | {least:.4} | {most:.4} | {imbalance:.4} |", shape.name);
    }
    println!("\n| method | seam | shape | median, degrees | 95 % |");
    println!("|---|---|---|---|---|");
    for (method, seam, name, [median, most]) in CREASES {
        let shape = all.iter().find(|s| s.name == name).expect("a known shape");
        let [a, b] = crease(shape, method, seam).expect("the shape has such a seam");
        println!(
            "| {} | {} | {name} | {a:.2} / {median} | {b:.2} / {most} |",
            method.name(),
            seam.name()
        );
    }
    meshes();
}

/// What edits, Coons patches and Catmull and Clark's rules cost on meshes of known sizes.
fn meshes() {
    println!("\n| work | s |");
    println!("|---|---|");
    let big = LimitSurface::of(&sheet(317, 317), |_, _| false).expect("a sheet is a manifold");
    for (rings, name) in [(Some(4), "4 rings"), (Some(40), "40 rings"), (None, "everywhere")] {
        let at = Spot { face: 50_000, part: None, u: 0.3, v: 0.6 };
        let normal = Some(DVec3::new(0.1, 0.2, 1.0));
        let point = Edit::Point { at, by: Some(DVec3::Z), normal };
        let rules = EditRules { rings, ..EditRules::default() };
        let start = Instant::now();
        let edited = edit(&big, &[point], &rules).expect("the boundary holds the sheet");
        let seconds = start.elapsed().as_secs_f64();
        assert!(edited.conflicts().is_empty(), "one edit contradicts nothing");
        println!("| energy edit on 100489 vertices, free: {name} | {seconds:.2} |");
    }
    let start = Instant::now();
    let rules = CoonsRules { draft_rad: Some(0.5), ..CoonsRules::default() };
    let fine = coons(&sheet(21, 11), rules, 5).expect("a sheet is a manifold");
    let seconds = start.elapsed().as_secs_f64();
    println!("| Coons, 200 quads, 5 levels: {} faces | {seconds:.2} |", fine.len());
    let start = Instant::now();
    let fine = subdivide(&sheet(26, 21), Scheme::CatmullClark, 5).expect("a sheet is a manifold");
    let seconds = start.elapsed().as_secs_f64();
    println!("| Catmull-Clark, 500 quads, 5 levels: {} faces | {seconds:.2} |", fine.len());
}

/// A wavy sheet of so many vertices along x and y.
fn sheet(nx: u32, ny: u32) -> PolyMesh {
    let mut mesh = PolyMesh::new();
    for k in 0..nx * ny {
        let (x, y) = (f64::from(k % nx), f64::from(k / nx));
        mesh.add_vertex(DVec3::new(x, y, 3.0 * libm::sin(0.1 * x) * libm::cos(0.07 * y)), false);
    }
    for k in (0..nx * (ny - 1) - 1).filter(|k| k % nx < nx - 1) {
        mesh.add_face(&[k, k + 1, k + nx + 1, k + nx]);
    }
    mesh
}
