//! How a program's lines flow through the planner: lines per second, speeds asked for and reached.

use super::ring::Block;
use std::collections::VecDeque;

/// Lines per second that boards with GRBL parse reliably (gnea/grbl issues 181 and 264); they do 400 to 500 at best.
pub const RELIABLE_LINES_PER_S: usize = 250;

/// What a program asks of the controller.
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize)]
pub struct Flow {
    /// Most lines whose motion ends within any one second.
    pub lines_per_s: usize,
    /// Mean speed that the feed moves ask for, mm/min.
    pub asked_mm_per_min: f64,
    /// Mean speed that they reach, with acceleration, corners and the look-ahead of 15 blocks, mm/min.
    pub reached_mm_per_min: f64,
}

/// Gathers a [`Flow`] block by block.
#[derive(Debug, Clone, Default)]
pub(super) struct Gauge {
    /// When the lines of the last second ended, s.
    ends: VecDeque<f64>,
    last_line: u32,
    most: usize,
    feed_mm: f64,
    /// Time of the feed moves at the speeds asked for, s.
    asked_s: f64,
    feed_s: f64,
}

impl Gauge {
    /// A block of a line ends at a time, and took that long.
    pub(super) fn ends(&mut self, block: &Block, line: u32, end_s: f64, seconds: f64) {
        if !block.is_rapid() {
            self.feed_mm += block.length;
            self.asked_s += block.length / block.nominal2.sqrt();
            self.feed_s += seconds;
        }
        // The chords of an arc are one line.
        if line == self.last_line {
            self.ends.pop_back();
        }
        self.last_line = line;
        self.ends.push_back(end_s);
        while self.ends.front().is_some_and(|&s| s <= end_s - 1.0) {
            self.ends.pop_front();
        }
        self.most = self.most.max(self.ends.len());
    }

    pub(super) fn flow(&self) -> Flow {
        let speed = |s: f64| if s > 0.0 { 60.0 * self.feed_mm / s } else { 0.0 };
        Flow {
            lines_per_s: self.most,
            asked_mm_per_min: speed(self.asked_s),
            reached_mm_per_min: speed(self.feed_s),
        }
    }
}
