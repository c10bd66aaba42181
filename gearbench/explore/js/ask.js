// Ask the server for a picked gear; a change of axes moves the pick but needs no new answer.
if (pick.data.design[0] !== question.data.design[0]) question.data = { design: [pick.data.design[0]] };
