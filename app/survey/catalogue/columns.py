"""The columns of a table of codes and of ratings, and what each is for."""

from __future__ import annotations

from collections.abc import Mapping

from app.survey.catalogue.ratings import GRADES
from app.survey.catalogue.table import LABEL_LANGUAGES

UNITS = ("mm", "%", "deg", "ppm", "count")

NEEDED: Mapping[str, str] = {
    "code": "Main code, 1 to 8 capital letters and digits",
    "char1": "First characterisation; empty: none, or left open",
    "char2": "Second characterisation, as char1",
    "label": "Meaning: the code, a colon, then what each characterisation adds, with commas",
    "group": "S structure, O operation (both are defects), C inventory, M other",
    "needs_clock": "Whether a clock position is needed: yes, no or opt",
    "needs_q1": "Whether the first quantity is needed: yes, no or opt",
    "unit_q1": f"Its unit: {', '.join(UNITS)}",
    "needs_q2": "Whether the second quantity is needed",
    "unit_q2": "Its unit",
    "continuous_allowed": "Whether it may be a stretch: yes or no",
}
LABELS = {f"label_{name}": f"Label in the language {name}" for name in LABEL_LANGUAGES}
THRESHOLDS = {f"grade_{grade}": f"From which value on the grade is {grade}" for grade in GRADES}
BOUNDS: Mapping[str, str] = {
    "min_q1": "Least first quantity that the checks accept",
    "max_q1": "Greatest first quantity",
    "min_q2": "Least second quantity",
    "max_q2": "Greatest second quantity",
}
OPTIONAL: Mapping[str, str] = {
    **LABELS,
    "grade_s": "Grade of the structure that every such defect has",
    "grade_o": "Grade of the operation that every such defect has",
    **BOUNDS,
    "grade_by": "The quantity that decides the grade instead: q1 or q2",
    **THRESHOLDS,
    "en13508": "Code of EN 13508-2 that stands for it in exchange files, such as BAB B A",
    "finding": "Kind of a proposal that begins as this code, such as crack or crack along",
    "hotkey": "Key of the code on the desk, such as 1",
    "icon": "Name of a picture",
}
RATING_NEEDED: Mapping[str, str] = {
    "rating": "Name of the rating, 2 to 16 capital letters, digits or _",
    "label": "What reports call it",
    "of": "Groups that it rates (S O), or ratings of rows above, with spaces between",
    "rule": "peak, mean, sum, per_m (sum for each metre), count, or quick (the two highest grades, "
    "with how many there are of each)",
}
RATING_OPTIONAL: Mapping[str, str] = {**LABELS, **THRESHOLDS}
