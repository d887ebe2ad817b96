#!/bin/bash
# Writes a man page from the program's own help:
#   make-page.sh PROGRAM VERSION VERB NAME-LINE OUTPUT    (VERB: '' for the program itself)
set -euo pipefail
program=$1 version=$2 verb=$3 name=$4 output=$5

scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
base=$(basename "$program")
page=$base${verb:+-$verb}
# help2man takes an indented block as one paragraph: examples become paragraphs of their own,
# and a command that goes on in the next line becomes one line. The program's one-line
# description is the page's name line already.
cat > "$scratch/$page" <<WRAPPER
#!/bin/bash
set -o pipefail
"$program" $verb --help | sed -e ':a' -e '/\\\\\$/{N;s/ *\\\\\\n */ /;ba}' \\
  -e 's/^  $base /\\n&/' -e 's/^Positionals:/Arguments:/'
WRAPPER
chmod +x "$scratch/$page"
# All other pages that are made.
{
  echo '[see also]'
  sed -n 's/^surfseg_add_man_page(\([a-z-]*\) "*\([a-z]*\)"* ".*/\1-\2/p' "$(dirname "$0")/../../cmake/SurfsegManPages.cmake" |
    sed -e 's/-$//' -e "/^$page\$/d" | sed -e 's/-/\\-/g' -e 's/.*/.BR & (1),/' -e '$s/,$//'
} > "$scratch/more"
help2man --no-info --name="$name" --version-string="$version" --include="$scratch/more" \
  --source="surfseg $version" --output="$scratch/$page.1" "$scratch/$page"
mv "$scratch/$page.1" "$output"
