#!/usr/bin/env bash
# Prints the Debian packages that own the shared libraries which the given programs load, one a line.
#
# usage: deploy/runtime-packages.sh PROGRAM...
set -euo pipefail
(($#)) || { echo "runtime-packages: no program given" >&2; exit 2; }

# What the programs name themselves; apt brings what those libraries need in turn.
libraries=$(readelf -d "$@" | sed -nE 's/.*\(NEEDED\).*\[(.+)\]$/\1/p' | sort -u)
[[ -n $libraries ]] || { echo "runtime-packages: the programs load no libraries" >&2; exit 1; }
while IFS= read -r library; do
  owner=$(dpkg-query -S "*/$library" | head -n 1) || { echo "no package owns $library" >&2; exit 1; }
  printf '%s\n' "${owner%%:*}"
done <<<"$libraries" | sort -u
