#!/usr/bin/env bash
# A Debian package of the program, its manual's pages, completions and scenes: target/debian/*.deb. Needs cargo-deb
# (`cargo install cargo-deb`).
set -euo pipefail
cd "$(dirname "$0")/.."
cargo build --locked --profile dist --bin gnss-twin
out=target/dist
mkdir -p "$out/man" "$out/completions"
"$out/gnss-twin" man --out "$out/man"
"$out/gnss-twin" completions bash >"$out/completions/gnss-twin"
"$out/gnss-twin" completions zsh >"$out/completions/_gnss-twin"
"$out/gnss-twin" completions fish >"$out/completions/gnss-twin.fish"
cargo deb --locked --no-build --profile dist
