//! Is the WebAssembly of the book that of its sources? It carries their fingerprint in a section of its own.

use calibench::synth::fnv1a;
use calibench_book::WEB_ASSEMBLY;
use calibench_harness::fingerprint::code;
use std::path::Path;

#[path = "../src/laboratory/sources.rs"]
mod sources;

/// The section's name, as `src/laboratory/lib.rs` gives it.
const SECTION: &str = "calibench-fingerprint";

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// An unsigned number of WebAssembly (LEB128) and what follows it.
fn number(bytes: &[u8]) -> (usize, &[u8]) {
    let length = 1 + bytes.iter().position(|byte| byte & 0x80 == 0).expect("a number ends");
    let digits = bytes[..length].iter().rev();
    (digits.fold(0, |number, byte| number << 7 | usize::from(byte & 0x7f)), &bytes[length..])
}

/// The content of the section with a name of its own, if the file has it.
fn section<'a>(file: &'a [u8], name: &str) -> Option<&'a [u8]> {
    let mut rest = file.strip_prefix(b"\0asm\x01\0\0\0")?;
    while let [kind, after @ ..] = rest {
        let (length, after) = number(after);
        let (content, following) = after.split_at(length);
        if *kind == 0 {
            let (length, content) = number(content);
            let (own, content) = content.split_at(length);
            if own == name.as_bytes() {
                return Some(content);
            }
        }
        rest = following;
    }
    None
}

#[test]
fn the_web_assembly_of_the_book_is_that_of_its_sources() {
    let file = std::fs::read(root().join(WEB_ASSEMBLY)).expect("it is committed");
    let written = String::from_utf8_lossy(section(&file, SECTION).expect("it carries a fingerprint"));
    let lines = code::of_paths(root(), sources::SOURCES, &[]).expect("every path of sources.rs is there");
    let lock = std::fs::read_to_string(root().join("Cargo.lock")).expect("it is committed");
    let versions = code::versions_of(&lock, code::NUMERIC_CRATES);
    let present = format!("{:016x}", fnv1a((lines + &versions).bytes()));
    assert_eq!(
        written, present,
        "{WEB_ASSEMBLY} is stale: what it is built from has changed since; run `.ci/laboratory --write`"
    );
}

#[test]
fn a_section_is_found_among_others() {
    let file = b"\0asm\x01\0\0\0\x01\x02ab\0\x04\x01xyz\0\x86\x80\0\x03ownpq";
    assert_eq!(section(file, "own"), Some(&b"pq"[..]));
    assert_eq!(section(file, "x"), Some(&b"yz"[..]));
    assert_eq!(section(file, "other"), None);
    // The example of the definition of LEB128 in DWARF 5, 7.6.
    assert_eq!(number(&[0xb9, 0x64, 7]), (12857, &[7][..]));
}

#[test]
fn nothing_in_it_names_a_folder_of_the_machine_that_built_it() {
    let file = std::fs::read(root().join(WEB_ASSEMBLY)).expect("it is committed");
    let text = String::from_utf8_lossy(&file);
    for folder in ["/home/", "/root/", "/Users/", "C:\\", ".cargo"] {
        assert!(!text.contains(folder), "{folder}");
    }
}
