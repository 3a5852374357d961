#!/usr/bin/env python3
"""Published figures and where they come from: `reports/evidence.csv` has each one, prose shows it by a marker (`tests/ledger/prose.py`).

usage: tests/evidence.py                    checks markers, numbers without a source, rows of the ledger against today's code
       tests/evidence.py --write            fills the markers from the ledger, and says in pages which of their figures are stale
       tests/evidence.py --list             lists ids that prose names and the ledger lacks, and numbers without a source
       tests/evidence.py --make [PREFIX…]   makes the figures whose ids or pages begin so (all without one), and writes the ledger
       tests/evidence.py --compare [PREFIX…]   makes runs of scenes and counts, and compares them with the ledger
       tests/evidence.py --confirm [STUDY…] makes some cases of studies with stale figures again: the page is today's where no digit differs
       tests/evidence.py --self-test        plants faults in a small repository; each must be reported
       GNSS_TWIN names the program that is measured.
exit:  0 all as it must be; 1 not, each finding with its file, line and cure; 2 a wrong command line.
"""

import sys
from pathlib import Path

# Modules of the ledger import one another by name; nothing is cached beside the sources.
sys.dont_write_bytecode = True
sys.path.insert(0, str(Path(__file__).resolve().parent / "ledger"))
import check  # noqa: E402
import make  # noqa: E402
import renew  # noqa: E402


def main(arguments):
    if arguments[:1] == ["--self-test"]:
        import self_test

        return self_test.run()
    from figures import FIGURES

    match arguments:
        case []:
            found, warnings = check.check(make.ROOT, FIGURES)
            for text in warnings:
                print(f"warning: {text}", file=sys.stderr)
            for text in found:
                print(text)
            table = check.read(make.ROOT)
            missed = sum(row["met"] == "no" for row in table.values())
            print(f"evidence: {len(table)} figures, {missed} miss their bar, {len(warnings)} stale and said so; {len(found)} findings")
            return bool(found)
        case ["--write"]:
            print("\n".join(check.write(make.ROOT, FIGURES)) or "nothing to write")
            return 0
        case ["--list"]:
            check.list_open(make.ROOT, FIGURES)
            return 0
        case ["--make", *prefixes]:
            return renew.make_all(FIGURES, prefixes)
        case ["--confirm", *names]:
            import confirm

            return confirm.confirm(FIGURES, names)
        case ["--compare", *prefixes]:
            return renew.compare(FIGURES, prefixes)
    print(__doc__, file=sys.stderr)
    return 2


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
