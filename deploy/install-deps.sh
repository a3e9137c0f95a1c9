#!/usr/bin/env bash
# Installs the Debian packages that Heliograph is built from and tested with: Debian 12 or 13, as root or through sudo.
# Asks dpkg first and leaves apt alone when nothing is missing.
#
# usage: deploy/install-deps.sh [--demo] [--with-bench] [--with-fuzz] [--with-package] [--print]
#   --demo        only what heliograph and heliographd are built from, without what the tests need
#   --with-bench  also what the benches' optional peers need: Blender, and LLVM 19 for Mitsuba, which itself comes by
#                 pip into a virtual environment
#   --with-fuzz   also what the fuzzers are built with
#   --with-package  also what cpack makes packages with
#   --print       only prints the names of the packages
set -euo pipefail

packages=(
  # tools
  ca-certificates ccache cmake g++ ninja-build protobuf-compiler protobuf-compiler-grpc python3
  # libraries; libembree-dev is Embree 3.13 in Debian 12 and Embree 4 in Debian 13
  libabsl-dev libboost-dev libcli11-dev libdeflate-dev libdraco-dev libembree-dev libgrpc++-dev libimath-dev libmeshoptimizer-dev libopenexr-dev
  libopenimageio-dev libprotobuf-dev libpugixml-dev libspdlog-dev libspng-dev libssl-dev libtbb-dev libturbojpeg0-dev
  nlohmann-json3-dev zlib1g-dev
  # without its programs OpenImageIO's CMake configuration does not load in Debian 13
  openimageio-tools
)
# The tests read our files with exrheader and oiiotool, our manuals with groff, and the viewer in a browser; the Python
# package is built by hatchling.
test_packages=(chromium chromium-driver fonts-dejavu-core groff-base libgtest-dev openexr python3-grpcio python3-hatchling
  python3-numpy python3-pip python3-protobuf python3-pytest python3-selenium python3-tqdm python3-venv)
fuzz_packages=(clang libclang-rt-dev)
package_packages=(dpkg-dev file)
bench_packages=(blender python3-numpy python3-venv libllvm19)

print=false
tests=true
for argument in "$@"; do
  case $argument in
    --demo) tests=false ;;
    --with-bench) packages+=("${bench_packages[@]}") ;;
    --with-fuzz) packages+=("${fuzz_packages[@]}") ;;
    --with-package) packages+=("${package_packages[@]}") ;;
    --print) print=true ;;
    -h | --help) sed -n '2,11s/^# \{0,1\}//p' "$0"; exit 0 ;;
    *) echo "install-deps: unknown argument '$argument'; allowed: --demo, --with-bench, --with-fuzz, --with-package, --print" >&2; exit 2 ;;
  esac
done
if $tests; then packages+=("${test_packages[@]}"); fi
if $print; then
  printf '%s\n' "${packages[@]}"
  exit 0
fi

if ! command -v dpkg-query >/dev/null || ! command -v apt-get >/dev/null; then
  echo "install-deps: this is no Debian; deploy/Dockerfile builds and runs Heliograph elsewhere" >&2
  exit 1
fi

missing=()
for package in "${packages[@]}"; do
  status=$(dpkg-query -W -f='${Status}' "$package" 2>/dev/null || true)
  [[ $status == *"ok installed" ]] || missing+=("$package")
done
((${#missing[@]})) || exit 0

as_root=()
if ((EUID != 0)); then
  if ! command -v sudo >/dev/null; then
    echo "install-deps: missing ${missing[*]}; run as root or install sudo" >&2
    exit 1
  fi
  as_root=(sudo)
fi
echo "install-deps: installing ${missing[*]}"
apt=("${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get -qq -o Dpkg::Use-Pty=0)
"${apt[@]}" update
"${apt[@]}" install -y --no-install-recommends "${missing[@]}" >/dev/null
