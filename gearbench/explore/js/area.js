// Mark the designs inside a box or a lasso; a double-click or the reset tool clears the marks.
// state.marks counts the changes, so that filter.js knows when to paint the lines again.
const state = (designs.explore ??= { marks: 0 });
const selecting = cb_obj.event_name === "selectiongeometry";
if (selecting && (!cb_obj.final || !["rect", "poly"].includes(cb_obj.geometry.type))) return;
state.area = selecting ? cb_obj.geometry : undefined;
state.marks = state.marks + 1;
refresh.execute(cb_obj);
