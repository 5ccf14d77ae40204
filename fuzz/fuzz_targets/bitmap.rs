//! Any bytes as a picture, by any method: an artwork or an error, never a panic.
#![no_main]
use libfuzzer_sys::fuzz_target;
use relievo::artwork::read_bitmap;
use relievo::job::{ArtworkSpec, Connectivity, Fit, Place, TraceMethod, TraceSpec};

fuzz_target!(|input: (u8, &[u8])| {
    let (choice, bytes) = input;
    let methods = [TraceMethod::Auto, TraceMethod::Crack, TraceMethod::Moore, TraceMethod::Grey];
    let trace = TraceSpec {
        method: methods[usize::from(choice & 3)],
        connectivity: if choice & 4 == 0 { Connectivity::Four } else { Connectivity::Eight },
        least_area_px: f64::from(choice >> 3 & 7),
        ..TraceSpec::default()
    };
    let spec = ArtworkSpec {
        file: "picture.png".to_owned(),
        fit: Fit::Own,
        at: Place::Center,
        font_dirs: Vec::new(),
        dpi: None,
        trace,
    };
    let _ = read_bitmap(bytes, &spec);
});
