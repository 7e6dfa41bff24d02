// The texts of the page in the language that a person has chosen, else the browser's. Another language is one more folder.
import { german } from './de';
import { english } from './en';

type Language = 'en' | 'de';

const KEY = 'language';

export const language = typeof document === 'undefined' ? 'en' : languageOf(localStorage.getItem(KEY) ?? navigator.language);

export const texts = language === 'de' ? german : english;

function languageOf(tag: string): Language {
  return tag.startsWith('de') ? 'de' : 'en';
}

// The address holds the request, so that it is shown again in the other language.
export function switchLanguage(): void {
  localStorage.setItem(KEY, language === 'de' ? 'en' : 'de');
  location.reload();
}
