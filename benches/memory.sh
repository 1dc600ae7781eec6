#!/usr/bin/env bash
# Peak resident memory of `strapd replay` on a log far larger than it may keep, against a log of one message.
#
#   cargo build --release --bin strapd --example generate_log
#   benches/memory.sh SCRATCH_DIR [BYTES]        default 2000000000; needs three times that on disk, one log at a time
#
# Prints a Markdown table and ends with 1 when a run needs more than 64 MiB and one chunk (1 MiB) above the start.
# `peak` is VmHWM, which counts mapped pages of the file too; `anonymous` is the highest of samples 20 ms apart.
set -euo pipefail

scratch=${1:?usage: benches/memory.sh SCRATCH_DIR [BYTES]}
bytes=${2:-2000000000}
cd "$(dirname "$0")/.."
strapd=${STRAPD:-target/release/strapd}
generate=target/release/examples/generate_log
limit_kib=$((65 * 1024))

for need in "$strapd" "$generate" /usr/bin/time; do
    [ -x "$need" ] || { echo "$need is missing (GNU time: Debian package \`time\`)" >&2; exit 1; }
done
mkdir -p "$scratch"
scratch=$(cd "$scratch" && pwd)
trap 'rm -f "$scratch"/memory-*' EXIT

# measure COMMAND...: sets peak and anonymous, in KiB.
measure() {
    /usr/bin/time --quiet -f %M -o "$scratch/memory-peak" "$@" </dev/null >"$scratch/memory-out" 2>&1 &
    local timer=$! child sample
    anonymous=0
    while kill -0 "$timer" 2>/dev/null; do
        child=$(cat "/proc/$timer/task/$timer/children" 2>/dev/null || true)
        sample=$(awk '/^RssAnon/ {print $2}' "/proc/${child%% *}/status" 2>/dev/null || true)
        [ "${sample:-0}" -le "$anonymous" ] || anonymous=$sample
        sleep 0.02
    done
    if ! wait "$timer"; then
        echo "$* failed:" >&2
        cat "$scratch/memory-out" >&2
        exit 1
    fi
    peak=$(cat "$scratch/memory-peak")
}

status=0
echo "| log | output | bytes | peak MiB | above one message, MiB | anonymous MiB | |"
echo "|---|---|---|---|---|---|---|"
for compression in none zstd; do
    one=$scratch/memory-one.mcap
    big=$scratch/memory-big.mcap
    "$generate" "$one" --messages 1 --compression "$compression" >/dev/null
    "$generate" "$big" --messages 1000000000 --max-bytes "$bytes" --compression "$compression" >/dev/null
    for output in null: "$scratch/memory-output.mcap"; do
        measure "$strapd" replay "$one" -o "$output" --force
        start=$peak
        measure "$strapd" replay "$big" -o "$output" --force
        above=$((peak - start))
        verdict=ok
        if [ "$above" -gt "$limit_kib" ]; then
            verdict="**too much**"
            status=1
        fi
        awk -v c="$compression" -v o="${output##*/memory-}" -v b="$(stat -c %s "$big")" \
            -v p="$peak" -v a="$above" -v n="$anonymous" -v v="$verdict" \
            'BEGIN { printf "| %s | %s | %.0f | %.1f | %.1f | %.1f | %s |\n", c, o, b, p/1024, a/1024, n/1024, v }'
        rm -f "$scratch/memory-output.mcap"
    done
    rm -f "$big"
done
exit "$status"
