// A page without a server: the stored picture of the pick, if there is one.
const design = String(pick.data.design[0]), tables = pictures[design];
const missing = "No picture of this design is stored in the file; those of the fronts are. gearbench explore computes any.";
answer.data = {
  now: [tables ?? null], summary: [names[design] ?? ""], message: [tables ? "" : missing],
};
