#!/usr/bin/env bash
# A fleet on one machine, or on several that share a folder (GNU parallel: apt-get install parallel).
#   examples/fleet/parallel.sh FLEET.yaml OUT SHARDS
set -euo pipefail
fleet=$1 out=$2 shards=$3
gapscope=${GAPSCOPE:-$(dirname "$0")/../../build/bin/gapscope}
"$gapscope" fleet plan "$fleet" --shards "$shards" --out "$out"
# One worker a shard; another machine is added with --sshlogin. A unit that failed is told by merge.
parallel --jobs "${JOBS:-$(nproc)}" "$gapscope" fleet run --jobs 1 --quiet --shard "{}/$shards" "$out" \
  ::: $(seq "$shards") || true
"$gapscope" fleet merge "$out"
