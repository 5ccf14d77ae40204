//! Which font a text gets, and what to say when it is not the one it asks for.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use usvg::fontdb::{self, Database, Family, ID};
use usvg::{FontFamily, FontResolver, FontStretch, FontStyle};

use super::odd::{Odd, Odds};
use crate::artwork::ArtworkError;
use crate::artwork::source::Source;

/// Stands for the font of text that names none.
pub(super) const UNNAMED: &str = "relievo-unnamed";

/// What the font resolver met.
#[derive(Debug, Default)]
pub(super) struct Log(Arc<Mutex<Found>>);

#[derive(Debug, Default)]
struct Found {
    /// Families asked for without any of them being there.
    missing: Vec<String>,
    /// Family asked for, family given.
    replaced: Vec<(String, String)>,
}

impl Log {
    /// A resolver that takes a font only when the text names it or leaves it open (`serif`, nothing).
    pub(super) fn resolver(&self) -> FontResolver<'static> {
        let found = self.0.clone();
        FontResolver {
            select_font: Box::new(move |font, database| select(font, database, &mut lock(&found))),
            select_fallback: FontResolver::default_fallback_selector(),
        }
    }

    /// Refuses missing fonts, notes replaced ones.
    pub(super) fn settle(&self, source: &Source, odds: &mut Odds) -> Result<(), ArtworkError> {
        let found = lock(&self.0);
        let element = source.elements.named("text").join(", ");
        if let Some(family) = found.missing.first() {
            return Err(ArtworkError::Font { element, family: family.clone() });
        }
        for (asked, given) in &found.replaced {
            odds.add(Odd::Font, format!("{asked} -> '{given}'"));
        }
        Ok(())
    }
}

/// Refuses a text with characters that no font has: they would be left out or become empty boxes.
pub(super) fn check_glyphs(text: &usvg::Text, element: &str) -> Result<(), ArtworkError> {
    let glyphs = text.layouted().iter().flat_map(|span| &span.positioned_glyphs);
    let mut lost: Vec<String> = glyphs
        .filter(|g| g.id.0 == 0 && !g.text.trim().is_empty())
        .map(|g| format!("'{}'", g.text))
        .collect();
    lost.sort();
    lost.dedup();
    if lost.is_empty() {
        return Ok(());
    }
    let plural = if lost.len() > 1 { "s" } else { "" };
    let (element, characters) = (element.to_owned(), lost.join(", "));
    Err(ArtworkError::Glyph { element, characters, plural })
}

fn lock(found: &Mutex<Found>) -> MutexGuard<'_, Found> {
    found.lock().unwrap_or_else(PoisonError::into_inner)
}

fn select(font: &usvg::Font, database: &Arc<Database>, log: &mut Found) -> Option<ID> {
    let asked: Vec<String> = font.families().iter().map(words).collect();
    for (i, family) in font.families().iter().enumerate() {
        let Some(id) = find(font, family, database) else { continue };
        if i > 0 || *family == FontFamily::Named(UNNAMED.to_owned()) {
            let given = database.face(id).and_then(|f| f.families.first().map(|f| f.0.clone()));
            let pair = (asked[0].clone(), given.unwrap_or_default());
            if !log.replaced.contains(&pair) {
                log.replaced.push(pair);
            }
        }
        return Some(id);
    }
    let asked = asked.join(", ");
    if !log.missing.contains(&asked) {
        log.missing.push(asked);
    }
    None
}

/// A family for people.
fn words(family: &FontFamily) -> String {
    match family {
        FontFamily::Named(name) if name == UNNAMED => "for text that names none".to_owned(),
        FontFamily::Named(name) => format!("'{name}'"),
        generic => generic.to_string(),
    }
}

fn find(font: &usvg::Font, family: &FontFamily, database: &Database) -> Option<ID> {
    let exact = match family {
        FontFamily::Named(name) => Family::Name(name),
        FontFamily::Serif => Family::Serif,
        FontFamily::SansSerif => Family::SansSerif,
        FontFamily::Cursive => Family::Cursive,
        FontFamily::Fantasy => Family::Fantasy,
        FontFamily::Monospace => Family::Monospace,
    };
    let open = !matches!(family, FontFamily::Named(name) if name != UNNAMED);
    // A text that leaves the family open takes any: the first one in the alphabet, so that the order in which
    // the fonts were found does not matter.
    let mut any = database.faces().flat_map(|f| f.families.iter().map(|f| f.0.as_str()));
    query(font, exact, database).or_else(|| {
        let first = if open { any.by_ref().min() } else { None };
        first.and_then(|name| query(font, Family::Name(name), database))
    })
}

fn query(font: &usvg::Font, family: Family, database: &Database) -> Option<ID> {
    database.query(&fontdb::Query {
        families: &[family],
        weight: fontdb::Weight(font.weight()),
        stretch: match font.stretch() {
            FontStretch::UltraCondensed => fontdb::Stretch::UltraCondensed,
            FontStretch::ExtraCondensed => fontdb::Stretch::ExtraCondensed,
            FontStretch::Condensed => fontdb::Stretch::Condensed,
            FontStretch::SemiCondensed => fontdb::Stretch::SemiCondensed,
            FontStretch::Normal => fontdb::Stretch::Normal,
            FontStretch::SemiExpanded => fontdb::Stretch::SemiExpanded,
            FontStretch::Expanded => fontdb::Stretch::Expanded,
            FontStretch::ExtraExpanded => fontdb::Stretch::ExtraExpanded,
            FontStretch::UltraExpanded => fontdb::Stretch::UltraExpanded,
        },
        style: match font.style() {
            FontStyle::Normal => fontdb::Style::Normal,
            FontStyle::Italic => fontdb::Style::Italic,
            FontStyle::Oblique => fontdb::Style::Oblique,
        },
    })
}
