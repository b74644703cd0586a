#!/usr/bin/env bash
# Installs what the tests need from Debian: Chromium (the report and the live page are opened in it; without the
# windows of a browser, where Debian has it so), npm (it fetches the live page's libraries), a C compiler, make
# and venv.
# Does nothing where all of it is there; asks sudo where it is not run by root.
set -euo pipefail

missing=()
command -v chromium-headless-shell > /dev/null || command -v chromium > /dev/null || missing+=(chromium)
command -v npm > /dev/null || missing+=(nodejs npm)
command -v gcc > /dev/null || missing+=(gcc libc6-dev)
command -v make > /dev/null || missing+=(make)
python3 -c 'import ensurepip, venv' 2> /dev/null || missing+=(python3-venv)

if [ "${#missing[@]}" -eq 0 ]; then
    exit 0
fi
if ! command -v apt-get > /dev/null; then
    echo "These are missing and this is no Debian system: ${missing[*]}. Install them and try again." >&2
    exit 1
fi
as_root=()
if [ "$(id -u)" -ne 0 ]; then
    as_root=(sudo)
fi
export DEBIAN_FRONTEND=noninteractive
"${as_root[@]}" apt-get update -qq
if apt-cache show chromium-headless-shell > /dev/null 2>&1; then
    missing=("${missing[@]/%chromium/chromium-headless-shell}")
fi
"${as_root[@]}" apt-get install -y -qq --no-install-recommends "${missing[@]}"
