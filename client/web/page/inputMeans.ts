/** Keys of a real keyboard. A keyboard on the screen sends none of these to a canvas. */
const kRealKey = /^(Arrow|Shift$|Tab$|Escape$|Home$)/;

/**
 * Marks `root` with the class "touch-only" while the user has neither a mouse nor a keyboard, as far as is known: hints
 * of them (class "for-mouse") are then hidden, and those of fingers (class "for-touch") shown.
 */
export function watchInputMeans(
  root: Pick<Element, "classList">,
  mouse: Pick<MediaQueryList, "matches" | "addEventListener"> = matchMedia("(any-pointer: fine)"),
  keys: Pick<Window, "addEventListener"> = window,
): void {
  let hasKeyboard = false;
  const mark = () => root.classList.toggle("touch-only", !mouse.matches && !hasKeyboard);
  mouse.addEventListener("change", mark);
  keys.addEventListener("keydown", ({ key }) => {
    hasKeyboard ||= kRealKey.test(key);
    mark();
  });
  mark();
}
