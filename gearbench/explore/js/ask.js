// Ask the server for a gear: as it is stored after a pick, with what the sliders say after one of them moved.
const picked = cb_obj === pick;
// other axes move the pick in the cloud, and ask nothing
if (picked && pick.data.design[0] === question.data.design[0]) return;
// sliders that followed an answer, or still stand for the gear before, ask nothing
if (!picked) {
  if (answer.awaited || sliders.every((slider) => slider.value === answer.placed?.[slider.name]?.value)) return;
  answer.placed = undefined;
} else answer.awaited = true;
const settings = picked ? null : Object.fromEntries(sliders.map((slider) => [slider.name, slider.value]));
question.data = { design: [pick.data.design[0]], settings: [settings] };
