#!/usr/bin/env bash
# Installs the Debian packages that Heliograph is built from and tested with: Debian 12 or 13, as root or through sudo.
# Asks dpkg first and leaves apt alone when nothing is missing.
#
# usage: deploy/install-deps.sh [--demo] [--with-bench] [--with-fuzz] [--with-package] [--with-vulkan-rt] [--print]
#   --demo        only what heliograph and heliographd are built from, without what the tests need
#   --with-bench  also what the benches' optional peers need: Blender, and LLVM 19 for Mitsuba, which itself comes by
#                 pip into a virtual environment
#   --with-fuzz   also what the fuzzers are built with
#   --with-package  also what cpack makes packages with
#   --with-vulkan-rt  also a software driver for Vulkan that traces rays: Debian 13 has it, and for Debian 12 the package
#                 source bookworm-backports is added, and mesa-vulkan-drivers of it
#   --print       only prints the names of the packages
set -euo pipefail

packages=(
  # tools
  ca-certificates ccache cmake g++ glslang-tools ninja-build protobuf-compiler protobuf-compiler-grpc python3
  # libraries; libembree-dev is Embree 3.13 in Debian 12 and Embree 4 in Debian 13
  libabsl-dev libboost-dev libcli11-dev libdeflate-dev libdraco-dev libembree-dev libgrpc++-dev libimath-dev libmeshoptimizer-dev libopenexr-dev
  libopenimageio-dev libprotobuf-dev libpugixml-dev libspdlog-dev libspng-dev libsqlite3-dev libssl-dev libtbb-dev libturbojpeg0-dev
  nlohmann-json3-dev prometheus-cpp-dev zlib1g-dev
  # headers and loader of Vulkan, which nothing is linked to (libvolk-dev is another library)
  libvulkan-dev libvulkan-volk-dev
  # without its programs OpenImageIO's CMake configuration does not load in Debian 13
  openimageio-tools
)
# The tests read our files with exrheader and oiiotool, our manuals with groff, and the viewer in a browser, trace
# paths on Mesa's software device, and make certificates with openssl; the Python package is built by hatchling;
# systemd's tools look at our unit.
test_packages=(chromium chromium-driver fonts-dejavu-core groff-base libgtest-dev libvulkan1 mesa-vulkan-drivers openexr
  openssl python3-grpcio python3-hatchling python3-numpy python3-pip python3-protobuf python3-pytest python3-selenium
  python3-tqdm python3-venv python3-yaml spirv-tools systemd vulkan-validationlayers)
fuzz_packages=(clang libclang-rt-dev)
package_packages=(dpkg-dev file)
bench_packages=(blender python3-numpy python3-venv libllvm19)
vulkan_rt_packages=(libvulkan1 mesa-vulkan-drivers)

print=false
tests=true
vulkan_rt=false
for argument in "$@"; do
  case $argument in
    --demo) tests=false ;;
    --with-bench) packages+=("${bench_packages[@]}") ;;
    --with-fuzz) packages+=("${fuzz_packages[@]}") ;;
    --with-package) packages+=("${package_packages[@]}") ;;
    --with-vulkan-rt) packages+=("${vulkan_rt_packages[@]}"); vulkan_rt=true ;;
    --print) print=true ;;
    -h | --help) sed -n '2,13s/^# \{0,1\}//p' "$0"; exit 0 ;;
    *) echo "install-deps: unknown argument '$argument'; allowed: --demo, --with-bench, --with-fuzz, --with-package, --with-vulkan-rt, --print" >&2; exit 2 ;;
  esac
done
if $tests; then packages+=("${test_packages[@]}"); fi
if $print; then
  printf '%s\n' "${packages[@]}" | awk '!seen[$0]++'
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

# Mesa's software device traces rays from 24.1 on, which Debian 12 has in its backports alone.
driver=mesa-vulkan-drivers
first_with_rays=24.1
release=
if $vulkan_rt && [[ $(. /etc/os-release && echo "${ID:-}${VERSION_ID:-}") == debian12 ]] &&
  ! dpkg --compare-versions "$(dpkg-query -W -f='${Version}' $driver 2>/dev/null || true)" ge $first_with_rays; then
  release=bookworm-backports
  others=()
  for package in "${missing[@]}"; do
    [[ $package == "$driver" ]] || others+=("$package")
  done
  missing=("${others[@]}")
fi
((${#missing[@]})) || [[ -n $release ]] || exit 0

as_root=()
if ((EUID != 0)); then
  if ! command -v sudo >/dev/null; then
    echo "install-deps: missing ${missing[*]}; run as root or install sudo" >&2
    exit 1
  fi
  as_root=(sudo)
fi
apt=("${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get -qq -o Dpkg::Use-Pty=0)
if [[ -n $release ]]; then
  source_file=/etc/apt/sources.list.d/$release.list
  echo "install-deps: --with-vulkan-rt: Debian 12's own $driver does not trace rays. Adding the package source $release"
  echo "install-deps:   as $source_file, and installing $driver with its libraries from it; nothing else comes from there."
  echo "deb http://deb.debian.org/debian $release main" | "${as_root[@]}" tee "$source_file" >/dev/null
fi
if ((${#missing[@]})); then echo "install-deps: installing ${missing[*]}"; fi
"${apt[@]}" update
if ((${#missing[@]})); then "${apt[@]}" install -y --no-install-recommends "${missing[@]}" >/dev/null; fi
if [[ -n $release ]]; then
  "${apt[@]}" install -y --no-install-recommends --target-release "$release" "$driver" >/dev/null
fi
