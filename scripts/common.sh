# What scripts/demo and scripts/check share. Sourced by bash, from anywhere; leaves the shell in the project's folder.
set -euo pipefail
called_from=$PWD
cd "$(dirname "${BASH_SOURCE[0]}")/.."
project=$PWD

# Debian packages; the README says what each is for.
build_packages=(g++ cmake ninja-build pkg-config ccache libsystemc-dev libglm-dev libboost1.81-dev nlohmann-json3-dev
  libcli11-dev libfmt-dev libpng-dev libopenexr-dev libmd-dev libassimp-dev libtomlplusplus-dev
  zlib1g-dev libzstd-dev libwebp-dev libzip-dev)
check_packages=(git clang libclang-rt-14-dev clang-format clang-tidy libgtest-dev libgmock-dev librapidcheck-dev libbenchmark-dev
  liblzma-dev xz-utils libboost-mpi1.81-dev openmpi-bin chromium)

# The comment at the head of a script is its help.
if [ "${1-}" = --help ]; then
  sed -n '2,/^[^#]/s/^# \{0,1\}//p' "$0"
  exit
fi

say() { printf '%s: %s\n' "$(basename "$0")" "$*" >&2; }

# Installs those of the named packages that are missing.
install_packages() {
  command -v dpkg-query >/dev/null || { say "not a Debian system; needs the equivalents of: $*"; return 0; }
  local missing
  missing=$(comm -23 <(printf '%s\n' "$@" | sort) \
    <(dpkg-query -W -f '${db:Status-Status} ${Package}\n' "$@" 2>/dev/null | sed -n 's/^installed //p' | sort))
  [ -n "$missing" ] || return 0
  local root=()
  if [ "$(id -u)" -ne 0 ]; then
    command -v sudo >/dev/null || { say "needs root or sudo to install:" $missing; exit 1; }
    root=(sudo)
  fi
  say "installing" $missing
  "${root[@]}" apt-get update -q >&2
  "${root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -q -y --no-install-recommends $missing >&2
}

# Runs a command; its output goes to a file, and is shown only if it fails.
quietly() {
  local log
  log=$(mktemp)
  if ! "$@" >"$log" 2>&1 </dev/null; then
    cat "$log" >&2
    rm -f "$log"
    say "failed: $*"
    return 1
  fi
  rm -f "$log"
}

# What ccache knows of one checkout serves another.
export CCACHE_BASEDIR=$project CCACHE_NOHASHDIR=true

# configure BINARY_DIR OPTIONS...: a cmake run, with ccache if there is one.
configure() {
  local options=(-S . -B "$@")
  if command -v ccache >/dev/null; then options+=(-DCMAKE_CXX_COMPILER_LAUNCHER=ccache); fi
  quietly cmake "${options[@]}"
}
