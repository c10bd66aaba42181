// Make Bokeh's figures faster to paint: switch off work that these pages do not need and that takes as long as all drawing.
// At every paint, Bokeh looks up each colour and width as a CSS variable (Bokeh's issue 15286; these pages set none), and
// the size of letters. It also writes the style sheet of the position of each part again, even if nothing has changed, and
// even for lines, which are not elements of the page. After that the browser computes all styles again.

// the prototype of a model, or the model itself, that defines a property
function owner(model, name) {
  while (model && !Object.hasOwn(model, name)) model = Object.getPrototypeOf(model);
  return model;
}

const view = [...Bokeh.index].find((candidate) => candidate.canvas_view);
const visual = owner(view?.visuals.background_fill, "_get_css_value");
if (visual) visual._get_css_value = () => "";
const sheet = owner(view?.canvas_view.parent_style, "_update");
if (sheet) {
  const update = sheet._update;
  sheet._update = function (css) { if (this.el.textContent !== css) update.call(this, css); };
}
const glyph = [...(view?.renderer_views.values() ?? [])].find((renderer) => renderer.glyph);
if (glyph) Object.getPrototypeOf(glyph).update_position = () => {};
const plot = owner(view, "base_font_size");
if (plot) {
  const size = view.base_font_size;
  Object.defineProperty(plot, "base_font_size", { get: () => size });
}
