// Ask the server for a picked gear; other axes move the pick in the cloud, and ask nothing.
if (pick.data.design[0] !== question.data.design[0]) question.data = { design: [pick.data.design[0]] };
