//! Layers that are meshes: keys, sizes, places, written text.

use super::*;
use crate::geom::DVec3;

/// A job of meshes only, each 20 x 10 x 5 units.
fn mesh_job(text: &str) -> Result<Job, JobError> {
    let draft = draft(text)?;
    let meshes = draft.meshes().map(|_| DVec3::new(20.0, 10.0, 5.0)).collect();
    let nothing = Found {
        size: DVec2::ZERO,
        unit_mm: None,
        layers: vec![],
        selectors: vec![],
        paths: vec![],
        meshes,
    };
    draft.settle(&nothing)
}

fn mesh_of(job: &Job, layer: usize) -> &MeshSpec {
    job.layers[layer].mesh().unwrap()
}

#[test]
fn a_job_of_one_mesh_needs_no_artwork() {
    let job = mesh_job("[[layer]]\nmesh = \"art/shell.obj\"\n").unwrap();
    assert_eq!((job.title.as_str(), job.layers[0].name.as_str()), ("shell", "shell"));
    assert!(!job.artwork.is_given());
    // A unit is a millimetre, the margin 10 mm on each side, and the mesh as high as it is.
    assert_eq!((job.stock.width_mm, job.stock.height_mm), (40.0, 30.0));
    assert_eq!(
        (mesh_of(&job, 0).unit_mm, mesh_of(&job, 0).lower_left_mm),
        (1.0, DVec2::splat(10.0))
    );
    assert_eq!((job.layers[0].base_mm, job.layers[0].height_mm), (0.0, 5.0));
    assert_eq!(job.layers[0].select, Selector::Mesh("art/shell.obj".to_owned()));
}

#[test]
fn width_scale_place_and_height_are_as_asked_for() {
    let job = mesh_job(
        "[[layer]]\nmesh = { file = \"a.obj\", width_mm = 24, at = [4, 6] }\nbase_mm = 1\n\
         [[layer]]\nmesh = { file = \"b.obj\", scale = 0.5, part = \"hinge\", up = \"y\" }\nheight_mm = 3\n",
    )
    .unwrap();
    let (a, b) = (mesh_of(&job, 0), mesh_of(&job, 1));
    assert_eq!((a.unit_mm, a.lower_left_mm), (1.2, DVec2::new(4.0, 6.0)));
    assert_eq!((b.unit_mm, b.up_is_y, b.part.as_deref()), (0.5, true, Some("hinge")));
    assert_eq!(job.layers[1].name, "hinge");
    // Six above its base of 1.
    assert_eq!((job.layers[0].height_mm, job.layers[1].height_mm), (7.0, 3.0));
    assert_eq!((job.stock.width_mm, job.stock.height_mm), (38.0, 28.0));
}

#[test]
fn meshes_and_shapes_share_a_job() {
    let text =
        with("[[layer]]\nselect = \"all\"\n[[layer]]\nmesh = \"m.obj\"\ncombine = \"add\"\n");
    let found = Found { meshes: vec![DVec3::new(20.0, 10.0, 2.0)], ..found() };
    let job = draft(&text).unwrap().settle(&found).unwrap();
    // Pixel art of 150 x 75 mm decides the stock; both lie in its middle.
    assert_eq!((job.stock.width_mm, job.stock.height_mm), (170.0, 95.0));
    assert_eq!(mesh_of(&job, 1).lower_left_mm, DVec2::new(75.0, 42.5));
    assert_eq!(job.layers[1].height_mm, 2.0);
}

#[test]
fn a_job_with_meshes_is_written_and_read_back() {
    let text = "[[layer]]\nname = \"shell\"\nmesh = { file = \"a.obj\", width_mm = 31.7, at = [4, 6], rotate_deg = 33, \
                levels = 3, crease_deg = 40, corner_deg = 50, up = \"y\", part = \"p q\" }\nheight_mm = 3\n\
                combine = \"replace\"\nfeather_mm = 1\n[[layer]]\nmesh = \"b.obj\"\n";
    let job = mesh_job(text).unwrap();
    let again = mesh_job(&job.to_toml()).unwrap();
    assert_eq!(again.layers, job.layers);
    assert_eq!(again.stock, job.stock);
    assert!(!job.to_toml().contains("[artwork]"));
}

#[test]
fn what_does_not_go_together_is_refused_at_its_place() {
    let refused = |text: &str, place: (usize, usize), words: &[&str]| {
        let error = mesh_job(text).expect_err(text);
        let picture = error.to_string();
        assert_eq!((error.line(), error.column()), (Some(place.0), Some(place.1)), "{picture}");
        assert!(
            words.iter().all(|word| picture.contains(word)),
            "{words:?} are not all in\n{picture}"
        );
    };
    let layer = |lines: &str| format!("[[layer]]\nmesh = \"a.obj\"\n{lines}\n");
    refused(&layer("select = \"all\""), (3, 10), &["does not use select", "leave one of them out"]);
    refused(&layer("surface = \"ruled\""), (3, 11), &["does not use surface"]);
    refused(&layer("draft_deg = 5"), (3, 13), &["without effect"]);
    refused("[[layer]]\nmesh = 5\n", (2, 8), &["path of an OBJ file"]);
    refused("[[layer]]\nmesh = \"\"\n", (2, 8), &["this is empty"]);
    refused("[[layer]]\nmesh = {}\n", (2, 8), &["`file` is missing"]);
    let table = |keys: &str| format!("[[layer]]\nmesh = {{ file = \"a.obj\", {keys} }}\n");
    refused(&table("scale = 2, width_mm = 3"), (2, 34), &["given twice"]);
    refused(&table("up = \"x\""), (2, 31), &["there is: z, y"]);
    refused(&table("levels = 9"), (2, 35), &["between 0 and 8"]);
    refused(&table("widht_mm = 9"), (2, 26), &["did you mean `width_mm`?"]);
    refused(&table("scale = 0.001"), (2, 34), &["0.0200 x 0.0100 mm", "mesh.scale"]);
    // 20 mm do not fit into 15, a box from 8 to 28 sticks out of 25, a base of 6 lies above a height of 4.
    refused(
        &format!("[stock]\nwidth_mm = 15\n{}", table("at = [0, 0]")),
        (2, 12),
        &["the mesh of layer 'a' is 20 mm long in X", "smaller mesh.width_mm"],
    );
    refused(
        &format!("[stock]\nwidth_mm = 25\n{}", table("at = [8, 0]")),
        (4, 31),
        &["sticks out of the stock by 3 mm in X", "change mesh.at"],
    );
    refused(&layer("base_mm = 6\nheight_mm = 4"), (4, 13), &["stand on its head"]);
    // Without artwork every layer is a mesh, and there is one.
    refused(
        "[[layer]]\nmesh = \"a.obj\"\n[[layer]]\nselect = \"all\"\n",
        (1, 1),
        &["`artwork` is missing"],
    );
}
