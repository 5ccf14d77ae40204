//! OBJ text -> vertices, faces, crease tags, each with its line.
//!
//! Read are `v`, `f` (with `v/vt/vn` and negative indices), `l` (its edges become creases), `o` and `g` (names of parts) and
//! the tags `t crease` and `t corner` that `OpenSubdiv` writes. Texture, normals, materials and smoothing groups say nothing
//! about the shape of a control mesh and are passed over; curves, surfaces and whatever is no OBJ at all are refused.

use super::ModelError;
use crate::geom::DVec3;
use crate::surface::SHARP;

/// Most bytes of a file.
const MOST_BYTES: usize = 64 << 20;
/// Most vertices of a file, and most corners of all its faces: a control mesh has hundreds.
const MOST_VERTICES: usize = 1 << 20;
const MOST_CORNERS: usize = 1 << 18;
/// Largest coordinate.
const FARTHEST: f64 = 1e9;
/// What says nothing about the shape.
const PASSED_OVER: [&str; 16] = [
    "vt",
    "vn",
    "vp",
    "s",
    "usemtl",
    "mtllib",
    "usemap",
    "maplib",
    "lod",
    "bevel",
    "c_interp",
    "d_interp",
    "shadow_obj",
    "trace_obj",
    "mg",
    "p",
];
/// Curves and surfaces of other kinds.
const FREE_FORM: [&str; 14] = [
    "cstype", "deg", "bmat", "step", "curv", "curv2", "surf", "parm", "trim", "hole", "scrv", "sp",
    "end", "con",
];

/// A place in the file, both from 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Place {
    pub(super) line: usize,
    pub(super) column: usize,
}

/// A face as it stands in the file.
#[derive(Debug, Clone)]
pub(super) struct Face {
    /// Its vertices, from 0.
    pub(super) corners: Vec<u32>,
    /// Where it begins.
    pub(super) place: Place,
    /// Indices of the names that it goes by.
    names: Vec<usize>,
}

/// What an OBJ file holds.
#[derive(Debug, Clone, Default)]
pub(super) struct Obj {
    pub(super) vertices: Vec<DVec3>,
    pub(super) faces: Vec<Face>,
    /// Edges with their sharpness and place, from `l` and `t crease`.
    pub(super) creases: Vec<([u32; 2], f64, Place)>,
    /// Vertices with their sharpness, from `t corner`.
    pub(super) corners: Vec<(u32, f64)>,
    /// Names of objects and groups, each once.
    names: Vec<String>,
}

impl Obj {
    /// Keeps the faces of one object or group only.
    ///
    /// # Errors
    /// [`ModelError::NoPart`].
    pub(super) fn keep(&mut self, part: &str, file: &str) -> Result<(), ModelError> {
        const LISTED: usize = 12;
        let wanted = self.names.iter().position(|name| name == part);
        self.faces.retain(|face| face.names.iter().any(|name| Some(*name) == wanted));
        if !self.faces.is_empty() {
            return Ok(());
        }
        let names = self.names.iter().take(LISTED).map(|name| format!("\"{name}\""));
        let mut there = names.collect::<Vec<_>>().join(", ");
        if there.is_empty() {
            there.push_str("no name at all");
        }
        Err(ModelError::NoPart { file: file.to_owned(), part: part.to_owned(), there })
    }
}

/// A word with its place.
type Word<'a> = (&'a str, Place);

/// Reads a whole file.
///
/// # Errors
/// [`ModelError`], with the place.
pub(super) fn read(bytes: &[u8], file: &str) -> Result<Obj, ModelError> {
    if bytes.len() > MOST_BYTES {
        let what = format!("{} MB of text", bytes.len() >> 20);
        return Err(ModelError::TooBig { file: file.to_owned(), what });
    }
    // Names may be in any encoding; all else is ASCII.
    let text = String::from_utf8_lossy(bytes);
    let text = text.strip_prefix('\u{feff}').unwrap_or(&text);
    let mut reader =
        Reader { file, obj: Obj::default(), object: None, groups: Vec::new(), corners: 0 };
    let mut words: Vec<Word<'_>> = Vec::new();
    for (line, text) in (1..).zip(text.split('\n')) {
        let text = text.split('#').next().unwrap_or("").trim_end();
        let (text, goes_on) = match text.strip_suffix('\\') {
            Some(text) => (text, true),
            None => (text, false),
        };
        words.extend(split(text, line));
        if !goes_on {
            reader.statement(&words)?;
            words.clear();
        }
    }
    reader.statement(&words)?;
    Ok(reader.obj)
}

/// The words of a line.
fn split(text: &str, line: usize) -> impl Iterator<Item = Word<'_>> {
    text.split_ascii_whitespace().map(move |word| {
        // Words are slices of the line.
        let at = word.as_ptr() as usize - text.as_ptr() as usize;
        (word, Place { line, column: text[..at].chars().count() + 1 })
    })
}

struct Reader<'a> {
    file: &'a str,
    obj: Obj,
    /// Index of the name of the object, and of those of the groups, that faces belong to.
    object: Option<usize>,
    groups: Vec<usize>,
    /// Corners of all faces so far.
    corners: usize,
}

impl Reader<'_> {
    fn fault(&self, place: Place, what: impl Into<String>) -> ModelError {
        let Place { line, column } = place;
        ModelError::Syntax { file: self.file.to_owned(), line, column, what: what.into() }
    }

    fn statement(&mut self, words: &[Word<'_>]) -> Result<(), ModelError> {
        let Some((&(key, place), rest)) = words.split_first() else { return Ok(()) };
        match key {
            "v" => self.vertex(place, rest),
            "f" | "fo" => self.face(place, rest),
            "l" => self.line(place, rest),
            "t" => self.tag(place, rest),
            "o" => {
                let name = rest.iter().map(|word| word.0).collect::<Vec<_>>().join(" ");
                self.object = (!name.is_empty()).then(|| self.name(&name));
                Ok(())
            }
            "g" => {
                self.groups = rest.iter().map(|word| self.name(word.0)).collect();
                Ok(())
            }
            _ if PASSED_OVER.contains(&key) => Ok(()),
            _ if FREE_FORM.contains(&key) => Err(self.fault(
                place,
                format!("`{key}` is a curve or surface that is not read; export polygons"),
            )),
            _ => {
                let shown: String = key.chars().take(20).collect();
                let shown = shown.escape_debug();
                Err(self.fault(
                    place,
                    format!("\"{shown}\" is no statement of an OBJ file; export the mesh as OBJ"),
                ))
            }
        }
    }

    /// Index of a name; names are few.
    fn name(&mut self, name: &str) -> usize {
        self.obj.names.iter().position(|known| known == name).unwrap_or_else(|| {
            self.obj.names.push(name.to_owned());
            self.obj.names.len() - 1
        })
    }

    fn number(&self, word: Word<'_>) -> Result<f64, ModelError> {
        let number = word.0.parse::<f64>().ok();
        number.filter(|n| n.is_finite() && n.abs() <= FARTHEST).ok_or_else(|| {
            let shown: String = word.0.chars().take(20).collect();
            let shown = shown.escape_debug();
            self.fault(
                word.1,
                format!(
                    "\"{shown}\" is no number that can be used; repair the mesh and export it again"
                ),
            )
        })
    }

    fn vertex(&mut self, place: Place, words: &[Word<'_>]) -> Result<(), ModelError> {
        if words.len() < 3 {
            let what = format!(
                "a vertex has x, y and z, this one {} numbers; export it again",
                words.len()
            );
            return Err(self.fault(place, what));
        }
        if self.obj.vertices.len() == MOST_VERTICES {
            let what = format!("more than {MOST_VERTICES} vertices");
            return Err(ModelError::TooBig { file: self.file.to_owned(), what });
        }
        let mut at = [0.0; 3];
        for (slot, word) in at.iter_mut().zip(words) {
            *slot = self.number(*word)?;
        }
        self.obj.vertices.push(DVec3::from(at));
        Ok(())
    }

    /// A vertex by its number in a face or line: from 1, or back from the last one.
    fn index(&self, word: Word<'_>) -> Result<u32, ModelError> {
        let text = word.0.split('/').next().unwrap_or("");
        let count = self.obj.vertices.len();
        let found = text.parse::<i64>().ok().and_then(|n| match n {
            1.. => usize::try_from(n - 1).ok(),
            0 => None,
            _ => usize::try_from(n.checked_add(count as i64)?).ok(),
        });
        found.filter(|v| *v < count).map(|v| v as u32).ok_or_else(|| {
            let shown: String = word.0.chars().take(20).collect();
            let shown = shown.escape_debug();
            self.fault(
                word.1,
                format!(
                    "\"{shown}\" names no vertex: {count} stand above, they count from 1 (or from -1 backwards); export \
                     the mesh again"
                ),
            )
        })
    }

    fn face(&mut self, place: Place, words: &[Word<'_>]) -> Result<(), ModelError> {
        if words.len() < 3 {
            let what = format!(
                "a face has three corners or more, this one {}; delete it in the modeller (Blender: Mesh, Clean Up, \
                 Degenerate Dissolve)",
                words.len()
            );
            return Err(self.fault(place, what));
        }
        self.corners += words.len();
        if self.corners > MOST_CORNERS {
            let what = format!("faces with more than {MOST_CORNERS} corners in all");
            return Err(ModelError::TooBig { file: self.file.to_owned(), what });
        }
        let corners = words.iter().map(|w| self.index(*w)).collect::<Result<Vec<_>, _>>()?;
        let mut seen = corners.clone();
        seen.sort_unstable();
        if let Some(twice) = seen.windows(2).find(|pair| pair[0] == pair[1]) {
            let again = corners.iter().rposition(|v| *v == twice[0]).unwrap_or(0);
            let what = format!(
                "the face comes to vertex {} twice; split it there (Blender: Mesh, Clean Up, Degenerate Dissolve)",
                twice[0] + 1
            );
            return Err(self.fault(words[again].1, what));
        }
        let names = self.object.into_iter().chain(self.groups.iter().copied()).collect();
        self.obj.faces.push(Face { corners, place, names });
        Ok(())
    }

    fn line(&mut self, place: Place, words: &[Word<'_>]) -> Result<(), ModelError> {
        let points = words.iter().map(|w| self.index(*w)).collect::<Result<Vec<_>, _>>()?;
        self.obj.creases.extend(points.windows(2).map(|p| ([p[0], p[1]], SHARP, place)));
        Ok(())
    }

    /// `t crease 2/1/0 0 1 3.5`: how many whole numbers, numbers and texts follow; vertices count from 0.
    fn tag(&mut self, place: Place, words: &[Word<'_>]) -> Result<(), ModelError> {
        let (Some(kind), Some(counts)) = (words.first(), words.get(1)) else { return Ok(()) };
        let kind = kind.0;
        if kind != "crease" && kind != "corner" {
            return Ok(());
        }
        let number = |part: Option<&str>| part.and_then(|p| p.parse::<usize>().ok());
        let mut parts = counts.0.split('/');
        let (Some(whole), Some(sharp)) = (number(parts.next()), number(parts.next())) else {
            let what =
                format!("the tag must tell its numbers: t {kind} 2/1/0 and the vertices, from 0");
            return Err(self.fault(counts.1, what));
        };
        let rest = &words[2..];
        if rest.len() < whole.saturating_add(sharp) || whole == 0 || (kind == "crease" && whole < 2)
        {
            let what =
                format!("the tag is cut short: it announces {whole} vertices and {sharp} numbers");
            return Err(self.fault(place, what));
        }
        let count = self.obj.vertices.len();
        let mut vertices = Vec::with_capacity(whole);
        for word in &rest[..whole] {
            let vertex = word.0.parse::<u32>().ok().filter(|v| (*v as usize) < count);
            vertices.push(vertex.ok_or_else(|| {
                let what = format!(
                    "no vertex can be meant here: {count} stand above, and tags count them from 0"
                );
                self.fault(word.1, what)
            })?);
        }
        let mut values = Vec::with_capacity(sharp);
        for word in &rest[whole..whole + sharp] {
            let value = self.number(*word)?;
            if value < 0.0 {
                return Err(self.fault(word.1, "a sharpness is not below 0 (smooth), 10 is sharp"));
            }
            values.push(value);
        }
        let value = |k: usize| values.get(k).or(values.last()).copied().unwrap_or(SHARP);
        if kind == "crease" {
            let edges = vertices.windows(2).enumerate();
            self.obj.creases.extend(edges.map(|(k, p)| ([p[0], p[1]], value(k), place)));
        } else {
            self.obj.corners.extend(vertices.iter().enumerate().map(|(k, v)| (*v, value(k))));
        }
        Ok(())
    }
}
