//! Small symmetric systems that may be singular: by eigenvalues, found with Jacobi's rotations (1846).

/// Eigenvalues below this part of the largest count as 0.
const DROPPED: f64 = 1e-12;
/// Most rounds of rotations; ten are many.
const ROUNDS: usize = 60;

/// A symmetric matrix with its inverse where it has one: `pseudo_inverse * side` is the least solution of least squares.
#[derive(Debug, Clone)]
pub(super) struct Symmetric {
    scale: Vec<f64>,
    values: Vec<f64>,
    /// One column for each value.
    vectors: Vec<Vec<f64>>,
}

impl Symmetric {
    /// Takes a symmetric, semidefinite matrix apart, rows first brought to 1 on the diagonal.
    pub(super) fn of(mut a: Vec<Vec<f64>>) -> Self {
        let n = a.len();
        let scale: Vec<f64> =
            (0..n).map(|k| if a[k][k] > 0.0 { 1.0 / a[k][k].sqrt() } else { 0.0 }).collect();
        for i in 0..n {
            for j in 0..n {
                a[i][j] *= scale[i] * scale[j];
            }
        }
        let mut vectors: Vec<Vec<f64>> =
            (0..n).map(|k| (0..n).map(|j| f64::from(u8::from(j == k))).collect()).collect();
        for _ in 0..ROUNDS {
            let off: f64 = (0..n).flat_map(|i| a[i][..i].iter()).map(|x| x * x).sum();
            if off <= f64::EPSILON * f64::EPSILON {
                break;
            }
            for p in 0..n {
                for q in p + 1..n {
                    rotate(&mut a, &mut vectors, p, q);
                }
            }
        }
        Self { scale, values: (0..n).map(|k| a[k][k]).collect(), vectors }
    }

    /// The least solution of least squares.
    pub(super) fn solve(&self, side: &[f64]) -> Vec<f64> {
        let side: Vec<f64> = side.iter().zip(&self.scale).map(|(b, s)| b * s).collect();
        let largest = self.values.iter().fold(0.0, |a: f64, b| a.max(*b));
        let mut out = vec![0.0; side.len()];
        for (value, vector) in self.values.iter().zip(&self.vectors) {
            if *value > DROPPED * largest {
                let part = vector.iter().zip(&side).map(|(v, b)| v * b).sum::<f64>() / value;
                out.iter_mut().zip(vector).for_each(|(o, v)| *o += part * v);
            }
        }
        out.iter_mut().zip(&self.scale).for_each(|(o, s)| *o *= s);
        out
    }
}

/// Makes the element at (p, q) vanish.
fn rotate(a: &mut [Vec<f64>], vectors: &mut [Vec<f64>], p: usize, q: usize) {
    let off = a[p][q];
    if off == 0.0 {
        return;
    }
    let theta = 0.5 * (a[q][q] - a[p][p]) / off;
    let t = theta.signum() / (theta.abs() + (theta * theta + 1.0).sqrt());
    let c = 1.0 / (t * t + 1.0).sqrt();
    let s = t * c;
    for row in a.iter_mut() {
        let (x, y) = (row[p], row[q]);
        (row[p], row[q]) = (c * x - s * y, s * x + c * y);
    }
    turn(a, p, q, c, s);
    a[p][q] = 0.0;
    a[q][p] = 0.0;
    turn(vectors, p, q, c, s);
}

/// Turns two rows into each other.
fn turn(rows: &mut [Vec<f64>], p: usize, q: usize, c: f64, s: f64) {
    let (head, tail) = rows.split_at_mut(q);
    for (x, y) in head[p].iter_mut().zip(&mut tail[0]) {
        (*x, *y) = (c * *x - s * *y, s * *x + c * *y);
    }
}
