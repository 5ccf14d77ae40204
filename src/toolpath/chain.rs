//! Linking: spans of rows -> chains that are cut without leaving the wood.

use super::order::Direction;
use crate::geom::DVec3;

/// What is cut of one row in one go: the tip's path, at least two points.
pub(super) type Span = Vec<DVec3>;

/// Joins spans of neighbouring rows into zigzag chains.
///
/// `link(done, next)` gives the points between the end of the path `done` and the start of `next` of a way that keeps
/// the tool down, or `None` when there is none or lifting is quicker. The order is fixed by the spans alone: lowest row first, then on to the
/// next row as long as a link is found, nearest end first.
pub(super) fn chains(
    rows: Vec<Vec<Span>>,
    direction: Direction,
    mut link: impl FnMut(&[DVec3], &[DVec3]) -> Option<Vec<DVec3>>,
) -> Vec<Vec<DVec3>> {
    let mut rows: Vec<Vec<Option<Span>>> =
        rows.into_iter().map(|row| row.into_iter().map(Some).collect()).collect();
    let mut chains: Vec<Vec<DVec3>> = Vec::new();
    for start in 0..rows.len() {
        for k in 0..rows[start].len() {
            let Some(mut chain) = rows[start][k].take() else { continue };
            if direction != Direction::Fixed
                && let Some(end) = chains.last().and_then(|c| c.last())
                && end.distance_squared(chain[chain.len() - 1]) < end.distance_squared(chain[0])
            {
                chain.reverse();
            }
            for row in &mut rows[start + 1..] {
                if !extend(&mut chain, row, direction, &mut link) {
                    break;
                }
            }
            chains.push(chain);
        }
    }
    chains
}

/// Appends the nearest span of `row` that can be reached; false when there is none.
fn extend(
    chain: &mut Vec<DVec3>,
    row: &mut [Option<Span>],
    direction: Direction,
    link: &mut impl FnMut(&[DVec3], &[DVec3]) -> Option<Vec<DVec3>>,
) -> bool {
    /// Ends of a row's spans that are tried before the tool is lifted.
    const TRIES: usize = 2;
    let at = chain[chain.len() - 1];
    let mut ends: Vec<(f64, usize, bool)> = Vec::new();
    for (k, span) in row.iter().enumerate() {
        let Some(span) = span else { continue };
        ends.push((at.distance_squared(span[0]), k, false));
        if direction != Direction::Fixed {
            ends.push((at.distance_squared(span[span.len() - 1]), k, true));
        }
    }
    ends.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)).then(a.2.cmp(&b.2)));
    for &(_, k, from_its_end) in ends.iter().take(TRIES) {
        let Some(mut span) = row[k].take() else { continue };
        if from_its_end {
            span.reverse();
        }
        if let Some(between) = link(chain, &span) {
            chain.extend(between);
            chain.extend(span);
            return true;
        }
        if from_its_end {
            span.reverse();
        }
        row[k] = Some(span);
    }
    false
}

#[cfg(test)]
mod tests {
    use super::*;

    fn span(x0: f64, x1: f64, y: f64) -> Span {
        vec![DVec3::new(x0, y, -1.0), DVec3::new(x1, y, -1.0)]
    }

    #[test]
    fn rows_are_cut_to_and_fro() {
        let rows = (0..4).map(|k| vec![span(0.0, 10.0, f64::from(k))]).collect();
        let chains = chains(rows, Direction::Both, |_, _| Some(Vec::new()));
        let xs: Vec<f64> = chains[0].iter().map(|p| p.x).collect();
        assert_eq!(chains.len(), 1);
        assert_eq!(xs, [0.0, 10.0, 10.0, 0.0, 0.0, 10.0, 10.0, 0.0]);
    }

    #[test]
    fn an_island_splits_the_rows_and_every_span_is_cut_once() {
        let mut rows = vec![vec![span(0.0, 10.0, 0.0)]];
        rows.extend(
            (1..4).map(|k| vec![span(0.0, 3.0, f64::from(k)), span(7.0, 10.0, f64::from(k))]),
        );
        let chains = chains(rows, Direction::Both, |a, b| {
            (a[a.len() - 1].distance(b[0]) < 2.0).then(Vec::new)
        });
        assert_eq!(chains.len(), 2);
        assert_eq!(chains.iter().map(Vec::len).sum::<usize>(), 14);
    }

    #[test]
    fn in_a_fixed_direction_no_row_is_turned_round() {
        let rows = (0..4).map(|k| vec![span(0.0, 10.0, f64::from(k))]).collect();
        let chains = chains(rows, Direction::Fixed, |_, _| Some(Vec::new()));
        assert!(chains[0].chunks(2).all(|row| row[0].x < row[1].x));
    }

    #[test]
    fn without_links_every_span_is_a_chain() {
        let rows = (0..3).map(|k| vec![span(0.0, 1.0, f64::from(k))]).collect();
        assert_eq!(chains(rows, Direction::Both, |_, _| None).len(), 3);
    }
}
