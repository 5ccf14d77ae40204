//! How true and how smooth the crest surfaces are, beside the figures that the method is known to reach:
//! `cargo bench --bench surfaces`. Each cell reads "measured / tabled".

#![allow(clippy::print_stdout, reason = "the table is what this command is for")]

#[path = "../tests/shapes/mod.rs"]
mod shapes;

use relievo::compare::tables::{CREASES, FINE, Method, Outline, Raised, crease, shapes, summary};
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
}
