/** Long lists of which only the part in view is in the document. */
import {useSignal} from '@preact/signals';
import {useEffect} from 'preact/hooks';

const BEYOND = 1;

/** The lines of a box that are in view, and one more on each side. @param {{current: HTMLElement | null}} box @param {number} count @param {number} pitch px from one line to the next @param {boolean} [sideways] */
export function useWindow(box, count, pitch, sideways = false) {
  const range = useSignal({first: 0, last: Math.min(count, 4)});
  useEffect(() => {
    const measure = () => {
      if (!box.current) return;
      const frame = box.current.getBoundingClientRect(), begin = sideways ? frame.left : frame.top, length = sideways ? innerWidth : innerHeight;
      const within = (/** @type {number} */ line) => Math.max(0, Math.min(count, line));
      const first = within(Math.floor(-begin / pitch) - BEYOND), last = within(Math.ceil((length - begin) / pitch) + BEYOND);
      if (first !== range.value.first || last !== range.value.last) range.value = {first, last};
    };
    measure();
    document.addEventListener('scroll', measure, true);  // of any box around it
    addEventListener('resize', measure);
    return () => { document.removeEventListener('scroll', measure, true); removeEventListener('resize', measure); };
  }, [count, pitch]);
  return {first: Math.min(range.value.first, count), last: Math.min(range.value.last, count)};
}
