"""The impulses of one step by Lemke's method: the problem of Anitescu and Potra, dense.

    0 ≤ γ_N + b ⊥ P_N ≥ 0,   0 ≤ s e ± γ_T ⊥ P_T± ≥ 0,   0 ≤ μ P_N − P_T⁺ − P_T⁻ ⊥ s ≥ 0,

γ = γ_free + D P with Delassus's matrix D = W M⁻¹ Wᵀ of what joints leave free. A solution exists
always: Anitescu, Potra: Formulating dynamic multi-rigid-body contact problems (1997).
"""

from __future__ import annotations

import numpy as np

from mbody.analysis.contact.complementarity import lemke
from mbody.kernels.contact_geometry import FOUND
from mbody.kernels.contact_shapes import ContactWork

__all__ = ["delassus", "impulses_by_lemke", "rows_of_contacts"]

Array = np.ndarray


def rows_of_contacts(contacts: ContactWork, which: Array) -> Array:
    """W of some contacts: (2 m, coordinates + 3), normals before tangents."""
    g, who = contacts.geometry[which], contacts.who[which]
    m = len(which)
    found = np.zeros((2 * m, len(contacts.velocity)))
    for k, (nx, ny) in enumerate((g[:, :2].T, np.array([g[:, 1], -g[:, 0]]))):
        for side, sign in ((0, -1.0), (1, 1.0)):
            rx, ry = g[:, 2 + 2 * side], g[:, 3 + 2 * side]
            for n, part in enumerate((nx, ny, rx * ny - ry * nx)):
                found[k * m + np.arange(m), 3 * who[:, side] + n] += sign * part
    found[:, -3:] = 0.0
    return found


def delassus(contacts: ContactWork, which: Array) -> tuple[Array, Array]:
    """D of some contacts, normals before tangents, and their rows W."""
    W, m = rows_of_contacts(contacts, which), len(which)
    Y = W * contacts.inverse
    Y[:, contacts.coupled] = 0.0
    for k, c in enumerate(which):
        column = int(contacts.column[c])
        if column >= 0:
            Y[k, contacts.coupled] = contacts.response[2 * column]
            Y[m + k, contacts.coupled] = contacts.response[2 * column + 1]
    return W @ Y.T, W


def impulses_by_lemke(contacts: ContactWork) -> Array | None:
    """(P_N, P_T) of all contacts of the step that is under way; None where no solution is found."""
    count = int(contacts.counts[FOUND])
    which = np.flatnonzero(np.isfinite(contacts.effect[:count, 4]))
    m, found = len(which), np.zeros((count, 2))
    if not m:
        return found
    D, W = delassus(contacts, which)
    free, mu = W @ contacts.free, contacts.effect[which, 3]
    N, T = slice(0, m), slice(m, 2 * m)
    zero, one = np.zeros((m, m)), np.eye(m)
    A = np.block(
        [
            [D[N, N], D[N, T], -D[N, T], zero],
            [D[T, N], D[T, T], -D[T, T], one],
            [-D[T, N], -D[T, T], D[T, T], one],
            [np.diag(mu), -one, -one, zero],
        ]
    )
    b = np.concatenate([free[N] + contacts.effect[which, 4], free[T], -free[T], np.zeros(m)])
    z = lemke(A, b)
    if z is None:
        return None
    found[which] = np.column_stack([z[:m], z[m : 2 * m] - z[2 * m : 3 * m]])
    return found
