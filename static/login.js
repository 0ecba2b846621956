/** Exchanges the access token for a session cookie; the server knows the next page. */

import { ApiError, get, post } from './core/server/api.js';
import { html, render } from './core/page/html.js';
import { preferences } from './core/page/preferences.js';
import { LANGUAGES, errorText, language, t } from './core/page/words.js';
import { showInsecure } from './components/shared/insecure-banner/insecure-banner.js';

/** Set while the language was chosen here and the server does not know it yet. */
const CHOSEN_HERE = 'chainage.language-chosen';

const asked = new URLSearchParams(location.search);
/** Token of a link that is followed only after a question; it is removed from the address. */
const linked = asked.get('token');
asked.delete('token');
const onward = `/login?${asked}`;
history.replaceState(null, '', onward);

const box = document.createElement('div');
box.className = 'login__box';
document.title = t('login.title');
const {
  form,
  token: field,
  fault,
  submit: button,
  link,
  session,
  stay,
} = render(
  box,
  html`<p class="dim">${t('login.tagline')}</p>
    <form class="login__form" data-part="form" novalidate>
      <p data-part="link" hidden>${t('login.link')}</p>
      <p data-part="session" hidden></p>
      <div class="field">
        <label for="token">${t('login.token')}</label>
        <input class="input" id="token" name="token" type="password" autocomplete="current-password"
          autocapitalize="off" spellcheck="false" required aria-describedby="fault help" data-part="token" />
        <p class="fault" id="fault" role="alert" data-part="fault"></p>
      </div>
      <button class="button button--primary" data-part="submit">${t('login.submit')}</button>
      <a class="button" href="${onward}" data-part="stay" hidden></a>
      <p class="help" id="help">${t('login.help')}</p>
    </form>
    <div class="login__languages" role="group" aria-label="${t('settings.language')}">
      ${LANGUAGES.map(
        ([code, name]) => html`<button type="button" class="button button--small" lang="${code}"
        data-language="${code}" aria-pressed="${String(code === language)}">${name}</button>`,
      )}
    </div>`,
);
document.querySelector('.login').append(box);
showInsecure();
field.focus();
if (linked) askAboutLink();

/** Shows what the link would do, and what it would replace. */
async function askAboutLink() {
  field.value = linked;
  link.hidden = false;
  try {
    const { name } = await get('/api/session');
    session.textContent = t('login.session', { name });
    stay.textContent = t('login.stay', { name });
    session.hidden = stay.hidden = false;
  } catch (error) {
    if (!(error instanceof ApiError)) throw error; // nobody is logged in, so nothing is replaced
  }
}

for (const choice of box.querySelectorAll('[data-language]')) {
  choice.addEventListener('click', () => {
    preferences.keep({ language: choice.dataset.language });
    sessionStorage.setItem(CHOSEN_HERE, 'yes');
    location.reload();
  });
}

function refuse(text) {
  fault.textContent = text;
  field.setAttribute('aria-invalid', 'true');
  field.focus();
  field.select();
}

/** Sends the language chosen on this page, which replaces an earlier one. */
async function keepLanguage() {
  if (!sessionStorage.getItem(CHOSEN_HERE)) return;
  sessionStorage.removeItem(CHOSEN_HERE);
  await preferences.load();
  try {
    await preferences.save({ language });
  } catch (error) {
    if (!(error instanceof ApiError)) throw error; // no reason to refuse the person
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
    location.assign(onward);
  } catch (error) {
    if (!(error instanceof ApiError)) throw error;
    refuse(error.status === 401 ? t('login.unknown') : errorText(error));
  } finally {
    button.disabled = false;
  }
});
