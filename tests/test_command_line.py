"""`python -m contactlaw`, and tables of impacts that are not as they should be."""

from __future__ import annotations

import json

import numpy as np
import pytest

from contactlaw import rebound
from contactlaw.__main__ import main
from contactlaw.calibration.reading import read_table

HEAD = "normal_before,tangential_before,normal_after,tangential_after"
ROW = "1.5,0.2,1.35,-0.03"


def test_rebound_is_that_of_the_function(capsys):
    assert main(["rebound", "0.5", "1.2", "--chi", "1.256", "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert said == {"chi": 1.256, "psi_1": [0.5, 1.2], "psi_2": rebound([0.5, 1.2], 1.256).tolist()}


def test_a_pair_by_names_or_numbers(capsys):
    assert main(["pair", "steel", "glass"]) == 0
    said = capsys.readouterr()
    assert "kappa" in said.out and "coupled" in said.err
    assert main(["pair", "Steel", "2e11 0.3"]) == 2
    assert "did you mean 'steel'" in capsys.readouterr().err
    assert main(["pair", "steel", "hard 0.3"]) == 2
    assert "b = 'hard 0.3': must be one of steel" in capsys.readouterr().err


@pytest.mark.parametrize("command", ["materials", "laws"])
def test_lists(command, capsys):
    assert main([command]) == 0
    said = capsys.readouterr().out
    assert len(said.splitlines()) >= 5
    assert command == "materials" or "microslip_turning: " in said


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "needs the columns"),
        (HEAD, "has no row"),
        (f"{HEAD}\n{ROW},7,8\n", "line 2: 6 cells where 4 columns are named"),
        (f"# one\n\n{HEAD}\n{ROW}\n1.5,2\n", "line 5: 2 cells"),
        (f"{HEAD},normal_before\n{ROW},9\n", "line 1: two columns are named normal_before"),
        (HEAD.replace(",", ";") + "\n1,5;0,2;1,35;0\n", "line 2: normal_before is '1,5'; .* with a point"),
        (f"{HEAD}\n{ROW}\n1_5,1,1,1\n", "line 3: normal_before is '1_5'"),
        (f"{HEAD}\nnan,1,1,1\n", "line 2: normal_before is 'nan'; must be a finite number"),
        (f"{HEAD}\n1e400,1,1,1\n", "line 2: normal_before is '1e400'"),
        (f"{HEAD}\n1.5,,1,1\n", "line 2: tangential_before is ''"),
        (f"{HEAD}\n" + "1" * 200_000 + ",1,1,1\n", "line 2: field larger than"),
        (f'{HEAD}\n1.5,"1\n{ROW}\n', "line 2: "),
        ("Normal_Before,tangential_before,normal_after,tangential_after\n" + ROW, "did you mean 'Normal_Before'"),
        (f"{HEAD},spin_before\n{ROW},1\n", "has one of spin_before and spin_after"),
        (f"{HEAD}\n{ROW}\0\n", "line 2: "),
        (f"{HEAD}\n-{ROW}\n", r"before\[0\]"),
    ],
)
def test_what_is_wrong_with_a_table_is_said_with_its_line(tmp_path, capsys, text, said):
    path = tmp_path / "t.csv"
    path.write_text(text)
    assert main(["calibrate", str(path)]) == 2
    error = capsys.readouterr().err
    assert len(error.splitlines()) == 1
    with pytest.raises(AssertionError, match=said):
        raise AssertionError(error)


@pytest.mark.parametrize("data", [b"\xe9\n" + f"{HEAD}\n{ROW}".encode(), bytes(range(256)) * 9, b"\xff\xfe\x00"])
def test_what_is_no_text_is_said(tmp_path, capsys, data):
    path = tmp_path / "t.csv"
    path.write_bytes(data)
    assert main(["calibrate", str(path)]) == 2
    assert "save it as CSV in UTF-8" in capsys.readouterr().err


@pytest.mark.parametrize(
    "change",
    [
        lambda text: text.encode("utf-8-sig"),
        lambda text: text.encode("utf-16"),
        lambda text: text.replace("\n", "\r\n").encode(),
        lambda text: text.replace("\n", "\r").encode(),
        lambda text: text.replace(",", ";").encode(),
        lambda text: text.replace(",", "\t").encode(),
        lambda text: text.replace(",", " , ").encode(),
        lambda text: "\n".join(",".join(f'"{cell}"' for cell in line.split(",")) for line in text.split("\n")).encode(),
    ],
)
def test_tables_of_other_make_are_read(tmp_path, change):
    path = tmp_path / "t.csv"
    path.write_bytes(change(f"{HEAD}\n{ROW}\n{ROW}"))
    columns = read_table(path)
    assert list(columns) == HEAD.split(",")
    np.testing.assert_array_equal(columns["tangential_after"], [-0.03, -0.03])


def test_files_that_cannot_be(tmp_path, capsys):
    for path in (tmp_path, tmp_path / "none.csv"):
        assert main(["calibrate", str(path)]) == 2
        assert "no such file" in capsys.readouterr().err
