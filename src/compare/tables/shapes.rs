//! The eight shapes that the tables are made with, by formulas: the ring, bands and bodies of known width, and outlines
//! with tips, junctions and a hole.

use crate::geom::{DVec2, Ring, signed_area};
use crate::outline::Region;
use std::f64::consts::{PI, TAU};

/// A shape with its edge length and what is tabled of its triangles.
#[derive(Debug)]
pub struct Shape {
    /// Its name.
    pub name: &'static str,
    /// Wanted length of the edges.
    pub edge_mm: f64,
    /// Its outline.
    pub region: Region,
    /// Tabled numbers of vertices and of triangles of classes T, S and J; zeros where nothing is tabled.
    pub counts: [usize; 4],
    /// The exact height where it is known, for a height of 1 over a base of 0.
    pub exact: Option<fn(DVec2) -> Option<f64>>,
}

/// Points of curved outlines, times the tabled ones, where exact heights are measured.
pub const FINE: u32 = 16;

impl Shape {
    /// True when numbers of vertices and triangles are tabled.
    pub fn is_tabled(&self) -> bool {
        self.counts[0] > 0
    }
}

/// The shapes; curved outlines have `fine` times as many points as tabled.
pub fn shapes(fine: u32) -> Vec<Shape> {
    let shape =
        |name, edge_mm, region, counts, exact| Shape { name, edge_mm, region, counts, exact };
    vec![
        shape("ring", 0.9, ring(fine), [56, 0, 56, 0], Some(ring_height)),
        shape("S", 0.6, s(fine), [62, 4, 54, 2], Some(s_height)),
        shape("plus", 0.7, star_of_arms(4, 1.0, 4.0, 0.0), [0; 4], Some(plus_height)),
        shape("leaf", 0.5, leaf(fine), [57, 2, 53, 0], None),
        shape("star", 0.6, star(), [60, 5, 50, 3], None),
        shape("C-scroll", 0.45, scroll(fine), [118, 2, 114, 0], None),
        shape("tee", 0.7, tee(), [40, 6, 28, 4], None),
        shape("wye", 0.7, star_of_arms(3, 0.9, 5.0, PI / 2.0), [45, 6, 33, 4], None),
    ]
}

/// A region without holes, whichever way round its points run.
fn solid(mut outer: Ring) -> Region {
    if signed_area(&outer) < 0.0 {
        outer.reverse();
    }
    Region { outer, holes: vec![] }
}

fn circle(n: u32, radius: f64, phase: f64) -> Ring {
    let at = |k: u32| DVec2::from_angle(phase + TAU * f64::from(k) / f64::from(n)) * radius;
    (0..n).map(at).collect()
}

fn ring(fine: u32) -> Region {
    let mut hole = circle(80 * fine, 3.0, 0.01);
    hole.reverse();
    Region { outer: circle(80 * fine, 5.0, 0.0), holes: vec![hole] }
}

fn ring_height(p: DVec2) -> Option<f64> {
    let off = p.length() - 4.0;
    (off.abs() <= 1.0).then_some(1.0 - off * off)
}

fn leaf(fine: u32) -> Region {
    let mut upper = vec![DVec2::new(-3.0, 0.2)];
    for k in 0..60 * fine {
        let x = f64::from(k) / f64::from(6 * fine);
        let bulge = libm::pow(libm::sin(PI * x / 10.0), 1.2);
        upper.push(DVec2::new(x, 0.2 * (1.0 - x / 10.0) + 2.3 * bulge));
    }
    let lower = upper.iter().rev().map(|p| DVec2::new(p.x, -p.y));
    let tip = [DVec2::new(10.0, 0.0)];
    solid(upper.iter().copied().chain(tip).chain(lower).collect())
}

fn star() -> Region {
    let radius = |k: u32| if k.is_multiple_of(2) { 5.0 } else { 1.909_830 };
    let at = |k: u32| DVec2::from_angle(PI / 2.0 + PI * f64::from(k) / 5.0) * radius(k);
    solid((0..10).map(at).collect())
}

/// A band round a centre line, `half_width` on either side at each of its points.
fn band(centre: &[DVec2], half_width: impl Fn(usize) -> f64) -> Region {
    let last = centre.len() - 1;
    let side = |k: usize, sign: f64| {
        let along = centre[(k + 1).min(last)] - centre[k.saturating_sub(1)];
        centre[k] + sign * half_width(k) * along.normalize().perp()
    };
    let left = (0..=last).map(|k| side(k, 1.0));
    solid(left.chain((0..=last).rev().map(|k| side(k, -1.0))).collect())
}

/// Turns of the S: centre of the arc, first angle and last angle in degrees.
const TURNS: [(DVec2, f64, f64); 2] =
    [(DVec2::new(0.0, 2.0), 30.0, 270.0), (DVec2::new(0.0, -2.0), 90.0, -150.0)];

fn s(fine: u32) -> Region {
    let n = 60 * fine - 1;
    let mut centre = Vec::new();
    for (k, (at, from, to)) in TURNS.into_iter().enumerate() {
        // The two arcs meet in one point.
        for j in u32::from(k > 0)..=n {
            let angle = from + (to - from) * f64::from(j) / f64::from(n);
            centre.push(at + 2.0 * DVec2::from_angle(angle.to_radians()));
        }
    }
    band(&centre, |_| 0.8)
}

/// The parabola across the S, away from its ends and from where its arcs meet.
fn s_height(p: DVec2) -> Option<f64> {
    TURNS.into_iter().find_map(|(at, from, to)| {
        let (low, high) = (from.min(to) + 50.0, from.max(to) - 50.0);
        let away = p - at;
        let angle = away.to_angle().to_degrees();
        let inside = [angle, angle + 360.0].iter().any(|a| (low..=high).contains(a));
        let off = (away.length() - 2.0) / 0.8;
        (inside && off.abs() <= 1.0).then_some(1.0 - off * off)
    })
}

fn scroll(fine: u32) -> Region {
    let n = 200 * fine;
    let part = |k: usize| k as f64 / f64::from(n - 1);
    let at = |k: u32| {
        let t = 2.5 * PI * part(k as usize);
        DVec2::from_angle(t) * (0.8 + 0.62 * t)
    };
    let centre: Ring = (0..n).map(at).collect();
    band(&centre, |k| 0.2 + 0.75 * libm::sin(PI * libm::pow(part(k), 0.8)))
}

fn tee() -> Region {
    let points = [
        [-4.0, 0.0],
        [-4.0, 2.0],
        [4.0, 2.0],
        [4.0, 0.0],
        [1.0, 0.0],
        [1.0, -4.0],
        [-1.0, -4.0],
        [-1.0, 0.0],
    ];
    solid(points.map(DVec2::from).to_vec())
}

/// Equal arms round the origin, the first at `angle`.
fn star_of_arms(arms: u32, half_width: f64, length: f64, angle: f64) -> Region {
    let turn = TAU / f64::from(arms);
    let reach = half_width / libm::sin(0.5 * turn);
    let mut outer = Vec::new();
    for k in 0..arms {
        let out = DVec2::from_angle(angle + turn * f64::from(k));
        let end = out * length;
        outer.extend([end - half_width * out.perp(), end + half_width * out.perp()]);
        outer.push(reach * DVec2::from_angle(angle + turn * (f64::from(k) + 0.5)));
    }
    solid(outer)
}

/// The parabola across the arms of the plus, away from their ends and from the crossing.
fn plus_height(p: DVec2) -> Option<f64> {
    let (along, across) = (p.abs().max_element(), p.abs().min_element());
    (1.5..2.5).contains(&along).then_some(1.0 - across * across)
}
