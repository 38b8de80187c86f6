"""Where tables and text of the command go: files, standard output, and what stands beside them."""

import csv
import io

import pytest

import mbody
from mbody import cli, gallery

SWEEP = ("sweep", "norton_fourbar", "--vary", "crank.A.x=4,5", "--vary", "motor.law.value=0,60")
OPTIMUM = ("optimize", "norton_fourbar", "--by", "crank.A.x=4:6", "--starts", "2", "--over", "turn")


@pytest.fixture
def run(capsys, tmp_path, monkeypatch):
    """The command in an empty folder: its exit status, what it prints, and its messages."""
    monkeypatch.chdir(tmp_path)

    def told(*words):
        status = cli.main(list(words))
        printed = capsys.readouterr()
        return status, printed.out, printed.err

    return told


def table(text):
    return list(csv.reader(io.StringIO(text)))


def test_a_table_of_designs_is_printed_with_units(run, tmp_path):
    words = (*SWEEP, "--measure", "A.force", "--measure", "rocker.angle")
    status, out, _ = run(*words, "--csv", "-")
    head, *rows = table(out)
    assert status == 0 and not list(tmp_path.iterdir())
    assert head[:2] == ["crank.A.x [in]", "motor.law.value [rad]"]
    assert head[2:] == ["A.force [lbf]", "rocker.angle [rad]", "error", "doubt"]
    forces = mbody.sweep(
        gallery.load("norton_fourbar"), {"crank.A.x": [4.0, 5.0]}, measure="A.force"
    )
    at_sixty = [float(row[2]) for row in rows if float(row[1]) > 1.0]
    # the same motion: its law begins at 60 deg in the model
    assert at_sixty == pytest.approx(forces["A.force"].tolist(), rel=1e-12)
    status, _, said = run(*words, "--csv", "file.csv", "--angle", "deg")
    assert status == 0 and "wrote file.csv: 4 designs" in said
    head, *rows = table((tmp_path / "file.csv").read_text(encoding="utf-8"))
    assert head[1] == "motor.law.value [deg]" and {row[1] for row in rows} == {"0.0", "60.0"}


def test_histories_of_designs_have_their_unit_once_a_column(run):
    _, out, _ = run(*SWEEP[:4], "--over", "turn", "--instants", "3", "--measure", "A.fx", *CSV)
    assert table(out)[0][1:4] == ["A.fx[0] [lbf]", "A.fx[1] [lbf]", "A.fx[2] [lbf]"]


CSV = ("--csv", "-")


def test_an_optimum_is_printed_as_a_table(run, tmp_path):
    status, out, _ = run(*OPTIMUM, "--minimize", "peak(motor.effort)", *CSV)
    head, row = table(out)
    assert status == 0 and not list(tmp_path.iterdir())
    assert head[:4] == ["number", "before", "optimum", "unit"]
    assert row[0] == "crank.A.x" and row[3] == "in" and 4.0 <= float(row[2]) <= 6.0


def test_two_aims_have_their_units(run):
    aims = ("--minimize", "peak(motor.effort)", "--minimize", "peak(max(A.force, B.force))")
    _, out, _ = run(*OPTIMUM, *aims, *CSV)
    head, *rows = table(out)
    names = "least peak(motor.effort)", "least peak(max(A.force, B.force))"
    assert head == [f"{names[0]} [lbf·in]", f"{names[1]} [lbf]", "crank.A.x [in]"] and rows
    _, out, _ = run(*OPTIMUM, *aims)
    line = next(line for line in out.splitlines() if line.startswith(f"{names[1]} = "))
    assert line.split(", before")[0].endswith(" lbf")


@pytest.mark.parametrize(
    "words",
    [
        ("derive", "norton_fourbar"),
        ("export", "norton_fourbar", "--to", "dxf"),
        ("import", "https://example.org/pmks?mech=ground,crank,R,0,0|crank,rod,R,0,10"),
    ],
    ids=lambda words: words[0],
)
def test_a_dash_prints_what_is_printed_without_a_file(run, tmp_path, words):
    if "dxf" in words:
        pytest.importorskip("ezdxf")
    plain = run(*words)
    if "dxf" in words:  # a drawing has the time when it was made
        plain = (plain[0], plain[1][:200], plain[2])
    for dash in ("-", "/dev/stdout"):
        found = run(*words, "-o", dash)
        if "dxf" in words:
            found = (found[0], found[1][:200], found[2])
        assert found == plain and plain[0] == 0
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    "words",
    [
        ("balance", "slider_crank", "--on", "crank=0.3"),
        ("cognates", "norton_fourbar", "--point", "coupler.P"),
        (*OPTIMUM, "--minimize", "peak(A.force)"),
    ],
    ids=lambda words: words[0],
)
def test_a_model_that_goes_beside_results_is_not_printed(run, tmp_path, words):
    status, out, said = run(*words, "-o", "-")
    assert status == 2 and not out and "give -o a name" in said
    assert not list(tmp_path.iterdir())


def test_a_sensitivity_has_the_unit_of_its_instant(run):
    _, out, _ = run("sensitivity", "norton_fourbar", "A.force")
    assert "A.force = 154.805 lbf at t = 0 s\n" in out
