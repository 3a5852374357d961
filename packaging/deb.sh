#!/usr/bin/env bash
# A Debian package of the program, which has its scenes within itself, its manual's pages and completions: target/debian/*.deb.
# Needs cargo-deb (`cargo install cargo-deb --locked`).
set -euo pipefail
cd "$(dirname "$0")/.."
cargo build --locked --release --bin gnss-twin
out=target/release
rm -rf "$out/man" "$out/completions"
mkdir -p "$out/man" "$out/completions"
"$out/gnss-twin" man --out "$out/man"
# As Debian has them: packed, and without the time of packing.
gzip -9n "$out"/man/*.1
gzip -9nc CHANGELOG.md >"$out/changelog.gz"
"$out/gnss-twin" completions bash >"$out/completions/gnss-twin"
"$out/gnss-twin" completions zsh >"$out/completions/_gnss-twin"
"$out/gnss-twin" completions fish >"$out/completions/gnss-twin.fish"
cargo deb --locked --no-build
