"""Finds texts of which a part can neither be seen nor scrolled to; fields scroll by themselves.

And those that run out of their own element into another text.
"""

from __future__ import annotations

from playwright.sync_api import Page

_CLIPPED = """() => {
  const SLACK = 1.5;
  const hides = how => how === "hidden" || how === "clip";
  const scrolls = how => how === "auto" || how === "scroll";
  const clippedBy = (box, from) => {
    // What can be scrolled along one axis is followed along the other alone.
    let { left, right, top, bottom } = box;
    let [x, y] = [true, true];
    for (let one = from; one && one !== document.documentElement; one = one.parentElement) {
      const style = getComputedStyle(one);
      const frame = one.getBoundingClientRect();
      // Text for screen readers alone is hidden on purpose.
      if (style.clip !== "auto" && frame.width <= 2) return null;
      if (x && hides(style.overflowX) && (left < frame.left - SLACK || right > frame.right + SLACK))
        return one;
      if (y && hides(style.overflowY) && (top < frame.top - SLACK || bottom > frame.bottom + SLACK))
        return one;
      if (scrolls(style.overflowX)) x = false;
      if (scrolls(style.overflowY)) y = false;
      if (style.position === "fixed") break;
    }
    const page = document.documentElement;
    const wide = page.scrollWidth > innerWidth, long = page.scrollHeight > innerHeight;
    if (x && !wide && (left < -SLACK || right > innerWidth + SLACK)) return page;
    if (y && !long && (top < -SLACK || bottom > innerHeight + SLACK)) return page;
    return null;
  };
  const found = [], running = [], texts = [];
  const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  while (walker.nextNode()) {
    const node = walker.currentNode;
    const parent = node.parentElement;
    const seen = parent.checkVisibility({ opacityProperty: true, visibilityProperty: true });
    if (!seen || !node.data.trim()) continue;
    // A link that is shown when it has the focus.
    if (parent.closest("script, style, svg, [aria-hidden=true], .skip")) continue;
    const range = document.createRange();
    range.selectNodeContents(node);
    for (const box of range.getClientRects()) {
      if (box.width === 0) continue;
      texts.push({ node, box });
      let block = parent;
      while (getComputedStyle(block).display === "inline") block = block.parentElement;
      const own = block.getBoundingClientRect();
      if (own.width <= 2) continue;  // for screen readers alone
      if (box.right > own.right + SLACK || box.left < own.left - SLACK) running.push({ node, box });
      const by = clippedBy(box, parent);
      if (by) {
        const name = `${by.tagName.toLowerCase()}.${String(by.className).split(" ").at(-1)}`;
        found.push(`"${node.data.trim().slice(0, 60)}" by ${name}`);
        break;
      }
    }
  }
  const words = node => `"${node.data.trim().slice(0, 60)}"`;
  const across = (a, b) => Math.min(a.right, b.right) - Math.max(a.left, b.left) > SLACK;
  const along = (a, b) => Math.min(a.bottom, b.bottom) - Math.max(a.top, b.top) > SLACK;
  for (const one of running)
    for (const other of texts)
      if (one.node !== other.node && across(one.box, other.box) && along(one.box, other.box))
        found.push(`${words(one.node)} written over ${words(other.node)}`);
  return [...new Set(found)];
}"""


def clipped_texts(page: Page) -> list[str]:
    """Each text that is cut off, with what cuts it off."""
    found: list[str] = page.evaluate(_CLIPPED)
    return found
