# What CI runs, one recipe a step; `just` alone lists them.
default:
    @just --list

# What a change must pass, and what else half an hour has room for
ci:
    bash .ci/run

# All of it, in an hour and three quarters
ci-all:
    bash .ci/run all

# Formatter and lints, warnings as errors
lint:
    bash .ci/lint

# The test suite
test:
    cargo test --locked
    cargo test --locked --all-features --test all -- study_parquet detect_photos photo_command

# The book, and every page of it in Chromium
book:
    cargo run --release --locked -- book
    .ci/browser --planted
    .ci/browser

# What the pages of the book compute, as WebAssembly: the bits of native code? `just laboratory --write` builds it anew
laboratory *ARGUMENTS:
    .ci/laboratory {{ARGUMENTS}}

# This library's solver, OpenCV and SciPy behind the gate
gate:
    bash .ci/gate

# What is published: packages, licences, the oldest Rust, the interface since the last release
package:
    bash .ci/package

# The documentation, warnings as errors
doc:
    RUSTDOCFLAGS="-D warnings" cargo doc --no-deps --locked

# Golden values, claims, published values and figures; writes nothing
check:
    cargo run --release --locked -- check

# The same bits for any thread count, in debug and release, without AVX2 and FMA, and on aarch64
reproducible:
    bash .ci/reproducible

# The Python package: built, checked, and tested in a fresh virtual environment
python:
    .ci/python

# Studies on a Slurm, a Dask, a Ray and a Snakemake of this machine alone
cluster:
    bash .ci/slurm
    bash .ci/engine dask
    bash .ci/engine ray
    bash .ci/engine snakemake

# Every experiment, figure and table, and the reconciliation
all:
    cargo run --release --locked

# This library beside OpenCV, mrcal and Ceres in one run; `just peers --write benches/peers/README.md` puts the tables there
peers *ARGUMENTS:
    benches/peers/run {{ARGUMENTS}}

# Digits of the certified problems that this library, OpenCV, SciPy and the minimal solver reach, for adapters/DIGITS.md and the book
digits:
    cargo run --release --locked -- gate certified --digits reference/digits.csv --timeout 600

# The certified problems: sums, observations, two of them certified anew, and steps from the values of all
certified *PROBLEMS:
    .ci/certified {{PROBLEMS}}

# The pictures of the README, light and dark
pictures:
    .ci/pictures

# Instructions of the kernels against golden/instructions.toml
instructions:
    .ci/instructions

# Accepts the present counts
bless-instructions:
    .ci/instructions --bless

# Every reader of untrusted bytes, so many seconds each
fuzz SECONDS="30":
    .ci/fuzz {{SECONDS}}

# Every so manieth change of the code that computes and judges: do the unit tests notice?
mutants NTH="120":
    .ci/mutants {{NTH}}

# The registers of floating-point lanes under Miri
miri:
    .ci/miri
