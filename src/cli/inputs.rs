//! A job file or bare artwork on the disk -> a checked draft and its artwork.

use super::files;
use crate::artwork::{Artwork, Fonts, is_picture, read_bitmap, read_svg};
use crate::controller::Store;
use crate::job::{ArtworkSpec, Draft, Found, Library, Machine, MeshSpec};
use crate::model::Model;
use anyhow::{Context, Result, anyhow, bail};
use std::path::{Path, PathBuf};

/// All that a command reads.
#[derive(Debug)]
pub(super) struct Input {
    pub(super) draft: Draft,
    pub(super) artwork: Artwork,
    /// The artwork's file, for messages; the job itself where every layer is a mesh.
    pub(super) artwork_file: PathBuf,
    /// The meshes that its layers name, and their files.
    pub(super) models: Vec<Model>,
    pub(super) model_files: Vec<PathBuf>,
    pub(super) library: Library,
}

/// Reads a job file (`.toml`), artwork (`.svg`, `.svgz`, `.png`, `.jpg`, `.jpeg`) or a mesh (`.obj`) and, for a job, the artwork
/// and the meshes it names.
pub(super) fn load(path: &Path) -> Result<Input> {
    let beside = path.parent().unwrap_or(Path::new(""));
    let library = library(beside)?;
    let extension =
        path.extension().and_then(|e| e.to_str()).unwrap_or_default().to_ascii_lowercase();
    let (draft, artwork_file) = match extension.as_str() {
        "toml" => {
            let text = files::read_text(path)?;
            let load = |name: &str| std::fs::read_to_string(beside.join(name));
            let draft = Draft::from_toml(&text, &path.display().to_string(), &library, &load)?;
            let is_given = draft.artwork().is_given();
            let file =
                if is_given { beside.join(&draft.artwork().file) } else { path.to_path_buf() };
            (draft, file)
        }
        known if known == "svg" || known == "svgz" || ArtworkSpec::PICTURES.contains(&known) => {
            let name = path.file_name().unwrap_or_default().to_string_lossy();
            (Draft::for_artwork(&name, &library), path.to_path_buf())
        }
        "" => {
            bail!(
                "{} has no extension; give a job file (.toml), artwork (.svg, .png, .jpg) or a mesh (.obj)",
                path.display()
            )
        }
        "obj" => return load_mesh(path, library),
        other => bail!(
            "{}: '.{other}' files are not read; give a job file (.toml), artwork (.svg, .svgz, .png, .jpg) or a mesh (.obj)",
            path.display()
        ),
    };
    let (model_files, models) = load_models(&draft, beside)?;
    let input = |draft: Draft, artwork: Artwork| Input {
        draft,
        artwork,
        artwork_file: artwork_file.clone(),
        models,
        model_files,
        library,
    };
    if !draft.artwork().is_given() {
        draft.refuse_picture_keys()?;
        return Ok(input(draft, Artwork::none()));
    }
    if artwork_file.extension().is_some_and(|e| e.eq_ignore_ascii_case("obj")) {
        return Err(draft.mesh_as_artwork().into());
    }
    let bytes = match files::read(&artwork_file) {
        Err(e) if artwork_file != path => {
            return Err(draft.unreadable_artwork(&format!("{e:#}")).into());
        }
        bytes => bytes?,
    };
    // What it is shows in its first bytes; its name counts when they say nothing.
    if is_picture(&bytes) || draft.artwork().is_picture() {
        let artwork = read_bitmap(&bytes, draft.artwork())
            .with_context(|| artwork_file.display().to_string())?;
        return Ok(input(draft, artwork));
    }
    draft.refuse_picture_keys()?;
    let dirs: Vec<PathBuf> = draft.artwork().font_dirs.iter().map(|d| beside.join(d)).collect();
    if let Some(lost) = dirs.iter().find(|d| !d.is_dir()) {
        let message = format!("font folder {} is not there", lost.display());
        return Err(draft.unreadable_fonts(&message).into());
    }
    let fonts = if needs_fonts(&bytes) { load_fonts(&dirs) } else { Fonts::none() };
    let artwork = read_svg(&bytes, &fonts).with_context(|| artwork_file.display().to_string())?;
    Ok(input(draft, artwork))
}

/// A mesh by itself: the only layer of a job without artwork.
fn load_mesh(path: &Path, library: Library) -> Result<Input> {
    let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let spec = MeshSpec::of_file(name.clone());
    let model = Model::read(&files::read(path)?, &path.display().to_string(), &spec)?;
    let draft = Draft::for_mesh(&name, model.size(), &library)?;
    Ok(Input {
        draft,
        artwork: Artwork::none(),
        artwork_file: path.to_path_buf(),
        models: vec![model],
        model_files: vec![path.to_path_buf()],
        library,
    })
}

impl Input {
    /// What the job needs to know of what it names.
    pub(super) fn found(&self) -> Found {
        crate::found(&self.artwork, &self.models)
    }
}

/// The meshes that a job names, with their files.
fn load_models(draft: &Draft, beside: &Path) -> Result<(Vec<PathBuf>, Vec<Model>)> {
    let (mut files, mut models) = (Vec::new(), Vec::new());
    for (layer, spec) in draft.meshes() {
        let path = beside.join(&spec.file);
        let bytes =
            files::read(&path).map_err(|e| draft.unreadable_mesh(layer, &format!("{e:#}")))?;
        models.push(Model::read(&bytes, &path.display().to_string(), spec)?);
        files.push(path);
    }
    Ok((files, models))
}

/// The built-in tables, overridden by `machines/*.toml` in `folder`.
pub(super) fn library(folder: &Path) -> Result<Library> {
    let mut library = Library::built_in();
    let Ok(entries) = std::fs::read_dir(folder.join("machines")) else { return Ok(library) };
    let mut paths: Vec<_> = entries.filter_map(|e| e.ok().map(|e| e.path())).collect();
    paths.sort();
    for path in paths.iter().filter(|p| p.extension().is_some_and(|e| e == "toml")) {
        library.overlay(&path.display().to_string(), &files::read_text(path)?)?;
    }
    Ok(library)
}

/// The EEPROM of a settings file.
pub(super) fn settings(path: &Path) -> Result<Store> {
    Store::from_text(&files::read_text(path)?)
        .map_err(|e| anyhow!("{}:{}: {e}", path.display(), e.line()))
}

/// The machine of a name, or of a file.
pub(super) fn machine(name: &str) -> Result<Machine> {
    let path = Path::new(name);
    if path.extension().is_some_and(|e| e == "toml") {
        let mut library = Library::built_in();
        library.overlay(name, &files::read_text(path)?)?;
        let stem = path.file_stem().unwrap_or_default().to_string_lossy();
        return library.machine(&stem).cloned().ok_or_else(|| {
            anyhow!("{name} holds no machine named '{stem}'; give the file the name that it states")
        });
    }
    let library = library(Path::new(""))?;
    library.machine(name).cloned().ok_or_else(|| {
        let names: Vec<_> = library.machines().map(|m| m.name.as_str()).collect();
        anyhow!(
            "there is no machine '{name}'; choose one of {}, or give a .toml file",
            names.join(", ")
        )
    })
}

/// Scanning the system's fonts takes long: it is done only for artwork that may hold text.
fn needs_fonts(bytes: &[u8]) -> bool {
    bytes.starts_with(&[0x1f, 0x8b]) || bytes.windows(4).any(|w| w == b"text")
}

/// The fonts of some folders; of the system without any.
fn load_fonts(dirs: &[PathBuf]) -> Fonts {
    let mut database = usvg::fontdb::Database::new();
    if dirs.is_empty() {
        database.load_system_fonts();
    }
    for dir in dirs {
        database.load_fonts_dir(dir);
    }
    Fonts::from_database(database)
}
