// What scrolls sideways can be reached by the keyboard, and the search has a name.
document.addEventListener("DOMContentLoaded", () => {
  document.querySelectorAll(".md-search").forEach((search) => search.setAttribute("aria-label", "Search"));
  const reach = () => document.querySelectorAll("article *").forEach((part) => {
    const scrolls = /auto|scroll/.test(getComputedStyle(part).overflowX);
    if (scrolls && part.scrollWidth > part.clientWidth) part.tabIndex = 0;
  });
  setTimeout(reach);
});
