"""viser's one page, served from our own origin with our head and our content security policy.

PAGE is the page, gzip; HEADERS are its response headers: send them all, and nothing that
contradicts them; ETAG is to be compared with If-None-Match.
"""

from __future__ import annotations

import gzip
import hashlib
from pathlib import Path

import viser

from vo_core.mosaic import UNSEEN_GREY

CSP = "; ".join(
    [
        "default-src 'none'",
        # No 'unsafe-eval': viser's client evaluates script that its server sends, and the address
        # of the page can name a foreign server.
        "script-src 'unsafe-inline' 'wasm-unsafe-eval' blob: data:",
        "style-src 'unsafe-inline'",
        "img-src data: blob:",
        "font-src data:",
        "worker-src blob: data:",
        "connect-src 'self' data: blob:",
        "base-uri 'none'",
        "form-action 'none'",
        "frame-ancestors 'self'",
    ]
)

# viser has no switch for panel and notifications; on a phone the panel is a sheet (3rd selector).
# The canvas is transparent where nothing is drawn, so the gradient is the sky of the scene.
_STYLE = """
[data-testid="floating-panel"], .mantine-Notifications-root,
.mantine-Paper-root[style*="position: fixed"] { display: none !important }
html, body, #root { background: #0b1015 }
div:has(> canvas) {
  background: radial-gradient(120% 90% at 50% 40%, #1c2732 0%, #111922 45%, #090d12 100%)
}
"""

# hasFocus: the client reconnects only while the frame has the focus, which it loses as soon as the
# operator works elsewhere on the page.
# shaderSource: labels are black on white without a choice; their two fragment shaders end in
# these colours (viser 1.1.1, LabelRenderer.tsx).
_SCRIPT = """
Document.prototype.hasFocus = () => true;
const shaderSource = WebGL2RenderingContext.prototype.shaderSource;
WebGL2RenderingContext.prototype.shaderSource = function (shader, source) {
  shaderSource.call(this, shader, source
    .replace("vec4(1.0, 1.0, 1.0, 0.85 * vAlpha)", "vec4(0.035, 0.055, 0.08, 0.72 * vAlpha)")
    .replace("gl_FragColor = vec4(0.0, 0.0, 0.0, a);", "gl_FragColor = vec4(0.93, 0.97, 1.0, a);"));
};
"""


# createImageBitmap: where the wall was not seen its pictures have one grey, and a JPEG knows no
# transparency.  Blocks of 8 x 8 pixels of nothing else, and what is like them beside them, are made
# transparent here.  Where the client decodes in another way (Safari) that grey is shown.
_UNSEEN_SCRIPT = """
const decode = window.createImageBitmap;
window.createImageBitmap = async function (source, ...rest) {
  const bitmap = await decode.call(this, source, ...rest);
  if (!(source instanceof Blob) || source.type !== "image/jpeg") return bitmap;
  const { width, height } = bitmap;
  const context = new OffscreenCanvas(width, height).getContext("2d", { willReadFrequently: true });
  context.drawImage(bitmap, 0, 0);
  bitmap.close();
  const picture = context.getImageData(0, 0, width, height);
  const { data } = picture;
  const isLike = (x, y, difference) => {
    const at = 4 * (y * width + x);
    for (let i = at; i < at + 3; i++) if (Math.abs(data[i] - UNSEEN) > difference) return false;
    return true;
  };
  const columns = Math.ceil(width / 8), rows = Math.ceil(height / 8);
  const isUnseen = new Uint8Array(columns * rows);
  const each = (column, row, visit) => {
    for (let y = 8 * row; y < Math.min(8 * row + 8, height); y++) {
      for (let x = 8 * column; x < Math.min(8 * column + 8, width); x++) {
        if (visit(x, y) === false) return false;
      }
    }
    return true;
  };
  for (let row = 0; row < rows; row++) {
    for (let column = 0; column < columns; column++) {
      isUnseen[row * columns + column] = each(column, row, (x, y) => isLike(x, y, 2));
    }
  }
  const isNearUnseen = (column, row) => {
    for (let r = Math.max(row - 2, 0); r <= Math.min(row + 2, rows - 1); r++) {
      for (let c = Math.max(column - 2, 0); c <= Math.min(column + 2, columns - 1); c++) {
        if (isUnseen[r * columns + c]) return true;
      }
    }
    return false;
  };
  for (let row = 0; row < rows; row++) {
    for (let column = 0; column < columns; column++) {
      if (!isNearUnseen(column, row)) continue;
      each(column, row, (x, y) => {
        if (isLike(x, y, 16)) data[4 * (y * width + x) + 3] = 0;
      });
    }
  }
  context.putImageData(picture, 0, 0);
  return decode.call(this, context.canvas, ...rest);
};
""".replace("UNSEEN", str(UNSEEN_GREY))


def with_our_head(page: str) -> str:
    """viser's page, served or stand-alone, without panel and in our colours."""
    before, head, after = page.partition("<head>")
    if not head:
        raise RuntimeError(f"viser {viser.__version__} has a page without <head>; 1.1.1 is needed.")
    return f"{before}{head}<style>{_STYLE}</style><script>{_SCRIPT}{_UNSEEN_SCRIPT}</script>{after}"


def _build_page() -> bytes:
    index = Path(viser.__file__).parent / "client" / "build" / "index.html"
    return gzip.compress(with_our_head(index.read_text("utf-8")).encode(), 9, mtime=0)


PAGE = _build_page()
ETAG = f'"{hashlib.sha256(PAGE).hexdigest()[:32]}"'
HEADERS = {
    "Content-Type": "text/html; charset=utf-8",
    "Content-Encoding": "gzip",
    "Content-Security-Policy": CSP,
    "ETag": ETAG,
    # The page and the server must be of one viser version.
    "Cache-Control": "no-cache",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
}
