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

git() { command git -c safe.directory="$project" "$@"; }
# The commit since which a change is: where HEAD left origin's branch, or, on that branch, the last one that is four hours
# older than HEAD. Nothing where there is none.
base_of_change() {
  local base
  base=$(git merge-base HEAD origin/HEAD 2>/dev/null || true)
  if [ -z "$base" ] || [ "$base" = "$(git rev-parse HEAD)" ]; then
    base=$(git rev-list -1 --before="$(($(git log -1 --format=%ct) - 4 * 3600))" HEAD)
  fi
  echo "$base"
}
# changed_since REVISION: files that are not what they were, what is not committed among them.
changed_since() { { git diff --name-only "$1"; git ls-files --others --exclude-standard; } | sort -u; }

# What ccache knows of one checkout serves another; what a source includes it has from the compiler, not from a second
# pass of the preprocessor.
export CCACHE_BASEDIR=$project CCACHE_NOHASHDIR=true CCACHE_DEPEND=true

# minutes SECONDS: as `7 s` or `2 min 5 s`.
minutes() { if [ "$1" -lt 60 ]; then echo "$1 s"; else echo "$(($1 / 60)) min $(($1 % 60)) s"; fi; }

# build DIR TARGET...: builds, and says how far it is: on a terminal in one line, elsewhere in a line every 20 seconds. What
# compilers say is shown.
build() {
  # Batches of sources take about as long as one another, so that their number tells the time that is left.
  NINJA_STATUS="[%f %t %e] " cmake --build "$1" -j "$(nproc)" --target "${@:2}" 2>&1 </dev/null | {
    local line done all seconds left said=0 clear=
    if [ -t 2 ]; then clear=$'\r\033[K'; fi
    while IFS= read -r line; do
      if [[ ! $line =~ ^\[([0-9]+)\ ([0-9]+)\ ([0-9]+)\. ]]; then
        printf '%s%s\n' "$clear" "$line"
        continue
      fi
      done=${BASH_REMATCH[1]} all=${BASH_REMATCH[2]} seconds=${BASH_REMATCH[3]}
      left=
      if [ "$done" -gt 3 ] && [ "$done" -lt "$all" ]; then left=", $(minutes $((seconds * (all - done) / done))) left"; fi
      if [ -n "$clear" ]; then
        printf '%scompiling: %d of %d steps%s' "$clear" "$done" "$all" "$left"
      elif [ $((seconds - said)) -ge 20 ]; then
        printf 'compiling: %d of %d steps%s\n' "$done" "$all" "$left"
        said=$seconds
      fi
    done
    printf '%s' "$clear"
  } >&2
}

# configure BINARY_DIR OPTIONS...: a cmake run, with ccache if there is one.
configure() {
  local options=(-S . -B "$@")
  if command -v ccache >/dev/null; then options+=(-DCMAKE_CXX_COMPILER_LAUNCHER=ccache); fi
  quietly cmake "${options[@]}"
}

# hashes_of BUILD: what result_hashes of a build prints, by as many processes as there are cores.
hashes_of() {
  seq 0 $(($(nproc) - 1)) | xargs -P 0 -I PART "$1/bin/result_hashes" PART "$(nproc)" | sort
}

# compare_hashes BUILD OTHER...: whether the programs of these builds compute the same, bit by bit.
compare_hashes() {
  local expected other
  export ASAN_OPTIONS=detect_leaks=0:detect_stack_use_after_return=0 SYSTEMC_DISABLE_COPYRIGHT_MESSAGE=1
  expected=$(hashes_of "$1")
  [ "$(wc -l <<<"$expected")" -eq 74 ]
  for other in "${@:2}"; do
    if ! diff <(echo "$expected") <(hashes_of "$other") >&2; then
      say "$other gives other results than $1"
      return 1
    fi
  done
}
