// The 3D view is unpacked on request: it needs a graphics card, and paper cannot show it.
const button = document.getElementById('scene-open');
button.addEventListener('click', () => {
  const packed = atob(document.getElementById('scene-page').textContent);
  const place = document.getElementById('scene-place');
  const frame = document.createElement('iframe');
  frame.title = place.dataset.title;
  // Without an origin of its own, the frame cannot reach this page.
  frame.sandbox = 'allow-scripts';
  frame.srcdoc = new TextDecoder().decode(Uint8Array.from(packed, (byte) => byte.charCodeAt(0)));
  place.append(frame);
  button.disabled = true;
});
