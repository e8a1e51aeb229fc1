//! Do the readers that meet untrusted bytes end without a panic? On every seed of the fuzz targets, cut off
//! and damaged at every place.

#[path = "../fuzz/readers.rs"]
mod readers;

use std::fs;
use std::path::Path;

/// Places at which a seed is cut or damaged, spread evenly over it.
const PLACES: usize = 64;

#[test]
fn every_reader_survives_its_seeds_whole_cut_off_and_damaged() {
    for (name, read) in readers::READERS {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/seeds").join(name);
        let mut seeds: Vec<_> = fs::read_dir(&folder).expect("every reader has seeds").flatten().collect();
        seeds.sort_by_key(fs::DirEntry::file_name);
        assert!(!seeds.is_empty(), "{name} has no seeds");
        for seed in seeds {
            let bytes = fs::read(seed.path()).expect("a seed is read");
            read(&bytes);
            for place in (0..PLACES).map(|i| i * bytes.len() / PLACES) {
                read(&bytes[..place]);
                for damage in [0x00, b'9', b'"', 0xff] {
                    let mut damaged = bytes.clone();
                    damaged[place] = damage;
                    read(&damaged);
                }
            }
        }
    }
}

#[test]
fn every_reader_is_a_fuzz_target_and_the_other_way_round() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/fuzz_targets");
    let entries = fs::read_dir(folder).expect("there are targets").flatten();
    let mut targets: Vec<String> = entries
        .map(|entry| entry.path().file_stem().unwrap_or_default().to_string_lossy().into_owned())
        .collect();
    targets.sort();
    let mut names = readers::READERS.map(|reader| reader.0);
    names.sort_unstable();
    assert_eq!(targets, names);
}
