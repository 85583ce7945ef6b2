#!/usr/bin/env bash
# make_venv.sh VENV CACHE: a virtual environment with the stock `mujoco` package of the pinned version, for the equality
# test. Wheels come from CACHE, which scripts/setup fills; what is missing there is fetched once and kept there.
# Exit status 77 (skip): no network and no wheel.
set -euo pipefail
venv=$1 cache=$2
packages=(mujoco-core==4.0.1 numpy)
if [ -e "$venv/ready" ] && [ "$(cat "$venv/ready")" = "${packages[*]}" ]; then exit 0; fi
rm -rf "$venv"
python3 -m venv "$venv"
install() {
  "$venv/bin/python" -m pip install --quiet --disable-pip-version-check --no-index \
    --find-links "$cache" "${packages[@]}"
}
if ! install 2> "$venv/log"; then
  mkdir -p "$cache"
  "$venv/bin/python" -m pip download --quiet --disable-pip-version-check --only-binary :all: \
    --find-links "$cache" --dest "$cache" "${packages[@]}" 2>> "$venv/log" && install || {
    cat "$venv/log" >&2
    echo "skipped: no wheel of ${packages[*]} in $cache and none to be had" >&2
    exit 77
  }
fi
echo "${packages[*]}" > "$venv/ready"
