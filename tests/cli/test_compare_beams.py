"""A comparison of files says which points it left out as beams without return."""

from pathlib import Path

import numpy as np
from typer.testing import CliRunner

from tests.scan.in_memory import shell
from tribrach.cli import app


def test_they_are_left_out_and_said(tmp_path: Path) -> None:
    """Shells at 40 m of both files would agree within a millimetre and hide a shift of 20 mm."""
    rng = np.random.default_rng(3)
    wall = np.column_stack([np.full(3000, 5.0), rng.uniform(-3, 3, (3000, 2))])
    for name, shift in (("a", 0.02), ("b", 0.0)):
        points = np.concatenate([wall + np.array([shift, 0, 0]), shell(300, 40.0)])
        np.savetxt(tmp_path / f"{name}.xyz", points, "%.6f", header="x y z", comments="")
    call = ["compare", str(tmp_path / "a.xyz"), str(tmp_path / "b.xyz")]
    result = CliRunner().invoke(app, [*call, "--method", "c2c"])
    assert result.exit_code == 0, result.output
    said = " ".join(result.output.split())
    for name in ("a", "b"):
        assert f"! {name}.xyz: 300 of 3300 points (9.1 %) are beams without return" in said
