"""Lane continuation: many motions, or many pieces of one, side by side with fixed steps.

Every lane starts from its own closed position and predicts, corrects and checks like the scalar
path, but cannot halve its step: a lane that fails a check is marked and left to `follow`.
"""

from __future__ import annotations

from mbody._jit import kernel
from mbody._lanes import highest, larger, ld, select_le, st, wide
from mbody._reference import by_reference
from mbody.core.follow import CORRECTION, TOLERANCE, TURNED
from mbody.core.forces import forces, signals
from mbody.core.instant import accelerations, multipliers, newton, rates, velocities
from mbody.core.output import keep
from mbody.core.path import behind, predict, step_size, strayed

__all__ = ["march"]

ITERATIONS = 6
#: A pivot below this part of its diagonal: too near a singular position for unchecked solves.
GUARD = 1e-9
#: Unbalanced part above which a lane is left to the scalar path.
BALANCE = 1e-11


@kernel
def march(L, W, soft, mode, s, t, given, reach, with_loads, still, output, bad):
    """Fill output (steps, rows, lanes) as `keep` says.

    s, t (steps, lanes): path parameter and time; given (2·steps, lanes): rate and acceleration of
    the one driver in mode 1; bad (1, lanes): set to one where a lane must not be trusted.
    """
    L, W = by_reference(L), by_reference(W)
    w = wide()
    signals(L, W, w, L.signal_law.shape[0])
    failed = 0.0 * w
    one = 0.0 * w + 1.0
    zero = 0.0 * w
    back, quintic = one, zero
    steps = s.shape[0]
    n3 = 3 * L.bodies
    for k in range(steps):
        here = ld(s, k, w)
        h = zero
        st(W.time, 0, ld(t, k, w), w)
        if k > 0:
            h = here - ld(s, k - 1, w)
            predict(L, W, w, h, back, quintic)
        signals(L, W, w, L.varying)
        if mode == 1:
            o = L.driver_row[0]
            st(W.signal, o, here, w)
            st(W.signal, o + 1, 1.0, w)
            st(W.signal, o + 2, 0.0, w)
        first, last, least = zero, zero, one
        for iteration in range(ITERATIONS):
            last, least = newton(L, W, w, soft, GUARD)
            if iteration == 0:
                first = last
            if highest(last) <= TOLERANCE * reach:
                break
        failed = larger(failed, select_le(last, zero + TOLERANCE * reach, zero, one))
        failed = larger(failed, select_le(-least, zero, zero, one))
        velocities(L, W, w, False)
        accelerations(L, W, w, False)
        if k > 0:
            off, size = strayed(L, W, w, h)
            moved = step_size(L, W, w)
            failed = larger(failed, select_le(first, CORRECTION * moved + 1e-9, zero, one))
            failed = larger(failed, select_le(off, TURNED * size + 1e-9, zero, one))
        behind(W, w)
        # a step of length zero leaves the history useless: predict by Taylor after it
        length = larger(h, -h)
        back = select_le(length, zero, one, h)
        quintic = select_le(length, zero, zero, one)
        if mode == 1:
            rates(L, W, w, 0, ld(given, 2 * k, w), ld(given, 2 * k + 1, w))
            if not still:
                velocities(L, W, w, False)
                accelerations(L, W, w, False)
        if still:
            for n in range(n3):
                st(W.v, n, 0.0, w)
                st(W.a, n, 0.0, w)
        if with_loads:
            forces(L, W, w, -1)
            rest = multipliers(L, W, w)
            failed = larger(failed, select_le(rest, zero + BALANCE, zero, one))
        keep(L, W, w, output[k])
    st(bad, 0, select_le(failed, zero, zero, one), w)
