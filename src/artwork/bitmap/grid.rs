//! A label for every pixel, and which pixels hang together.

/// The label beyond the rim of the picture.
pub(super) const OUTSIDE: u8 = 255;

/// Labels of pixels, y up: the first row is the lowest.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Labels {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) of: Vec<u8>,
}

impl Labels {
    /// The label of pixel (i, j); [`OUTSIDE`] beyond the rim.
    pub(super) fn at(&self, i: i32, j: i32) -> u8 {
        if i < 0 || j < 0 || i as usize >= self.width || j as usize >= self.height {
            OUTSIDE
        } else {
            self.of[j as usize * self.width + i as usize]
        }
    }
}

/// Whether the two pixels of one label that touch only at lattice point (x, y) hang together.
pub(super) type Joined<'a> = &'a (dyn Fn(i32, i32) -> bool + Sync);

/// Pixels of one label side by side in a row.
#[derive(Debug, Clone, Copy)]
struct Run {
    start: u32,
    end: u32,
    label: u8,
    component: u32,
}

/// The connected components of the labels.
#[derive(Debug, Clone)]
pub(super) struct Components {
    /// Where the runs of each row begin; one more entry at the end.
    rows: Vec<u32>,
    runs: Vec<Run>,
    /// Number of pixels of each component. Components are numbered by their first run, row by row.
    pub(super) areas: Vec<u64>,
}

impl Components {
    /// Finds the components: runs of neighbouring rows that share a side, or a corner that is joined.
    pub(super) fn of(labels: &Labels, joined: Joined<'_>) -> Self {
        let (mut rows, mut runs) = (Vec::with_capacity(labels.height + 1), Vec::new());
        for row in labels.of.chunks_exact(labels.width) {
            rows.push(runs.len() as u32);
            let mut start = 0;
            for part in row.chunk_by(|a, b| a == b) {
                let end = start + part.len() as u32;
                let component = runs.len() as u32;
                runs.push(Run { start, end, label: part[0], component });
                start = end;
            }
        }
        rows.push(runs.len() as u32);
        let mut parent: Vec<u32> = (0..runs.len() as u32).collect();
        for j in 1..labels.height {
            // Runs fill their rows, so stepping to the next end meets every pair that shares a side.
            let (mut a, mut b) = (rows[j - 1] as usize, rows[j] as usize);
            let (above, end) = (rows[j] as usize, rows[j + 1] as usize);
            while a < above && b < end {
                let (p, q) = (runs[a], runs[b]);
                if p.label == q.label {
                    unite(&mut parent, a as u32, b as u32);
                }
                if p.end == q.end {
                    let corners = [(a + 1, b, a + 1 < above), (a, b + 1, b + 1 < end)];
                    for (below, over, there) in corners {
                        if there
                            && runs[below].label == runs[over].label
                            && joined(p.end as i32, j as i32)
                        {
                            unite(&mut parent, below as u32, over as u32);
                        }
                    }
                }
                a += usize::from(p.end <= q.end);
                b += usize::from(q.end <= p.end);
            }
        }
        let mut areas = Vec::new();
        let mut number = vec![u32::MAX; runs.len()];
        for (k, run) in runs.iter_mut().enumerate() {
            let root = find(&mut parent, k as u32) as usize;
            if number[root] == u32::MAX {
                number[root] = areas.len() as u32;
                areas.push(0);
            }
            run.component = number[root];
            areas[number[root] as usize] += u64::from(run.end - run.start);
        }
        Self { rows, runs, areas }
    }

    /// The component of a pixel of the picture.
    pub(super) fn at(&self, i: i32, j: i32) -> u32 {
        let row = &self.runs[self.rows[j as usize] as usize..self.rows[j as usize + 1] as usize];
        row[row.partition_point(|run| run.end as i32 <= i)].component
    }

    /// Gives every component of less than `least` pixels the label that it shares most of its border with; how
    /// many there were. The picture's rim counts for nothing.
    pub(super) fn absorb_specks(&self, labels: &mut Labels, least: f64) -> usize {
        let small = |c: u32| (self.areas[c as usize] as f64) < least;
        // (component, label beyond the border) for each crack of a small component.
        let mut borders: Vec<(u32, u8)> = Vec::new();
        for j in 0..labels.height as i32 {
            let row = self.rows[j as usize] as usize..self.rows[j as usize + 1] as usize;
            for run in self.runs[row].iter().filter(|run| small(run.component)) {
                let (start, end) = (run.start as i32, run.end as i32);
                let sides = [(start - 1, j), (end, j)].into_iter();
                let around = sides.chain((start..end).flat_map(|i| [(i, j - 1), (i, j + 1)]));
                let beyond = around.map(|(i, j)| labels.at(i, j));
                let other = |l: &u8| *l != run.label && *l != OUTSIDE;
                borders.extend(beyond.filter(other).map(|l| (run.component, l)));
            }
        }
        borders.sort_unstable();
        let mut takers: Vec<(u32, u8)> = Vec::new();
        for of_one in borders.chunk_by(|a, b| a.0 == b.0) {
            let best = of_one.chunk_by(|a, b| a == b).fold((0, 0), |best, same| {
                if same.len() > best.0 { (same.len(), same[0].1) } else { best }
            });
            takers.push((of_one[0].0, best.1));
        }
        for j in 0..labels.height {
            for run in &self.runs[self.rows[j] as usize..self.rows[j + 1] as usize] {
                if !small(run.component) {
                    continue;
                }
                if let Ok(k) = takers.binary_search_by_key(&run.component, |t| t.0) {
                    let at = j * labels.width;
                    labels.of[at + run.start as usize..at + run.end as usize].fill(takers[k].1);
                }
            }
        }
        takers.len()
    }
}

fn find(parent: &mut [u32], mut k: u32) -> u32 {
    while parent[k as usize] != k {
        let up = parent[parent[k as usize] as usize];
        parent[k as usize] = up;
        k = up;
    }
    k
}

/// The lower number stays the root, so that the outcome hangs on nothing but the labels.
fn unite(parent: &mut [u32], a: u32, b: u32) {
    let (a, b) = (find(parent, a), find(parent, b));
    parent[a.max(b) as usize] = a.min(b);
}
