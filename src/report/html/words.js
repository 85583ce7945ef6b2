"use strict";
// The glossary: as a list, and where a word stands first in a section, under the pointer, a finger or the keyboard.

const escaped = (text) => text.replace(/[.*+?^${}()|[\]\\]/g, "\\$&");

// Text that people read: no code, no controls, nothing that is drawn.
const notProse = "code, pre, abbr, select, button, svg, .plot, .brand, label, h1, h2, h3, dl";
const isProse = (node) => !node.parentElement.closest(notProse);

function markWords(section, pattern, meanings) {
  const seen = new Set(), texts = [];
  const walker = document.createTreeWalker(section, NodeFilter.SHOW_TEXT);
  while (walker.nextNode()) if (isProse(walker.currentNode)) texts.push(walker.currentNode);
  for (const text of texts) {
    for (let rest = text; rest; ) {
      const found = [...rest.data.matchAll(pattern)].find((m) => !seen.has(m[1].toLowerCase()));
      if (!found) break;
      const word = rest.splitText(found.index);
      rest = word.splitText(found[0].length);
      seen.add(found[1].toLowerCase());
      const means = meanings.get(found[1].toLowerCase());
      word.replaceWith(element("abbr", {tabindex: 0, "data-means": means, "aria-description": means}, word.data));
    }
  }
}

function writeWords(glossary) {
  const meanings = new Map(glossary.map(({word, means}) => [word.toLowerCase(), means]));
  const list = document.getElementById("word-list");
  for (const {word, means} of glossary) list.append(element("dt", {}, word), element("dd", {}, means));
  const longestFirst = [...meanings.keys()].sort((a, b) => b.length - a.length);
  const pattern = new RegExp(`(?<![\\w-])(${longestFirst.map(escaped).join("|")})s?(?![\\w-])`, "gi");
  document.querySelectorAll("main > section").forEach((section) => markWords(section, pattern, meanings));
}
