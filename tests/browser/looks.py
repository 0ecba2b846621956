"""How a page looks to those who see it differently: the faults that axe-core finds."""

from __future__ import annotations

from typing import Literal

from axe_playwright_python.base import AXE_SCRIPT
from playwright.sync_api import Page

COLOUR_RULES = ["color-contrast", "link-in-text-block"]
"""All that axe-core checks by default and that depends on colours."""

_RUN = """([within, rules]) => axe.run(within ?? document, {
  // viser's client in its frame is not ours to mend.
  iframes: false,
  // It would fetch every style sheet and sound again, for a rule about sounds that play unasked.
  preload: false,
  // What passed is thousands of elements, which no one reads.
  resultTypes: ['violations'],
  ...(rules && { runOnly: { type: 'rule', values: rules } }),
}).then(({ violations }) => violations.flatMap(({ id, nodes }) => nodes.map(
  ({ html, failureSummary }) => `${id}: ${html}\\n${failureSummary}`)))"""


def faults(page: Page, rules: list[str] | None = None, *, within: str | None = None) -> list[str]:
    """Return the faults of the page as it looks now: by all rules, or by those that are named.

    `within` selects a part of it, where only that is new.
    """
    if not page.evaluate("'axe' in window"):
        page.evaluate(AXE_SCRIPT)
    found: list[str] = page.evaluate(_RUN, [within, rules])
    return found


def expect_no_fault(
    page: Page,
    schemes: tuple[Literal["dark", "light"], ...] = ("dark", "light"),
    *,
    within: str | None = None,
) -> None:
    """In no scheme of colours; all that a second scheme changes is colours."""
    rules = None
    for scheme in schemes:
        page.emulate_media(color_scheme=scheme, reduced_motion="reduce")
        assert faults(page, rules, within=within) == [], scheme
        rules = COLOUR_RULES
