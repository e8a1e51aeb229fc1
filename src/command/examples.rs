//! What would one type? Examples at the end of every verb's help. They are commands that run: a test runs
//! them all.

use clap::{Arg, Command, CommandFactory};

/// Verbs, those of a verb after it, and what one would type. What it reads is in `tests/verb_examples.rs`.
const EXAMPLES: &[(&str, &[&str])] = &[
    ("list", &["calibench list", "calibench list --names", "calibench list --format json"]),
    ("explain", &["calibench explain line-bending.max-deviation", "calibench explain 5.4"]),
    ("run", &["calibench run line-bending", "calibench run line-bending --seed 7 --out another-seed"]),
    ("check", &["calibench check line-bending", "calibench check line-bending --bits --format json"]),
    ("bless", &["calibench bless line-bending"]),
    ("claims", &["calibench claims line-bending", "calibench claims line-bending --out claims.md"]),
    ("book", &["calibench book"]),
    ("new study", &["calibench new study my-study"]),
    ("new experiment", &["calibench new experiment my-question"]),
    (
        "new adapter",
        &[
            "calibench new adapter my-solver",
            "calibench new adapter my-solver --language cpp",
            "calibench new adapter my-solver --language rust",
            "calibench new adapter my-solver --language octave",
        ],
    ),
    ("new board", &["calibench new board my-board"]),
    (
        "board",
        &[
            "calibench board chess:9x6:25mm",
            "calibench board circles:9x7:20mm:8mm --pdf letter --out page",
            "calibench board charuco:7x5:35mm:26mm:DICT_4X4_50 --out coded",
        ],
    ),
    (
        "calibrate",
        &[
            "calibench calibrate --board circles:9x7:10mm:3mm --out result photo0.png photo1.png photo2.png photo3.png",
            "calibench calibrate corners.csv --image-size 640x480 --fix k2=0 --out result",
            "calibench calibrate rings.csv --image-size 640x480",
            "calibench calibrate solid.csv --target target.csv --image-size 640x480 --out measured",
            "calibench calibrate pairs.csv --mode tilted",
        ],
    ),
    ("ninepoint", &["calibench ninepoint dots.png --out nine"]),
    (
        "noise",
        &[
            "calibench noise --board circles:9x7:10mm:3mm still0.png still1.png still2.png still3.png",
            "calibench noise still.csv --want 2 --out noise",
        ],
    ),
    ("undistort", &["calibench undistort --camera result/result.json --out corrected photo0.png photo1.png"]),
    (
        "convert",
        &[
            "calibench convert result/result.json camera.yaml --to opencv-yaml",
            "calibench convert fisheye.json fisheye.yaml --to kalibr",
            "calibench convert chess:9x6:25mm target.yaml",
            "calibench convert aprilgrid:6x6:88mm:0.3 tags.yaml",
        ],
    ),
    (
        "tsai",
        &[
            "calibench tsai corners.csv --image-size 640x480 --out one-view",
            "calibench tsai solid.csv --principal-point 326,243 --aspect free",
        ],
    ),
    (
        "validate",
        &[
            "calibench validate result/result.json new.csv --out validation",
            "calibench validate result/result.json --again again.json",
        ],
    ),
    (
        "diff",
        &[
            "calibench diff result/result.json camera.yaml --out difference",
            "calibench diff fisheye.json fisheye.yaml",
        ],
    ),
    ("measure", &["calibench measure result/result.json --view 0 --pixels 200,200,300,250"]),
    (
        "next-pose",
        &[
            "calibench next-pose result/result.json --board circles:9x7:10mm:3mm --want fx",
            "calibench next-pose result/result.json --corners corners.csv --want pixel --want length --at 0,0,150 --length 50 --out next",
        ],
    ),
    ("register", &["calibench register taught.csv found.csv"]),
    ("hand-eye", &["calibench hand-eye robot.csv result/result.json --robot-sd-mm 0.1 --robot-sd-deg 0.1"]),
    ("check-reference", &["calibench check-reference history.csv --reference 25 --sd 0.01"]),
    (
        "study run",
        &[
            "calibench study run my-study.toml --out my-study",
            "calibench study run my-study.toml --shard 0/2 --out part0",
            "calibench study run my-study.toml --shard 1/2 --out part1",
            "calibench study run my-study.toml --solver \"python3 my_solver.py\" --out theirs",
        ],
    ),
    ("study resume", &["calibench study resume my-study --format json"]),
    (
        "study commands",
        &[
            "calibench study commands my-study.toml --shards 2 --out parts",
            "calibench study commands my-study.toml --shards 2 --out parts --merge",
        ],
    ),
    ("study figure", &["calibench study figure my-study", "calibench study figure my-study --panel bias/fx"]),
    ("study cell", &["calibench study cell my-study 0", "calibench study cell my-study 1 --format json"]),
    ("study merge", &["calibench study merge part0 part1 --out whole"]),
    (
        "study compare",
        &["calibench study compare my-study whole", "calibench study compare my-study --factor views"],
    ),
    ("study plan", &["calibench study plan my-study.toml --want fx=2 --want depth=1 --confirm 100"]),
    ("study measure", &["calibench study measure my-study.toml --trials 100"]),
    (
        "gate",
        &[
            "calibench gate --html report.html",
            "calibench gate --solver \"python3 my_solver.py\" --samples 1",
            "calibench gate --planted k2-ignored --samples 4",
            "calibench gate --samples 32 --record before",
        ],
    ),
    ("gate export", &["calibench gate export asked --samples 1"]),
    ("gate judge", &["calibench gate judge before", "calibench gate judge before --against builtin"]),
    ("gate hand-eye", &["calibench gate hand-eye"]),
    ("gate detector", &["calibench gate detector --boards chessboard,circles --samples 4"]),
    ("gate certified", &["calibench gate certified --problem nine-points --least-digits 11"]),
    ("gate digits-table", &["calibench gate digits-table digits.csv"]),
    ("gate faults", &["calibench gate faults"]),
    ("gate power", &["calibench gate power gate-power --size thorough"]),
    ("gate power-table", &["calibench gate power-table gate-power"]),
    ("gate schema", &["calibench gate schema schemas"]),
    ("doctor", &["calibench doctor"]),
    ("exit-codes", &["calibench exit-codes"]),
    ("completions", &["calibench completions bash"]),
    ("manual", &["calibench manual --out man"]),
];

/// The command line with its examples.
pub(super) fn command() -> Command {
    let plain = taking_negative_numbers(super::Arguments::command());
    EXAMPLES.iter().fold(plain, |command, (verb, lines)| {
        let words: Vec<&str> = verb.split(' ').collect();
        with_examples(command, &words, lines)
    })
}

/// The command with options that take -5 for a number, and -5,10 for two where they want several, so that
/// whoever wants others says why, and not for an option that does not exist.
fn taking_negative_numbers(command: Command) -> Command {
    let of_option = |arg: Arg| {
        if arg.is_positional() || !arg.get_action().takes_values() {
            return arg;
        }
        let wants_several = arg.get_value_names().is_some_and(|names| names.iter().any(|n| n.contains(',')));
        let arg = arg.allow_negative_numbers(true);
        if wants_several { arg.allow_hyphen_values(true) } else { arg }
    };
    command.mut_args(of_option).mut_subcommands(taking_negative_numbers)
}

/// The command whose verb, or whose verb's verb, has these examples behind what it says.
fn with_examples(command: Command, verb: &[&str], lines: &[&str]) -> Command {
    let Some((first, rest)) = verb.split_first() else {
        let mut after = command.get_after_help().map(|said| format!("{said}\n\n")).unwrap_or_default();
        after.push_str("Examples:");
        lines.iter().for_each(|line| after.push_str(&format!("\n  {line}")));
        return command.after_help(after);
    };
    // `study run` has the name `run` below `study`.
    command.mut_subcommand(first, |below| with_examples(below, rest, lines))
}
