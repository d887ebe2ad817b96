#!/bin/bash
# Prints the tables of docs/*.md again, by the studies that they come from, and compares them:
#
#   tools/reprint-docs.sh                  all of them
#   tools/reprint-docs.sh flows energies   those of these pages
#   tools/reprint-docs.sh --write flows    and writes what is printed into the page
#   tools/reprint-docs.sh --help
#
# Code 1 where a number differs by more than its tolerance, or the page lacks a table that is printed.
set -euo pipefail
root=$(cd "$(dirname "$0")/.." && pwd)
exec "${SURFSEG_PYTHON:-/usr/bin/python3}" "$root/tools/reprint_docs.py" "$@"
