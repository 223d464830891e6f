# What tests of programs say of a command; sourced by them, with the folder of the programs as $1. They run in a folder
# of their own, which is gone at the end, and end with finish.
set -uo pipefail
bin=$(realpath "$1")
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work" || exit 1
export KALMARM_CACHE=$work/cache
failures=0
fail() {
  echo "FAILED: $*" >&2
  failures=$((failures + 1))
}
finish() {
  ((failures == 0)) && echo "all checks passed"
  exit $((failures > 0))
}

# expect_ok COMMAND…: exit 0
expect_ok() { "$@" >out 2>err || fail "$* -> exit $?: $(cat err)"; }

# expect_error WORD COMMAND…: exit 2, and one line on stderr that starts with the program's name and has the word
expect_error() {
  local word=$1 code
  shift
  "$@" 2>err
  code=$?
  [[ $code == 2 ]] || fail "$* -> exit $code instead of 2"
  [[ $(wc -l <err) == 1 ]] || fail "$* -> $(wc -l <err) lines on stderr: $(cat err)"
  grep -q "^$(basename "$1"): error: " err || fail "$* -> $(cat err)"
  grep -qF -- "$word" err || fail "$* -> no '$word' in: $(cat err)"
}

# expect_refused WORD COMMAND…: the same, and no output file, whole or in part
expect_refused() {
  rm -f refused*
  expect_error "$@" >out
  [[ -z $(find . -name 'refused*') ]] || fail "${*:2} -> left a file behind"
}

json() { python3 -c "import json,sys; d=json.load(open(sys.argv[1])); print(($2))" "$1"; }
expect_equal() { [[ $1 == "$2" ]] || fail "expected $2, got $1"; }
