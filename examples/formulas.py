"""The velocity model in symbols, and as C."""

import tempfile

import bodyplan as bp

legs = bp.silo4().symbolic()
print(legs.forward("fl.foot")[2, 3])
with tempfile.TemporaryDirectory() as folder:
    for path in legs.c_source().write(folder):
        print(path.name, len(path.read_text().splitlines()), "lines")
