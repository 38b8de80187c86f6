"""`mbody doctor`: what is installed, and that the kernels compute a number that is known."""

import json

import numpy as np
import pytest

from mbody import cli
from mbody.cli import compile

pytestmark = pytest.mark.processor

Long = np.longdouble
PI = Long("3.14159265358979323846264338327950288")


def rad(degrees):
    return Long(degrees) * PI / 180


def along(angle, length):
    return length * np.array([np.cos(angle), np.sin(angle)])


def cross(r, f):
    return r[0] * f[1] - r[1] * f[0]


def acceleration(omega, alpha, r):
    return alpha * np.array([-r[1], r[0]]) - omega * omega * r


def driving_torque():
    """Norton, example 11-3, by the book's nine equations in extended precision."""
    a, b, c, d, g = map(Long, (5, 15, 10, 19, 386))
    crank, omega, alpha = rad(60), Long(25), Long(-40)
    pin = along(crank, a)
    coupler, rocker = rad(21), rad(104)
    for _ in range(30):
        gap = pin + along(coupler, b) - np.array([d, Long(0)]) - along(rocker, c)
        phi_q = np.array(
            [
                [-b * np.sin(coupler), c * np.sin(rocker)],
                [b * np.cos(coupler), -c * np.cos(rocker)],
            ]
        )
        step = solved(phi_q, -gap)
        coupler, rocker = coupler + step[0], rocker + step[1]
    w3, w4 = solved(phi_q, -omega * np.array([-pin[1], pin[0]]))
    pin_acceleration = acceleration(omega, alpha, pin)
    ends = w4**2 * along(rocker, c) - w3**2 * along(coupler, b)
    a3, a4 = solved(phi_q, -(pin_acceleration + ends))
    mass = [Long(text) / g for text in ("1.5", "7.7", "5.8")]
    inertia = [Long(text) for text in ("0.4", "1.5", "0.8")]
    centre = [along(crank + rad(30), Long(3)), along(coupler + rad(45), Long(9))]
    centre.append(along(rocker, Long(5)))
    moved = [
        acceleration(omega, alpha, centre[0]),
        pin_acceleration + acceleration(w3, a3, centre[1]),
        acceleration(w4, a4, centre[2]),
    ]
    matrix, right = np.zeros((9, 9), dtype=Long), np.zeros(9, dtype=Long)
    pushes = (  # body, first column of the force, its sign, from the mass centre to its place
        *((0, 0, 1, -centre[0]), (0, 2, 1, pin - centre[0])),
        *((1, 2, -1, -centre[1]), (1, 4, 1, along(coupler, b) - centre[1])),
        *((2, 4, -1, along(rocker, c) - centre[2]), (2, 6, 1, -centre[2])),
    )
    for body, column, sign, r in pushes:
        k = 3 * body
        matrix[k, column] = matrix[k + 1, column + 1] = sign
        matrix[k + 2, column], matrix[k + 2, column + 1] = -sign * r[1], sign * r[0]
    matrix[2, 8] = 1
    for body, spin in enumerate((alpha, a3, a4)):
        right[3 * body : 3 * body + 2] = mass[body] * moved[body]
        right[3 * body + 2] = inertia[body] * spin
    force = along(rad(330), Long(80))
    right[3:5] -= force
    right[5] -= cross(along(coupler + rad(100), Long(3)), force)
    right[8] -= Long(120)
    return solved(matrix, right)[8]


def solved(matrix, right):
    """Gaussian elimination with row pivots; NumPy's own has no extended precision."""
    a, x = matrix.copy(), np.array(right, dtype=Long)
    for k in range(len(x)):
        p = k + int(np.abs(a[k:, k]).argmax())
        a[[k, p]], x[[k, p]] = a[[p, k]], x[[p, k]]
        for i in range(k + 1, len(x)):
            f = a[i, k] / a[k, k]
            a[i] -= f * a[k]
            x[i] -= f * x[k]
    for k in reversed(range(len(x))):
        x[k] = (x[k] - a[k, k + 1 :] @ x[k + 1 :]) / a[k, k]
    return x


def test_the_number_of_doctor_is_right():
    # both are the nearest doubles, or beside them where extended precision is double
    assert float(driving_torque()) == pytest.approx(compile.TORQUE, rel=1e-15)


def test_doctor_runs_a_kernel(capsys):
    assert cli.main(["doctor", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    check = found["kernel_check"]
    assert found["ready"] and check["agrees"] and check["error"] is None
    assert check["value"] == pytest.approx(check["expected"], rel=1e-12)
    assert cli.main(["doctor"]) == 0
    assert "agrees with 243.237590761 lbf·in" in capsys.readouterr().out


def test_kernels_that_do_not_run_are_not_ready(capsys, monkeypatch):
    def broken(*_):
        raise AttributeError("'EntryLibrary' object has no attribute '_reload_init'")

    monkeypatch.setattr("mbody.analysis.driven.driven.kinetostatics", broken)
    assert cli.main(["doctor", "--json"]) == 1
    found = json.loads(capsys.readouterr().out)
    assert not found["ready"] and "_reload_init" in found["kernel_check"]["error"]
    assert cli.main(["doctor"]) == 1
    assert "NOT READY: the kernels do not run" in capsys.readouterr().out


def test_a_wrong_number_is_not_ready(capsys, monkeypatch):
    monkeypatch.setattr(compile, "TORQUE", compile.TORQUE * (1.0 + 1e-9))
    assert cli.main(["doctor"]) == 1
    assert "NOT READY: the kernels compute wrongly" in capsys.readouterr().out
