#!/usr/bin/env bash
# Makes docs/scenes.md's reference, its pictures (frame, true background and mask by three sources of
# one seed) and its table of times anew. Takes some minutes.
set -euo pipefail
cd "$(dirname "$0")/.."

tests/install-dependencies.sh build test
again=()
[ ! -f build/build.ninja ] || again=(--reconfigure)
meson setup "${again[@]}" build -Dtests=enabled -Dscene=enabled >/dev/null
ninja -C build gst/libgstqdmdscene.so tests/scenes/scene-table tests/bench/scene

export GST_PLUGIN_PATH_1_0="$PWD/build/gst" GST_REGISTRY_1_0="$PWD/build/docs-registry.bin"
reference=$(mktemp)
times=$(mktemp)
trap 'rm -f "$reference" "$times"' EXIT
build/tests/scenes/scene-table >"$reference"

# The frame at which a scene shows what it is about; 60 where nothing else is said.
frame_of() {
  case "$1" in
    low-rate | very-short) echo 4 ;;
    abandon) echo 90 ;;
    remove | intermittent-motion) echo 190 ;;
    bands) echo 61 ;;
    fade) echo 180 ;;
    light-switch | illumination-changes) echo 135 ;;
    exposure) echo 100 ;;
    *) echo 60 ;;
  esac
}

mkdir -p docs/images/scenes
mapfile -t names < <(sed -n 's/^### //p' "$reference")
for name in "${names[@]}"; do
  printf '\rpictures: %-24s' "$name" >&2
  effects=
  # The gain is only seen where the light changes.
  [ "$name" != exposure ] || effects=effects=light-switch
  source="qdmdscenesrc scene=$name $effects seed=7 num-buffers=$(($(frame_of "$name") + 1))"
  caps="video/x-raw,width=320,height=240"
  # Every frame is written over the one before.
  gst-launch-1.0 -q compositor name=side sink_1::xpos=320 sink_2::xpos=640 ! videoconvert ! \
    videoscale method=lanczos ! video/x-raw,width=720,height=180,pixel-aspect-ratio=1/1 ! \
    jpegenc quality=80 ! multifilesink location="docs/images/scenes/$name.jpg" \
    $source ! $caps ! side.sink_0 \
    $source truth=background ! $caps ! side.sink_1 \
    $source truth=mask ! $caps ! side.sink_2
done
echo >&2

build/tests/bench/scene --benchmark_repetitions=5 --benchmark_report_aggregates_only=true \
  --benchmark_enable_random_interleaving=true --benchmark_min_time=0.05 \
  --benchmark_format=json >"$times"

/usr/bin/python3 - docs/scenes.md "$reference" "$times" <<'PYTHON'
import json
import re
import sys

page, reference, times = sys.argv[1:]
text = open(page).read()


def put(name, content):
    global text
    start, end = f'<!-- {name} -->', f'<!-- end of {name} -->'
    text, count = re.subn(re.escape(start) + '.*?' + re.escape(end),
                          lambda _: f'{start}\n{content.strip()}\n{end}', text, flags=re.S)
    if count != 1:
        sys.exit(f'{page} has no place for {name}')


medians, ratios = {}, {}
for run in json.load(open(times))['benchmarks']:
    if run.get('aggregate_name') != 'median':
        continue
    name, width, height = re.match(r'([^/]+)/width:(\d+)/height:(\d+)', run['run_name']).groups()
    size = f'{width}x{height}'
    medians.setdefault(name, {})[size] = run['real_time']
    if 'ratio' in run:
        ratios[size] = run['ratio']
medians.pop('default_against_bare_loop')
sizes = list(ratios)
rows = ['| scene | ' + ' | '.join(f'{s}: us a frame | beside `default`' for s in sizes) + ' |',
        '|---' * (1 + 2 * len(sizes)) + '|']
order = ['default', 'default_with_truth'] + re.findall('^### (.*)$', open(reference).read(), re.M)
for name, by_size in sorted(medians.items(), key=lambda item: order.index(item[0])):
    cells = [f'{by_size[s]:.1f} | +{max(by_size[s] - medians["default"][s], 0):.1f}' for s in sizes]
    rows.append(f'| {name.replace("_", " ")} | ' + ' | '.join(cells) + ' |')
bare = ', '.join(f'{ratio:.3f} at {size}' for size, ratio in ratios.items())
rows.append('')
rows.append('`default` against a loop that only paints background and mover, in turn in one run, '
            f'median over median: {bare}.')
put('reference', open(reference).read())
put('times', '\n'.join(rows))
open(page, 'w').write(text)
PYTHON
