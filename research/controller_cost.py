"""What one step of an exported controller costs: instructions (callgrind), stack (gcc), code and constants (size).

    python research/controller_cost.py CONTROLLER.c [...]

Needs gcc, binutils and valgrind. The instructions are counted on the machine that it runs on, over random readings, the
largest count of them given; they hold the C library's sin, cos, sqrt and atan2, the only part that branches.
"""

from __future__ import annotations

import re
import subprocess
import sys
import tempfile
from pathlib import Path

STEPS = 200
_DRIVER = r"""
#include <stdlib.h>
#include <valgrind/callgrind.h>
#include CONTROLLER
#define COUNT(a) ((int)(sizeof(a) / sizeof((a)[0])))
static REAL memory[COUNT(swash_memory)], measured[MEASURED], reference[8], command[COMMANDS];
static REAL within(double low, double high) { return (REAL)(low + (high - low) * rand() / (double)RAND_MAX); }
int main(void) {
  int i, k;
  for (k = 0; k < COUNT(memory); ++k) memory[k] = swash_memory[k];
  for (i = 0; i < STEPS; ++i) {
    for (k = 0; k < MEASURED; ++k) measured[k] = within(-0.5, 0.5);
    measured[MEASURED - 1] = within(10.5, 12.5);
    for (k = 0; k < 8; ++k) reference[k] = within(-0.5, 0.5);
    if (i == 0) swash_step(memory, measured, reference, command); /* the linker finds the library's functions */
    CALLGRIND_ZERO_STATS;
    swash_step(memory, measured, reference, command);
    CALLGRIND_DUMP_STATS;
  }
  return 0;
}
"""


def run(*command: str | Path, cwd: Path) -> str:
    return subprocess.run(list(map(str, command)), cwd=cwd, check=True, capture_output=True, text=True).stdout


def cost(source: Path) -> dict[str, float]:
    """Instructions of a step (median and most), bytes of code with constants, stack, and RAM in all."""
    text = source.read_text(encoding="utf-8")
    arguments = re.search(
        r"void swash_step\((\w+) memory\[(\d+)\], const \w+ measured\[(\d+)\].*?command\[(\d+)\]", text, re.DOTALL
    )
    if arguments is None:
        raise SystemExit(f"{source} has no swash_step over memory, measured, reference and command")
    real, memory, measured, commands = arguments.groups()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "driver.c").write_text(_DRIVER, encoding="utf-8")
        flags = [f"-DREAL={real}", f"-DMEASURED={measured}", f"-DCOMMANDS={commands}", f"-DSTEPS={STEPS}"]
        flags.append(f'-DCONTROLLER="{source.resolve()}"')
        run("gcc", "-std=c99", "-O2", *flags, "driver.c", "-o", "driver", "-lm", cwd=folder)
        run("gcc", "-std=c99", "-O2", "-c", "-fstack-usage", source.resolve(), "-o", "step.o", cwd=folder)
        stack = sum(int(line.split("\t")[1]) for line in (folder / "step.su").read_text().splitlines())
        text_size, data, bss, *_ = map(int, run("size", "step.o", cwd=folder).splitlines()[1].split()[:3])
        run("valgrind", "--tool=callgrind", "--callgrind-out-file=out", "./driver", cwd=folder)
        summaries = [re.search(r"^summary: (\d+)", p.read_text(), re.MULTILINE) for p in folder.glob("out.*")]
    counts = sorted(int(m[1]) for m in summaries if m and int(m[1]) > 0)
    if len(counts) > STEPS:  # the dump at the end of the program holds no step
        counts = counts[1:]
    carried = int(memory) * (8 if real == "double" else 4)
    ram = carried + stack + data + bss
    return {"median": counts[len(counts) // 2], "most": counts[-1], "stack": stack, "code": text_size, "ram": ram}


if __name__ == "__main__":
    print(f"{'controller':20}{'instructions':>14}{'(median)':>11}{'code [B]':>10}{'stack [B]':>11}{'RAM [B]':>10}")
    for path in map(Path, sys.argv[1:]):
        c = cost(path)
        numbers = f"{c['most']:14.0f}{c['median']:11.0f}{c['code']:10.0f}{c['stack']:11.0f}{c['ram']:10.0f}"
        print(f"{path.stem:20}{numbers}")
