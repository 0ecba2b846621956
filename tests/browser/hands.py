"""A person at a page, whose actions are counted."""

from __future__ import annotations

from pathlib import Path

from playwright.sync_api import Locator, Page
from steps import export


class Hands:
    """A person at the page, who counts."""

    def __init__(self, page: Page) -> None:
        self.page = page
        self.actions = 0

    def press(self, key: str) -> None:
        self.actions += 1
        self.page.keyboard.press(key)

    def number(self, text: str) -> None:
        """A short number is one action."""
        self.actions += 1
        for sign in text:
            self.page.keyboard.press(sign)

    def click(self, what: Locator) -> None:
        self.actions += 1
        what.click()

    def select(self, what: Locator, choice: str) -> None:
        self.actions += 1
        what.select_option(choice)

    def type(self, what: Locator, text: str) -> None:
        """A short text is one action, with the click into its field."""
        self.actions += 1
        what.fill(text)

    def choose(self, what: Locator, file: Path) -> None:
        """Press a button that asks for a file, and choose it."""
        with self.page.expect_file_chooser() as asked:
            self.click(what)
        self.actions += 1
        asked.value.set_files(file)

    def answer(self, *answers: str) -> None:
        """Letters and numbers, and how grave the defect is."""
        for answer in answers:
            (self.press if answer.isalpha() else self.number)(answer)

    def finish(self) -> None:
        """Finish a survey that reached its end."""
        self.click(self.page.get_by_role("button", name="Finish", exact=True))
        dialog = self.page.get_by_role("dialog")
        self.click(dialog.get_by_label("The end was reached"))
        self.click(dialog.get_by_role("button", name="Finish"))

    def export(self, name: str) -> bytes:
        """Download a format: the menu, the format, its button."""
        self.actions += 3
        return export(self.page, name)
