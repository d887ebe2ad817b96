#!/bin/bash
# Writes the completion of a program for bash or zsh from its own --help, so that they are of one
# source:
#   make-completion.sh bash|zsh PROGRAM OUTPUT
set -euo pipefail
shell=$1 program=$2 output=$3
base=$(basename "$program")

# A line VERB|SHORT|LONG|VALUE|CHOICES|HELP for each option, VALUE 1 if it takes one.
options_of() {
  "$program" ${1:+"$1"} --help | awk -v verb="$1" '
    match($0, /^  (-[A-Za-z],)?--[a-z0-9_-]+/) {
      split(substr($0, 3, RLENGTH - 2), names, ",")
      short = names[2] == "" ? "" : names[1]
      long = names[2] == "" ? names[1] : names[2]
      rest = substr($0, RLENGTH + 1)
      value = rest ~ /^ (TEXT|INT|UINT|FLOAT)/
      choices = ""
      if (match(rest, /^ TEXT:\{[^}]*\}/)) {
        choices = substr(rest, 8, RLENGTH - 8)
        gsub(",", " ", choices)
      }
      help = rest ~ /   */ ? rest : ""
      sub(/^.*[^ ]  +/, "", help)
      sub(/^ +/, "", help)
      if (help == "") { held = verb "|" short "|" long "|" value "|" choices "|"; next }
      print verb "|" short "|" long "|" value "|" choices "|" help
      next
    }
    held != "" { sub(/^ +/, ""); print held $0; held = "" }'
}

verbs=$("$program" --help |
  awk '/^Subcommands:/ { inside = 1; next } /^[^ ]/ || /^$/ { inside = 0 } inside { print $1 }')
scratch=$(mktemp)
trap 'rm -f "$scratch"' EXIT
{ for verb in $verbs; do options_of "$verb"; done; options_of ""; } > "$scratch"

bash_completion() {
  local function=_${base//-/_}
  echo "# bash completion of $base, made from its --help"
  echo "$function() {"
  echo '  local current=${COMP_WORDS[COMP_CWORD]} previous=${COMP_WORDS[COMP_CWORD-1]} verb= options= word'
  if [ -n "$verbs" ]; then
    echo '  for word in "${COMP_WORDS[@]:1:COMP_CWORD-1}"; do'
    echo "    case \$word in $(echo $verbs | sed 's/ /|/g')) verb=\$word; break ;; esac"
    echo '  done'
    echo '  if [ -z "$verb" ] && [[ $current != -* ]]; then'
    echo "    COMPREPLY=(\$(compgen -W \"$(echo $verbs)\" -- \"\$current\"))"
    echo '    return'
    echo '  fi'
  fi
  echo '  case "$verb $previous" in'
  awk -F'|' '$5 != "" {
    pattern = "\"" $1 " " $3 "\""
    if ($2 != "") pattern = pattern "|\"" $1 " " $2 "\""
    print "    " pattern ") COMPREPLY=($(compgen -W \"" $5 "\" -- \"$current\")); return ;;"
  }' "$scratch"
  echo '  esac'
  echo '  case $verb in'
  awk -F'|' '{ words[$1] = words[$1] " " $3; if ($2 != "") words[$1] = words[$1] " " $2
               if (!($1 in seen)) { seen[$1] = 1; order[++n] = $1 } }
    END { for (k = 1; k <= n; ++k) {
      verb = order[k]
      print "    " (verb == "" ? "\"\"" : verb) ") options=\"" substr(words[verb], 2) "\" ;;"
    } }' "$scratch"
  echo '  esac'
  echo '  [[ $current == -* ]] && COMPREPLY=($(compgen -W "$options" -- "$current"))'
  echo '}'
  echo "complete -o default -F $function $base"
}

zsh_completion() {
  echo "#compdef $base"
  echo "# zsh completion of $base, made from its --help"
  if [ -n "$verbs" ]; then
    echo "if (( CURRENT == 2 )) && [[ \$words[2] != -* ]]; then"
    echo '  local -a verbs'
    echo '  verbs=('
    "$program" --help | awk '/^Subcommands:/ { inside = 1; next } /^[^ ]/ || /^$/ { inside = 0 }
      inside { verb = $1; sub(/^ +[^ ]+ +/, ""); gsub(/[\x27:]/, " "); print "    \x27" verb ":" $0 "\x27" }'
    echo '  )'
    echo "  _describe verb verbs"
    echo '  return'
    echo 'fi'
  fi
  echo 'local -a options'
  [ -z "$verbs" ] || echo 'case $words[2] in'
  awk -F'|' -v verbs="$verbs" '
    { help = $6; gsub(/[\x27\[\]:\\]/, " ", help)
      if (length(help) > 70) help = substr(help, 1, 67) "..."
      value = $5 != "" ? ":value:(" $5 ")" : $4 ? ":value:_files" : ""
      line = "    \x27*" $3 "[" help "]" value "\x27"
      if ($2 != "") line = line "\n    \x27*" $2 "[" help "]" value "\x27"
      text[$1] = text[$1] line "\n"
      if (!($1 in seen)) { seen[$1] = 1; order[++n] = $1 } }
    END { for (k = 1; k <= n; ++k) {
      verb = order[k]
      pattern = verbs == "" ? "" : "  " (verb == "" ? "*" : verb) ") "
      print pattern "options=(\n" text[verb] "  )" (verbs == "" ? "" : " ;;")
    } }' "$scratch"
  if [ -n "$verbs" ]; then
    echo 'esac'
    echo '(( CURRENT > 2 )) && [[ $words[2] != -* ]] && { shift words; (( CURRENT-- )); }'
  fi
  echo "_arguments \$options '*:file:_files'"
}

"${shell}_completion" > "$output"
