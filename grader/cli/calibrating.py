"""``planmark calibrate``."""

import json
from collections.abc import Sequence
from pathlib import Path

import typer

from grader.calibration import calibrate, residual_map
from grader.documents import CalibrationDocument
from grader.files import write_whole
from grader.intake import count_pages
from grader.records import Unread
from grader.workers import Limits, Workers, result_of

_FIT = "printer and scanner are fit for grading"


def calibrate_scans(scans: Sequence[Path], svg: Path | None, *, as_json: bool) -> bool:
    """Tell what scans of the calibration page say; whether anything is to be done."""
    found: list[CalibrationDocument] = []
    unread = False
    with Workers(1, Limits(), __name__) as workers:
        pages = [(path, page + 1) for path in scans for page in range(result_of(workers, count_pages, path))]
        for path, page in pages:
            one = result_of(workers, calibrate, path, page)
            if isinstance(one, Unread):
                unread = True
                typer.echo(f"{path.name}, page {page}: {one.reason}", err=True)
                continue
            found.append(one)
            if not as_json:
                _tell(one)
    if as_json:
        typer.echo(json.dumps([one.model_dump(mode="json") for one in found], indent=2))
    if svg is not None and found:
        write_whole(svg, residual_map(found[0]))
        typer.echo(f"{svg}: where the page is off, magnified", err=True)
    return unread or any(one.advice != [_FIT] for one in found)


def _tell(one: CalibrationDocument) -> None:
    typer.echo(f"{one.source}, page {one.page}")
    if one.scale_x is not None and one.scale_y is not None and one.scale_se is not None:
        se = f"\N{PLUS-MINUS SIGN} {100.0 * one.scale_se:.3f}"
        along, across = 100.0 * one.scale_x, 100.0 * one.scale_y
        typer.echo(f"  scale along the sheet {along:.3f} %, across it {across:.3f} % ({se})")
    if one.unequal is not None:
        typer.echo(
            f"  unequal scale {100.0 * one.unequal:+.3f} %, right angles off by {one.skew_deg:+.3f} degrees"
        )
    typer.echo(f"  markers off an even map by {one.residual_mm:.3f} mm")
    seen = one.segments
    typer.echo(f"  {seen.read} of {seen.printed} segments read")
    if seen.length_rms_mm is not None:
        mean, rms, worst = seen.length_mean_mm, seen.length_rms_mm, seen.length_worst_mm
        typer.echo(
            f"  their lengths are off by {mean:+.3f} mm on the mean, {rms:.3f} rms, {worst:.3f} at worst"
        )
        turn, place = seen.direction_rms_deg, seen.place_rms_mm
        typer.echo(f"  directions {turn:.3f} degrees rms, places {place:.3f} mm rms")
    for line in one.advice:
        typer.echo(f"  {line}")
