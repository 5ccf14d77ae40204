//! The document as text: unpacked, checked, and every element given an id of its own.
//!
//! `usvg` resolves SVG into paths but forgets names, Inkscape labels and everything it does not paint. So the
//! text is read here first: each element is written down with its name, labels and groups, elements without
//! an id (or with one that is taken) get a synthetic one in the text that `usvg` reads, and painted things are
//! found again by it.

mod references;

use std::collections::{HashMap, HashSet};
use std::io::Read;

use usvg::roxmltree::{self, Document, Node};

use super::ArtworkError;
use super::values::{self, Fault};

/// Most bytes of text that are read.
const MAX_BYTES: usize = 256 << 20;
/// Most XML nodes that are read.
const MAX_NODES: u32 = 2_000_000;
/// Deepest nesting of elements, `use` unfolded.
const MAX_DEPTH: usize = 256;

const SVG: &str = "http://www.w3.org/2000/svg";
const INKSCAPE: &str = "http://www.inkscape.org/namespaces/inkscape";

/// Elements whose content is not painted where it stands.
const NOT_PAINTED: [&str; 14] = [
    "clipPath",
    "defs",
    "desc",
    "filter",
    "flowRoot",
    "foreignObject",
    "linearGradient",
    "marker",
    "mask",
    "metadata",
    "pattern",
    "radialGradient",
    "symbol",
    "title",
];
/// Elements that paint something by themselves.
const PAINTING: [&str; 12] = [
    "circle",
    "ellipse",
    "flowRoot",
    "foreignObject",
    "image",
    "line",
    "path",
    "polygon",
    "polyline",
    "rect",
    "text",
    "use",
];

/// A checked document.
#[derive(Debug)]
pub(super) struct Source {
    /// The text for `usvg`: every element has an id of its own.
    pub(super) text: String,
    /// What is known of each element.
    pub(super) elements: Elements,
    /// Millimetres a CSS pixel, when the root gives its size in physical units.
    pub(super) unit_mm: Option<f64>,
    /// Bitmaps in the file, by name: they are not carved.
    pub(super) bitmaps: Vec<String>,
}

/// The elements of a document in its order, by the id they have in [`Source::text`].
#[derive(Debug, Default)]
pub(super) struct Elements {
    /// In document order.
    pub(super) list: Vec<Element>,
    by_id: HashMap<String, usize>,
}

impl Elements {
    /// Index of the element with this id in [`Source::text`].
    pub(super) fn find(&self, id: &str) -> Option<usize> {
        self.by_id.get(id).copied()
    }

    /// Names of all elements with this tag.
    pub(super) fn named(&self, tag: &str) -> Vec<&str> {
        self.list.iter().filter(|e| e.tag == tag).map(|e| e.name.as_str()).collect()
    }
}

/// What is known of one element.
#[derive(Debug, Clone)]
pub(super) struct Element {
    /// For messages: `path 'petal3' (line 12)`.
    pub(super) name: String,
    /// Its tag: `path`, `g`.
    pub(super) tag: String,
    /// The group it lies in.
    pub(super) parent: Option<usize>,
    /// Its id as written.
    pub(super) id: Option<String>,
    /// Its Inkscape label.
    pub(super) label: Option<String>,
    /// True for an Inkscape layer.
    pub(super) is_layer: bool,
    /// True when it should paint something where it stands.
    pub(super) paints: bool,
    /// True when it or a group around it is switched off by `display: none`.
    pub(super) switched_off: bool,
    /// Id of what a `use` draws.
    pub(super) target: Option<String>,
}

/// Reads, checks and names a document.
pub(super) fn read(bytes: &[u8]) -> Result<Source, ArtworkError> {
    let text = decode(bytes)?;
    let options = roxmltree::ParsingOptions {
        allow_dtd: true,
        nodes_limit: MAX_NODES,
        ..roxmltree::ParsingOptions::default()
    };
    let document = Document::parse_with_options(&text, options).map_err(|e| explain(&e))?;
    let lines = Lines::of(&text);
    let root = document.root_element();
    check_root(root, &lines)?;
    check_depth(root, &lines)?;

    let mut reader = Reader {
        lines: &lines,
        elements: Elements::default(),
        by_node: HashMap::new(),
        ids: HashSet::new(),
        edits: Vec::new(),
        bitmaps: Vec::new(),
        taken: root.descendants().filter_map(|n| n.attribute("id")).collect(),
        body: root.range().start,
    };
    for node in root.descendants().filter(Node::is_element) {
        reader.element(node)?;
    }
    references::check(&document, |node| reader.name(node))?;
    let Reader { elements, edits, bitmaps, .. } = reader;
    let unit_mm = unit_mm(root);
    let text = rewrite(&text, edits);
    Ok(Source { text, elements, unit_mm, bitmaps })
}

/// Bytes -> text without a byte order mark; gzip is unpacked.
fn decode(bytes: &[u8]) -> Result<String, ArtworkError> {
    let unpacked;
    let bytes = if bytes.starts_with(&[0x1f, 0x8b]) {
        let mut out = Vec::new();
        let limit = MAX_BYTES as u64 + 1;
        flate2::read::GzDecoder::new(bytes)
            .take(limit)
            .read_to_end(&mut out)
            .map_err(|e| ArtworkError::Compressed { reason: e.to_string() })?;
        unpacked = out;
        unpacked.as_slice()
    } else {
        bytes
    };
    if bytes.len() > MAX_BYTES {
        let what = format!("more than {MAX_BYTES} bytes of text");
        return Err(ArtworkError::TooBig { what, limit: MAX_BYTES });
    }
    let text = std::str::from_utf8(bytes).map_err(|e| {
        let good = &bytes[..e.valid_up_to()];
        ArtworkError::NotText { line: good.split(|b| *b == b'\n').count() }
    })?;
    Ok(text.strip_prefix('\u{feff}').unwrap_or(text).to_owned())
}

fn explain(error: &roxmltree::Error) -> ArtworkError {
    match error {
        roxmltree::Error::NodesLimitReached => ArtworkError::TooBig {
            what: format!("more than {MAX_NODES} nodes of XML"),
            limit: MAX_NODES as usize,
        },
        error => {
            let at = error.pos();
            // The reader puts the place at the end of its words; it stands at the front of ours.
            let words = error.to_string();
            let reason = words.split(" at ").next().unwrap_or_default().to_owned();
            ArtworkError::Xml { line: at.row, column: at.col, reason }
        }
    }
}

/// Where the lines of a text begin.
struct Lines(Vec<usize>);

impl Lines {
    fn of(text: &str) -> Self {
        Self(std::iter::once(0).chain(text.match_indices('\n').map(|(i, _)| i + 1)).collect())
    }

    fn line(&self, at: usize) -> u32 {
        self.0.partition_point(|start| *start <= at) as u32
    }

    fn of_node(&self, node: Node) -> u32 {
        self.line(node.range().start)
    }
}

fn check_root(root: Node, lines: &Lines) -> Result<(), ArtworkError> {
    let line = lines.of_node(root);
    if !root.has_tag_name((SVG, "svg")) {
        let tag = root.tag_name().name();
        let hint = if tag == "svg" { " without the namespace of SVG" } else { "" };
        return Err(ArtworkError::NotSvg { line, root: tag.to_owned(), hint: hint.to_owned() });
    }
    let bad = |attribute: &str, text: &str| ArtworkError::Size {
        line,
        attribute: attribute.to_owned(),
        text: text.to_owned(),
    };
    for attribute in ["width", "height"] {
        if let Some(text) = root.attribute(attribute)
            && text.trim() != "auto"
        {
            match values::read_length(text) {
                Ok((number, _)) if number > 0.0 => {}
                _ => return Err(bad(attribute, text)),
            }
        }
    }
    if let Some(text) = root.attribute("viewBox") {
        match values::read_view_box(text) {
            Ok([_, _, w, h]) if w > 0.0 && h > 0.0 => {}
            _ => return Err(bad("viewBox", text)),
        }
    }
    Ok(())
}

/// Refuses deep nesting before anything walks the tree by recursion.
fn check_depth(root: Node, lines: &Lines) -> Result<(), ArtworkError> {
    let mut depth = 0_usize;
    let mut node = root;
    loop {
        if depth > MAX_DEPTH {
            return Err(ArtworkError::TooDeep { line: lines.of_node(node), limit: MAX_DEPTH });
        }
        if let Some(child) = node.first_child() {
            depth += 1;
            node = child;
            continue;
        }
        loop {
            if node == root {
                return Ok(());
            }
            if let Some(next) = node.next_sibling() {
                node = next;
                break;
            }
            depth -= 1;
            node = node.parent().unwrap_or(root);
        }
    }
}

/// Physical units of the root's width or height make the drawing one of that size.
fn unit_mm(root: Node) -> Option<f64> {
    let physical = |attribute: &str| {
        let (_, unit) = values::read_length(root.attribute(attribute)?).ok()?;
        matches!(unit, "mm" | "cm" | "in" | "pt" | "pc").then_some(())
    };
    physical("width").or_else(|| physical("height")).map(|()| 25.4 / 96.0)
}

/// One change of the text: these bytes are replaced.
type Edit = (std::ops::Range<usize>, String);

fn rewrite(text: &str, mut edits: Vec<Edit>) -> String {
    edits.sort_by_key(|(range, _)| range.start);
    let mut out = String::with_capacity(text.len() + edits.len() * 24);
    let mut at = 0;
    for (range, new) in edits {
        if range.start < at {
            continue; // the same bytes twice: an element that an entity repeats
        }
        out.push_str(&text[at..range.start]);
        out.push_str(&new);
        at = range.end;
    }
    out.push_str(&text[at..]);
    out
}

struct Reader<'a> {
    lines: &'a Lines,
    elements: Elements,
    by_node: HashMap<roxmltree::NodeId, usize>,
    /// Ids met so far.
    ids: HashSet<String>,
    edits: Vec<Edit>,
    bitmaps: Vec<String>,
    /// All ids of the document.
    taken: HashSet<&'a str>,
    /// Where the root element begins; what stands before it is the text of entities.
    body: usize,
}

impl Reader<'_> {
    fn element(&mut self, node: Node) -> Result<(), ArtworkError> {
        if !matches!(node.tag_name().namespace(), None | Some(SVG)) {
            return Ok(());
        }
        let parent = node.parent_element().and_then(|p| self.by_node.get(&p.id()).copied());
        let tag = node.tag_name().name();
        let name = self.describe(node);
        let off = is_off(node) || parent.is_some_and(|p| self.elements.list[p].switched_off);
        let hidden = node.ancestors().skip(1).any(|a| NOT_PAINTED.contains(&a.tag_name().name()));
        let element = Element {
            name,
            tag: tag.to_owned(),
            parent,
            id: node.attribute("id").map(str::to_owned),
            label: node.attribute((INKSCAPE, "label")).map(str::to_owned),
            is_layer: node.attribute((INKSCAPE, "groupmode")) == Some("layer"),
            paints: !hidden && PAINTING.contains(&tag),
            switched_off: off,
            target: references::target(node).map(str::to_owned),
        };
        check_values(node, &element.name)?;
        if tag == "image" && !hidden && !off {
            self.bitmaps.push(element.name.clone());
        }
        let index = self.elements.list.len();
        if let Some(id) = self.own_id(node, index) {
            self.elements.by_id.insert(id, index);
        }
        self.by_node.insert(node.id(), index);
        self.elements.list.push(element);
        Ok(())
    }

    fn name(&self, node: Node) -> String {
        self.describe(node)
    }

    fn describe(&self, node: Node) -> String {
        let tag = node.tag_name().name();
        let line = self.lines.of_node(node);
        match node.attribute("id").or_else(|| node.attribute((INKSCAPE, "label"))) {
            Some(id) => format!("{tag} '{id}' (line {line})"),
            None => format!("{tag} (line {line})"),
        }
    }

    /// The id that the element has in the rewritten text; `None` when it cannot be given one of its own.
    fn own_id(&mut self, node: Node, index: usize) -> Option<String> {
        let written = node.attribute_node("id");
        if let Some(id) = written
            && !id.value().is_empty()
            && self.ids.insert(id.value().to_owned())
        {
            return Some(id.value().to_owned());
        }
        if node.range().start < self.body {
            return None;
        }
        let mut id = format!("relievo-{index}");
        while self.taken.contains(id.as_str()) {
            id.push('-');
        }
        if let Some(written) = written {
            self.edits.push((written.range_value(), id.clone()));
        } else {
            let at = tag_end(node)?;
            self.edits.push((at..at, format!(" id=\"{id}\"")));
        }
        Some(id)
    }
}

/// Where the name of the tag ends in the text; `None` when the text there is not that of the tag.
fn tag_end(node: Node) -> Option<usize> {
    let start = node.range().start;
    let text = node.document().input_text().get(start..)?.strip_prefix('<')?;
    let name = text.split(|c: char| c.is_whitespace() || matches!(c, '>' | '/')).next()?;
    name.ends_with(node.tag_name().name()).then_some(start + 1 + name.len())
}

/// True when the element itself says `display: none`.
fn is_off(node: Node) -> bool {
    let by_style = node.attribute("style").is_some_and(|style| {
        style.split(';').filter_map(|s| s.split_once(':')).any(|(key, value)| {
            key.trim() == "display" && value.trim().trim_end_matches("!important").trim() == "none"
        })
    });
    by_style || node.attribute("display").is_some_and(|d| d.trim() == "none")
}

/// Checks the numbers that place and shape an element.
fn check_values(node: Node, name: &str) -> Result<(), ArtworkError> {
    for attribute in node.attributes().filter(|a| a.namespace().is_none()) {
        let value = attribute.value();
        let checked = match (attribute.name(), node.tag_name().name()) {
            ("d", "path") => values::check_path(value),
            ("points", "polygon" | "polyline") => values::check_points(value),
            ("transform" | "gradientTransform" | "patternTransform", _) => {
                values::check_transform(value)
            }
            (
                "x" | "y" | "width" | "height" | "rx" | "ry" | "cx" | "cy" | "r" | "x1" | "y1"
                | "x2" | "y2",
                "rect" | "circle" | "ellipse" | "line" | "use",
            )
            | ("stroke-width", _) => values::check_length(value),
            _ => Ok(()),
        };
        checked.map_err(|fault: Fault| ArtworkError::Value {
            element: name.to_owned(),
            attribute: attribute.name().to_owned(),
            near: values::near(value, &fault),
            reason: fault.reason,
        })?;
    }
    Ok(())
}
