// On a page without a server, show the stored figures of the pick, if there are any.
const design = String(pick.data.design[0]), tables = pictures[design];
const missing = "No figures of this design are stored in the file; those of the fronts are. gearbench explore computes any.";
answer.data = {
  now: [tables ?? null], summary: [names[design] ?? ""], message: [tables ? "" : missing],
};
