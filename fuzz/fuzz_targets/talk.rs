//! Any program to any controller: neither the sender nor the simulated controller may panic, and whatever is heard,
//! no more bytes are unanswered than the ring holds.
#![no_main]

use libfuzzer_sys::fuzz_target;
use relievo::controller::{Controller, Store};
use relievo::stream::{RING_BYTES, Sender, prepare};
use std::sync::Arc;

fuzz_target!(|data: &[u8]| {
    let (program, heard) = data.split_at(data.len() / 2);
    let mut controller = Controller::new(Store::default());
    controller.feed(heard);
    controller.advance(1.0);
    let Ok(script) = prepare(&String::from_utf8_lossy(program)) else { return };
    let mut sender = Sender::new(Arc::new(script), 0.0);
    for (k, piece) in heard.chunks(16).enumerate() {
        let said = sender.step(k as f64 * 0.05, piece);
        assert!(sender.unanswered_bytes() <= RING_BYTES);
        controller.feed(&said);
        controller.advance(0.05);
    }
});
