/** Exchanges the access token for a session cookie and goes on to the page that was asked for. */

import { ApiError, post } from './core/api.js';

const form = document.querySelector('#login');
const field = document.querySelector('#token');
const fault = document.querySelector('#fault');
const button = document.querySelector('#submit');

const REASONS = {
  401: 'This token is not known here. Check that it was copied whole, without spaces.',
  429: 'Too many attempts. Wait a minute, then try again.',
};

/** Only an address of this site, else the list. */
function destination() {
  const next = new URLSearchParams(location.search).get('next') ?? '/';
  const url = new URL(next, location.origin);
  return url.origin === location.origin ? url.pathname + url.search : '/';
}

function refuse(text) {
  fault.textContent = text;
  field.setAttribute('aria-invalid', 'true');
  field.focus();
  field.select();
}

form.addEventListener('submit', async (event) => {
  event.preventDefault();
  const token = field.value.trim();
  if (!token) {
    refuse('Paste the access token first.');
    return;
  }
  button.disabled = true;
  try {
    await post('/api/login', { token });
    location.assign(destination());
  } catch (error) {
    if (!(error instanceof ApiError)) throw error;
    refuse(REASONS[error.status] ?? error.message);
  } finally {
    button.disabled = false;
  }
});
