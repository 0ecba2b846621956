"""What of the modules below the page only a browser has: elements, windows, two people's pages.

The others are tried in Node: `tests/javascript`.
"""

from __future__ import annotations

import pytest
from playwright.sync_api import Browser, Page, expect
from steps import Server, log_in


@pytest.fixture
def site(page: Page, server: Server) -> Page:
    """A document of the server in which nothing runs but the modules that a test imports."""
    log_in(page, server, "/healthz")
    return page


def test_text_is_escaped_wherever_it_comes_from(site: Page) -> None:
    evil = "<img src=x onerror=alert(1)>\"'&"
    shown = site.evaluate(
        """async (evil) => {
          const { html, render } = await import('/static/core/page/html.js');
          const element = document.createElement('div');
          const nested = [html`<b>${evil}</b>`, null, false];
          render(element, html`<p title="${evil}">${evil}${nested}</p>`);
          const [p] = element.children;
          return [p.title, p.textContent, element.querySelectorAll('img').length];
        }""",
        evil,
    )
    assert shown == [evil, evil + evil, 0]


def test_a_field_takes_a_key_only_while_it_is_shown(site: Page) -> None:
    """It has the focus of a dialog that has just closed until the page is drawn again."""
    run = site.evaluate(
        """async () => {
          const { bindKeys } = await import('/static/core/page/keys.js');
          const field = document.body.appendChild(document.createElement('input'));
          const run = [];
          const bindings = [{ keys: ['1', 'Escape'], run: (_, key) => run.push(key) }];
          bindKeys(document, bindings, new AbortController().signal);
          const press = (key) =>
            field.dispatchEvent(new KeyboardEvent('keydown', { key, bubbles: true }));
          field.onkeydown = ({ key }) => (field.hidden = key === 'Escape'); // as a form that closes
          press('1');
          press('Escape');
          const whileShown = run.splice(0);
          press('1');
          return [whileShown, run];
        }"""
    )
    assert run == [[], ["1"]]


def test_a_fault_leaves_once_the_person_goes_on_or_the_server_answers_again(
    browser: Browser, server: Server
) -> None:
    site = browser.new_context().new_page()  # a clock is that of all pages of a window
    log_in(site, server, "/healthz")
    site.clock.install(time=0)
    site.clock.pause_at(1)  # else it goes on while the test is slow
    site.evaluate(
        """async () => {
          const { toast } = await import('/static/components/shared/toast-stack/toast-stack.js');
          const { get } = await import('/static/core/server/api.js');
          Object.assign(window, { toast, ask: () => get('/healthz') });
          document.body.append(document.createElement('toast-stack'));
        }"""
    )
    shown = site.locator(".toast")
    for kind, over in (
        ({}, lambda: site.keyboard.press("a")),
        ({}, lambda: site.mouse.click(300, 5)),
        ({"isUnreachable": True}, lambda: site.evaluate("() => ask()")),
    ):
        site.evaluate("(kind) => toast('No.', { kind: 'error', ...kind })", kind)
        site.clock.fast_forward("10:00")
        expect(shown).to_have_count(1)
        over()
        site.clock.fast_forward(6000)
        expect(shown).to_have_count(1)
        site.clock.fast_forward(6000)
        expect(shown).to_have_count(0)
    site.context.close()


TWO_DESKS = """async () => {
  const { DeskWindows, followDesk } = await import('/static/core/page/desk-windows.js');
  const { Store } = await import('/static/core/page/store.js');
  const deskOf = () => Object.assign(new EventTarget(), {
    inspection: { id: 'one' },
    playhead: new Store({ frame: 0 }),
    selection: new Store(null),
    picking: new Store(null),
    observations: Object.assign(new Store([]), {
      find(id) { return this.value.find((item) => item === id) ?? null; },
    }),
    select(id) { this.selection.set(id); },
  });
  window.desk = () => {
    const lifetime = new AbortController();
    const desk = deskOf();
    return { desk, windows: new DeskWindows(desk, lifetime.signal), leave: () => lifetime.abort() };
  };
  window.here = desk();
  let address;
  window.open = (url) => { address = url; return window; };
  here.windows.toggle('wall');
  const id = sessionStorage.getItem('chainage.desk');
  sessionStorage.clear(); // as in another tab
  window.other = desk();
  history.replaceState(null, '', address);
  window.wall = deskOf();
  followDesk(wall, 'wall', new AbortController().signal);
  sessionStorage.setItem('chainage.desk', id);
}"""


def test_a_window_belongs_to_the_desk_that_opened_it(site: Page) -> None:
    site.evaluate(TWO_DESKS)
    site.wait_for_function("() => here.windows.has('wall')")
    site.evaluate("() => { here.leave(); window.again = desk(); }")  # as a reload does
    site.wait_for_function("() => again.windows.has('wall')")
    assert site.evaluate("other.windows.value") == []

    # Escape in the window ends what the desk wanted a click for.
    site.evaluate("again.desk.picking.set(() => {})")
    site.wait_for_function("() => wall.picking.value")
    site.evaluate("() => { wall.selection.set('tag'); wall.picking.set(null); }")
    site.wait_for_function("() => !again.desk.picking.value")

    # Whoever has gone on at the desk is not brought back to what the window has tagged meanwhile.
    site.evaluate("""() => {
      again.desk.observations.set(['another']);
      again.desk.selection.set('another');
      again.desk.observations.set(['another', 'tag']);
    }""")
    assert site.evaluate("again.desk.selection.value") == "another"

    # This page was opened by no script, so that none may close it.
    site.route("**/inspections/one", lambda route: route.fulfill(body="the desk"))
    with site.expect_navigation(url="**/inspections/one"):
        site.evaluate("() => { setTimeout(() => again.windows.toggle('wall')); }")


def test_remarks_of_two_tabs_are_kept_for_the_person_who_typed_them(site: Page) -> None:
    def as_person(name: str, script: str) -> object:
        site.reload()
        return site.evaluate(
            f"""async (name) => {{
              document.documentElement.dataset.person = name;
              const {{ RemarkDrafts }} = await import('/static/core/defects/remark-drafts.js');
              const [here, there] = [new RemarkDrafts('one'), new RemarkDrafts('one')];
              {script}
            }}""",
            name,
        )

    as_person("Ann", "here.put('a', 'Is it wet?'); there.put('b', 'Roots'); here.put('a', 'Wet?');")
    assert as_person("Ben", "return here.value;") == {}
    assert as_person("Ann", "return here.value;") == {"a": "Wet?", "b": "Roots"}
    sent = "here.put('a', ''); there.put('b', ''); return Object.keys(localStorage).join();"
    assert "remarks" not in str(as_person("Ann", sent))
