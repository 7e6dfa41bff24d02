// What everybody is to see: the service is away, a link cannot be shown or has to be copied by hand.
import { isAway } from '../service/client';
import { showBanner } from '../state/messages';
import { banner } from '../state/store';
import { texts } from '../texts';

export function Banner() {
  const shown = banner.value;
  return (
    <>
      {isAway.value && (
        <p class="banner" role="alert">
          {texts.said.away}
        </p>
      )}
      {shown && (
        <div class="banner" role="alert">
          <span>{shown.text}</span>
          {shown.link && <input readOnly value={shown.link} aria-label={texts.said.link} ref={(field) => field?.select()} />}
          <button type="button" onClick={() => showBanner(null)}>
            {texts.said.close}
          </button>
        </div>
      )}
    </>
  );
}
