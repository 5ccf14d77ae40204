//! Any bytes as a program, in both dialects: moves or an error, never a panic; and what the strict reader takes means
//! the same to the tolerant one.
#![no_main]
use libfuzzer_sys::fuzz_target;
use relievo::gcode::read::{Frame, read, read_any};
use relievo::geom::DVec3;
use relievo::job::Library;

fuzz_target!(|bytes: &[u8]| {
    let library = Library::built_in();
    let machine = library.machines().next().expect("machines are built in");
    let start = DVec3::new(0.0, 0.0, 5.0);
    let unhomed = Frame::new(start);
    let homed = Frame { machine_zero_mm: Some(DVec3::new(300.0, 200.0, 80.0)), ..unhomed.clone() };
    let any = read_any(bytes, machine, &unhomed);
    let _ = read_any(bytes, machine, &homed);
    if let Ok(text) = std::str::from_utf8(bytes)
        && let Ok(strict) = read(text, machine, start)
    {
        let any = any.expect("a program of the strict dialect");
        assert_eq!((any.moves, any.events), (strict.moves, strict.events));
    }
});
