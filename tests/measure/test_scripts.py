"""Every script of this folder runs, in its shortest form: else it rots."""

import subprocess
import sys
from pathlib import Path

import pytest

FOLDER = Path(__file__).parent
SHORTEST = {
    "archive": ["equal", "--films", "2"],
    "collection": [],
    "counter": ["--only", "white on a light wall"],
    "features": ["--features", "3000"],
    "film_of_the_desk": ["{out}/desk.webp"],
    "long_survey": ["20x2000"],
    "map": ["--assets", "200", "--inspections", "1"],
    "report": [],
    "resilience": ["--files", "20", "--rounds", "2", "--seconds", "8"],
    "screenshots": ["{out}"],
    "walls": ["--culverts", "2", "--tracked", "0", "--length-mm", "2000"],
}


def ran(*words: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, str(FOLDER), *words], capture_output=True, text=True)


def test_without_a_name_it_lists_the_scripts_all_of_which_are_tried_here() -> None:
    listed = ran()
    assert listed.returncode == 2
    assert [line.split()[0] for line in listed.stdout.splitlines()] == sorted(SHORTEST)


@pytest.mark.long
@pytest.mark.timeout(900)
@pytest.mark.parametrize("name", SHORTEST)
def test_a_script_runs_in_its_shortest_form(name: str, tmp_path: Path) -> None:
    ended = ran(name, *(word.format(out=tmp_path) for word in SHORTEST[name]))
    assert ended.returncode == 0, f"{ended.stdout[-3000:]}\n{ended.stderr[-5000:]}"
