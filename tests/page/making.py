"""Paths and pages for the tests of pages."""

from __future__ import annotations

import base64
import gzip
import json
import re

import numpy as np

from cornersmooth import Settings, read
from cornersmooth.page import smoothed_page
from cornersmooth.pipeline import Result, postprocess
from cornersmooth.times import planned_saving

#: a zigzag with corners of several kinds: rounded ones, a reversal, a turn of the axis alone
PATH = """TOOL PATH/{name},TOOL,T
TLDATA/MILL,8.0000,4.0000,60.0000,0.0000,0.0000
$$ {comment}
RAPID
GOTO/-10.0,0.0,20.0,0.0,0.0,1.0
RAPID
GOTO/0.0,0.0,5.0
FEDRAT/MMPM,1500.0
GOTO/0.0,0.0,0.0
GOTO/20.0,0.0,0.0
GOTO/20.0,15.0,0.0,0.0871557,0.0,0.9961947
GOTO/5.0,15.0,1.0
GOTO/18.0,15.2,1.0
GOTO/18.0,30.0,2.0,0.1736482,0.0,0.9848078
GOTO/0.0,30.0,2.0
GOTO/0.0,45.0,2.0,0.0,0.0,1.0
RAPID
GOTO/0.0,45.0,20.0
END-OF-PATH
"""

HOSTILE = (
    "</script><script>document.title='taken'</script>\"'`${1}{{styles}}<img src=x onerror=alert(1)>&amp;" + "x" * 10000
)


def smoothed(
    path: str = PATH,
    *,
    name: str = "PART",
    comment: str = "none",
    source: str = "part.cls",
    method: str = "proportional",
    form: object = None,
    **settings: float,
) -> Result:
    """Run of a path in memory."""
    import io

    text = path.format(name=name, comment=comment).encode()
    kept = Settings(tolerance=0.02, method=method, **settings)
    return postprocess(read(text, name=source), io.BytesIO(), kept, form=form)


def page_of(result: Result, **more: object) -> str:
    """Page of a run, with its planned time where it is good."""
    saving = None
    if result.verdict == "PASSED":
        saving = planned_saving(result.program, result.smoothed.settings, result.form, axes=more.get("axes"))
    contents = result.report(saving=saving, limits=more.get("axes"))
    return smoothed_page(result, contents, saving=saving, **more)  # type: ignore[arg-type]


def values_of(page: str) -> tuple[dict[str, object], dict[str, np.ndarray]]:
    """What the scripts of a page read: plain values and arrays."""
    meta = json.loads(re.search(r'<script type="application/json" id="values">(.*?)</script>', page, re.S)[1])
    packed = re.search(r'<script type="application/octet-stream" id="arrays">(.*?)</script>', page, re.S)[1]
    data = gzip.decompress(base64.b64decode(packed))
    kinds = {"f4": "<f4", "i4": "<i4", "u1": "u1"}
    arrays = {}
    for key, entry in meta["arrays"].items():
        count = entry["count"] * entry["width"]
        array = np.frombuffer(data, kinds[entry["type"]], count, entry["at"])
        arrays[key] = array if entry["width"] == 1 else array.reshape(-1, entry["width"])
    return meta, arrays
