//! Does the book notice what is wrong with its sources? One broken page a fault, and the book as it stands.

use calibench_book::{Compiled, Evidence, Page, Sources, build, compile};
use calibench_harness::project::Project;
use calibench_harness::{Build, Context, Experiment, ExperimentError, Record};
use std::path::Path;

const LINE_BENDING: Experiment =
    Experiment { id: "line-bending", title: "title", question: "question", seed: 0, takes_image: false, run };

fn run(context: &Context) -> Result<Record, ExperimentError> {
    let mut record = context.record();
    record.claim_that("c", "zero is small").at_most(0.0, 1.0).because("definition");
    Ok(record)
}

fn project() -> Project {
    Project::above(Path::new(env!("CARGO_MANIFEST_DIR"))).unwrap()
}

fn page_of(text: &str) -> Page {
    Page { path: "page.md".into(), title: "Page".into(), number: Some(1), text: text.into() }
}

/// A book of one page, with the golden values of line bending and no record.
fn book_of(text: &str) -> Compiled {
    let project = project();
    let page = page_of(text);
    let evidence = Evidence::of_records(&project, &[LINE_BENDING], &[], &Build::default());
    let sources = Sources::load(&project, evidence).unwrap();
    compile(&Sources { pages: vec![page], references: Vec::new(), contradictions: Vec::new(), ..sources })
}

/// Findings of the page, as `line: message`.
fn findings(text: &str) -> Vec<String> {
    let of_page = |f: &&calibench_book::Finding| f.file == "book/text/page.md";
    book_of(text).findings.iter().filter(of_page).map(|f| format!("{}: {}", f.line, f.message)).collect()
}

#[test]
fn a_number_is_shown_with_its_provenance() {
    let compiled = book_of("It bends by {{num line-bending.max-deviation .3 unit}}.");
    let page = &compiled.pages[0].content;
    assert!(page.contains("4.678\u{a0}px</a>"), "{page}");
    for part in [
        "seed 0",
        "absolute 3e-12",
        "published 4.678",
        "row 4 of data/line-bending/numbers.csv",
        "calibench run line-bending",
    ] {
        assert!(page.contains(part), "{part} is not in {page}");
    }
    let csv = String::from_utf8(compiled.assets["data/line-bending/numbers.csv"].clone()).unwrap();
    assert!(csv.lines().nth(4).unwrap().starts_with("max-deviation,4.67774722"), "{csv}");
}

#[test]
fn a_number_leads_to_its_record_and_the_record_back_to_the_text() {
    let compiled =
        book_of("{{num line-bending.max-deviation .3}} and again {{num line-bending.max-deviation .1}}.");
    let (page, record) = (&compiled.pages[0].content, &compiled.records[0].content);
    let place = "at-line-bending.max-deviation";
    assert_eq!(page.matches(&format!("id=\"{place}\"")).count(), 1, "{page}");
    assert!(page.contains("href=\"record-line-bending.md#number-max-deviation\""), "{page}");
    assert!(record.contains(&format!("<a href=\"page.md#{place}\">section 1</a>")), "{record}");
}

#[test]
fn a_figure_is_described_and_sized_and_a_listing_leads_to_its_file() {
    let compiled = book_of(
        "{{figure line-bending.grids Three \"grids\".}}\n\n{{code experiments/line_bending.rs sweep_k1}}",
    );
    let page = &compiled.pages[0].content;
    assert!(page.contains("alt=\"Three &quot;grids&quot;.\" width="), "{page}");
    let source = String::from_utf8(compiled.assets["code/experiments-line_bending.rs.html"].clone()).unwrap();
    let (_, link) = page.split_once("code/experiments-line_bending.rs.html#").unwrap();
    let line = link.split('"').next().unwrap();
    let (_, quoted) = source.split_once(&format!("id=\"{line}\"")).unwrap();
    assert!(quoted.lines().next().unwrap().contains("fn sweep_k1"), "{line}");
}

#[test]
fn a_laboratory_is_an_empty_element_with_golden_values_to_the_last_bit() {
    let compiled = book_of("{{lab line-bending}}\n\n{{figure line-bending.grids Three grids.}}\n");
    let page = &compiled.pages[0].content;
    assert!(
        page.contains("data-lab=\"line-bending\" data-golden=\"") && page.contains("\"></div>"),
        "{page}"
    );
    let golden = std::fs::read_to_string(project().root().join("golden/line-bending.snap")).unwrap();
    let rms = golden.lines().find_map(|line| line.strip_prefix("number | rms-deviation | ")).unwrap();
    let value = rms.split(' ').next().unwrap();
    assert!(
        page.contains(&format!("&quot;line-bending.rms-deviation&quot;,{value},&quot;px&quot;")),
        "{page}"
    );
    assert_eq!(page.matches("<figure").count(), 1, "the figure is there for paper: {page}");
}

#[test]
fn what_does_not_resolve_is_found_with_its_line() {
    let cases = [
        ("{{num line-bending.nonsense .3}}", "has no number `nonsense`"),
        ("{{num nonsense.rmse .3}}", "there is no experiment `nonsense`"),
        ("{{num line-bending.points x3}}", "is no format"),
        ("{{figure line-bending.nonsense}}", "draws no figure"),
        ("{{figure line-bending.grids}}", "say behind its name what is seen"),
        ("{{shell README.md calibench nonsense}}", "has no block"),
        ("{{table line-bending.nonsense *}}", "has no table"),
        ("{{lab nonsense}}", "there is no laboratory `nonsense`"),
        // Of this book only one experiment is known.
        ("{{lab four-pose}}", "golden/ has no such number"),
        ("{{cite nobody1900}}", "has no `nobody1900`"),
        ("{{ref eq:nonsense}}", "nothing is named"),
        ("{{const nonsense}}", "is no constant"),
        ("{{contradiction nonsense}}", "has no `nonsense`"),
        ("{{code experiments/line_bending.rs nonsense}}", "has no item"),
        ("{{nonsense}}", "is not understood"),
        ("{{num line-bending.points", "is opened here and never closed"),
        ("[gone](gone.md)", "there is no page `gone.md`"),
        ("[gone](#gone)", "has no place `gone`"),
        ("[plain](http://example.org)", "only https"),
        ("$\\nonsense$", "formula"),
        ("bends by 4.678", "`4.678` is typed in"),
        ("off by 33 %", "`33` is typed in"),
        ("$$\nx\n$$ {#eq:x}", "never referred to"),
    ];
    for (text, expected) in cases {
        let found = findings(&format!("# Title\n\n{text}\n"));
        assert!(found.iter().any(|f| f.starts_with("3: ") && f.contains(expected)), "{text}: {found:?}");
    }
}

#[test]
fn a_sound_page_has_no_finding() {
    let text = "# Title {#top}\n\nSee [above](#top), {{ref eq:x}} and §5.1 of 1971; `4.5 px` is code, $4.5$ a formula.\n\n\
                $$\nx^2\n$$ {#eq:x}\n";
    assert_eq!(findings(text), Vec::<String>::new());
}

#[test]
fn figures_that_no_page_shows_are_found() {
    let compiled = book_of("# Title\n");
    let unused: Vec<String> = compiled.findings.iter().map(ToString::to_string).collect();
    assert!(
        unused.iter().any(|f| f.contains("figure `line-bending.grids` is shown on no page")),
        "{unused:?}"
    );
}

#[test]
fn unused_names_are_found_where_they_are_defined() {
    let project = project();
    let evidence = Evidence::of_records(&project, &[LINE_BENDING], &[], &Build::default());
    let mut sources = Sources::load(&project, evidence).unwrap();
    sources.pages = vec![page_of("# Title\n")];
    let findings = compile(&sources).findings;
    let uncited = sources.references.len();
    let silent = sources.contradictions.len();
    let golden = std::fs::read_to_string(project.root().join("golden/line-bending.snap")).unwrap();
    let figures = golden.lines().filter(|line| line.starts_with("figure | ")).count();
    assert!(uncited > 0 && silent > 0 && figures > 0);
    assert_eq!(findings.len(), uncited + silent + figures, "{findings:?}");
    for finding in &findings {
        let text = std::fs::read_to_string(project.root().join(&finding.file)).unwrap();
        let lines: Vec<&str> = text.lines().collect();
        let name = finding.message.split('`').nth(1).unwrap();
        if finding.file == "book/references.toml" {
            assert_eq!(lines[finding.line - 1], "[[reference]]", "{finding}");
            assert_eq!(lines[finding.line], format!("key = \"{name}\""), "{finding}");
        } else if finding.file == "book/contradictions.toml" {
            assert_eq!(lines[finding.line - 1], "[[contradiction]]", "{finding}");
            assert_eq!(lines[finding.line], format!("id = \"{name}\""), "{finding}");
        } else {
            let file = name.strip_prefix("line-bending.").unwrap();
            assert!(lines[finding.line - 1].starts_with(&format!("figure | {file}.")), "{finding}");
        }
    }
}

#[test]
fn a_reference_at_the_head_of_a_sentence_is_capitalised() {
    let page =
        book_of("# T\n\n$$\nx\n$$ {#eq:x}\n\n{{ref eq:x}} is one. {{ref eq:x}} too; so is {{ref eq:x}}.\n");
    let content = &page.pages[0].content;
    let count = |word: &str| content.matches(word).count();
    assert_eq!((count(">Equation\u{a0}(1.1)<"), count(">equation\u{a0}(1.1)<")), (2, 1), "{content}");
}

#[test]
fn the_book_is_built_whole_and_leads_nowhere_outside() {
    let project = project();
    let evidence = Evidence::of_records(&project, &[LINE_BENDING], &[], &Build::default());
    let sources = Sources::load(&project, evidence).unwrap();
    let compiled = compile(&sources);
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("book");
    build(&project, &compiled, &folder).unwrap();
    for page in &sources.pages {
        let html = folder.join(page.path.replace(".md", ".html"));
        let text = std::fs::read_to_string(&html).unwrap_or_else(|e| panic!("{}: {e}", html.display()));
        for outside in ["src=\"http", "src=\"//", "<link rel=\"stylesheet\" href=\"http", "url(http"] {
            assert!(!text.contains(outside), "{} has {outside}", page.path);
        }
    }
    let index = std::fs::read_to_string(folder.join("search-index.js")).unwrap();
    assert!(
        index.contains("[\"line-bending.html\",\"result\",\"How far does a lens bend a straight line?\"")
    );
    for file in [
        "print.html",
        "search.html",
        "style/search.js",
        "style/book.css",
        "style/CalibenchMath.woff2",
        "record-line-bending.html",
        "style/laboratory.css",
        "laboratory/solver.js",
        "laboratory/line-bending.js",
    ] {
        assert!(folder.join(file).is_file(), "{file} is missing");
    }
}

#[test]
fn the_solver_stands_in_the_book_once_and_only_laboratories_load_it() {
    let project = project();
    let compiled = book_of("{{lab line-bending}}\n\n{{figure line-bending.grids Three grids.}}\n");
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("book-laboratory");
    build(&project, &compiled, &folder).unwrap();
    let read = |file: &str| std::fs::read_to_string(folder.join(file)).unwrap();
    let loads = |file: &str| read(file).contains("laboratory/calibench.js");
    assert!(loads("page.html") && !loads("search.html") && !loads("print.html"));
    let bytes = std::fs::metadata(project.root().join(calibench_book::WEB_ASSEMBLY)).unwrap().len();
    // Base64 takes four characters for three bytes; the rest is the statement around it.
    let digits = 4 * bytes.div_ceil(3);
    assert_eq!(read("laboratory/calibench.js").len() as u64, digits + "Laboratory.code = '';\n".len() as u64);
}

#[test]
fn what_a_killed_build_left_is_gone_after_the_next_and_of_two_at_once_both_end_well() {
    let project = project();
    let compiled = book_of("# One page");
    let out = Path::new(env!("CARGO_TARGET_TMPDIR")).join("book-killed");
    let _ = std::fs::remove_dir_all(&out);
    // Killed while it wrote, and between the two steps that put the new book in the place of the old.
    for left in [".book.new", ".book.old"] {
        std::fs::create_dir_all(out.join(left)).unwrap();
        std::fs::write(out.join(left).join("half.html"), "half").unwrap();
    }
    std::thread::scope(|scope| {
        let built = [(); 2].map(|()| scope.spawn(|| build(&project, &compiled, &out.join("book"))));
        built.into_iter().for_each(|build| build.join().unwrap().unwrap());
    });
    let entries = std::fs::read_dir(&out).unwrap().flatten();
    let mut names: Vec<String> = entries.map(|e| e.file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    assert_eq!(names, [".book.lock", "book"]);
    assert!(out.join("book/page.html").is_file() && !out.join("book/half.html").exists());
    // A build that fails leaves the book that is there: a file stands where a folder is to be made.
    std::fs::write(out.join(".book.new"), "in the way").unwrap();
    assert!(build(&project, &compiled, &out.join("book")).is_err());
    assert!(out.join("book/page.html").is_file());
}
