#!/bin/sh
# A shell line for any CI: judges a calibrator. Exit code 0 trusted, 1 not trusted, 2 wrong usage, 3 incomplete.
#
#     cargo install --locked --git ADDRESS --bin calibench     (ADDRESS: where you got this repository)
#     sh gate.sh './my-calibrator --json-lines' [more options of calibench gate]
command="${1:?usage: gate.sh COMMAND [OPTIONS]}"
shift
exec calibench gate --solver "$command" --junit gate.xml --html gate.html "$@"
