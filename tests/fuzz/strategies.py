"""Inputs for hypothesis, which makes a failing one small."""

import copy
import json
from typing import Any

from hypothesis import strategies as st

from tests.fuzz import corpus, mutate

numbers = st.sampled_from(corpus.NUMBERS) | st.floats().map(repr) | st.integers().map(str)
units = st.lists(st.sampled_from(corpus.UNITS), max_size=4).flatmap(
    lambda parts: st.sampled_from(("*", "/", "-", " ", "^2*")).map(lambda sign: sign.join(parts))
)
junk = st.text(max_size=8) | st.sampled_from(corpus.ODD)


def _larger(part: st.SearchStrategy[str]) -> st.SearchStrategy[str]:
    """Sums, products, powers, brackets, calls and units of smaller formulas."""
    signs = st.sampled_from(("+", " - ", "*", " / ", "^", "**", "·", " ", ","))
    return st.one_of(
        st.tuples(part, signs, part).map("".join),
        part.map(lambda text: f"({text})"),
        st.tuples(part, units).map(" ".join),
        st.tuples(st.sampled_from(corpus.FUNCTIONS), st.lists(part, max_size=3)).map(
            lambda call: f"{call[0]}({', '.join(call[1])})"
        ),
        part.map(lambda text: f"-{text}"),
    )


formulas = st.recursive(
    numbers | st.sampled_from(corpus.NAMES) | st.sampled_from(corpus.FORMULAS) | junk,
    _larger,
    max_leaves=12,
)
values = st.recursive(
    st.sampled_from(corpus.VALUES) | formulas | st.floats() | st.integers() | junk,
    lambda part: st.lists(part, max_size=3) | st.dictionaries(junk | formulas, part, max_size=2),
    max_leaves=6,
)


@st.composite
def tables(draw: Any) -> Any:
    """The tables of a right model, or such as the schema wants, with changes somewhere."""
    if draw(st.booleans()):
        data = json.loads(draw(st.sampled_from(corpus.tables())))
    else:
        random = draw(st.randoms(use_true_random=False))
        data = mutate.of_schema(random, mutate.SCHEMA, 5)
    for _ in range(draw(st.integers(0, 4))):
        found = list(mutate.places(data))
        if not found:
            break
        table, key = found[draw(st.integers(0, len(found) - 1))]
        kind = draw(st.sampled_from(("value", "value", "delete", "rename", "nest", "copy")))
        if kind == "value":
            table[key] = copy.deepcopy(draw(values))
        elif kind == "delete":
            del table[key]
        elif kind == "rename" and isinstance(table, dict):
            table[draw(junk | formulas | st.just(f"{key}s"))] = table.pop(key)
        elif kind == "nest":
            for _ in range(draw(st.sampled_from((1, 2, 40)))):
                table[key] = [table[key]]
        else:
            other, name = found[draw(st.integers(0, len(found) - 1))]
            table[key] = copy.deepcopy(other[name])
    return data


@st.composite
def texts(draw: Any, is_json: bool) -> str:
    """The text of a model with pieces put in, cut out, or taken from another."""
    seeds = st.sampled_from(corpus.tables() if is_json else corpus.models())
    text = draw(seeds)
    for _ in range(draw(st.integers(1, 4))):
        i = draw(st.integers(0, len(text)))
        j = min(len(text), i + draw(st.sampled_from((0, 1, 3, 30))))
        other = draw(seeds)
        k = draw(st.integers(0, len(other)))
        piece = draw(st.sampled_from(mutate.SOUP) | junk | formulas | st.just(other[k : k + 60]))
        text = text[:i] + piece + text[j:]
    return text
