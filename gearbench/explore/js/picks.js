// Keep picked designs for comparison; runs after compare.js. A kept gear has the name of the design whose numbers are
// shown, even while another pick is being computed.
actions = () => [];  // no actions except "drop"
byId("keep").addEventListener("click", () => {
  const number = kept.reduce((last, gear) => Math.max(last, gear.number), 0) + 1;
  keep({ name: byId("summary").textContent, number });
});
