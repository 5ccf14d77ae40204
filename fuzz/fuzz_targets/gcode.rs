//! Any text as a program: moves or an error, never a panic.
#![no_main]
use libfuzzer_sys::fuzz_target;
use relievo::geom::DVec3;
use relievo::job::Library;
use relievo::gcode::read::read;

fuzz_target!(|text: &str| {
    let library = Library::built_in();
    let machine = library.machines().next().expect("machines are built in");
    let _ = read(text, machine, DVec3::new(0.0, 0.0, 5.0));
});
