"""CSV logs: what a good one gives, and what a bad one gets, with its line."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from estimfw_inertial.readers import CsvLayout, read_log

from estimfw.errors import ConfigError, DataError

LAYOUT = CsvLayout(time="t", gyro=("gx", "gy", "gz"), accel=("ax", "ay", "az"))
HEADER = "t,gx,gy,gz,ax,ay,az"
Write = Callable[..., Path]


def rows(count: int = 4) -> list[list[object]]:
    return [[0.01 * (k + 1), *(0.1 * k + c for c in range(6))] for k in range(count)]


def layout(**fields: Any) -> CsvLayout:
    return replace(LAYOUT, **fields)


def refusal(path: Path, layout: CsvLayout = LAYOUT) -> str:
    with pytest.raises(DataError) as caught:
        read_log(path, layout)
    return str(caught.value)


def test_increments_arrive_to_the_last_bit(csv_of: Write) -> None:
    rng = np.random.default_rng(3)
    table = np.column_stack([0.01 * np.arange(1, 51), rng.standard_normal((50, 6))])
    log = read_log(csv_of(table), LAYOUT)
    assert np.array_equal(log.stream.time, table[:, 0])
    assert np.array_equal(log.stream.values, table[:, 1:])


def test_columns_are_found_by_name_and_others_ignored(csv_of: Write) -> None:
    text = "az,status,ay,ax,t,gz,gy,gx\n6,ok,5,4,0.01,3,2,1\n"
    assert read_log(csv_of(text), LAYOUT).stream.values.tolist() == [[1, 2, 3, 4, 5, 6]]


def test_rates_in_customary_units_become_increments_in_si(csv_of: Write) -> None:
    table = [[10.0 * k, 36.0, 0.0, 0.0, 0.0, 0.0, 1.0] for k in range(1, 6)]
    units = layout(values="rate", time_unit="ms", gyro_unit="deg/s", accel_unit="g")
    stream = read_log(csv_of(table), units).stream
    assert stream.time == pytest.approx([0.01, 0.02, 0.03, 0.04, 0.05])
    assert stream.values[0] == pytest.approx([np.radians(0.36), 0, 0, 0, 0, 0.0980665])


def test_a_unit_of_another_dimension_is_refused(csv_of: Write) -> None:
    with pytest.raises(ConfigError, match="the unit of the gyros is 'deg/s', which is in rad/s, not in rad"):
        read_log(csv_of(rows()), layout(gyro_unit="deg/s"))


@pytest.mark.parametrize(
    ("fields", "hint"),
    [
        ({"gyro_unit": "deg/s", "accel_unit": "g"}, "say `values: rate`"),
        ({"values": "rate", "gyro_unit": "deg", "accel_unit": "g*s"}, "say `values: increment`"),
        (
            {"values": "rate", "gyro_unit": "m/s"},
            "units: {gyro: rad/s, accel: m/s^2}`, or such as {gyro: deg/s, accel: g}",
        ),
        ({"accel_unit": "m"}, "units: {gyro: rad, accel: m/s}`, or such as {gyro: deg, accel: g*s}"),
        ({"time_unit": "deg"}, "`units: {time: s}`, or ms, us"),
    ],
)
def test_a_wrong_unit_gets_the_key_and_the_right_ones(csv_of: Write, fields: dict[str, str], hint: str) -> None:
    with pytest.raises(ConfigError) as caught:
        read_log(csv_of(rows()), layout(**fields))
    assert hint in str(caught.value.hint)


def test_decimal_commas_and_semicolons_are_read_when_said(csv_of: Write) -> None:
    text = "t;gx;gy;gz;ax;ay;az\n0,01;1,5;2;3;4;5;6\n"
    assert read_log(csv_of(text), layout(separator=";", decimal=",")).stream.values[0, 0] == 1.5


def test_byte_order_mark_comments_blank_lines_and_crlf_are_no_harm(csv_of: Write) -> None:
    text = "\ufeff# made by a logger\r\n\r\n" + HEADER + "\r\n0.01,1,2,3,4,5,6\r\n\r\n0.02,1,2,3,4,5,6\r\n"
    log = read_log(csv_of(text), LAYOUT)
    assert len(log.stream) == 2
    assert log.lines is not None and log.lines.tolist() == [4, 6]


def test_a_number_that_is_missing_stays_missing_in_its_own_component(csv_of: Write) -> None:
    table = rows()
    table[0][3], table[1][2], table[2][6], table[3][4] = "", "nan", "inf", " "
    values = read_log(csv_of(table), LAYOUT).stream.values
    assert np.argwhere(np.isnan(values)).tolist() == [[0, 2], [1, 1], [2, 5], [3, 3]]


def test_renamed_column_is_named_with_those_found(csv_of: Write) -> None:
    text = refusal(csv_of(rows(), "t,gyro_x,gy,gz,ax,ay,az"))
    assert "log.csv:1: no column 'gx'" in text
    assert "columns found: 't', 'gyro_x', 'gy'" in text


def test_all_missing_columns_are_named_at_once_with_the_key_to_say(csv_of: Write) -> None:
    text = refusal(csv_of(rows(), "time,wx,wy,wz,ax,ay,az"))
    assert "log.csv:1: no columns 't', 'gx', 'gy', 'gz'\n" in text
    assert "columns found: 'time', 'wx', 'wy', 'wz', 'ax', 'ay', 'az'" in text
    assert "source.columns={time: ..., gyro: [..., ..., ...], accel: [..., ..., ...]}" in text


def test_duplicate_column_is_refused_not_renamed(csv_of: Write) -> None:
    text = refusal(csv_of(rows(), "t,gx,gx,gy,gz,ax,ay,az"))
    assert "log.csv:1: the column 'gx' stands 2 times in the header" in text


def test_a_file_without_header_is_told_so(csv_of: Write) -> None:
    assert "the first line must hold the names" in refusal(csv_of("0.01,1,2,3,4,5,6\n0.02,1,2,3,4,5,6\n"))


def test_ragged_row_is_refused_with_its_line(csv_of: Write) -> None:
    table = rows()
    table[1].pop()
    assert "log.csv:3: 6 columns, expected 7" in refusal(csv_of(table))


def test_a_last_line_cut_off_is_told_so(csv_of: Write) -> None:
    table = rows()
    del table[3][3:]
    text = refusal(csv_of(table))
    assert "log.csv:5: 3 columns, expected 7" in text
    assert "cut off" in text


def test_text_in_a_number_cell_is_refused_with_its_line(csv_of: Write) -> None:
    table = rows()
    table[2][4] = "abc"
    assert "log.csv:4: 'abc' in column 5 is not a number" in refusal(csv_of(table))


def test_the_line_is_right_below_blank_lines_and_empty_cells(csv_of: Write) -> None:
    text = HEADER + "\n0.01,1,2,3,4,5,6\n\n\n0.02,,2,3,4,5,6\n0.03,1,2,True,4,5,6\n"
    assert "log.csv:6: 'True' in column 4" in refusal(csv_of(text))


def test_decimal_commas_between_semicolons_get_a_hint(csv_of: Write) -> None:
    text = refusal(csv_of("t;gx;gy;gz;ax;ay;az\n0,01;1;2;3;4;5;6\n"), layout(separator=";"))
    assert "'0,01' in column 1 is not a number\n  a decimal comma? Then say `decimal: ','`" in text


def test_decimal_commas_between_commas_get_a_hint(csv_of: Write) -> None:
    text = refusal(csv_of(HEADER + "\n0,01,1,5,2,5,3,5,4,5,5,5,6,5\n"))
    assert "log.csv:2: 14 columns, expected 7" in text
    assert "decimal commas?" in text


def test_wrong_separator_gets_a_hint(csv_of: Write) -> None:
    text = refusal(csv_of("t;gx;gy;gz;ax;ay;az\n0.01;1;2;3;4;5;6\n"))
    assert "the columns seem to be separated by ';': say `separator: ';'`" in text


@pytest.mark.parametrize(("text", "message"), [("", "the file is empty"), (HEADER + "\n\n", "no data rows")])
def test_zero_rows_are_refused(csv_of: Write, text: str, message: str) -> None:
    assert message in refusal(csv_of(text))


@pytest.mark.parametrize(("data", "message"), [(b"t,gx\n\xff\xfe1", ":2: byte 5 is not text"), (b"t\0\0", "is zero")])
def test_a_binary_file_is_refused(tmp_path: Path, data: bytes, message: str) -> None:
    path = tmp_path / "log.csv"
    path.write_bytes(data)
    assert message in refusal(path)
