#!/usr/bin/env bash
# Puts the tables and pictures of docs/robust.md anew. Needs the sequences: QDMD_DATA names the
# folder that has SBI, SBMnet and CDnet. Takes some ten minutes.
set -euo pipefail
cd "$(dirname "$0")/.."

if [ -z "${QDMD_DATA:-}" ] && [ -d ../shared/data ]; then QDMD_DATA=$(cd ../shared/data && pwd); fi
[ -d "${QDMD_DATA:-}/SBI" ] ||
  { echo "Set QDMD_DATA to the folder that has SBI, SBMnet and CDnet." >&2; exit 1; }

tests/install-dependencies.sh build test demo
again=()
[ ! -f build/build.ninja ] || again=(--reconfigure)
meson setup "${again[@]}" build -Dtests=enabled -Dscene=enabled >/dev/null
ninja -C build gst/libgstqdmd.so gst/libgstqdmdscene.so tests/evaluation/qdmd-evaluate \
  tests/evaluation/qdmd-robust-ablation

results=build/robust
rm -rf "$results"
mkdir -p "$results"
export GST_REGISTRY_1_0="$PWD/$results/registry.bin" GST_PLUGIN_PATH="$PWD/build/gst"
evaluate=(build/tests/evaluation/qdmd-evaluate --in-process)
at_most=(--dataset "$QDMD_DATA" --jobs 1 --thin 300 --format json)

echo "== methods" >&2
"${evaluate[@]}" "${at_most[@]}" >"$results/whole.json"
echo "== orders and rates" >&2
"${evaluate[@]}" "${at_most[@]}" --methods robust --reverse >"$results/reversed.json"
"${evaluate[@]}" "${at_most[@]}" --methods robust --every 2 >"$results/every-second.json"
echo "== ablation" >&2
build/tests/evaluation/qdmd-robust-ablation --dataset "$QDMD_DATA" >"$results/ablation.md"

# Frames of the sequences may not be shown; simulated ones and Debian's street scene may.
echo "== pictures" >&2
# sheet NAME PICTURE: of the methods' backgrounds at the middle or last frame, as
# docs/images/robust-NAME.jpg.
sheet() {
  # Without truth it ends with 1.
  "${evaluate[@]}" --dataset "$results/$1" --methods robust,qdmd,dmd,median \
    --picture "$2" --output-dir "$results/$1-out" >/dev/null || [ -f "$results/$1-out/$1_sheet.png" ]
  gst-launch-1.0 -q filesrc location="$results/$1-out/$1_sheet.png" ! pngdec ! videoconvert ! \
    videoscale method=lanczos ! video/x-raw,width=1400,pixel-aspect-ratio=1/1 ! \
    jpegenc quality=82 ! filesink location="docs/images/robust-$1.jpg"
}
# 20 seconds of a scene in which a bag is left, and of one in which the light fades.
caps="video/x-raw,width=320,height=240,framerate=5/1"
for scene in abandon fade; do
  folder=$results/$scene
  mkdir -p "$folder/input" "$folder/gt"
  effects=$scene picture=middle frames=50
  [ "$scene" != fade ] || { effects="basic,fade=0.4:duration=20" picture=last frames=100; }
  gst-launch-1.0 -q qdmdscenesrc scene="$effects" seed=7 num-buffers=100 ! $caps ! videoconvert ! \
    pngenc ! multifilesink location="$folder/input/%06d.png"
  # Every frame is written over the one before: the one that is scored stays.
  gst-launch-1.0 -q qdmdscenesrc scene="$effects" seed=7 truth=background num-buffers="$frames" ! $caps ! \
    videoconvert ! pngenc ! multifilesink location="$folder/gt/GT_$scene.png"
  sheet "$scene" "$picture"
done
video=$QDMD_DATA/videos/vtest.avi
[ -f "$video" ] || video=build/vtest.avi
if [ -f "$video" ]; then
  mkdir -p "$results/street/input"
  gst-launch-1.0 -q filesrc location="$video" ! decodebin ! videoconvert ! videorate ! \
    video/x-raw,framerate=5/2 ! jpegenc quality=95 ! \
    multifilesink location="$results/street/input/%06d.jpg"
  sheet street middle
fi

/usr/bin/python3 - docs/robust.md "$results" <<'PYTHON'
import json
import re
import sys

page, results = sys.argv[1:]
text = open(page).read()


def load(name):
    return json.load(open(f'{results}/{name}.json'))


def put(name, table):
    global text
    start, end = f'<!-- {name} -->', f'<!-- end of {name} -->'
    text, count = re.subn(start + '.*?' + end, lambda _: f'{start}\n{table.strip()}\n{end}', text,
                          flags=re.S)
    if count != 1:
        sys.exit(f'{page} has no place for {name}')


def ages(rows, method):
    return {row['sequence']: row['AGE'] for row in rows if row['method'] == method}


def line(name, values):
    values = list(values)
    cells = [f'{value:.2f}' for value in values] + [f'**{sum(values) / len(values):.2f}**']
    return f'| {name} | ' + ' | '.join(cells) + ' |\n'


whole = load('whole')
methods = list(dict.fromkeys(row['method'] for row in whole))
sequences = list(ages(whole, methods[0]))
head = '| AGE | ' + ' | '.join(s.split('/')[-1] for s in sequences) + ' | **mean** |\n'
head += '|---' * (len(sequences) + 2) + '|\n'
put('methods', head + ''.join(line(m, ages(whole, m).values()) for m in methods))
put('orders', head + line('robust', ages(whole, 'robust').values())
    + ''.join(line(f'robust, {name}', ages(load(file), 'robust').values())
              for name, file in (('reversed', 'reversed'), ('every second frame', 'every-second'))))

masks = '| sequence | method | precision | recall | F |\n|---|---|---|---|---|\n'
for row in whole:
    if row['F'] is not None and row['method'] in ('robust', 'qdmd', 'mog2', 'knn'):
        numbers = ' | '.join(f"{row[k]:.3f}" for k in ('precision', 'recall', 'F'))
        masks += f"| {row['sequence'].split('/')[-1]} | {row['method']} | {numbers} |\n"
put('masks', masks)
put('ablation', open(f'{results}/ablation.md').read())
open(page, 'w').write(text)
PYTHON
