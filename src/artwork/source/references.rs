//! References between elements: none may leave the file, run in a circle or unfold without end.

use std::collections::{BTreeSet, HashMap};

use usvg::roxmltree::{Document, Node, NodeId};

use super::{ArtworkError, MAX_DEPTH};

/// Most elements after every `use` is replaced by what it draws.
const MAX_UNFOLDED: f64 = 500_000.0;

const XLINK: &str = "http://www.w3.org/1999/xlink";

/// Elements whose `href` is read while the artwork is resolved (links for readers, scripts and animations are not).
const FOLLOWED: [&str; 9] = [
    "feImage",
    "filter",
    "image",
    "linearGradient",
    "pattern",
    "radialGradient",
    "textPath",
    "tref",
    "use",
];

/// Id of what a `use` draws, when it stands in this file.
pub(super) fn target<'a>(node: Node<'a, '_>) -> Option<&'a str> {
    let is_use = node.tag_name().name() == "use";
    href(node).filter(|_| is_use).and_then(|h| h.trim().strip_prefix('#'))
}

/// Checks all references of a document.
pub(super) fn check(
    document: &Document,
    name: impl Fn(Node) -> String,
) -> Result<(), ArtworkError> {
    let mut ids = HashMap::new();
    for node in document.descendants() {
        if let Some(id) = node.attribute("id") {
            ids.entry(id).or_insert(node);
        }
    }
    check_external(document, &name)?;
    let rules = style_rules(document);
    let mut graph = Graph { ids, rules, name: &name, seen: HashMap::new() };
    graph.measure(document.root_element(), 0).map(drop)
}

fn href<'a>(node: Node<'a, '_>) -> Option<&'a str> {
    if !FOLLOWED.contains(&node.tag_name().name()) {
        return None;
    }
    node.attribute("href").or_else(|| node.attribute((XLINK, "href")))
}

fn check_external(document: &Document, name: &impl Fn(Node) -> String) -> Result<(), ArtworkError> {
    let external = |element: String, href: &str| {
        let href = href.chars().take(80).collect();
        Err(ArtworkError::External { element, href })
    };
    for node in document.descendants() {
        if let Some(pi) = node.pi() {
            let value = pi.value.unwrap_or_default();
            if pi.target == "xml-stylesheet" && !value.contains("href=\"#") {
                return external("the xml-stylesheet line".to_owned(), value);
            }
        }
        if !node.is_element() {
            continue;
        }
        if let Some(href) = href(node) {
            let href = href.trim();
            let embedded = node.tag_name().name() == "image" && href.starts_with("data:");
            if !href.starts_with('#') && !embedded {
                return external(name(node), href);
            }
        }
        let is_style = node.tag_name().name() == "style";
        if is_style {
            let css = without_font_faces(node.text().unwrap_or_default());
            if let Some((_, import)) = css.split_once("@import") {
                return external(name(node), import.split(';').next().unwrap_or_default().trim());
            }
            if let Some(url) = urls(&css).find(|url| !url.starts_with('#')) {
                return external(name(node), url);
            }
        }
        let painted = node.attributes().filter(|a| a.namespace().is_none());
        for attribute in painted {
            if let Some(url) = urls(attribute.value()).find(|url| !url.starts_with('#')) {
                return external(name(node), url);
            }
        }
    }
    Ok(())
}

/// What stands in each `url(...)` of a value.
fn urls(value: &str) -> impl Iterator<Item = &str> {
    value.split("url(").skip(1).map(|rest| {
        let inside = rest.split(')').next().unwrap_or_default();
        inside.trim().trim_matches(['"', '\'']).trim()
    })
}

/// A style sheet without comments and `@font-face { ... }`: web fonts are not read, so they cannot hurt.
fn without_font_faces(css: &str) -> String {
    let mut out = String::new();
    for (i, part) in css.split("/*").enumerate() {
        out.push_str(if i == 0 {
            part
        } else {
            part.split_once("*/").map_or("", |(_, rest)| rest)
        });
    }
    while let Some(from) = out.find("@font-face") {
        let to = out[from..].find('}').map_or(out.len(), |len| from + len + 1);
        out.replace_range(from..to, "");
    }
    out
}

/// A rule of a style sheet that refers to other elements: the words of its selector, and the ids.
struct Rule {
    words: BTreeSet<String>,
    targets: Vec<String>,
}

fn style_rules(document: &Document) -> Vec<Rule> {
    let mut out = Vec::new();
    for node in document.descendants().filter(|n| n.tag_name().name() == "style") {
        let css = without_font_faces(node.text().unwrap_or_default());
        for (selector, body) in css.split('}').filter_map(|rule| rule.split_once('{')) {
            let targets: Vec<String> =
                urls(body).filter_map(|u| u.strip_prefix('#')).map(str::to_owned).collect();
            if !targets.is_empty() {
                let word = |c: char| !(c.is_alphanumeric() || c == '-' || c == '_' || c == '*');
                let words = selector.split(word).filter(|w| !w.is_empty()).map(str::to_owned);
                out.push(Rule { words: words.collect(), targets });
            }
        }
    }
    out
}

/// Depth and number of elements below an element, `use` unfolded.
#[derive(Clone, Copy)]
struct Extent {
    depth: usize,
    count: f64,
}

struct Graph<'a, 'd, F> {
    ids: HashMap<&'a str, Node<'a, 'd>>,
    rules: Vec<Rule>,
    name: &'a F,
    /// `None` while an element is being measured: to meet it again then is a circle.
    seen: HashMap<NodeId, Option<Extent>>,
}

impl<'a, 'd, F: Fn(Node) -> String> Graph<'a, 'd, F> {
    fn measure(&mut self, node: Node<'a, 'd>, depth: usize) -> Result<Extent, ArtworkError> {
        if let Some(Some(extent)) = self.seen.get(&node.id()).copied() {
            return self.within(extent, node, depth);
        }
        self.within(Extent { depth: 0, count: 0.0 }, node, depth)?;
        self.seen.insert(node.id(), None);
        let mut extent = Extent { depth: 0, count: 1.0 };
        for child in node.children().filter(Node::is_element) {
            let inner = self.measure(child, depth + 1)?;
            extent.depth = extent.depth.max(inner.depth + 1);
            extent.count += inner.count;
        }
        for id in self.targets(node) {
            let is_use = target(node) == Some(id.as_str());
            let Some(other) = self.ids.get(id.as_str()).copied() else {
                if is_use {
                    return Err(ArtworkError::Dangling { element: (self.name)(node), target: id });
                }
                continue;
            };
            if self.seen.get(&other.id()).is_some_and(Option::is_none) {
                return Err(ArtworkError::Circle { element: (self.name)(node), target: id });
            }
            let inner = self.measure(other, depth + 1)?;
            extent.depth = extent.depth.max(inner.depth + 1);
            if is_use {
                extent.count += inner.count;
            }
        }
        self.seen.insert(node.id(), Some(extent));
        self.within(extent, node, depth)
    }

    fn within(&self, extent: Extent, node: Node, depth: usize) -> Result<Extent, ArtworkError> {
        if depth + extent.depth > MAX_DEPTH {
            let line = node.document().text_pos_at(node.range().start).row;
            return Err(ArtworkError::TooDeep { line, limit: MAX_DEPTH });
        }
        if extent.count > MAX_UNFOLDED {
            return Err(ArtworkError::TooBig {
                what: format!(
                    "{} draws {:.0} elements once every use is unfolded",
                    (self.name)(node),
                    extent.count
                ),
                limit: MAX_UNFOLDED as usize,
            });
        }
        Ok(extent)
    }

    /// Ids that an element refers to, by its attributes or by a style rule that may apply to it.
    fn targets(&self, node: Node) -> Vec<String> {
        let by_href = href(node).and_then(|h| h.trim().strip_prefix('#')).map(str::to_owned);
        let mut out: Vec<String> = by_href.into_iter().collect();
        for attribute in node.attributes() {
            let local = urls(attribute.value()).filter_map(|u| u.strip_prefix('#'));
            out.extend(local.map(str::to_owned));
        }
        let classes = node.attribute("class").unwrap_or_default().split_whitespace();
        let words: Vec<&str> =
            classes.chain(node.attribute("id")).chain([node.tag_name().name(), "*"]).collect();
        for rule in &self.rules {
            if words.iter().any(|w| rule.words.contains(*w)) {
                out.extend(rule.targets.iter().cloned());
            }
        }
        out
    }
}
