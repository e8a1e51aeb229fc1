#!/bin/sh
# The same as a shell line, for any other CI: exit code 0 trusted, 1 not trusted, 2 wrong usage, 3 incomplete.
exec calibench gate --solver "${1:?usage: gate.sh COMMAND}" --junit gate.xml --html gate.html
