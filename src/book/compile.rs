//! How does a page of sources become a page of markdown? Piece by piece, every fault noted on the way.

use super::finding::Finding;
use super::labels::Labels;
use super::links;
use super::math::Mathematics;
use super::page::CompiledPage;
use super::prose;
use super::record_page;
use super::resolve::Resolver;
use super::scan::{Kind, Piece, scan};
use super::sources::{Page, Sources};
use super::text::escape;
use std::collections::{BTreeMap, BTreeSet};

/// The book without its looks.
#[derive(Debug, Clone, Default)]
pub struct Compiled {
    /// The pages of the summary.
    pub pages: Vec<CompiledPage>,
    /// One page an experiment: everything its record says.
    pub records: Vec<CompiledPage>,
    /// Files that the pages show or link to, by path below the book.
    pub assets: BTreeMap<String, Vec<u8>>,
    /// What does not resolve, by file and line.
    pub findings: Vec<Finding>,
}

/// Resolves every page.
pub fn compile(sources: &Sources) -> Compiled {
    let mut findings = Vec::new();
    let mut labels = Labels::default();
    let scanned: Vec<Vec<Piece<'_>>> = sources.pages.iter().map(|p| scan(&p.text)).collect();
    for (page, pieces) in sources.pages.iter().zip(&scanned) {
        labels.take((&page.path, &page.file()), page.number, pieces, &mut findings);
    }
    let paths: BTreeSet<String> = sources.pages.iter().map(|p| p.path.clone()).collect();
    let mathematics = Mathematics::new();
    let mut resolver = Resolver::new(sources, labels);
    let mut pages = Vec::new();
    for (page, pieces) in sources.pages.iter().zip(&scanned) {
        let mut content = String::new();
        resolver.page.clone_from(&page.path);
        for piece in pieces {
            let first = begins_sentence(&content);
            match translate((page, piece), first, &mathematics, &paths, &mut resolver) {
                Ok(text) => content.push_str(&text),
                Err(message) => {
                    findings.push(Finding::new(page.file(), piece.line, message.clone()));
                    let message = super::text::inline(&message);
                    content.push_str(&format!(r#"<span class="unresolved">{message}</span>"#));
                }
            }
            findings.extend(typed_in(page, piece));
        }
        pages.push(CompiledPage {
            path: page.path.clone(),
            title: page.title.clone(),
            number: page.number,
            below: false,
            content,
        });
    }
    findings.extend(resolver.unused());
    let records = record_page::record_pages(sources, &resolver.used, &mut resolver.assets);
    findings.sort();
    Compiled { pages, records, assets: resolver.assets, findings }
}

/// Whether what follows `before` is the first of a sentence.
fn begins_sentence(before: &str) -> bool {
    let text_before = before.trim_end();
    let between = &before[text_before.len()..];
    text_before.is_empty()
        || between.matches('\n').count() > 1
        || !between.is_empty() && text_before.ends_with(['.', '?', '!'])
}

fn translate(
    (page, piece): (&Page, &Piece<'_>),
    first: bool,
    mathematics: &Mathematics,
    paths: &BTreeSet<String>,
    resolver: &mut Resolver<'_>,
) -> Result<String, String> {
    match &piece.kind {
        Kind::Prose(text) => Ok(text.to_string()),
        Kind::Code(text) => Ok(text.to_string()),
        Kind::Math(tex) => mathematics.inline(tex),
        Kind::Equation { tex, label } => {
            let formula = mathematics.display(tex)?;
            let Some(label) = label else {
                return Ok(format!("<div class=\"equation\">{formula}</div>\n"));
            };
            let number = resolver.labels.get(label).map_or("", |l| l.number.as_str());
            let id = escape(label);
            let number = format!(r#"<span class="equation-number">{number}</span>"#);
            Ok(format!("<div class=\"equation\" id=\"{id}\">{formula}{number}</div>\n"))
        }
        Kind::Placeholder(text) => resolver.resolve(text, first),
        Kind::Html(text) if text.starts_with("<!--") => Ok(String::new()),
        Kind::Html(text) => Ok(text.to_string()),
        Kind::Target(target) => match links::dead(&page.path, target, paths, &resolver.labels) {
            None => Ok(target.to_string()),
            Some(message) => Err(message),
        },
        Kind::Place(name) => Ok(format!("{{#{name}}}")),
        Kind::Unclosed(what) => Err(format!("{what} is opened here and never closed")),
    }
}

/// Results typed into the prose of a page.
fn typed_in(page: &Page, piece: &Piece<'_>) -> Vec<Finding> {
    let Kind::Prose(text) = &piece.kind else { return Vec::new() };
    let finding = |(at, number): (usize, &str)| {
        let line = piece.line + text[..at].bytes().filter(|&b| b == b'\n').count();
        let message = format!(
            "`{number}` is typed in: take it from a record ({{{{num ...}}}}), the chapter ({{{{published ...}}}}) or the scene \
             ({{{{const ...}}}})"
        );
        Finding::new(page.file(), line, message)
    };
    prose::quantities(text).into_iter().map(finding).collect()
}
