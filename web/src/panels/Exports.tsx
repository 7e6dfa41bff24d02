// The plan in every format that the service writes, and the request as code.
import { useState } from 'preact/hooks';
import { nameOf } from '../request/cells';
import { codeOf, LANGUAGES } from '../request/code';
import type { Language } from '../request/code';
import { base, client, outcome } from '../service/client';
import type { PlanFormat } from '../service/types';
import { exportedRequest } from '../state/cells';
import { refuse } from '../state/messages';
import { request } from '../state/store';
import { texts } from '../texts';
import { copy, save } from './save';

const FORMATS: Readonly<Record<PlanFormat, string>> = {
  html: '.html',
  svg: '.svg',
  png: '.png',
  json: '.json',
  csv: '.csv',
  ros2: '.ros2.json',
  msgpack: '.msgpack',
  npz: '.npz',
  mcap: '.mcap',
  urscript: '.script',
  urscript_moves: '.moves.script',
  krl: '.src',
  krl_kss5: '.kss5.src',
  krl_kss8: '.kss8.src',
  rapid: '.mod',
  rapid_moves: '.moves.mod',
  fanuc_ls: '.ls',
  c_header: '.h',
};

export function Exports() {
  const [language, setLanguage] = useState<Language>('curl');
  const [copied, setCopied] = useState(false);
  const shown = request.value;
  if (!shown) return null;
  const code = codeOf(language, shown, base);
  return (
    <>
      <h3>{texts.exports.files}</h3>
      <div class="buttons wrap">
        {(Object.keys(FORMATS) as PlanFormat[]).map((format) => (
          <button key={format} type="button" disabled={exportedRequest() === null} onClick={() => void download(format)}>
            {format === 'html' ? texts.exports.report : format}
          </button>
        ))}
      </div>
      {shown.cell && <p class="hint">{texts.cells.exported(shown.cell.name)}</p>}
      <h3>{texts.exports.code}</h3>
      <div class="buttons" role="group" aria-label={texts.exports.code}>
        {LANGUAGES.map((name) => (
          <button key={name} type="button" aria-pressed={language === name} onClick={() => setLanguage(name)}>
            {texts.exports.languages[name]}
          </button>
        ))}
        <button
          type="button"
          onClick={() => {
            void copy(code).then(setCopied);
            setTimeout(() => setCopied(false), 1500);
          }}
        >
          {copied ? texts.exports.copied : texts.exports.copy}
        </button>
      </div>
      <pre class="code" tabIndex={0}>
        {code}
      </pre>
    </>
  );
}

async function download(format: PlanFormat): Promise<void> {
  const body = exportedRequest();
  if (!body) return;
  const call = client.POST('/v1/trajectories/export', { body, params: { query: { format } }, parseAs: 'blob' });
  const found = await outcome(call as unknown as Promise<{ data?: Blob; error?: unknown }>);
  if (found.answer) save(`${nameOf(request.value!)}${FORMATS[format]}`, found.answer);
  else refuse(found.problem);
}
