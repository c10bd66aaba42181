// Picked designs beside each other, after compare.js. A gear is named as its numbers are shown, not as a pick that waits.
actions = () => [];
byId("keep").addEventListener("click", () => {
  const number = kept.reduce((last, each) => Math.max(last, each.number), 0) + 1;
  keep({ name: byId("summary").textContent, number });
});
