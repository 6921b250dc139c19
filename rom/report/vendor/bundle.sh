#!/bin/sh
# Makes three.min.js again, byte for byte; needs npm and, once, the network.
set -eu
here=$(cd "$(dirname "$0")" && pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
npm install --silent --no-save --no-audit --no-fund three@0.187.0 esbuild@0.28.2
cp "$here/three_part.js" .
banner="/*! three.js 0.187.0
$(cat node_modules/three/LICENSE)
*/"
node_modules/.bin/esbuild three_part.js --bundle --minify --format=iife --global-name=THREE \
  --legal-comments=none --target=es2020 --banner:js="$banner" --outfile="$here/three.min.js"
cp node_modules/three/LICENSE "$here/three.LICENSE"
sha256sum "$here/three.min.js"
