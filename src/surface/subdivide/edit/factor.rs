//! Sparse symmetric matrices and their Cholesky factors, by nested dissection and dense fronts.
//!
//! ```text
//!   +------+-+------+   Unknowns have places. The longer side of what is left is halved; unknowns of the first half that
//!   |      |s|      |   meet the second one are eliminated after both (George 1973). Each part is one dense *front*: its
//!   |  A   |s|  B   |   own columns, and the later unknowns that they reach. What it leaves to these is added to the front
//!   |      |s|      |   of the part that it belongs to (Duff and Reid 1983). Parts that do not meet are independent: two
//!   +------+-+------+   threads or one give the same bits.
//! ```

use super::super::masks::SparseRow;
use crate::geom::DVec3;

/// Parts of no more unknowns than this are not cut.
const LEAF: usize = 48;
/// Parts of more unknowns than this go to threads of their own.
const TASK: usize = 2048;
/// Columns eliminated together.
const BLOCK: usize = 48;
/// A pivot below this part of its diagonal element is none.
const SINGULAR: f64 = 1e-12;

/// A sparse symmetric matrix: in each row the columns up to its own, ascending.
#[derive(Debug, Clone, Default)]
pub(super) struct Lower {
    pub(super) rows: Vec<Vec<(u32, f64)>>,
}

impl Lower {
    pub(super) fn new(count: usize) -> Self {
        Self { rows: vec![Vec::new(); count] }
    }

    /// Adds to the element at (i, j) and (j, i).
    pub(super) fn add(&mut self, i: u32, j: u32, value: f64) {
        let row = &mut self.rows[i.max(j) as usize];
        match row.binary_search_by_key(&i.min(j), |e| e.0) {
            Ok(at) => row[at].1 += value,
            Err(at) => row.insert(at, (i.min(j), value)),
        }
    }
}

/// The factor of a positive definite matrix.
#[derive(Debug, Clone)]
pub(super) struct Factor {
    count: usize,
    /// In the order of elimination.
    fronts: Vec<Front>,
}

#[derive(Debug, Clone)]
struct Front {
    /// Unknowns eliminated here.
    own: Vec<u32>,
    /// Later ones that they reach, in the order of their elimination.
    later: Vec<u32>,
    /// Column by column: own and later rows of the own columns.
    lower: Vec<f64>,
}

/// What a part leaves to later unknowns: a square, the lower half of it, column by column.
struct Rest {
    later: Vec<u32>,
    square: Vec<f64>,
}

/// A part of the unknowns.
enum Part {
    Leaf(Vec<u32>),
    Cut(Box<[Self; 2]>, Vec<u32>),
}

impl Part {
    fn len(&self) -> usize {
        match self {
            Self::Leaf(own) => own.len(),
            Self::Cut(halves, own) => own.len() + halves[0].len() + halves[1].len(),
        }
    }

    /// Numbers the unknowns in the order of their elimination.
    fn number(&self, place: &mut [u32], next: &mut u32) {
        let own = match self {
            Self::Leaf(own) => own,
            Self::Cut(halves, own) => {
                halves.iter().for_each(|half| half.number(place, next));
                own
            }
        };
        for &v in own {
            place[v as usize] = *next;
            *next += 1;
        }
    }
}

impl Factor {
    /// The factor of a matrix whose unknowns lie at these places; `None` when it is not positive definite.
    pub(super) fn of(matrix: &Lower, places: &[DVec3]) -> Option<Self> {
        let count = matrix.rows.len();
        let mut links: Vec<Vec<(u32, f64)>> = matrix.rows.clone();
        for (i, row) in matrix.rows.iter().enumerate() {
            for &(j, value) in row.iter().filter(|e| (e.0 as usize) < i) {
                links[j as usize].push((i as u32, value));
            }
        }
        let mut side = vec![0; count];
        let all = (0..count as u32).collect();
        let part = cut(all, places, &links, &mut side, &mut 0);
        let mut place = vec![0; count];
        part.number(&mut place, &mut 0);
        let (fronts, _) = eliminate(&part, &links, &place)?;
        Some(Self { count, fronts })
    }

    /// Half of solving, from the front: a sparse right side divided by the factor, sorted, its zeros left out. The scalar
    /// product of two halves is that of one side with the solution for the other.
    pub(super) fn half(&self, side: &[(u32, f64)]) -> SparseRow {
        let mut x = vec![0.0; self.count];
        for &(v, value) in side {
            x[v as usize] += value;
        }
        for Front { own, later, lower } in &self.fronts {
            let height = own.len() + later.len();
            for (k, &v) in own.iter().enumerate() {
                let at = x[v as usize];
                if at == 0.0 {
                    continue;
                }
                let column = &lower[k * height..(k + 1) * height];
                let at = at / column[k];
                x[v as usize] = at;
                let rows = own.iter().chain(later).zip(column).skip(k + 1);
                rows.for_each(|(&w, l)| x[w as usize] -= l * at);
            }
        }
        (0..).zip(x).filter(|(_, value)| *value != 0.0).collect()
    }

    /// The other half, from the back, in place.
    pub(super) fn back(&self, x: &mut [f64]) {
        debug_assert_eq!(x.len(), self.count, "one number for each unknown");
        for Front { own, later, lower } in self.fronts.iter().rev() {
            let height = own.len() + later.len();
            for (k, &v) in own.iter().enumerate().rev() {
                let column = &lower[k * height..(k + 1) * height];
                let rows = own.iter().chain(later).zip(column).skip(k + 1);
                let known: f64 = rows.map(|(&w, l)| l * x[w as usize]).sum();
                x[v as usize] = (x[v as usize] - known) / column[k];
            }
        }
    }
}

/// Cuts a set of unknowns into parts; `side` holds the number of the last set that each was found in.
fn cut(
    mut own: Vec<u32>,
    places: &[DVec3],
    links: &[Vec<(u32, f64)>],
    side: &mut [u32],
    stamp: &mut u32,
) -> Part {
    if own.len() <= LEAF {
        return Part::Leaf(own);
    }
    let at = |v: u32| places[v as usize];
    let low = own.iter().fold(DVec3::INFINITY, |a, &v| a.min(at(v)));
    let size = own.iter().fold(DVec3::NEG_INFINITY, |a, &v| a.max(at(v))) - low;
    let axis = (1..3).fold(0, |best, k| if size[k] > size[best] { k } else { best });
    let order = |a: &u32, b: &u32| {
        (at(*a)[axis], at(*a)[(axis + 1) % 3], *a)
            .partial_cmp(&(at(*b)[axis], at(*b)[(axis + 1) % 3], *b))
            .unwrap_or(std::cmp::Ordering::Equal)
    };
    own.sort_unstable_by(order);
    let second = own.split_off(own.len() / 2);
    *stamp += 1;
    for &v in &second {
        side[v as usize] = *stamp;
    }
    let meets = |v: &u32| links[*v as usize].iter().any(|e| side[e.0 as usize] == *stamp);
    let (between, first): (Vec<u32>, Vec<u32>) = own.into_iter().partition(meets);
    let first = cut(first, places, links, side, stamp);
    let second = cut(second, places, links, side, stamp);
    Part::Cut(Box::new([first, second]), between)
}

fn eliminate(part: &Part, links: &[Vec<(u32, f64)>], place: &[u32]) -> Option<(Vec<Front>, Rest)> {
    let (mut fronts, rests, own) = match part {
        Part::Leaf(own) => (Vec::new(), Vec::new(), own),
        Part::Cut(halves, own) => {
            let [first, second] = &**halves;
            let (first, second) = if part.len() > TASK {
                rayon::join(|| eliminate(first, links, place), || eliminate(second, links, place))
            } else {
                (eliminate(first, links, place), eliminate(second, links, place))
            };
            let ((mut fronts, one), (more, two)) = (first?, second?);
            fronts.extend(more);
            (fronts, vec![one, two], own)
        }
    };
    let at = |v: u32| place[v as usize];
    let mut own = own.clone();
    own.sort_unstable_by_key(|&v| at(v));
    let last = own.last().map_or(0, |&v| at(v));
    let mut later: Vec<u32> = rests.iter().flat_map(|rest| &rest.later).copied().collect();
    later.extend(own.iter().flat_map(|&v| links[v as usize].iter().map(|e| e.0)));
    later.retain(|&v| own.binary_search_by_key(&at(v), |&w| at(w)).is_err());
    if !own.is_empty() {
        later.retain(|&v| at(v) > last);
    }
    later.sort_unstable_by_key(|&v| at(v));
    later.dedup();
    let (n, height) = (own.len(), own.len() + later.len());
    let index = |v: u32| match own.binary_search_by_key(&at(v), |&w| at(w)) {
        Ok(k) => k,
        Err(_) => n + later.binary_search_by_key(&at(v), |&w| at(w)).expect("rows of the front"),
    };
    let mut square = vec![0.0; height * height];
    for (k, &v) in own.iter().enumerate() {
        for &(w, value) in links[v as usize].iter().filter(|e| at(e.0) >= at(v)) {
            square[k * height + index(w)] += value;
        }
    }
    for rest in rests {
        let rows: Vec<usize> = rest.later.iter().map(|&v| index(v)).collect();
        let size = rows.len();
        for (k, &column) in rows.iter().enumerate() {
            for (j, &row) in rows.iter().enumerate().skip(k) {
                square[column * height + row] += rest.square[k * size + j];
            }
        }
    }
    // Against the matrix as it was: what is left of a singular one is round-off.
    let diagonal = |&v: &u32| links[v as usize].iter().find(|e| e.0 == v).map_or(0.0, |e| e.1);
    let diagonal: Vec<f64> = own.iter().map(diagonal).collect();
    if !triangulate(&mut square, &diagonal, height) {
        return None;
    }
    let left = later.len();
    let mut rest = vec![0.0; left * left];
    for k in 0..left {
        let column = (n + k) * height;
        rest[k * left + k..(k + 1) * left]
            .copy_from_slice(&square[column + n + k..column + height]);
    }
    square.truncate(n * height);
    fronts.push(Front { own, later: later.clone(), lower: square });
    Some((fronts, Rest { later, square: rest }))
}

/// Eliminates the first columns of a square of this height, one for each element that the diagonal once had; false when a
/// pivot is too small.
fn triangulate(square: &mut [f64], diagonal: &[f64], height: usize) -> bool {
    let n = diagonal.len();
    for first in (0..n).step_by(BLOCK) {
        let last = (first + BLOCK).min(n);
        for k in first..last {
            let (before, on) = square.split_at_mut(k * height);
            let column = &mut on[k..height];
            for p in first..k {
                let other = &before[p * height + k..(p + 1) * height];
                let part = other[0];
                column.iter_mut().zip(other).for_each(|(c, o)| *c -= part * o);
            }
            let pivot = column[0];
            if !(pivot.is_finite() && pivot > SINGULAR * diagonal[k] && pivot > 0.0) {
                return false;
            }
            let root = pivot.sqrt();
            for c in column.iter_mut() {
                *c /= root;
            }
        }
        let (block, rest) = square.split_at_mut(last * height);
        let block = &block[first * height..];
        for (k, column) in rest.chunks_exact_mut(height).enumerate() {
            let row = last + k;
            let column = &mut column[row..];
            let mut pairs = block.chunks_exact(4 * height);
            for four in pairs.by_ref() {
                let [a, b, c, d] = [0, 1, 2, 3].map(|j| &four[j * height + row..(j + 1) * height]);
                let parts = [a[0], b[0], c[0], d[0]];
                for ((((x, a), b), c), d) in column.iter_mut().zip(a).zip(b).zip(c).zip(d) {
                    *x -= (parts[0] * a + parts[1] * b) + (parts[2] * c + parts[3] * d);
                }
            }
            for one in pairs.remainder().chunks_exact(height) {
                let one = &one[row..];
                let part = one[0];
                column.iter_mut().zip(one).for_each(|(x, o)| *x -= part * o);
            }
        }
    }
    true
}
