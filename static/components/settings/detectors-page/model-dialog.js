/** Asks for a model and its declaration; the server checks both before it keeps them. */

import { ApiError, post } from '../../../core/server/api.js';
import { html, setText } from '../../../core/page/html.js';
import { Upload } from '../../../core/server/upload.js';
import { t } from '../../../core/page/words.js';
import { closesWhenSent, formFoot, openDialog } from '../../shared/dialog/dialog.js';
import { icon } from '../../shared/icon/icon.js';
import { toastError } from '../../shared/toast-stack/toast-stack.js';
import { EXAMPLE } from './example.js';

/** @returns {Promise<boolean>} whether a model was added */
export async function addModel() {
  const opened = openDialog({
    title: t('detectors.add'),
    size: 'wide',
    content: html`<form class="stack gap-4" data-part="form" novalidate>
      <div class="field"><label for="model-file">${t('detectors.file')}</label>
        <input class="input" type="file" accept=".onnx" id="model-file" data-part="file" /></div>
      <div class="field"><label for="model-declaration">${t('detectors.declaration')}</label>
        <textarea class="input mono model__declaration" id="model-declaration" rows="10" maxlength="20000" spellcheck="false"
          aria-describedby="model-help" data-part="declaration"></textarea>
        <span class="help" id="model-help">${t('detectors.declaration_help')}</span>
        <span class="flow"><button type="button" class="button button--small" data-part="example">${icon('edit')}${t('detectors.example')}</button>
          <a class="button button--small" download="declaration.yaml" href="data:text/yaml;charset=utf-8,${encodeURIComponent(EXAMPLE)}">${icon('download')}${t('detectors.download')}</a></span></div>
      <p class="dim unless-empty" role="status" data-part="said"></p>
      ${formFoot(t('detectors.check'))}</form>`,
  });
  const { parts, closed } = opened;
  /** @type {Upload|null} */
  let upload = null;
  let sent = null;
  parts.example.addEventListener('click', () => {
    parts.declaration.value = EXAMPLE;
    parts.declaration.focus();
  });
  closesWhenSent(opened, async () => {
    const [file] = parts.file.files;
    const declaration = parts.declaration.value;
    if (!file || !declaration.trim()) throw new ApiError(0, 'incomplete', t('detectors.incomplete'));
    try {
      if (sent !== file) {
        await upload?.cancel(); // of a file before this one
        upload = new Upload(file, file.name);
        upload.addEventListener('change', () =>
          setText(parts.said, t('films.sending', { percent: Math.floor((100 * upload.offset) / upload.size) })),
        );
        await upload.start();
        if (upload.state !== 'DONE') throw new ApiError(0, 'upload_failed', upload.reason ?? '');
        sent = file; // another declaration needs no other file
      }
      setText(parts.said, t('detectors.checking'));
      await post('/api/detectors', { upload_id: upload.id, declaration });
      upload.forget();
      upload = null;
    } finally {
      setText(parts.said, '');
    }
  });
  const isAdded = (await closed) === 'done';
  upload?.cancel().catch(toastError); // nothing came of it
  return isAdded;
}
