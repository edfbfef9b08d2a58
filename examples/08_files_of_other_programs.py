"""A network of another program, read and adjusted; and what is wrong with a file, in a sentence.

The levelling net is written as GNU Gama would: any of its files does as well.
"""

import tempfile
from pathlib import Path

import tribrach as tb
from tribrach.errors import InputError

GAMA = """<?xml version="1.0"?>
<gama-local xmlns="http://www.gnu.org/software/gama/gama-local"><network>
<parameters sigma-apr="1" />
<points-observations distance-stdev="5" direction-stdev="10">
<point id="A" z="100.000" fix="z" /><point id="B" adj="z" /><point id="C" adj="z" />
<height-differences>
<dh from="A" to="B" val="1.2340" stdev="1.0" />
<dh from="B" to="C" val="0.8652" stdev="1.0" />
<dh from="C" to="A" val="-2.1005" stdev="1.0" />
</height-differences>
</points-observations></network></gama-local>
"""

with tempfile.TemporaryDirectory() as folder:
    file = Path(folder) / "levelling.gkf"
    file.write_text(GAMA, encoding="utf-8")
    print(tb.adjust(file).summary())

    file.write_text(GAMA.replace('stdev="1.0" />', 'stdev="-1.0" />', 1), encoding="utf-8")
    try:
        tb.adjust(file)
    except InputError as error:
        print(str(error).replace(folder, "…"))
