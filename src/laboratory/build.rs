//! From which sources is this WebAssembly built? It carries their fingerprint, so that nobody can commit one
//! without the other.

#[path = "../harness/fingerprint/code.rs"]
mod code;
mod sources;

use std::path::Path;

fn main() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let lock = root.join("Cargo.lock");
    for path in sources::SOURCES.iter().map(|path| root.join(path)).chain([lock.clone()]) {
        println!("cargo:rerun-if-changed={}", path.display());
    }
    let lines = code::of_paths(&root, sources::SOURCES, &[]).and_then(|lines| {
        Ok(lines + &code::versions_of(&std::fs::read_to_string(lock)?, code::NUMERIC_CRATES))
    });
    let lines = lines.unwrap_or_else(|error| panic!("a path of src/laboratory/sources.rs: {error}"));
    println!("cargo:rustc-env=LABORATORY_FINGERPRINT={:016x}", fnv1a(lines.as_bytes()));
}

/// FNV-1a, 64 bits, as `calibench::synth::fnv1a`, which a build script cannot ask.
fn fnv1a(bytes: &[u8]) -> u64 {
    bytes
        .iter()
        .fold(0xcbf2_9ce4_8422_2325, |hash, byte| (hash ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3))
}
