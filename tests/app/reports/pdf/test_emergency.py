"""The act-now sheet: one page whatever happens."""

from dataclasses import replace

import pypdfium2
from hypothesis import given
from hypothesis import strategies as st
from reports import entry, full_report, remarked, report

from app.reports.pdf import emergency


def pages_of(content):
    with pypdfium2.PdfDocument(content) as pdf:
        return [" ".join(page.get_textpage().get_text_range().split()) for page in pdf]


def test_it_states_what_where_and_who(tmp_path):
    (page,) = pages_of(emergency.write(full_report(tmp_path)).content)

    for words in ("Act now", "CUL-0041", "FT 5 Jalan Klang–Banting", "Broken wall: fallen in",
                 "12.40 m ± 0.06 m", "9–2 o’clock", "51.452500, 9.000179", "Operator 1",
                 "wall fallen in; road above: act now", "Page 1 / 1"):  # fmt: skip
        assert words in page


def test_in_malay():
    (page,) = pages_of(emergency.write(report(language="ms", units="ft")).content)

    assert "Tindakan segera" in page
    assert "40.7 ft ± 0.2 ft" in page


def test_the_others_of_severity_5_are_listed_and_the_rest_counted():
    observations = [{"distance_m": float(n), "code": "BAC", "severity": 5} for n in range(1, 10)]
    (page,) = pages_of(emergency.write(report(observations=observations)).content)

    assert page.index("1.00 m") < page.index("2.00 m") < page.index("5.00 m")
    assert "6.00 m" not in page
    assert "and 4 more in the report" in page


def test_without_severity_5_it_says_so():
    (page,) = pages_of(emergency.write(report(observations=())).content)

    assert "No observation has severity 5." in page
    assert "No emergency" in page
    assert "Act now" not in page


def test_a_quick_tag_without_a_kind_is_called_as_on_the_page():
    observations = [{"distance_m": 1.0, "code": "BAC", "severity": 5}]
    (page,) = pages_of(emergency.write(report(observations=observations)).content)

    assert "Broken wall (BAC)" in page
    assert "not in the pack" not in page


@given(st.text(max_size=4000), st.integers(0, 8))
def test_it_is_always_one_page(text, others):
    urgent = [entry(n, distance_m=float(n), code="BAC", severity=5) for n in range(1, others + 2)]
    urgent[0] = replace(remarked(urgent[0], text), tagged_by=text)
    made = report(entries=tuple(urgent), header={"asset_id": text, "road": text, "operator": text})

    assert len(pages_of(emergency.write(made).content)) == 1
