#!/usr/bin/env bash
# Thousands of logs on one machine, or on several that share a folder (GNU parallel: apt-get install parallel).
#   examples/parallel.sh EXPERIMENT OUT SHARDS LOG...
set -euo pipefail
experiment=$1 out=$2 shards=$3
shift 3
gapscope=${GAPSCOPE:-$(dirname "$0")/../build/bin/gapscope}
"$gapscope" plan "$experiment" "$@" --shards "$shards" --out "$out"
# One worker a shard; another machine is added with --sshlogin.
parallel --jobs "${JOBS:-$(nproc)}" "$gapscope" run --jobs 1 --quiet --shard "{}/$shards" "$out" ::: $(seq "$shards")
"$gapscope" merge "$out"
