"""The commands `mbody export` and `mbody import`: files of other programs."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from mbody.cli.option_values import given, model_of
from mbody.cli.streams import UsageError, message


def export(args: Any) -> int:
    """Write a model for another program; what that lacks is reported."""
    if args.fmi is not None and args.to != "fmu":
        raise UsageError(f"--fmi goes with --to fmu, not with --to {args.to}: leave it out")
    if args.to != "dxf" and (args.width or args.hole):
        raise UsageError(f"--width and --hole go with --to dxf, not with --to {args.to}")
    if args.to == "image":
        return _image(args)
    _refuse_instants(args)
    if args.to == "dxf":
        return _dxf(args)
    return _fmu(args) if args.to == "fmu" else _mjcf(args)


def _refuse_instants(args: Any) -> None:
    if args.instants is not None:
        what = {"fmu": "a unit", "dxf": "a drawing of parts"}.get(args.to, "a file of MuJoCo")
        raise UsageError(f"--instants goes with --to image: {what} has no instants")


def _mjcf(args: Any) -> int:
    """Write a model for MuJoCo."""
    from mbody.engines.mjcf import to_mjcf

    made = to_mjcf(model_of(args), fix_drivers=args.fix_drivers)
    missing = [f"not in the file: '{one.element}': {one.why}" for one in made.not_expressible]
    return _write(args.output, made.text, [*missing, *made.notes])


def _dxf(args: Any) -> int:
    """Write a drawing of all parts."""
    from mbody.exchange import to_dxf

    made = to_dxf(model_of(args), args.width, args.hole)
    return _write(args.output, made.text, made.notes)


def _image(args: Any) -> int:
    """Write the image of a model."""
    if args.output is None:
        raise UsageError("an image is binary, it cannot be printed: name its file with -o FILE")
    from mbody.image.model_image import to_image

    made = to_image(model_of(args), **given(args, "instants", "analyses"))
    return _write(args.output, made.content, made.notes, f": {len(made.content)} bytes")


def _fmu(args: Any) -> int:
    """Write a unit of co-simulation."""
    if args.output is None:
        raise UsageError("a unit is binary, it cannot be printed: name its file with -o FILE")
    from pathlib import Path

    from mbody.image.fmu import VERSIONS, to_fmu

    made = to_fmu(model_of(args), args.fmi or VERSIONS[0], name=Path(args.output).stem)
    machines = ", ".join(made.platforms)
    size = f": {len(made.content)} bytes, with binaries for {machines}"
    return _write(args.output, made.content, made.notes, size)


def _write(output: str | None, content: str | bytes, notes: Sequence[str], more: str = "") -> int:
    """Write a file, or print its text, and say the notes on it; `more`: what it contains."""
    from mbody.files.writing import writing

    if output is None:
        print(content, end="", flush=True)
    else:
        with writing(output, binary=isinstance(content, bytes)) as file:
            file.write(content)
    for note in notes:
        message(f"mbody: {note}")
    if output is not None:
        message(f"wrote {output}{more}")
    return 0


# -- `mbody import FILE -o model.toml` ---------------------------------------------------------


def import_file(args: Any) -> int:
    """Write a model file from another program's; what was assumed or left out is reported."""
    from mbody.exchange import import_model
    from mbody.files.model import save, to_toml

    made = import_model(args.file, args.units)
    if args.output is None:
        print(to_toml(made.mechanism), end="", flush=True)
    else:
        save(made.mechanism, args.output)
    for note in made.notes:
        message(f"mbody: {note}")
    if args.output is not None:
        message(f"wrote {args.output}: {made.mechanism.name}, from a file of {made.form}")
    return 0
