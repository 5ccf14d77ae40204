//! When a program's lines reach the controller over a serial line of limited speed.

use std::collections::VecDeque;

/// Bytes that GRBL's receive buffer holds.
const RX_BYTES: usize = 128;

/// Bits on the wire for each byte: start, eight, stop.
const BITS_PER_BYTE: f64 = 10.0;

/// A serial line that is kept as busy as the receive buffer lets it.
#[derive(Debug, Clone)]
pub(super) struct Supply {
    seconds_per_byte: f64,
    /// When the last byte so far is through, s.
    wire_s: f64,
    /// Lines in the receive buffer or on the way: bytes, and when the controller took them out.
    waiting: VecDeque<(usize, f64)>,
    waiting_bytes: usize,
}

impl Supply {
    pub(super) fn new(baud: f64) -> Self {
        Self {
            seconds_per_byte: BITS_PER_BYTE / baud,
            wire_s: 0.0,
            waiting: VecDeque::new(),
            waiting_bytes: 0,
        }
    }

    /// When a line of this many bytes (its end included) is there, s. `room_s` is when the planner has room for it.
    pub(super) fn arrival_s(&mut self, bytes: usize, room_s: f64) -> f64 {
        let mut begin_s = self.wire_s;
        while self.waiting_bytes + bytes > RX_BYTES {
            let Some((gone, taken_s)) = self.waiting.pop_front() else { break };
            self.waiting_bytes -= gone;
            begin_s = begin_s.max(taken_s);
        }
        self.wire_s = begin_s + bytes as f64 * self.seconds_per_byte;
        self.waiting.push_back((bytes, self.wire_s.max(room_s)));
        self.waiting_bytes += bytes;
        self.wire_s
    }
}
