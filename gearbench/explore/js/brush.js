// Drag along an axis: keep that range. Double-click near an axis: clear it.
const begins = cb_obj.event_name === "panstart" || cb_obj.event_name === "doubletap";
const k = Math.round(begins ? cb_obj.x : plot.brush?.axis ?? cb_obj.x);  // number of the axis; a drag stays on its first
const axis = axes[k];
if (!axis?.slider) return;
const { slider, low, high } = axis;
if (cb_obj.event_name === "doubletap") {
  slider.value = [slider.start, slider.end];
  return;
}
if (cb_obj.event_name === "panstart") plot.brush = { axis: k, from: cb_obj.y };
if (!plot.brush) return;
// an axis runs from 0 to 1; a little more at both ends makes sure that the ends can be reached
const ends = [plot.brush.from, cb_obj.y].map((y) => low + Math.min(1.02, Math.max(-0.02, y)) * (high - low));
const value = [Math.max(slider.start, Math.min(...ends)), Math.min(slider.end, Math.max(...ends))];
if (value[1] > value[0]) slider.value = value;
if (cb_obj.event_name === "panend") plot.brush = undefined;
