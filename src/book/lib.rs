//! How does the book get its numbers? Its sources hold placeholders; every one is resolved from golden/,
//! figures/, the records of the last run and the code, and what cannot be resolved is a finding with file and
//! line.
//!
//! ```text
//! book/text/*.md --scan--> pieces --label--> names of equations, figures, tables, places
//!                                 --resolve (evidence, references, constants, code)--> markdown --html, layout--> out/book
//! ```
//!
//! Placeholders, all in double braces:
//!
//! | placeholder | becomes |
//! |---|---|
//! | `num four-pose.rmse .4` | the golden value with 4 decimals (`s3`: significant digits, `e1`: power of ten, `%1`: percent), its provenance on it; `unit` adds the unit |
//! | `published four-pose.rmse` | the digits that the chapter prints |
//! | `const fx` | a constant of the chapter's scene |
//! | `figure line-bending.grids What is seen` | the committed figure, numbered, with its caption; the words are for those who do not see it |
//! | `lab four-pose` | the place of a figure that the reader moves, filled by scripts where they run |
//! | `table line-bending.k1 k1,max digits=4 rows=1-5` | columns of a table of the record |
//! | `caption tab:name Text` | number and caption of the table written below it |
//! | `claims four-pose` | the experiment's claims with their verdicts |
//! | `run four-pose` | the command that reproduces the section, with its verdict |
//! | `code experiments/line_bending.rs sweep_k1` | that item of that file |
//! | `shell README.md calibench calibrate a.csv` | the block of that file that shows that command with what it prints |
//! | `cite zhang2000`, `citep zhang2000` | `Zhang (2000)`, `(Zhang 2000)` |
//! | `ref eq:projection` | `equation (1.1)`, `Figure 2.1`, `Table 3.2` |
//! | `contradiction two-views` | a statement of the chapter that does not hold, declared where the text says so |
//! | `all-contradictions` | all of them, with links to where they are declared |
//! | `item-counts`, `all-items` | every item of the chapter and what became of it |
//! | `published-counts` | how many published values hold, by kind of verdict |
//! | `all-published`, `all-references` | the appendix, the list of references |
//!
//! An equation is written between lines of `$$`, the last one followed by its name: `$$ {#eq:projection}`.

mod appendix;
mod compile;
mod constants;
mod contradictions;
mod csv_table;
mod evidence;
mod finding;
mod format;
mod golden_file;
mod html;
mod items;
mod labels;
mod laboratory;
mod layout;
mod links;
mod listed;
mod listing;
mod math;
mod page;
mod picture;
mod prose;
mod record_page;
mod record_summary;
mod references;
mod render;
mod resolve;
mod scan;
mod search;
mod sources;
mod summary;
mod text;

pub use compile::{Compiled, compile};
pub use contradictions::Contradiction;
pub use evidence::{Evidence, ExperimentEvidence};
pub use finding::Finding;
pub use items::Item;
pub use laboratory::WEB_ASSEMBLY;
pub use page::CompiledPage;
pub use render::{BookError, build, index_of};
pub use sources::{Page, Sources};

/// How many pieces a page is made of: its reader alone, for tests that feed it anything.
pub fn pieces_of(text: &str) -> usize {
    scan::scan(text).len()
}

use calibench_harness::project::Project;
use calibench_harness::{Build, Experiment, Record};

/// Everything in the book's sources that does not resolve: unknown and unused names, stale figures, dead
/// links, and results typed in by hand. Writes nothing; `records` are those of the present run.
pub fn check(project: &Project, experiments: &[Experiment], records: &[&Record]) -> Vec<Finding> {
    let evidence = Evidence::of_records(project, experiments, records, &Build::default());
    match Sources::load(project, evidence) {
        Ok(sources) => compile(&sources).findings,
        Err(finding) => vec![finding],
    }
}
