// Give the handles of Bokeh's sliders names for screen readers; Bokeh gives them none.
function name(root) {
  for (const element of root.querySelectorAll("*")) {
    if (!element.shadowRoot) continue;
    const handles = element.shadowRoot.querySelectorAll(".noUi-handle");
    const title = element.shadowRoot.querySelector(".bk-slider-title")?.textContent.split(":")[0];
    handles.forEach((handle, i) => {
      const end = handles.length < 2 ? "" : i ? ", at most" : ", at least";
      handle.setAttribute("aria-label", title + end);
    });
    name(element.shadowRoot);
  }
}
name(document);
