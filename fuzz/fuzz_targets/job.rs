//! Any text as a job file: a job or an error, never a panic.
#![no_main]
use libfuzzer_sys::fuzz_target;
use relievo::job::{Draft, Library};

fuzz_target!(|text: &str| {
    let no_files = |_: &str| Err(std::io::Error::from(std::io::ErrorKind::NotFound));
    let _ = Draft::from_toml(text, "fuzz.toml", &Library::built_in(), &no_files);
});
