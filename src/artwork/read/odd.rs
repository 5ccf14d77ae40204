//! Odd things met while reading, gathered so that hundreds of paths make a handful of notes.

use std::collections::BTreeMap;

/// Most names that one note lists.
const LISTED: usize = 5;

/// A kind of odd thing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Odd {
    Bitmap,
    Font,
    Foreign,
    SwitchedOff,
    Hidden,
    Invisible,
    ClippedAway,
    Nothing,
    Unpainted,
    OpenPath,
    OffPage,
    Pattern,
    Mask,
    Filter,
    SeeThrough,
}

impl Odd {
    fn words(self) -> &'static str {
        match self {
            Self::Bitmap => "not carved, a bitmap (trace it into paths first)",
            Self::Font => "text set in another font than it asks for",
            Self::Foreign => {
                "not carved, a text box that SVG readers do not know (Inkscape: Text, Convert to Text)"
            }
            Self::SwitchedOff => "not carved, switched off by display: none",
            Self::Hidden => "not carved, hidden",
            Self::Invisible => "not carved, fully transparent",
            Self::ClippedAway => "not carved, nothing of it is left inside its clip path",
            Self::Nothing => {
                "not carved, it paints nothing (no size, an empty clip path, or a style that switches it off)"
            }
            Self::Unpainted => "not carved, closed but neither filled nor stroked",
            Self::OpenPath => {
                "kept but not carved, an open path that is neither filled nor stroked"
            }
            Self::OffPage => "outside the page, carved all the same (remove it if it is not meant)",
            Self::Pattern => "painted with a pattern, carved as if filled with its first colour",
            Self::Mask => "masked; masks are not applied, so the whole shape is carved",
            Self::Filter => "has a filter (blur, shadow, ...), which is not carved",
            Self::SeeThrough => "see-through, carved as if it were not",
        }
    }
}

/// What was met, by kind.
#[derive(Debug, Default)]
pub(super) struct Odds(BTreeMap<Odd, Vec<String>>);

impl Odds {
    /// Writes down a thing by name; a name counts once for each kind.
    pub(super) fn add(&mut self, odd: Odd, name: String) {
        let names = self.0.entry(odd).or_default();
        // Parts of one element follow each other, so looking at the last one is enough.
        if names.last() != Some(&name) {
            names.push(name);
        }
    }

    /// One note for each kind.
    pub(super) fn notes(&self) -> Vec<String> {
        self.0.iter().map(|(odd, names)| format!("{}: {}", listed(names), odd.words())).collect()
    }
}

fn listed(names: &[String]) -> String {
    let shown = names.iter().take(LISTED).cloned().collect::<Vec<_>>().join(", ");
    let more = names.len().saturating_sub(LISTED);
    if more > 0 { format!("{shown} and {more} more") } else { shown }
}
