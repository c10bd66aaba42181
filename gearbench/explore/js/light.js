// Spare Bokeh's figures what these pages have no use for at every paint, and what costs as much as all drawing: each
// colour and width is first looked up as a CSS variable (Bokeh's issue 15286; these pages set none), the size of letters
// likewise; and the style sheet of each part's position is written anew although it says the same, those of lines, which
// are drawn and no elements, too. After a sheet the browser works out all styles again.
function own(model, name) {
  while (model && !Object.hasOwn(model, name)) model = Object.getPrototypeOf(model);
  return model;
}

const view = [...Bokeh.index].find((each) => each.canvas_view);
const visual = own(view?.visuals.background_fill, "_get_css_value");
if (visual) visual._get_css_value = () => "";
const sheet = own(view?.canvas_view.parent_style, "_update");
if (sheet) {
  const update = sheet._update;
  sheet._update = function (css) { if (this.el.textContent !== css) update.call(this, css); };
}
const glyph = [...(view?.renderer_views.values() ?? [])].find((each) => each.glyph);
if (glyph) Object.getPrototypeOf(glyph).update_position = () => {};
const plot = own(view, "base_font_size");
if (plot) {
  const size = view.base_font_size;
  Object.defineProperty(plot, "base_font_size", { get: () => size });
}
