#!/bin/bash
# completion_test.sh bash|zsh FOLDER: asks the completions of surfseg as the shell does.
set -euo pipefail
shell=$1 folder=$2
if ! command -v "$shell" > /dev/null; then
  echo "skipped: $shell is missing"
  exit 77
fi

expect() {  # what came, what was wanted
  [ "$1" = "$2" ] || { echo "came: $1"; echo "wanted: $2"; exit 1; }
}

if [ "$shell" = bash ]; then
  ask() {  # the words of the command line
    source "$folder/surfseg.bash"
    COMP_WORDS=("$@") COMP_CWORD=$(($# - 1)) COMPREPLY=()
    _surfseg
    echo "${COMPREPLY[*]}"
  }
  expect "$(ask surfseg seg)" segment
  expect "$(ask surfseg segment --space "")" "ras lps ijk"
  expect "$(ask surfseg segment --edge-l)" --edge-length
  expect "$(ask surfseg render --edge-l)" ""
  expect "$(ask surfseg segment "")" ""  # files
  source "$folder/surfseg-slicer.bash"
  source "$folder/curveseg.bash"
else
  for program in surfseg curveseg surfseg-slicer; do zsh -n "$folder/$program.zsh"; done
  # The words that _arguments and _describe are given.
  ask() {
    zsh -fc '
      _describe() { print verbs: $#verbs }
      _arguments() { print -l "$@" | grep -c -- "--edge-length\[" }
      words=('"$*"'); CURRENT=$#words
      complete_it() { source '"$folder"'/surfseg.zsh }
      complete_it'
  }
  expect "$(ask surfseg seg)" "verbs: 8"
  expect "$(ask surfseg segment --e)" 1
  expect "$(ask surfseg render --e || true)" 0
fi
