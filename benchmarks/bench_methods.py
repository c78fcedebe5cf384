"""Time smoothing alone, by the paper's method beside `proportional`: ``bench_methods.py FILE [FORM METHOD]``.

Each form and method is a process of its own, so that its peak of memory is its own. Reading the file is not in the
times, but in the memory.
"""

import resource
import subprocess
import sys
import time

from cornersmooth import Settings, choose_form, read, smooth

FORMS = ("g6.2", "g1")
METHODS = ("proportional", "zhang2016")
TOLERANCE, AXIS_LENGTH = 0.01, 10.0  # mm


def measure(file: str, form: str, method: str) -> None:
    """Print seconds of processor time for smoothing, and MB at the peak."""
    program = read(file)
    settings = Settings(tolerance=TOLERANCE, axis_length=AXIS_LENGTH, method=method)
    start = time.process_time()
    smooth(program, settings, form=choose_form("fanuc", form), processes=1)
    taken = time.process_time() - start
    print(taken, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024)


def main() -> None:
    """Time both methods in both forms in turn, and print a line a form."""
    if len(sys.argv) > 2:
        measure(*sys.argv[1:])
        return
    for form in FORMS:
        lines = []
        for method in METHODS:
            command = [sys.executable, __file__, sys.argv[1], form, method]
            lines.append(subprocess.run(command, check=True, capture_output=True, text=True).stdout.split())
        (plain, _), (paper, memory) = ([float(word) for word in line] for line in lines)
        print(
            f"smoothing alone {form:5} proportional {plain:6.2f} s, zhang2016 {paper:6.2f} s of processor time: "
            f"{paper / plain:.1f} times, {memory:.0f} MB",
            flush=True,
        )


if __name__ == "__main__":
    main()
