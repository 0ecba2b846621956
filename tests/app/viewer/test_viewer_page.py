import gzip

from app.viewer import page

HTML = gzip.decompress(page.PAGE).decode()


def test_our_head_comes_before_anything_of_viser() -> None:
    head = HTML.index("<head>")
    assert HTML.index("hasFocus = () => true") > head
    assert HTML.index("hasFocus = () => true") < HTML.index("Viser client")


def test_policy_forbids_foreign_servers_and_evaluated_script() -> None:
    policy = page.HEADERS["Content-Security-Policy"]
    assert "connect-src 'self' blob:" in policy
    assert "'unsafe-inline' 'wasm" not in policy
    assert "sandbox allow-scripts" in policy
    assert "frame-ancestors 'self'" in policy
    assert "'unsafe-eval'" not in policy.replace("'wasm-unsafe-eval'", "")


def test_page_is_checked_again_and_never_stale() -> None:
    assert page.HEADERS["Cache-Control"] == "no-cache"
    assert page.HEADERS["ETag"] == page.ETAG
