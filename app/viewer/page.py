"""Serves viser's page from our own origin with our head and content security policy.

PAGE is the page, gzip. HEADERS are its response headers: send all of them and nothing that
contradicts them. Compare ETAG with If-None-Match.
"""

from __future__ import annotations

import base64
import gzip
import hashlib
import re
from pathlib import Path

import viser
import zstandard

from vo_core.mosaic.layout import UNSEEN_GREY

# viser cannot switch off panel and notifications; on a phone the panel is a sheet (3rd selector).
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
# shaderSource: viser draws labels black on white and has no option for it; the two fragment shaders
# of labels end in these colours (viser 1.1.1, LabelRenderer.tsx).
_SCRIPT = """
Document.prototype.hasFocus = () => true;
const shaderSource = WebGL2RenderingContext.prototype.shaderSource;
WebGL2RenderingContext.prototype.shaderSource = function (shader, source) {
  shaderSource.call(this, shader, source
    .replace("vec4(1.0, 1.0, 1.0, 0.85 * vAlpha)", "vec4(0.035, 0.055, 0.08, 0.72 * vAlpha)")
    .replace("gl_FragColor = vec4(0.0, 0.0, 0.0, a);", "gl_FragColor = vec4(0.93, 0.97, 1.0, a);"));
};
"""


# createImageBitmap: the unseen wall has one grey in the pictures, as a JPEG has no transparency.
# This script makes it transparent: blocks of 8 x 8 pixels of that grey alone, and similar pixels
# beside them.  A client that decodes in another way (Safari) shows the grey.
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


def with_our_head(page: str, more: str = "") -> str:
    """Return viser's page, served or stand-alone, without panel and in our colours.

    `more` is a script that runs before viser's.
    """
    before, head, after = page.partition("<head>")
    if not head:
        raise _wrong_version("has a page without <head>")
    script = _SCRIPT + _UNSEEN_SCRIPT + more
    return f"{before}{head}<style>{_STYLE}</style><script>{script}</script>{after}"


def _policy(scripts: list[str]) -> str:
    """Return a content security policy that allows only these scripts."""
    hashes = " ".join(
        f"'sha256-{base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()}'"
        for script in scripts
    )
    return "; ".join(
        [
            # A separate origin: no cookie is sent from here, and nothing of ours can be read.
            "sandbox allow-scripts",
            "default-src 'none'",
            # No 'unsafe-eval': viser's client evaluates script that its server sends.
            f"script-src {hashes} 'wasm-unsafe-eval'",
            "style-src 'unsafe-inline'",
            "img-src data: blob:",
            "font-src data:",
            "worker-src blob: data:",
            # No data: here, or an address could contain a scene.
            "connect-src 'self' blob:",
            "base-uri 'none'",
            "form-action 'none'",
            "frame-ancestors 'self'",
        ]
    )


_INLINE_SCRIPT = re.compile(r"<script\b[^>]*>(.*?)</script>", re.DOTALL)
_PACKED = re.compile(r'data-p="([^"]*)" data-ss="(\d+)" data-cs="(\d+)"')
"""Style and script of viser's client, and their sizes in bytes (vite-plugin-compress-html)."""
_DIGITS = {
    code: digit for digit, code in enumerate(b for b in range(0x21, 0x7F) if b not in b"\"&<>'`")
}
"""Digits of base 88: five of them encode four bytes."""


def _packed_script(page: str) -> str:
    """Return the script that viser's client unpacks and adds to its page."""
    packed = _PACKED.search(page)
    if packed is None:
        raise _wrong_version("packs its client in another way")
    text, style_bytes, script_bytes = packed[1].encode(), int(packed[2]), int(packed[3])
    unpacked = zstandard.ZstdDecompressor().decompress(_from_base_88(text))
    if len(unpacked) != style_bytes + script_bytes:
        raise _wrong_version("packs its client in another way")
    return unpacked[style_bytes:].decode()


def _from_base_88(text: bytes) -> bytes:
    decoded = bytearray()
    for start in range(0, len(text), 5):
        group = text[start : start + 5]
        value = 0
        for code in group:
            value = 88 * value + _DIGITS[code]
        decoded += value.to_bytes(len(group) - 1, "big")
    return bytes(decoded)


def _wrong_version(what: str) -> RuntimeError:
    return RuntimeError(f"viser {viser.__version__} {what}; 1.1.1 is needed.")


_HERE = Path(__file__).parent
_INDEX = (Path(viser.__file__).parent / "client" / "build" / "index.html").read_text("utf-8")
_TEXT = with_our_head(_INDEX, (_HERE / "frame.js").read_text("utf-8"))

PAGE = gzip.compress(_TEXT.encode(), 9, mtime=0)
ETAG = f'"{hashlib.sha256(PAGE).hexdigest()[:32]}"'
HEADERS = {
    "Content-Type": "text/html; charset=utf-8",
    "Content-Encoding": "gzip",
    "Content-Security-Policy": _policy([*_INLINE_SCRIPT.findall(_TEXT), _packed_script(_INDEX)]),
    # A browser refuses to open a sandboxed page on its own if it has an opener policy.
    "Cross-Origin-Opener-Policy": "unsafe-none",
    "ETag": ETAG,
    # The page and the server must have the same viser version.
    "Cache-Control": "no-cache",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
}
