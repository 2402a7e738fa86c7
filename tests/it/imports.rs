//! The graph of imports: which file of a package uses which other, followed through re-exports, and its circles.

use super::sources::{SourceFile, is_ident, is_path_separator, is_punct};
use proc_macro2::{Delimiter, TokenTree};
use std::collections::{BTreeMap, BTreeSet};

/// One name that a `use` brings in: the path as written, the name it gets, and whether it is passed on (`pub use`).
#[derive(Debug, Clone)]
struct Import {
    path: Vec<String>,
    name: String,
    is_public: bool,
}

/// A file as far as imports go.
struct Module<'a> {
    source: &'a SourceFile,
    imports: Vec<Import>,
    /// Absolute paths (from the package's root) that the code names outside `use`.
    paths: Vec<Vec<String>>,
    /// Words of the code outside `use`.
    words: BTreeSet<String>,
    /// Items that the file defines itself.
    items: BTreeSet<String>,
}

/// The files of one package by their module paths.
pub struct Graph<'a> {
    modules: BTreeMap<Vec<String>, Module<'a>>,
}

/// An arrow: from file, to file, and the item that is used.
pub type Arrows = BTreeMap<(String, String), BTreeSet<String>>;

impl<'a> Graph<'a> {
    /// Reads the files of one package.
    pub fn new(sources: impl Iterator<Item = &'a SourceFile>) -> Self {
        let modules = sources.filter(|s| s.module != ["main"]).map(|source| {
            let mut module = Module {
                source,
                imports: Vec::new(),
                paths: Vec::new(),
                words: BTreeSet::new(),
                items: BTreeSet::new(),
            };
            module.read(&source.tokens, 0);
            (source.module.clone(), module)
        });
        Self { modules: modules.collect() }
    }

    /// Which file uses which, and what of it.
    pub fn arrows(&self) -> Arrows {
        let mut arrows = Arrows::new();
        for module in self.modules.values() {
            let aliases: BTreeMap<&str, &Import> = module.imports.iter().map(|i| (i.name.as_str(), i)).collect();
            let mut used: Vec<Vec<String>> = Vec::new();
            for import in &module.imports {
                // A re-export is no use of the item, unless the code names it too.
                if !import.is_public || module.words.contains(&import.name) {
                    used.push(import.path.clone());
                }
            }
            for path in &module.paths {
                match aliases.get(path[0].as_str()) {
                    Some(import) => used.push([&import.path[..], &path[1..]].concat()),
                    None => used.push(path.clone()),
                }
            }
            for path in used {
                let Some(path) = module.absolute(&path) else { continue };
                let Some((target, item)) = self.resolve(&path, 0) else { continue };
                if target != module.source.path {
                    arrows.entry((module.source.path.clone(), target)).or_default().insert(item);
                }
            }
        }
        arrows
    }

    /// The file that defines what an absolute path names, and the item; `None` for a module alone and for what is not of
    /// this package.
    fn resolve(&self, path: &[String], depth: usize) -> Option<(String, String)> {
        let mut length = 0;
        while length < path.len() && self.modules.contains_key(&path[..=length]) {
            length += 1;
        }
        let module = self.modules.get(&path[..length])?;
        let item = path.get(length)?;
        if module.items.contains(item) || depth > 8 {
            return Some((module.source.path.clone(), item.clone()));
        }
        if let Some(import) = module.imports.iter().find(|i| i.name == *item) {
            let target = [&module.absolute(&import.path)?[..], &path[length + 1..]].concat();
            return self.resolve(&target, depth + 1);
        }
        for glob in module.imports.iter().filter(|i| i.name == "*") {
            let Some(folder) = module.absolute(&glob.path[..glob.path.len() - 1]) else { continue };
            let target = [&folder[..], &path[length..]].concat();
            if let Some(found) = self.resolve(&target, depth + 1)
                && found.1 != *"*"
            {
                return Some(found);
            }
        }
        Some((module.source.path.clone(), item.clone()))
    }
}

impl Module<'_> {
    /// A path of this file from the package's root; `None` where it leads out of the package.
    fn absolute(&self, path: &[String]) -> Option<Vec<String>> {
        let here = &self.source.module;
        match path.first()?.as_str() {
            "crate" => Some(path[1..].to_vec()),
            "self" => Some([here, &path[1..]].concat()),
            "super" => {
                let ups = path.iter().take_while(|p| *p == "super").count();
                Some([&here[..here.len().checked_sub(ups)?], &path[ups..]].concat())
            }
            first if self.source.children.contains(first) => Some([&here[..], path].concat()),
            _ => None,
        }
    }

    /// Reads tokens at a depth of inline modules (`mod x86 { ... }`), whose `super` is this file.
    fn read(&mut self, tokens: &[TokenTree], inline: usize) {
        let mut at = 0;
        while at < tokens.len() {
            if is_ident(&tokens[at], "use") {
                let end = at + tokens[at..].iter().position(|t| is_punct(t, ';')).unwrap_or(tokens.len() - at - 1);
                let is_public = is_public_at(tokens, at);
                let mut leaves = Vec::new();
                use_leaves(&tokens[at + 1..end], &[], &mut leaves);
                for (path, name) in leaves {
                    if let Some(path) = outside(path, inline) {
                        self.imports.push(Import { path, name, is_public });
                    }
                }
                at = end + 1;
                continue;
            }
            if inline == 0
                && ["fn", "struct", "enum", "union", "trait", "type", "const", "static"]
                    .iter()
                    .any(|k| is_ident(&tokens[at], k))
                && let Some(TokenTree::Ident(name)) = tokens.get(at + 1)
            {
                self.items.insert(name.to_string());
            }
            let is_inline_module = is_ident(&tokens[at], "mod")
                && matches!(tokens.get(at + 2), Some(TokenTree::Group(g)) if g.delimiter() == Delimiter::Brace);
            if is_inline_module && let Some(TokenTree::Group(group)) = tokens.get(at + 2) {
                let inner: Vec<TokenTree> = group.stream().into_iter().collect();
                self.read(&inner, inline + 1);
                at += 3;
                continue;
            }
            match &tokens[at] {
                TokenTree::Group(group) => {
                    let inner: Vec<TokenTree> = group.stream().into_iter().collect();
                    // Items inside functions and implementations are nobody else's: depth stands for "not at the top".
                    let before = self.items.clone();
                    self.read(&inner, inline);
                    self.items = before;
                    at += 1;
                }
                TokenTree::Ident(first) => {
                    let (path, next) = path_at(tokens, at);
                    let is_field = at > 0 && is_punct(&tokens[at - 1], '.');
                    let follows_path = at >= 2 && is_path_separator(tokens, at - 2) || is_field;
                    if !is_field {
                        self.words.insert(first.to_string());
                    }
                    if path.len() > 1
                        && !follows_path
                        && let Some(path) = outside(path, inline)
                    {
                        self.paths.push(path);
                    }
                    at = next;
                }
                _ => at += 1,
            }
        }
    }
}

/// Whether `pub` or `pub(...)` stands before the token at `at`.
fn is_public_at(tokens: &[TokenTree], at: usize) -> bool {
    at > 0
        && (is_ident(&tokens[at - 1], "pub")
            || matches!(&tokens[at - 1], TokenTree::Group(g) if g.delimiter() == Delimiter::Parenthesis)
                && at > 1
                && is_ident(&tokens[at - 2], "pub"))
}

/// A path in an inline module as the file around it would write it; `None` where it stays inside.
fn outside(path: Vec<String>, inline: usize) -> Option<Vec<String>> {
    let ups = path.iter().take_while(|p| *p == "super").count();
    match (inline, ups) {
        (0, _) => Some(path),
        (_, 0) => (path[0] == "crate").then_some(path),
        (_, ups) if ups <= inline => Some([&["self".to_owned()], &path[inline..]].concat()),
        (_, _) => Some(path[inline..].to_vec()),
    }
}

/// The path `a::b::c` that starts at a position, and where it ends.
fn path_at(tokens: &[TokenTree], mut at: usize) -> (Vec<String>, usize) {
    let mut path = Vec::new();
    while let Some(TokenTree::Ident(name)) = tokens.get(at) {
        path.push(name.to_string());
        at += 1;
        if !is_path_separator(tokens, at) || !matches!(tokens.get(at + 2), Some(TokenTree::Ident(_))) {
            break;
        }
        at += 2;
    }
    (path, at)
}

/// Every name that a `use` tree brings in, with its path.
fn use_leaves(tokens: &[TokenTree], before: &[String], leaves: &mut Vec<(Vec<String>, String)>) {
    for branch in tokens.split(|t| is_punct(t, ',')).filter(|b| !b.is_empty()) {
        let start = if is_path_separator(branch, 0) { 2 } else { 0 };
        let (path, next) = path_at(branch, start);
        let mut path = [before, &path[..]].concat();
        let next = if is_path_separator(branch, next) { next + 2 } else { next };
        match branch.get(next) {
            Some(TokenTree::Group(group)) => {
                let inner: Vec<TokenTree> = group.stream().into_iter().collect();
                use_leaves(&inner, &path, leaves);
            }
            Some(star) if is_punct(star, '*') => {
                path.push("*".into());
                leaves.push((path, "*".into()));
            }
            other => {
                if path.len() > 1 && path.last().is_some_and(|p| p == "self") {
                    path.pop();
                }
                let renamed = other.is_some_and(|t| is_ident(t, "as")).then(|| branch.get(next + 1)).flatten();
                let name = renamed.map_or_else(|| path.last().cloned().unwrap_or_default(), ToString::to_string);
                leaves.push((path, name));
            }
        }
    }
}

/// The sets of nodes that reach each other, each of two or more, by Kosaraju's algorithm.
pub fn circles(arrows: &BTreeSet<(String, String)>) -> Vec<BTreeSet<String>> {
    let nodes: BTreeSet<&String> = arrows.iter().flat_map(|(a, b)| [a, b]).collect();
    let next = |node: &String, backwards: bool| -> Vec<String> {
        let along = arrows.iter().filter(|(a, b)| if backwards { b == node } else { a == node });
        along.map(|(a, b)| if backwards { a.clone() } else { b.clone() }).collect()
    };
    fn visit(node: &String, next: &dyn Fn(&String) -> Vec<String>, seen: &mut BTreeSet<String>, out: &mut Vec<String>) {
        if seen.insert(node.clone()) {
            next(node).iter().for_each(|n| visit(n, next, seen, out));
            out.push(node.clone());
        }
    }
    let (mut seen, mut order) = (BTreeSet::new(), Vec::new());
    nodes.iter().for_each(|n| visit(n, &|n| next(n, false), &mut seen, &mut order));
    let (mut seen, mut found) = (BTreeSet::new(), Vec::new());
    for node in order.iter().rev() {
        let mut component = Vec::new();
        visit(node, &|n| next(n, true), &mut seen, &mut component);
        if component.len() > 1 {
            found.push(component.into_iter().collect());
        }
    }
    found
}

#[test]
fn imports_are_followed_through_reexports_aliases_and_inline_paths() {
    let file = |path: &str, module: &[&str], children: &[&str], text: &str| SourceFile {
        path: path.into(),
        package: "p".into(),
        module: module.iter().map(ToString::to_string).collect(),
        lines: 0,
        tokens: text.parse::<proc_macro2::TokenStream>().unwrap().into_iter().collect(),
        children: children.iter().map(ToString::to_string).collect(),
        text: text.into(),
    };
    let files = [
        file("lib", &[], &["a", "b"], "mod a; mod b; pub use a::A;"),
        file("a", &["a"], &["deep"], "mod deep; pub use deep::{Deep, other as another}; pub struct A;"),
        file("deep", &["a", "deep"], &[], "pub struct Deep; pub fn other() {} fn f() { super::super::b::g(); }"),
        file(
            "b",
            &["b"],
            &[],
            "use crate::{a, A}; use super::a::Deep as D; pub fn g() { a::another(); } mod x { use super::g; }",
        ),
    ];
    let arrows = Graph::new(files.iter()).arrows();
    let of = |from: &str, to: &str| {
        arrows.get(&(from.to_owned(), to.to_owned())).map(|s| s.iter().cloned().collect::<Vec<_>>())
    };
    assert_eq!(of("b", "deep"), Some(vec!["Deep".to_owned(), "other".to_owned()]));
    assert_eq!(of("b", "a"), Some(vec!["A".to_owned()]));
    assert_eq!(of("deep", "b"), Some(vec!["g".to_owned()]));
    assert_eq!(arrows.len(), 3, "{arrows:?}");
    let found = circles(&arrows.into_keys().collect());
    assert_eq!(found, [BTreeSet::from(["b".to_owned(), "deep".to_owned()])]);
}
