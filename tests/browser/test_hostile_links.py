"""Whatever ran in the 3D view could change nothing."""

from __future__ import annotations

import pytest
from builders import TOKEN, Client
from playwright.sync_api import Browser

ATTACK = """async (id) => {
  const tried = {};
  const put = (html, event) => {
    document.body.insertAdjacentHTML('beforeend', html);
    return new Promise((happens) => document.body.lastChild.addEventListener(event, happens));
  };
  const image = put('<img src="data:," onerror="window.ran = true">', 'error');
  const frame = put('<iframe srcdoc="<script>parent.ran = true</script>"></iframe>', 'load');
  const script = document.createElement('script');
  script.textContent = 'window.ran = true';
  document.body.append(script);
  await Promise.all([image, frame]);
  tried.ran = window.ran ?? false;
  const readable = (read) => { try { return read(); } catch (error) { return error.name; } };
  tried.cookie = readable(() => document.cookie);
  tried.page = readable(() => parent.document.title);
  tried.made = readable(() => new Function('return 1')()());
  for (const [method, path] of [['PATCH', ''], ['GET', '']]) {
    tried[method] = await fetch(`/api/inspections/${id}${path}`, {
      method, credentials: 'include', headers: { 'Content-Type': 'application/json' },
      body: method === 'PATCH' ? '{"name": "stolen"}' : undefined,
    }).then(({ status }) => status, (error) => error.name);
  }
  tried.live = await new Promise((resolve) => {
    const server = location.origin.replace('http', 'ws');
    const socket = new WebSocket(`${server}/api/inspections/${id}/live`);
    socket.onopen = () => resolve('open');
    socket.onerror = () => resolve('refused');
  });
  tried.data = await fetch('data:text/plain,x').then(() => 'fetched', (error) => error.name);
  return tried;
}"""


@pytest.mark.webgl
def test_what_runs_in_the_3d_view_can_change_nothing(
    browser: Browser, shared: Client, done: str
) -> None:
    page = browser.new_page()
    page.goto(f"{shared.server.url}/login?token={TOKEN}&next=/inspections/{done}")
    page.frame_locator("viewer-panel iframe").locator("canvas[data-engine]").wait_for()
    view = page.frames[-1]
    assert f"/viewer/{done}/" in view.url
    assert view.evaluate(ATTACK, done) == {
        "ran": False,
        "cookie": "SecurityError",
        "page": "SecurityError",
        "made": "EvalError",
        "PATCH": "TypeError",
        "GET": "TypeError",
        "live": "refused",
        "data": "TypeError",
    }
    page.close()
    assert shared.inspection(done)["name"] == "Culvert 7"
