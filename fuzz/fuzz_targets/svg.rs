//! Any bytes as SVG: an artwork or an error, never a panic.
#![no_main]
use libfuzzer_sys::fuzz_target;
use relievo::artwork::{Fonts, read_svg};

fuzz_target!(|bytes: &[u8]| {
    let _ = read_svg(bytes, &Fonts::none());
});
