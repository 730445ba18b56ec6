"""A first row with more cells than there are names is refused like any other."""

import pytest

from harvester.errors import InputError
from harvester.records.csv_table import read_table

ROWS = [f"{k},{k}e-6" for k in range(1, 9)]


@pytest.mark.parametrize("extra", ["", "0,"])
def test_a_longer_first_row_is_refused(tmp_path, extra):
    """Its last cell was dropped without a word: 0,5,9e-07 of a decimal comma was 0 and 5."""
    text = f"f (Hz),psd (g^2/Hz)\n0,5,{extra}9e-07\n" + "\n".join(ROWS) + "\n"
    (tmp_path / "a.csv").write_text(text)
    with pytest.raises(InputError, match=r"of 2 columns, .* cells in row 1, .*correct or delete"):
        read_table(tmp_path / "a.csv", "FILE")


def test_a_delimiter_at_the_end_of_each_row_is_no_cell(tmp_path):
    text = "f (Hz),psd (g^2/Hz),\n" + "".join(f"{row},\n" for row in ROWS)
    (tmp_path / "a.csv").write_text(text)
    table = read_table(tmp_path / "a.csv", "FILE")
    assert [column.values.tolist()[:2] for column in table.columns][:2] == [[1, 2], [1e-6, 2e-6]]
