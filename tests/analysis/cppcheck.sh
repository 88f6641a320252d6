#!/usr/bin/env bash
# cppcheck on own code: cppcheck.sh OUT_DIR          every file by itself, then all of the drive's code as one
#                       cppcheck.sh OUT_DIR FILE     FILE alone: finds what its comments `// finds: ID` say, line by line,
#                                                    and nothing else
# What is switched off, with reasons: cppcheck-suppressions.txt. Exit 1 where anything is found, 77 without cppcheck.
set -euo pipefail
out=${1:?usage: cppcheck.sh OUT_DIR [FILE]} seeded=${2:-}
here=$(cd -- "$(dirname -- "${BASH_SOURCE[0]}")" && pwd)
root=$(cd -- "$here/../.." && pwd)
command -v cppcheck >/dev/null || {
  echo "cppcheck.sh: Skipped"
  echo "cppcheck is not installed (Debian: cppcheck)"
  echo "[  SKIPPED ]"
  exit 77
}

# cppcheck 2.10 gives a file up at the template head of a lambda, and at some uses of the word `template` behind a name;
# without them it reads on. Lines stay where they are.
readable() {
  sed -E 's/(\[[&=a-z_, ]*\])<((class|typename|std::size_t)[^>]*)>\(/\1(/; s/(::|\.|->)template /\1/g' "$1" >"$2"
}
check() {
  cppcheck --quiet --std=c++20 --language=c++ --enable=warning,style,performance,portability --suppress=missingIncludeSystem \
    --suppressions-list="$here/cppcheck-suppressions.txt" --template='{file}:{line}: {id}: {message}' --template-location='' "$@" 2>&1
}

rm -rf "$out/source"
mkdir -p "$out/source/tests/analysis"
if [[ -n $seeded ]]; then
  name=$(basename "$seeded")
  readable "$seeded" "$out/source/$name"
  cd "$out/source"
  check "$name" | sed -E 's/^([^:]*):([0-9]+): ([A-Za-z]+):.*/\2 \3/' | sort -n >../found.txt
  awk '{ if (match($0, /\/\/ finds: /)) print FNR, substr($0, RSTART + RLENGTH) }' "$name" | sort -n >../expected.txt
  [[ -s ../expected.txt ]] || {
    echo "$seeded says of no line what is found in it" >&2
    exit 2
  }
  diff ../expected.txt ../found.txt
  echo "found all $(wc -l <../found.txt) faults"
  exit 0
fi

cd "$root"
while IFS= read -r file; do
  mkdir -p "$out/source/$(dirname "$file")"
  readable "$file" "$out/source/$file"
  echo "$file"
done < <(find shared firmware boards hil host -name '*.cpp' -o -name '*.hpp' | sort) >"$out/files.txt"
readable tests/analysis/drive_headers.cpp "$out/source/tests/analysis/drive_headers.cpp"

cd "$out/source"
# cppcheck keeps what it found in a file until that file changes; here also until options, suppressions or cppcheck change.
key=$({ cat "$here/cppcheck.sh" "$here/cppcheck-suppressions.txt" && cppcheck --version; } | sha256sum)
if [[ $(cat ../kept/key 2>/dev/null) != "$key" ]]; then
  rm -rf ../kept
  mkdir -p ../kept/files ../kept/drive
  echo "$key" >../kept/key
fi
{
  check --cppcheck-build-dir=../kept/files --file-list=../files.txt
  check --cppcheck-build-dir=../kept/drive -I. tests/analysis/drive_headers.cpp
} | sort -u >../findings.txt
cat ../findings.txt
[[ ! -s ../findings.txt ]] || {
  echo "correct the code where a finding is right; a wrong finding goes into tests/analysis/cppcheck-suppressions.txt with its reason"
  exit 1
}
echo "$(wc -l <../files.txt) files, nothing found"
