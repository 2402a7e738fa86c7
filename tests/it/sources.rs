//! The workspace's own source files as token streams: without comments, attributes and unit tests.

use proc_macro2::{Delimiter, Spacing, TokenStream, TokenTree};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// The root of the repository.
pub fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// One source file outside tests, examples and benches.
pub struct SourceFile {
    /// Path from the root of the repository, `/` between folders.
    pub path: String,
    /// `core`, `flight`, ...; `overfly` for the root package.
    pub package: String,
    /// Module path inside the package; empty for `lib.rs`.
    pub module: Vec<String>,
    /// The file as it is.
    pub text: String,
    /// Lines without those of unit tests.
    pub lines: usize,
    /// Tokens without comments, attributes and unit tests.
    pub tokens: Vec<TokenTree>,
    /// Modules that the file declares (`mod name;`).
    pub children: BTreeSet<String>,
}

/// A function: its name, first line and number of lines from `fn` to the closing brace.
pub struct Function {
    pub name: String,
    pub line: usize,
    pub lines: usize,
}

/// Every Rust file under a folder, sorted.
pub fn rust_files(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut folders = vec![folder.to_path_buf()];
    while let Some(folder) = folders.pop() {
        let Ok(entries) = std::fs::read_dir(&folder) else { continue };
        for path in entries.map(|e| e.unwrap().path()) {
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|e| e == "rs") {
                found.push(path);
            }
        }
    }
    found.sort();
    found
}

/// The packages under `crates/` and the root, each with its folder.
pub fn packages() -> Vec<(String, PathBuf)> {
    let mut found = vec![("overfly".to_owned(), root().to_path_buf())];
    for entry in std::fs::read_dir(root().join("crates")).unwrap() {
        let path = entry.unwrap().path();
        if path.join("Cargo.toml").exists() {
            found.push((path.file_name().unwrap().to_str().unwrap().to_owned(), path));
        }
    }
    found.sort();
    found
}

/// All source files of all packages, files of unit tests left out.
pub fn sources() -> Vec<SourceFile> {
    let mut all = Vec::new();
    for (package, folder) in packages() {
        let src = folder.join("src");
        let mut tests: Vec<Vec<String>> = Vec::new();
        let mut found = Vec::new();
        for file in rust_files(&src) {
            let (source, test_modules) = read(&package, &src, &file);
            tests.extend(test_modules.into_iter().map(|name| [&source.module[..], &[name]].concat()));
            found.push(source);
        }
        all.extend(found.into_iter().filter(|s| !tests.iter().any(|t| s.module.starts_with(t))));
    }
    assert!(all.len() > 100, "found only {} sources", all.len());
    all
}

/// A file, and the modules of unit tests that it declares.
fn read(package: &str, src: &Path, file: &Path) -> (SourceFile, Vec<String>) {
    let text = std::fs::read_to_string(file).unwrap();
    let stream: TokenStream = text.parse().unwrap_or_else(|e| panic!("{}: {e}", file.display()));
    let mut stripped = Stripped::default();
    let tokens = stripped.strip(stream);
    let relative = file.strip_prefix(src).unwrap().with_extension("");
    let mut module: Vec<String> = relative.iter().map(|p| p.to_str().unwrap().to_owned()).collect();
    if matches!(module.last().map(String::as_str), Some("mod" | "lib")) {
        module.pop();
    }
    let source = SourceFile {
        path: file.strip_prefix(root()).unwrap().to_str().unwrap().replace('\\', "/"),
        package: package.to_owned(),
        module,
        lines: text.lines().count() - stripped.test_lines,
        children: declared(&tokens),
        tokens,
        text,
    };
    (source, stripped.test_modules)
}

/// What was taken out of a file.
#[derive(Default)]
struct Stripped {
    test_lines: usize,
    test_modules: Vec<String>,
}

impl Stripped {
    /// The tokens without attributes (doc comments among them) and items under `#[cfg(test)]`.
    fn strip(&mut self, stream: TokenStream) -> Vec<TokenTree> {
        let mut kept = Vec::new();
        let mut rest = stream.into_iter().peekable();
        while let Some(token) = rest.next() {
            if is_punct(&token, '#') {
                if rest.peek().is_some_and(|t| is_punct(t, '!')) {
                    rest.next();
                }
                let Some(TokenTree::Group(attribute)) = rest.next() else { continue };
                if is_cfg_test(&attribute.stream()) {
                    let first = token.span().start().line;
                    let mut item = Vec::new();
                    for next in rest.by_ref() {
                        item.push(next);
                        if ends_item(&item) {
                            break;
                        }
                    }
                    let last = item.last().map_or(first, |t| t.span().end().line);
                    self.test_lines += last + 1 - first;
                    self.test_modules.extend(declared(&item));
                }
                continue;
            }
            kept.push(match token {
                TokenTree::Group(group) => {
                    let inner = self.strip(group.stream()).into_iter().collect();
                    let mut new = proc_macro2::Group::new(group.delimiter(), inner);
                    new.set_span(group.span());
                    TokenTree::Group(new)
                }
                other => other,
            });
        }
        kept
    }
}

/// Whether an item's tokens are complete: `;`, or the braces of a function, module, type or implementation.
fn ends_item(item: &[TokenTree]) -> bool {
    let word = |w: &str| item.iter().any(|t| is_ident(t, w));
    let to_semicolon = word("use") || word("static") || word("const") && !word("fn") || word("let");
    match item.last() {
        Some(TokenTree::Punct(p)) => p.as_char() == ';',
        Some(TokenTree::Group(g)) => g.delimiter() == Delimiter::Brace && !to_semicolon,
        _ => false,
    }
}

fn is_cfg_test(attribute: &TokenStream) -> bool {
    let mut tokens = attribute.clone().into_iter();
    let is_cfg = tokens.next().is_some_and(|t| is_ident(&t, "cfg"));
    let inner = tokens.next().map(|t| t.to_string()).unwrap_or_default();
    is_cfg && (inner.contains("(test") || inner.contains(" test")) && !inner.contains("not")
}

/// Names of `mod name;`.
fn declared(tokens: &[TokenTree]) -> BTreeSet<String> {
    let mut names = BTreeSet::new();
    for window in tokens.windows(3) {
        if let [a, TokenTree::Ident(name), c] = window
            && is_ident(a, "mod")
            && is_punct(c, ';')
        {
            names.insert(name.to_string());
        }
    }
    names
}

/// Whether a token is this punctuation character.
pub fn is_punct(token: &TokenTree, c: char) -> bool {
    matches!(token, TokenTree::Punct(p) if p.as_char() == c)
}

/// Whether a token is this word.
pub fn is_ident(token: &TokenTree, word: &str) -> bool {
    matches!(token, TokenTree::Ident(i) if i == word)
}

/// Whether `::` stands at a position.
pub fn is_path_separator(tokens: &[TokenTree], at: usize) -> bool {
    let [Some(TokenTree::Punct(a)), Some(b)] = [tokens.get(at), tokens.get(at + 1)] else { return false };
    a.as_char() == ':' && a.spacing() == Spacing::Joint && is_punct(b, ':')
}

/// Calls `visit` with the tokens of the file and of every group in it, outermost first.
pub fn every_group(tokens: &[TokenTree], visit: &mut dyn FnMut(&[TokenTree])) {
    visit(tokens);
    for token in tokens {
        if let TokenTree::Group(group) = token {
            let inner: Vec<TokenTree> = group.stream().into_iter().collect();
            every_group(&inner, visit);
        }
    }
}

/// The functions of a file, those inside others too.
pub fn functions(source: &SourceFile) -> Vec<Function> {
    let mut found = Vec::new();
    every_group(&source.tokens, &mut |tokens| {
        for (at, pair) in tokens.windows(2).enumerate() {
            let [keyword, TokenTree::Ident(name)] = pair else { continue };
            if !is_ident(keyword, "fn") {
                continue;
            }
            let line = keyword.span().start().line;
            let end = tokens[at..]
                .iter()
                .find(|t| is_punct(t, ';') || matches!(t, TokenTree::Group(g) if g.delimiter() == Delimiter::Brace));
            let last = end.map_or(line, |t| t.span().end().line);
            found.push(Function { name: name.to_string(), line, lines: last + 1 - line });
        }
    });
    found
}

/// A word or a string, and its line.
pub type Located = (String, usize);

/// Each word of the file's code, and each string literal, with its line.
pub fn words_and_strings(source: &SourceFile) -> (Vec<Located>, Vec<Located>) {
    let (mut words, mut strings) = (Vec::new(), Vec::new());
    every_group(&source.tokens, &mut |tokens| {
        for token in tokens {
            let line = token.span().start().line;
            match token {
                TokenTree::Ident(word) => words.push((word.to_string(), line)),
                TokenTree::Literal(literal) => strings.push((literal.to_string(), line)),
                _ => {}
            }
        }
    });
    strings.retain(|(text, _)| text.contains('"'));
    (words, strings)
}

#[test]
fn reading_leaves_out_comments_attributes_and_tests() {
    let text = "//! Doc.\n/// `SystemTime`\n#[derive(Debug)]\nstruct A;\nfn f() {\n    // SystemTime\n    g()\n}\n#[cfg(test)]\nmod tests {\n    fn long() {}\n}\n#[cfg(test)]\nmod other;\nmod real;";
    let mut stripped = Stripped::default();
    let tokens = stripped.strip(text.parse().unwrap());
    let code = tokens.iter().cloned().collect::<TokenStream>().to_string();
    assert!(!code.contains("SystemTime") && !code.contains("long") && !code.contains("derive"), "{code}");
    assert!(code.contains("struct A") && code.contains("g ()"), "{code}");
    assert_eq!((stripped.test_lines, stripped.test_modules), (6, vec!["other".to_owned()]));
    assert_eq!(declared(&tokens), BTreeSet::from(["real".to_owned()]));
    let source = SourceFile {
        path: String::new(),
        package: String::new(),
        module: vec![],
        text: String::new(),
        lines: 0,
        tokens,
        children: BTreeSet::new(),
    };
    let functions = functions(&source);
    assert_eq!((functions.len(), functions[0].line, functions[0].lines), (1, 5, 4));
}
