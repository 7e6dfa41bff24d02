// A button with a menu of actions: https://www.w3.org/WAI/ARIA/apg/patterns/menu-button/
import { useId, useLayoutEffect, useRef, useState } from 'preact/hooks';

export interface MenuItem {
  text: string;
  onChoose: () => void;
}

export interface MenuGroup {
  label?: string;
  items: readonly MenuItem[];
}

interface MenuProps {
  label: string;
  groups: readonly MenuGroup[];
}

export function Menu({ label, groups }: MenuProps) {
  const id = useId();
  const host = useRef<HTMLSpanElement>(null);
  const [opened, setOpened] = useState<'first' | 'last' | null>(null); // the item that gets the focus
  const close = (): void => {
    setOpened(null);
    host.current?.querySelector('button')?.focus();
  };
  // At once: an effect after the paint could take the focus back from a key that was pressed meanwhile.
  useLayoutEffect(() => {
    if (opened)
      itemsOf(host.current!)
        .at(opened === 'first' ? 0 : -1)
        ?.focus();
  }, [opened]);
  const onKeyDown = (event: KeyboardEvent): void => {
    if (!opened && (event.key === 'ArrowDown' || event.key === 'ArrowUp')) setOpened(event.key === 'ArrowDown' ? 'first' : 'last');
    else if (opened && event.key === 'Escape') close();
    else if (!opened || !move(event, itemsOf(host.current!))) return;
    event.preventDefault();
  };
  const onFocusOut = (event: FocusEvent): void => {
    if (!host.current?.contains(event.relatedTarget as Node | null)) setOpened(null);
  };
  return (
    <span class="menu" ref={host} onKeyDown={onKeyDown} onFocusOut={onFocusOut}>
      <button
        type="button"
        aria-haspopup="menu"
        aria-expanded={opened !== null}
        aria-controls={opened ? id : undefined}
        onClick={() => (opened ? close() : setOpened('first'))}
      >
        {label} <span aria-hidden="true">▾</span>
      </button>
      {opened && (
        <div class="menu-items" role="menu" id={id} aria-label={label}>
          {groups.map((group, number) => (
            <div key={number} role="group" aria-label={group.label}>
              {group.label && (
                <span class="menu-title" aria-hidden="true">
                  {group.label}
                </span>
              )}
              {group.items.map(({ text, onChoose }) => (
                <button
                  key={text}
                  type="button"
                  role="menuitem"
                  tabIndex={-1}
                  onClick={() => {
                    close();
                    onChoose();
                  }}
                >
                  {text}
                </button>
              ))}
            </div>
          ))}
        </div>
      )}
    </span>
  );
}

function itemsOf(host: HTMLElement): HTMLElement[] {
  return [...host.querySelectorAll<HTMLElement>('[role=menuitem]')];
}

// Moves the focus by arrows, to the ends, and to the next item that begins with a letter; false: the key does nothing here.
function move({ key }: KeyboardEvent, items: readonly HTMLElement[]): boolean {
  const at = items.indexOf(document.activeElement as HTMLElement);
  const to =
    { ArrowDown: at + 1, ArrowUp: at - 1, Home: 0, End: -1 }[key] ?? (key.length === 1 && key !== ' ' ? nextWith(key, items, at) : null);
  if (to === null) return false;
  items.at(to % items.length)?.focus();
  return true;
}

function nextWith(letter: string, items: readonly HTMLElement[], at: number): number | null {
  const order = items.map((_, i) => (at + 1 + i) % items.length);
  return order.find((i) => items[i]!.textContent.trim().toLowerCase().startsWith(letter.toLowerCase())) ?? null;
}
