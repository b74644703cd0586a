"""What a command used, measured by a process that is itself small.

    python benchmarks/used.py COMMAND ARGUMENT ...

Prints seconds of processor time, seconds by the clock and the peak of the memory [GiB] as JSON. Linux counts the memory
that a process had before it became the command, so that one started by a large program seems as large.
"""

import json
import os
import sys
import time

begin = time.perf_counter()
pid = os.posix_spawnp(sys.argv[1], sys.argv[1:], os.environ, file_actions=[(os.POSIX_SPAWN_DUP2, 2, 1)])
_, status, spent = os.wait4(pid, 0)
told = {"processor": spent.ru_utime + spent.ru_stime, "clock": time.perf_counter() - begin}
print(json.dumps({**told, "peak_gib": spent.ru_maxrss / 2**20}))
sys.exit(os.waitstatus_to_exitcode(status))
