// A page without a server: the stored picture of the pick, if there is one.
const design = String(pick.data.design[0]), tables = pictures[design];
if (!tables) {
  message.text = "No picture of this design is stored in the file; those of the fronts are. " +
    "<b>gearbench explore</b> computes any.";
  return;
}
message.text = "";
summary.text = texts[design];
for (const [name, source] of Object.entries(sources)) source.data = tables[name];
for (const name of compared) before[name].data = tables[name];
