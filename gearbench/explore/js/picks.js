// Picked designs beside each other, after compare.js. A gear has the name of the numbers shown, not of a pick still being computed.
actions = () => [];
byId("keep").addEventListener("click", () => {
  const number = kept.reduce((last, each) => Math.max(last, each.number), 0) + 1;
  keep({ name: byId("summary").textContent, number });
});
