"""Would the unit tests of a package notice if its code were wrong? Every change that cargo-mutants lists, in one build.

cargo-mutants compiles the package once for each change, which takes days. Here all changes are compiled together, each behind a question:

    a < b   becomes   (if crate::mutant::is(7) { a <= b } else { a < b })

and a variable of the environment says which of them is on. Changes that do not compile are taken out until the rest does. Each test is run once
to record which changes it reaches, and a change is tried on the tests that reach it, the fastest first.

usage: mutants.py PACKAGE NTH FOLDER...     (from the root of a copy of the sources, which it changes)
"""
import collections
import concurrent.futures
import json
import os
import pathlib
import re
import subprocess
import sys
import time
import tomllib

import tree_sitter
import tree_sitter_rust

FEATURES = {"calibench": ["--features", "io,serde"], "calibench-study": ["--features", "parquet"]}
ROOT = {"calibench": "src/calibench", "calibench-gate": "src/gate", "calibench-study": "src/study"}
# A test that runs so many times longer than without a change, and this many seconds, hangs.
SLOWER, PATIENCE = 10, 20
# So many of the tests that reach a change are run first, then so many, then the others.
STAGES = 6, 30
RECORD = pathlib.Path("target/mutants-reached")

# What the changed code asks. With MUTANT=7 the seventh change is on; with MUTANT_RECORD=FILE none is, and FILE lists those that were asked for.
SWITCH = """
//! Which change is on?
use std::io::Write;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering::Relaxed};
const UNKNOWN: u32 = 0;
const RECORDING: u32 = 1;
static STATE: AtomicU32 = AtomicU32::new(UNKNOWN);
static ASKED: [AtomicBool; 32768] = [const { AtomicBool::new(false) }; 32768];
/// Whether it is this one.
#[inline(always)]
pub fn is(id: u32) -> bool {
    let state = STATE.load(Relaxed);
    if state > RECORDING { state == id } else { first(id) }
}
#[cold]
fn first(id: u32) -> bool {
    if STATE.load(Relaxed) == UNKNOWN {
        let on = std::env::var("MUTANT").map(|id| id.parse().expect("a number"));
        let none = if std::env::var("MUTANT_RECORD").is_ok() { RECORDING } else { u32::MAX };
        STATE.store(on.unwrap_or(none), Relaxed);
    }
    if STATE.load(Relaxed) == RECORDING && !ASKED[id as usize].swap(true, Relaxed) {
        let path = std::env::var("MUTANT_RECORD").expect("it was there");
        let mut file = std::fs::OpenOptions::new().create(true).append(true).open(path).expect("it opens");
        file.write_all(format!("{id}\\n").as_bytes()).expect("it is written");
    }
    STATE.load(Relaxed) == id
}
"""
FIRST_ID = 2
OPERATIONS = "binary_expression", "compound_assignment_expr", "unary_expression"


def listed(folders, nth):
    """Every so many-th change, with an id."""
    files = [word for folder in folders for word in ("--file", f"{folder.rstrip('/')}/**/*.rs")]
    command = ["cargo", "mutants", "--workspace", "--list", "--json", *files]
    changes = json.loads(subprocess.run(command, capture_output=True, text=True, check=True).stdout)[::nth]
    for id, change in enumerate(changes, FIRST_ID):
        change["id"] = id
    return changes


class Source:
    """A file of which some expressions have variants."""

    parser = tree_sitter.Parser(tree_sitter.Language(tree_sitter_rust.language()))

    def __init__(self, path, changes):
        self.path, self.changes = pathlib.Path(path), changes
        self.text = self.path.read_bytes()
        self.root = self.parser.parse(self.text).root_node
        self.line_starts = [0]
        for line in self.text.split(b"\n"):
            self.line_starts.append(self.line_starts[-1] + len(line) + 1)

    def offset(self, position):
        start = self.line_starts[position["line"] - 1]
        line = self.text[start : self.line_starts[position["line"]]].decode()
        return start + len(line[: position["column"] - 1].encode())

    def around(self, start, end, kinds):
        node = self.root.descendant_for_byte_range(start, end)
        while node and node.type not in kinds:
            node = node.parent
        return node

    def write(self):
        """Writes the file with its changes; those that have no place in it are left out."""
        self.variants, self.returns, self.guards = (collections.defaultdict(list) for _ in range(3))
        self.changes = [change for change in self.changes if self.place(change)]
        text = self.text[: self.root.start_byte] + self.emit(self.root) + self.text[self.root.end_byte :]
        self.path.write_bytes(text)

    def place(self, change):
        start, end = (self.offset(change["span"][side]) for side in ("start", "end"))
        id, genre, new = change["id"], change["genre"], change["replacement"]
        if genre == "FnValue":
            # Of an opaque type there is one.
            function = self.around(start, start, ("function_item",))
            if function and "impl " not in change["function"]["return_type"]:
                self.returns[function.child_by_field_name("body").start_byte].append((id, new))
                return True
        elif genre in ("BinaryOperator", "UnaryOperator"):
            node = self.around(start, end, OPERATIONS)
            if node:
                first, last = node.start_byte, node.end_byte
                is_unary = genre == "UnaryOperator"
                changed = self.text[first + 1 : last] if is_unary else self.text[first:start] + new.encode() + self.text[end:last]
                self.variants[first, last].append((id, changed))
                return True
        elif genre in ("MatchArm", "MatchArmGuard"):
            arm = self.around(start, start, ("match_arm",))
            if arm:
                pattern = arm.child_by_field_name("pattern")
                self.guards[pattern.start_byte, pattern.end_byte].append((id, genre == "MatchArmGuard" and new == "true"))
                return True
        return False

    def emit(self, node):
        """The text of a node. Comments bracket what belongs to a change, so that an error of the compiler tells which it is."""
        span = node.start_byte, node.end_byte
        if node.type == "match_pattern" and span in self.guards:
            return self.guarded(node, self.guards[span])
        out, at = b"", node.start_byte
        for child in node.children:
            out += self.text[at : child.start_byte] + self.emit(child)
            at = child.end_byte
        out += self.text[at : node.end_byte]
        if node.type == "block" and node.start_byte in self.returns:
            ways = [bracketed([id], f"if {asked(id)} {{ return {new}; }}".encode()) for id, new in self.returns[node.start_byte]]
            out = b"{" + b"".join(ways) + out[1:]
        if node.type in OPERATIONS and span in self.variants:
            variants = self.variants.pop(span)
            ways = [f"if {asked(id)} {{ ".encode() + bracketed([id], new) + b" } else " for id, new in variants]
            out = bracketed([id for id, _ in variants], b"(" + b"".join(ways) + b"{ " + out + b" })")
        return out

    def guarded(self, node, guards):
        condition = node.child_by_field_name("condition")
        text = b"true" if condition is None else self.emit(condition)
        for id, is_always in guards:
            text = (f"{asked(id)} || (" if is_always else f"!{asked(id)} && (").encode() + text + b")"
        return self.text[node.start_byte : node.children[0].end_byte] + b" if " + bracketed([id for id, _ in guards], text)


def asked(id):
    return f"crate::mutant::is({id})"


def bracketed(ids, text):
    ids = ",".join(map(str, ids)).encode()
    return b" /*(" + ids + b"*/ " + text + b" /*" + ids + b")*/ "


def blamed(path, at):
    """The ids of the innermost change around a byte of a file."""
    open_changes = []
    for bracket in re.finditer(rb"/\*\(([\d,]+)\*/|/\*([\d,]+)\)\*/", path.read_bytes()):
        if bracket.start() > at:
            break
        if bracket[1]:
            open_changes.append(bracket[1])
        elif open_changes:
            open_changes.pop()
    return {int(id) for id in open_changes[-1].split(b",")} if open_changes else set()


def near(source, line):
    """Changes that an error outside of all of them may come from: deleted arms of its function, else all of it, else all of the file."""
    inside = lambda c: c["function"] and c["function"]["span"]["start"]["line"] <= line <= c["function"]["span"]["end"]["line"]
    function = [change for change in source.changes if inside(change)]
    arms = [change for change in function if change["genre"] == "MatchArm"]
    return {change["id"] for change in arms or function or source.changes}


def checked(build):
    command = ["cargo", "check", "--profile", "test", "--message-format=json", *build]
    return subprocess.run(command, capture_output=True, text=True)


def take_out_what_does_not_compile(sources, build):
    """Lines are those of the unchanged file: no change adds one."""
    while True:
        ran = checked(build)
        if ran.returncode == 0:
            return
        wrong = set()
        messages = [json.loads(line) for line in ran.stdout.splitlines() if line.startswith("{")]
        errors = [m["message"] for m in messages if m.get("reason") == "compiler-message" and m["message"]["level"] == "error"]
        outside = []
        for error in errors:
            spans = sorted(error["spans"], key=lambda span: not span["is_primary"])
            found = (blamed(pathlib.Path(span["file_name"]), span["byte_start"]) for span in spans if span["file_name"] in sources)
            ids = next(filter(None, found), set())
            wrong |= ids
            outside += [] if ids else [(span["file_name"], span["line_start"]) for span in spans if span["file_name"] in sources][:1]
        if not wrong:
            wrong = set().union(*(near(sources[path], line) for path, line in outside))
        if not wrong:
            sys.exit(ran.stderr[-4000:])
        for source in sources.values():
            if any(change["id"] in wrong for change in source.changes):
                source.changes = [change for change in source.changes if change["id"] not in wrong]
                source.write()
        print(f"{len(wrong)} do not compile", flush=True)


class Tests:
    """The unit tests of the changed package."""

    def __init__(self, package, build):
        ran = subprocess.run(["cargo", "test", "--no-run", "--message-format=json", *build], capture_output=True, text=True, check=True)
        built = [json.loads(line) for line in ran.stdout.splitlines() if line.startswith("{")]
        self.program = next(b["executable"] for b in built if b.get("executable") and "lib" in b["target"]["kind"])
        self.folder = pathlib.Path(ROOT[package]).resolve()
        config = tomllib.loads(pathlib.Path(".cargo/config.toml").read_text())
        self.environment = {**os.environ, **config["env"], "CARGO_MANIFEST_DIR": str(self.folder), "RUST_BACKTRACE": "0"}
        names = subprocess.run([self.program, "--list"], cwd=self.folder, capture_output=True, text=True).stdout
        self.names = re.findall(r"^(.*): test$", names, re.MULTILINE)

    def run(self, names, seconds=None, **environment):
        command = [self.program, "--exact", "--test-threads=1", *names]
        return subprocess.run(
            command, cwd=self.folder, env={**self.environment, **environment}, capture_output=True, timeout=seconds
        ).returncode

    def reaching(self, pool):
        """The tests that reach a change, by its id, each behind its seconds."""
        RECORD.mkdir(parents=True, exist_ok=True)
        reached = collections.defaultdict(list)
        for name, seconds, ids in pool.map(self.recorded, range(len(self.names))):
            for id in ids:
                reached[id].append((seconds, name))
        return reached

    def recorded(self, number):
        file, name, start = (RECORD / str(number)).resolve(), self.names[number], time.monotonic()
        file.unlink(missing_ok=True)
        if self.run([name], MUTANT_RECORD=str(file)):
            print(f"fails without a change, and is left out: {name}", flush=True)
            return name, 0, []
        return name, time.monotonic() - start, map(int, file.read_text().split() if file.exists() else [])

    def ending(self, id, reaching):
        """How a change ends."""
        tests = sorted(reaching)
        stages = tests[: STAGES[0]], tests[STAGES[0] : STAGES[1]], tests[STAGES[1] :]
        for stage in filter(None, stages):
            try:
                if self.run([name for _, name in stage], SLOWER * sum(s for s, _ in stage) + PATIENCE, MUTANT=str(id)):
                    return "noticed"
            except subprocess.TimeoutExpired:
                return "noticed"
        return "not noticed" if tests else "not reached"


def main():
    package, nth, folders = sys.argv[1], int(sys.argv[2]), [folder.rstrip("/") for folder in sys.argv[3:]]
    build = ["--package", package, "--lib", *FEATURES.get(package, [])]
    # What does not compile without a change would be taken for a fault of the changes.
    if checked(build).returncode:
        sys.exit(f"{package} does not compile as it is")
    by_file = collections.defaultdict(list)
    for change in listed(folders, nth):
        by_file[change["file"]].append(change)
    counted = {folder: sum(len(c) for path, c in by_file.items() if path.startswith(folder + "/")) for folder in folders}
    sources = {path: Source(path, changes) for path, changes in by_file.items()}
    library = pathlib.Path(ROOT[package])
    (library / "mutant.rs").write_text(SWITCH)
    with (library / "lib.rs").open("a") as lib:
        lib.write("\n#[doc(hidden)]\npub mod mutant;\n")
    for source in sources.values():
        source.write()
    placed = sum(len(source.changes) for source in sources.values())
    print(f"{placed} of {sum(counted.values())} changes have a place; a field that is left out of a struct has none", flush=True)
    take_out_what_does_not_compile(sources, build)
    tests = Tests(package, build)
    changes = [change for source in sources.values() for change in source.changes]
    endings = {folder: collections.Counter() for folder in folders}
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool, open("target/mutants-missed.txt", "w") as missed:
        reached = tests.reaching(pool)
        print(f"{len(changes)} compile; {len(tests.names)} tests reach {len(reached)}", flush=True)
        for change, ending in zip(changes, pool.map(lambda c: tests.ending(c["id"], reached[c["id"]]), changes)):
            folder = next(folder for folder in folders if change["file"].startswith(folder + "/"))
            endings[folder][ending] += 1
            if ending != "noticed":
                print(f"{ending}: {change['name']}", file=missed, flush=True)
    for folder, ends in endings.items():
        tried = sum(ends.values())
        print(f"{folder}: {counted[folder]} changes, {tried} compile, {dict(ends)}, {100 * ends['noticed'] / max(tried, 1):.1f} % noticed")
    print("what was not noticed stands in target/mutants-missed.txt")


main()
