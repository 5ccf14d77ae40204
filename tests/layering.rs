//! The module table of `src/lib.rs` is law: no module uses one that its row does not name.
//!
//! The table is read from the doc comment of `lib.rs`, the sources are parsed with `syn`, and every path
//! that starts at `crate`, `self` or `super` is resolved to the module it reaches: in `use` items with
//! groups, in re-exports, in types and expressions, and inside macro calls. `#[cfg(test)]` modules are
//! left out: tests may compare one module with another.
#![allow(clippy::unwrap_used, reason = "a test: a broken table or source should stop it")]

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use syn::visit::Visit;

/// What one row allows.
#[derive(Debug, Clone, Default)]
struct Row {
    everything: bool,
    /// (module path reached, part of this module that may reach it or "" for all of it).
    allowed: Vec<(String, String)>,
}

#[derive(Debug)]
struct Table {
    order: Vec<String>,
    rows: BTreeMap<String, Row>,
}

fn read_table(lib: &str) -> Table {
    let mut table = Table { order: Vec::new(), rows: BTreeMap::new() };
    for line in lib.lines().filter_map(|l| l.strip_prefix("//! |")) {
        let cells: Vec<&str> = line.trim_end_matches('|').split('|').map(str::trim).collect();
        let [name, _, uses] = cells[..] else { panic!("a row has three cells: {line}") };
        let Some(name) = name.strip_prefix('`').and_then(|n| n.strip_suffix('`')) else { continue };
        let mut row = Row::default();
        match uses {
            "-" => {}
            "all" => row.everything = true,
            "all above" => {
                row.allowed = table.order.iter().map(|m| (m.clone(), String::new())).collect();
            }
            _ => {
                let mut words = uses.split_whitespace().peekable();
                while let Some(word) = words.next().map(|w| w.trim_matches('`')) {
                    let mut part = String::new();
                    if let Some(p) = words.peek().and_then(|w| w.strip_prefix('(')) {
                        part = p.to_string();
                        words.next();
                        assert_eq!(words.next(), Some("only)"), "`name (part only)` in: {line}");
                    }
                    row.allowed.push((word.to_string(), part));
                }
            }
        }
        table.order.push(name.to_string());
        table.rows.insert(name.to_string(), row);
    }
    table
}

/// One use of a path: where it stands and the absolute module path it names.
#[derive(Debug, Clone, PartialEq)]
struct Use {
    from: Vec<String>,
    to: Vec<String>,
}

struct Collector {
    here: Vec<String>,
    uses: Vec<Use>,
}

impl Collector {
    fn record(&mut self, segments: &[String]) {
        let mut at: Vec<String> = match segments.first().map(String::as_str) {
            Some("crate") => Vec::new(),
            Some("self") => self.here.clone(),
            Some("super") => self.here[..self.here.len().saturating_sub(1)].to_vec(),
            _ => return,
        };
        for s in &segments[1..] {
            if s == "super" {
                at.pop();
            } else {
                at.push(s.clone());
            }
        }
        self.uses.push(Use { from: self.here.clone(), to: at });
    }

    fn tree(&mut self, prefix: &[String], tree: &syn::UseTree) {
        let join = |name: &syn::Ident| {
            let mut p = prefix.to_vec();
            p.push(name.to_string());
            p
        };
        match tree {
            syn::UseTree::Path(p) => self.tree(&join(&p.ident), &p.tree),
            syn::UseTree::Name(n) => self.record(&join(&n.ident)),
            syn::UseTree::Rename(r) => self.record(&join(&r.ident)),
            syn::UseTree::Glob(_) => self.record(prefix),
            syn::UseTree::Group(g) => g.items.iter().for_each(|t| self.tree(prefix, t)),
        }
    }
}

fn is_test_only(attrs: &[syn::Attribute]) -> bool {
    attrs.iter().any(|a| {
        a.path().is_ident("cfg") && a.parse_args::<syn::Path>().is_ok_and(|p| p.is_ident("test"))
    })
}

impl<'ast> Visit<'ast> for Collector {
    fn visit_item_mod(&mut self, item: &'ast syn::ItemMod) {
        if is_test_only(&item.attrs) || item.content.is_none() {
            return;
        }
        self.here.push(item.ident.to_string());
        syn::visit::visit_item_mod(self, item);
        self.here.pop();
    }

    fn visit_item_use(&mut self, item: &'ast syn::ItemUse) {
        self.tree(&[], &item.tree);
    }

    fn visit_path(&mut self, path: &'ast syn::Path) {
        let segments: Vec<String> = path.segments.iter().map(|s| s.ident.to_string()).collect();
        self.record(&segments);
        syn::visit::visit_path(self, path);
    }

    fn visit_macro(&mut self, mac: &'ast syn::Macro) {
        self.visit_path(&mac.path);
        let text = mac.tokens.to_string().replace(' ', "");
        for (at, start) in text.match_indices("crate::").chain(text.match_indices("super::")) {
            let before = text[..at].chars().next_back();
            if before.is_some_and(|c| c.is_alphanumeric() || c == '_' || c == ':') {
                continue;
            }
            let rest: String = text[at..]
                .chars()
                .take_while(|c| c.is_alphanumeric() || *c == '_' || *c == ':')
                .collect();
            assert!(rest.starts_with(start));
            let segments: Vec<String> =
                rest.split("::").filter(|s| !s.is_empty()).map(str::to_string).collect();
            self.record(&segments);
        }
    }
}

fn uses_in(module: &[String], source: &str) -> Vec<Use> {
    let file = syn::parse_file(source).unwrap();
    let mut c = Collector { here: module.to_vec(), uses: Vec::new() };
    c.visit_file(&file);
    c.uses
}

/// The sentence that is wrong with a use, if any.
fn fault(table: &Table, u: &Use) -> Option<String> {
    let module = u.from.first()?; // lib.rs itself holds the house together
    let row = table.rows.get(module).cloned().unwrap_or_default();
    let target = u.to.first()?;
    let reaches = |path: &str| {
        let want: Vec<&str> = path.split("::").collect();
        u.to.len() >= want.len() && u.to.iter().zip(&want).all(|(a, b)| a == b)
    };
    if target == module {
        // Neither half of gcode imports the other.
        let halves = |v: &[String]| v.get(1).cloned().filter(|s| s == "read" || s == "write");
        let crossing = module == "gcode"
            && matches!((halves(&u.from), halves(&u.to)), (Some(a), Some(b)) if a != b);
        return crossing.then(|| format!("{} uses {}", u.from.join("::"), u.to.join("::")));
    }
    let fine = row.everything
        || row
            .allowed
            .iter()
            .any(|(path, part)| reaches(path) && (part.is_empty() || u.from.get(1) == Some(part)));
    (!fine).then(|| {
        format!("`{}` uses `{}`, which its row does not name", u.from.join("::"), u.to.join("::"))
    })
}

fn sources() -> Vec<(Vec<String>, PathBuf)> {
    fn walk(dir: &Path, module: &[String], out: &mut Vec<(Vec<String>, PathBuf)>) {
        let mut entries: Vec<_> =
            std::fs::read_dir(dir).unwrap().map(|e| e.unwrap().path()).collect();
        entries.sort();
        for path in entries {
            let stem = path.file_stem().unwrap().to_str().unwrap().to_string();
            let mut here = module.to_vec();
            if path.is_dir() {
                here.push(stem);
                walk(&path, &here, out);
            } else if path.extension().is_some_and(|e| e == "rs") && stem != "lib" && stem != "main"
            {
                assert_ne!(stem, "mod", "{}: folder modules are src/x.rs + src/x/", path.display());
                here.push(stem);
                out.push((here, path));
            }
        }
    }
    let mut out = Vec::new();
    walk(&Path::new(env!("CARGO_MANIFEST_DIR")).join("src"), &[], &mut out);
    out
}

/// The modules that a source declares for tests only, with files of their own.
fn test_modules(module: &[String], source: &str) -> Vec<Vec<String>> {
    let file = syn::parse_file(source).unwrap();
    let name = |item: &syn::Item| match item {
        syn::Item::Mod(m) if is_test_only(&m.attrs) && m.content.is_none() => {
            Some([module, &[m.ident.to_string()]].concat())
        }
        _ => None,
    };
    file.items.iter().filter_map(name).collect()
}

fn lib_source() -> String {
    std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("src/lib.rs")).unwrap()
}

#[test]
fn no_module_uses_one_that_its_row_does_not_name() {
    let table = read_table(&lib_source());
    let mut faults = Vec::new();
    let sources = sources();
    let tests: Vec<Vec<String>> = sources
        .iter()
        .flat_map(|(module, path)| test_modules(module, &std::fs::read_to_string(path).unwrap()))
        .collect();
    let is_test = |module: &[String]| tests.iter().any(|test| module.starts_with(test));
    for (module, path) in sources.into_iter().filter(|(module, _)| !is_test(module)) {
        assert!(table.rows.contains_key(&module[0]), "`{}` has no row in the table", module[0]);
        let source = std::fs::read_to_string(&path).unwrap();
        for u in uses_in(&module, &source) {
            if let Some(f) = fault(&table, &u) {
                faults.push(format!("{}: {f}", path.display()));
            }
        }
    }
    faults.dedup();
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
fn modules_are_declared_in_the_order_of_the_table() {
    let lib = lib_source();
    let declared: Vec<String> = syn::parse_file(&lib)
        .unwrap()
        .items
        .iter()
        .filter_map(|i| if let syn::Item::Mod(m) = i { Some(m.ident.to_string()) } else { None })
        .collect();
    assert_eq!(declared, read_table(&lib).order);
}

#[test]
fn a_row_names_only_modules_above_it() {
    let table = read_table(&lib_source());
    for (k, name) in table.order.iter().enumerate() {
        for (used, _) in &table.rows[name].allowed {
            let module = used.split("::").next().unwrap();
            assert!(table.order[..k].iter().any(|m| m == module), "`{name}` names `{used}`");
        }
    }
}

#[test]
fn every_way_to_write_a_use_is_seen() {
    let table = read_table(
        "//! | `a` | x | - |\n//! | `b` | x | a |\n//! | `c` | x | a (write only) b::read |\n",
    );
    let bad = |module: &[&str], source: &str| {
        let module: Vec<String> = module.iter().map(|s| (*s).to_string()).collect();
        uses_in(&module, source).iter().filter(|u| fault(&table, u).is_some()).count()
    };
    assert_eq!(bad(&["a"], "use crate::b::X;"), 1);
    assert_eq!(bad(&["a"], "use crate::{b::{X, Y}, c};"), 3);
    assert_eq!(bad(&["a"], "pub use super::b::*;"), 1);
    assert_eq!(bad(&["a", "deep"], "fn f(x: super::super::b::X) {}"), 1);
    assert_eq!(bad(&["a"], "fn f() { let x = vec![crate::b::X::new(1)]; }"), 1);
    assert_eq!(bad(&["a"], "mod m { use super::super::b; }"), 1);
    assert_eq!(bad(&["a"], "#[cfg(test)] mod tests { use crate::b; }"), 0);
    let declared = test_modules(&["a".into()], "mod b; #[cfg(test)] mod tests;");
    assert_eq!(declared, [["a".to_string(), "tests".to_string()]]);
    assert_eq!(bad(&["b"], "use crate::a::X; use super::a; use self::inner::Z;"), 0);
    assert_eq!(bad(&["c", "write"], "use crate::a::X;"), 0);
    assert_eq!(bad(&["c", "other"], "use crate::a::X;"), 1);
    assert_eq!(bad(&["c"], "use crate::b::read::X;"), 0);
    assert_eq!(bad(&["c"], "use crate::b::write::X;"), 1);
}
