"""A process that analyses recordings: a task a line on stdin, its result a line on stdout.

It ends when its stdin is closed.
"""

import json
import os
import sys

from edge_ident.fleet.analysis import analyse


def main() -> None:
    """Analyse until there is nothing more to do."""
    answers = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)  # what a library prints is no answer
    for line in sys.stdin:
        task = json.loads(line)
        print(json.dumps(analyse(task["file"], task["options"])), file=answers, flush=True)


if __name__ == "__main__":
    main()
