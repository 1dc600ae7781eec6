#!/usr/bin/env bash
# Instructions per sample of every method, counted by callgrind: the machine's noise has no part in it.
#
#   benches/callgrind.sh [INPUT...]          # default: rates jittered increments
#
# Needs valgrind. Prints Markdown. A method's figure is that of eight passes over 8192 samples less that of four,
# so that the start of the program and the making of the log cancel.
set -euo pipefail
cd "$(dirname "$0")/.."
cargo build --release --quiet -p strapd-attitude --example propagate_once
program=target/release/examples/propagate_once
[ $# -gt 0 ] || set -- rates jittered increments

instructions() {
    local file
    file=$(mktemp)
    valgrind --tool=callgrind --callgrind-out-file="$file" "$program" "$@" >/dev/null 2>&1
    sed -n 's/^summary: //p' "$file"
    rm -f "$file"
}

echo "| method | $(printf '%s | ' "$@" | sed 's/ $//')"
echo "|$(printf -- '---|%.0s' "" "$@")"
"$program" | while read -r method; do
    row="| $method |"
    for input in "$@"; do
        some=$(instructions "$method" "$input" 4)
        more=$(instructions "$method" "$input" 8)
        row+=" $(((more - some) / (4 * 8192))) |"
    done
    echo "$row"
done
