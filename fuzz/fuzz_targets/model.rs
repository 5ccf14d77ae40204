//! Any bytes as an OBJ mesh: a manifold of finite size or an error, never a panic.
#![no_main]
use libfuzzer_sys::fuzz_target;
use relievo::job::MeshSpec;
use relievo::model::Model;

fuzz_target!(|input: (u8, Option<f64>, &[u8])| {
    let (levels, angle, bytes) = input;
    let angle = angle.filter(|a| a.is_finite() && *a > 0.0);
    let spec = MeshSpec {
        levels: Some(u32::from(levels % 3)),
        crease_rad: angle,
        corner_rad: angle,
        ..MeshSpec::of_file("fuzz.obj".to_owned())
    };
    if let Ok(model) = Model::read(bytes, "fuzz.obj", &spec) {
        assert!(model.size().is_finite());
    }
});
