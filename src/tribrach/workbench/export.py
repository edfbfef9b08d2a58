"""The page with its data as a folder that any web server can give out.

The same page and the same files as from the command: it finds no session there and is read only. A
server without ranges will do as long as clouds are small enough to be loaded whole.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path

import numpy as np

from tribrach._types import Progress
from tribrach.errors import InputError
from tribrach.io.keeping import keeping, refuse_loss
from tribrach.io.outputs import copy_file, write_texts
from tribrach.job.state import PICTURES
from tribrach.scratch import scratch_folder
from tribrach.workbench.clouds import (
    SceneCloudFile,
    cloud_parts,
    convert_clouds,
    convert_further,
    lacking_clouds,
    written_clouds,
)
from tribrach.workbench.epochs import read_epochs
from tribrach.workbench.further import further_names
from tribrach.workbench.relative import named_joint
from tribrach.workbench.result_folder import CLOUDS, ResultFolder, read_result
from tribrach.workbench.scene import scene_of
from tribrach.workbench.schema import FORM, SceneJoint
from tribrach.workbench.sources import PointSources
from tribrach.workbench.static_files import PAGE, page_files
from tribrach.workbench.tables import TABLES, table_csv, table_json, table_of

#: the joint covariance of what has a name
JOINT = "joint.f64"
_README = """This folder is a page of Tribrach: {title}.

It is looked at with a browser and needs a web server; a browser does not load such pages from
the disk (file://). On this machine:

    python -m http.server 8000 --bind 127.0.0.1 --directory .

and then http://127.0.0.1:8000/ in the browser. Any other web server does as well, with two things
to know:

* The clouds (clouds/*.copc.laz) are loaded in parts if the server answers ranges, and whole if it
  does not, as the one above; then they should not be larger than 200 MB.
* The server must send the files as they are: do not let it compress .laz or .wasm on the way.

Everything is in this folder; the page asks no other server for anything. Tables are in tables/ as
JSON and CSV, the scene in scene.json. Sigmas of distances between points and stations are there;
those of distances to single points of a cloud, and error budgets, need the program:
tribrach view FOLDER-OF-RESULTS.
"""


def export_page(
    folder: Path,
    out: Path,
    progress: Progress,
    *,
    overwrite: bool = False,
    further: Sequence[Path] = (),
    epochs: Path | None = None,
) -> int:
    """Write the page and its data."""
    pages = page_files()
    if PAGE not in pages:
        raise InputError(
            "the page of the workbench is not in this installation",
            cure="install the program again, from a wheel or a whole checkout",
        )
    result, beside = read_result(folder), ResultFolder.beside(folder)
    if out.resolve() == folder.resolve():
        raise InputError(
            "the page would lie among the results", file=out, cure="name another folder"
        )
    clouds: list[SceneCloudFile] = []
    with ExitStack() as stack:
        paths = written_clouds(result, folder)
        place = folder
        if not os.access(folder, os.W_OK):
            place = stack.enter_context(scratch_folder())
        for besides, name in zip(further, further_names(further), strict=True):
            convert_further(besides, name, place, progress, clouds.append)
        convert_clouds(paths, place, progress, clouds.append)
        clouds.sort(key=lambda cloud: cloud.name)
        stack.enter_context(
            keeping([*paths, *further, *(cloud.path for cloud in clouds)], out, overwrite=overwrite)
        )
        parts = cloud_parts(clouds, beside.pose_file, upright=beside.frame.kind != "ecef")
        displaced = [] if epochs is None else read_epochs(epochs)
        scene = scene_of(result, beside, parts, epochs=displaced)
        lacking = lacking_clouds(result, folder, beside.pose_file)
        scene = replace(scene, lacking=lacking)
        texts: dict[Path, str | bytes] = {}
        joint = named_joint(PointSources(beside, {}, {}))
        if joint is not None:
            names, matrix = joint
            texts[out / JOINT] = matrix[np.tril_indices(len(matrix))].astype("<f8").tobytes()
            scene = replace(scene, joint=SceneJoint(names=names, file=JOINT))
        texts |= {
            out / "scene.json": FORM.text(scene),
            out / "README.txt": _README.format(title=scene.title),
        }
        for name in TABLES:
            columns = table_of(scene, name)
            texts[out / "tables" / f"{name}.json"] = table_json(columns)
            texts[out / "tables" / f"{name}.csv"] = table_csv(columns)
        copies = {out / PAGE: pages[PAGE]}
        copies |= {out / "app" / name: path for name, path in pages.items() if name != PAGE}
        copies |= {out / CLOUDS / cloud.file: cloud.path for cloud in clouds}
        for name in beside.picture_names:
            path = beside.picture_file(name)
            if path is not None and path.is_file() and not path.is_symlink():
                copies[out / PICTURES / name] = path
        for path in (*texts, *copies):
            refuse_loss(path)
        write_texts(texts)
        for path, source in copies.items():
            copy_file(source, path)
    return len(texts) + len(copies)
