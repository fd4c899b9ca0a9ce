#!/bin/sh
# Removes what no run of odscen needs of SUMO's packages, and keeps once what both have of the same
# libraries. SUMO's own windows are gone then. See docs/ci.md.
set -eu
cd "$(python -c 'import sysconfig; print(sysconfig.get_path("purelib"))')"
for file in libsumo.libs/*; do
    same="eclipse_sumo.libs/${file##*/}"
    if cmp -s "$file" "$same"; then ln -f "$same" "$file"; fi
done
rm -rf sumo_data sumo/data sumo/lib64 sumo/bin/sumo-gui sumo/bin/netedit
rm -rf sumo/tools/contributed sumo/tools/game
