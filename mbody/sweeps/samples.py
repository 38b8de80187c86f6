"""The designs of a sweep: grids, lists, Latin hypercube, Sobol and Monte Carlo."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, TypeAlias

import numpy as np

from mbody.core.searches import latin
from mbody.errors import ModelError, brief
from mbody.model.element import whole_number
from mbody.model.numbers import dimension_named
from mbody.quantities.formula import Number, range_given, value_given
from mbody.system.system import System

# -- Distributions of a number about its mean: normal, uniform, triangular ---------------------

#: Standard deviations in the tolerance of a normal distribution: 99.73 % of the values are within.
SIGMAS = 3.0


@dataclass(frozen=True)
class Scatter:
    """A distribution of a number; base class.

    `tolerance`: ±, in the units of the mechanism or with a unit.
    `mean`: By default the number of the mechanism.
    """

    tolerance: Number | None = None
    mean: Number | None = None

    def __post_init__(self) -> None:
        if self.tolerance is None:
            raise ModelError(f"{type(self).__name__} has no width: give tolerance")

    def spread(self) -> Any:
        """The width as it was given."""
        return self.tolerance

    #: Fourth cumulant by the fourth power of the standard deviation: 0 of a normal distribution.
    excess: ClassVar[float] = 0.0

    def deviation_of(self, width: float) -> float:
        """The standard deviation, of a width in the units of the mechanism."""
        raise NotImplementedError

    def at(self, part: np.ndarray, width: float) -> np.ndarray:
        """Deviations from the mean at these probabilities (the quantile function).

        `part`: Between 0 and 1, both excluded.
        `width`: `spread` in the units of the mechanism.
        """
        raise NotImplementedError


@dataclass(frozen=True)
class Normal(Scatter):
    """Normal distribution: p(x) = exp(−(x − mean)²/2σ²)/(σ √2π).

    Parameters
    ----------
    tolerance : float or str, optional
        ±; three standard deviations: 99.73 % of the values are within.
    mean : float or str, optional
        By default the number of the mechanism.
    deviation : float or str, optional
        The standard deviation σ, instead of a tolerance.

    >>> Normal(deviation="0.02 mm").spread()
    '0.02 mm'
    """

    deviation: Number | None = None

    def __post_init__(self) -> None:
        if (self.tolerance is None) == (self.deviation is None):
            raise ModelError("Normal takes one width: give either tolerance or deviation")

    def spread(self) -> Any:
        """The tolerance, or the standard deviation."""
        return self.deviation if self.tolerance is None else self.tolerance

    def deviation_of(self, width: float) -> float:
        """A third of the tolerance, or the width itself."""
        return width if self.tolerance is None else width / SIGMAS

    def at(self, part: np.ndarray, width: float) -> np.ndarray:
        """σ Φ⁻¹(part)."""
        from scipy.special import ndtri

        return np.asarray(self.deviation_of(width) * ndtri(part))


@dataclass(frozen=True)
class Uniform(Scatter):
    """Uniform distribution within mean ± tolerance.

    >>> Uniform(2.0).at(np.array([0.25]), 2.0)
    array([-1.])
    """

    excess: ClassVar[float] = -1.2

    def deviation_of(self, width: float) -> float:
        """Width / √3."""
        return width / 3.0**0.5

    def at(self, part: np.ndarray, width: float) -> np.ndarray:
        """Width · (2 part − 1)."""
        return width * (2.0 * part - 1.0)


@dataclass(frozen=True)
class Triangular(Scatter):
    """Triangular distribution: greatest density at the mean, zero at ± tolerance.

    >>> Triangular(2.0).at(np.array([0.125, 0.5]), 2.0)
    array([-1.,  0.])
    """

    excess: ClassVar[float] = -0.6

    def deviation_of(self, width: float) -> float:
        """Width / √6."""
        return width / 6.0**0.5

    def at(self, part: np.ndarray, width: float) -> np.ndarray:
        """±width · (1 − √(2 part′)), part′ from the nearer end."""
        tail = np.minimum(part, 1.0 - part)
        return np.asarray(width * np.sign(part - 0.5) * (1.0 - np.sqrt(2.0 * tail)))


#: Designs of one sweep, at most.
MOST = 100_000_000
#: Distance of a probability from 0 and 1, where the normal quantile is infinite.
EDGE = 2.0**-54


@dataclass(frozen=True, eq=False)
class Samples:
    """The values of the parameters of a sweep.

    Attributes
    ----------
    kind : str
        "grid", "together", "latin hypercube", "sobol" or "monte carlo".
    parameters : mapping
        By name: values, or a `Scatter` or (low, high) for random ones.
    count, seed : int
        Number of random designs, and the seed.

    Examples
    --------
    >>> Samples("together", {"a": [1.0, 2.0], "b": [3.0, 4.0]}).kind
    'together'
    """

    kind: str
    parameters: Values | Spreads
    count: int = 0
    seed: int = 0

    def __post_init__(self) -> None:
        if not isinstance(self.parameters, Mapping) or not self.parameters:
            raise ModelError(
                'sweep: parameters must be a dict of names such as {"crank.A.x": [1.0, 1.1]}, '
                f"not {brief(self.parameters)}"
            )
        if self.kind in ("grid", "together"):
            return
        for name, least, most in (("count", 1, MOST), ("seed", 0, None)):
            value = whole_number(f"{self.kind}: {name}", getattr(self, name), least, most)
            object.__setattr__(self, name, value)


@dataclass(frozen=True)
class Steps:
    """Equidistant values of a grid, both ends included; they may have units.

    >>> Steps("1 in", "2 in", 11).count
    11
    """

    low: Number
    high: Number
    count: int


#: Values of numbers by name.
Values: TypeAlias = "Mapping[str, Number | Iterable[Number] | Steps]"
#: How numbers are spread, by name.
Spreads: TypeAlias = "Mapping[str, tuple[Number, Number] | list[Number] | Scatter]"


@dataclass(frozen=True, eq=False)
class DesignNumbers:
    """The numbers of the designs.

    `names`: Dotted names and parameters of the `System`.
    `values` (designs, names): In the units of the mechanism.
    `axes`: Values of each axis of a grid by the given name, else empty.
    `given_names`: The names as given.
    """

    names: tuple[str, ...]
    values: np.ndarray
    axes: dict[str, np.ndarray]
    given_names: tuple[str, ...]


def grid(parameters: Values) -> Samples:
    """Every value of each parameter with every value of the others.

    >>> grid({"crank.A.x": [1.0, 1.1], "crank.mass": [1, 2, 3]}).kind
    'grid'
    """
    return Samples("grid", parameters)


def together(parameters: Values) -> Samples:
    """A list of designs: the first values of all parameters, the second ones, and so on.

    >>> together({"crank.A.x": [1.0, 1.1], "crank.mass": [1, 2]}).kind
    'together'
    """
    return Samples("together", parameters)


def latin_hypercube(parameters: Spreads, count: int, seed: int = 0) -> Samples:
    """Random designs, one in each of `count` slices of every parameter (McKay 1979).

    Parameters
    ----------
    parameters : mapping
        By name (low, high), or a `Normal`, `Uniform` or `Triangular`.
    count, seed : int

    >>> latin_hypercube({"crank.A.x": (0.9, 1.1)}, 100).count
    100
    """
    return Samples("latin hypercube", parameters, count, seed)


def sobol(parameters: Spreads, count: int, seed: int = 0) -> Samples:
    """Points of a scrambled Sobol sequence, which fills the space evenly; best with a power of two.

    Parameters as of `latin_hypercube`.

    >>> sobol({"crank.A.x": (0.9, 1.1)}, 128, seed=3).seed
    3
    """
    return Samples("sobol", parameters, count, seed)


def monte_carlo(parameters: Spreads, count: int, seed: int = 0) -> Samples:
    """Independent random designs; parameters as of `latin_hypercube`.

    >>> from mbody.sweeps import Normal
    >>> monte_carlo({"crank.A.x": Normal(tolerance=0.01)}, 1000).kind
    'monte carlo'
    """
    return Samples("monte carlo", parameters, count, seed)


def drawn(system: System, given: Samples | Values) -> DesignNumbers:
    """The numbers of all designs."""
    samples = given if isinstance(given, Samples) else Samples("grid", given)
    given_names = tuple(samples.parameters)
    names = tuple(_changeable(system, name) for name in given_names)
    if len(set(names)) < len(names):
        raise ModelError(f"sweep: {', '.join(given_names)}: name each number once")
    if samples.kind in ("grid", "together"):
        columns = {
            name: _row(system, number, values)
            for (name, values), number in zip(samples.parameters.items(), names, strict=True)
        }
        if samples.kind == "grid":
            return DesignNumbers(names, _product(columns), columns, given_names)
        return DesignNumbers(names, _columns(columns), {}, given_names)
    parts = _parts(samples, len(names))
    values = [
        _spread(system, number, how, part)
        for (how, part, number) in zip(samples.parameters.values(), parts.T, names, strict=True)
    ]
    return DesignNumbers(names, np.stack(values, axis=1), {}, given_names)


def _changeable(system: System, name: str) -> str:
    """The dotted name of a number; a load of one number is called by its own name."""
    name = system.number_name(name)
    system.with_values(
        {name: system.values.get(name, 0.0)}
    )  # raises for numbers that cannot be changed
    return name


def _number(system: System, name: str, value: Any, verb: str = "sweep") -> float:
    """One number in the units of the mechanism."""
    machine = system.mechanism
    return value_given(
        value, dimension_named(machine, name), machine.parameters.scope(), verb, name
    )


def _row(system: System, name: str, values: Any) -> np.ndarray:
    """Values of one parameter."""
    if isinstance(values, Steps):
        low, high = (_number(system, name, one) for one in (values.low, values.high))
        values = np.linspace(low, high, max(0, values.count))
    if isinstance(values, str | bytes | Mapping | Scatter) or not hasattr(values, "__iter__"):
        values = [values]
    if isinstance(values, np.ndarray) and values.dtype.kind in "iuf" and values.ndim == 1:
        row = values.astype(np.float64)
    else:
        row = np.array([_number(system, name, value) for value in values], dtype=np.float64)
    if not row.size or not np.isfinite(row).all():
        raise ModelError(f"sweep: '{name}' needs finite values, at least one", name)
    return row


def _product(columns: Mapping[str, np.ndarray]) -> np.ndarray:
    count = math.prod(len(row) for row in columns.values())
    if count > MOST:
        raise ModelError(
            f"sweep: the grid has {count:.3g} designs, at most {MOST:.0e} are possible: use "
            "fewer values, or random designs with sobol"
        )
    mesh = np.meshgrid(*columns.values(), indexing="ij")
    return np.stack([part.reshape(-1) for part in mesh], axis=1)


def _columns(columns: Mapping[str, np.ndarray]) -> np.ndarray:
    counts = {name: len(row) for name, row in columns.items()}
    if len(set(counts.values())) > 1:
        given = " and ".join(f"{count} of '{name}'" for name, count in counts.items())
        raise ModelError(f"sweep: there are {given}: give as many values of each")
    return np.stack(list(columns.values()), axis=1)


def _parts(samples: Samples, width: int) -> np.ndarray:
    """Numbers between 0 and 1: (designs, width)."""
    rng = np.random.default_rng(samples.seed)
    if samples.kind == "monte carlo":
        parts = rng.random((samples.count, width))
    elif samples.kind == "sobol":
        from scipy.stats import qmc

        power = max(0, (samples.count - 1).bit_length())
        parts = qmc.Sobol(width, seed=rng).random_base2(power)[: samples.count]
    else:
        parts = latin(samples.count, width, samples.seed)
    return np.clip(parts, EDGE, 1.0 - EDGE)


def _spread(system: System, name: str, how: Any, part: np.ndarray) -> np.ndarray:
    """Random values of one parameter."""
    scatter, middle, width = scatter_of(system, name, how)
    return np.asarray(middle + scatter.at(part, width))


def scatter_of(
    system: System, name: str, how: Any, verb: str = "sweep"
) -> tuple[Scatter, float, float]:
    """Distribution, mean and width of one number, in the units of the mechanism; (low, high) is a
    uniform one. Sentences begin with the verb.
    """
    if isinstance(how, Scatter):
        width = _number(system, name, how.spread(), verb)
        middle = system.values[name] if how.mean is None else _number(system, name, how.mean, verb)
        if not width >= 0.0:
            raise ModelError(f"{verb}: the width of '{name}' is {width:g}: give 0 or more", name)
        return how, float(middle), width
    if not isinstance(how, list | tuple) or len(how) != 2:
        raise ModelError(
            f"{verb}: '{name}' needs (low, high), or a Normal, Uniform or Triangular "
            f"distribution, not {brief(how)}",
            name,
        )
    machine = system.mechanism
    dimension, scope = dimension_named(machine, name), machine.parameters.scope()
    low, high = range_given(how, dimension, scope, verb, name, equal=True)
    width = 0.5 * (high - low)
    return Uniform(width, low + width), low + width, width
