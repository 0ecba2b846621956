/** Exchanges the access token for a session cookie and goes on to the page that was asked for. */

import { ApiError, post } from './core/api.js';
import { html, render } from './core/html.js';
import { preferences } from './core/preferences.js';
import { LANGUAGES, errorText, language, t } from './core/words.js';
import { showInsecure } from './components/insecure-banner/insecure-banner.js';

/** Set while the language was chosen here and the server does not know of it. */
const CHOSEN_HERE = 'chainage.language-chosen';

const box = document.createElement('div');
box.className = 'login__box';
document.title = t('login.title');
const { form, token: field, fault, submit: button } = render(
  box,
  html`<p class="dim">${t('login.tagline')}</p>
    <form class="login__form" data-part="form" novalidate>
      <div class="field">
        <label for="token">${t('login.token')}</label>
        <input class="input" id="token" name="token" type="password" autocomplete="current-password"
          autocapitalize="off" spellcheck="false" required aria-describedby="fault help" data-part="token" />
        <p class="fault" id="fault" role="alert" data-part="fault"></p>
      </div>
      <button class="button button--primary" data-part="submit">${t('login.submit')}</button>
      <p class="help" id="help">${t('login.help')}</p>
    </form>
    <div class="login__languages" role="group" aria-label="${t('settings.language')}">
      ${LANGUAGES.map(([code, name]) => html`<button type="button" class="button button--small" lang="${code}"
        data-language="${code}" aria-pressed="${String(code === language)}">${name}</button>`)}
    </div>`,
);
document.querySelector('.login').append(box);
showInsecure();
field.focus();

for (const choice of box.querySelectorAll('[data-language]')) {
  choice.addEventListener('click', () => {
    preferences.keep({ language: choice.dataset.language });
    sessionStorage.setItem(CHOSEN_HERE, 'yes');
    location.reload();
  });
}

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

/** The language that was chosen on this page goes before the one of earlier days. */
async function keepLanguage() {
  if (!sessionStorage.getItem(CHOSEN_HERE)) return;
  sessionStorage.removeItem(CHOSEN_HERE);
  await preferences.load();
  try {
    await preferences.save({ language });
  } catch (error) {
    if (!(error instanceof ApiError)) throw error; // no reason to keep the person out
  }
}

form.addEventListener('submit', async (event) => {
  event.preventDefault();
  const token = field.value.trim();
  if (!token) {
    refuse(t('login.empty'));
    return;
  }
  button.disabled = true;
  try {
    await post('/api/login', { token });
    await keepLanguage();
    location.assign(destination());
  } catch (error) {
    if (!(error instanceof ApiError)) throw error;
    refuse(error.status === 401 ? t('login.unknown') : errorText(error));
  } finally {
    button.disabled = false;
  }
});
